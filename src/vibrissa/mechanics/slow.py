"""Active whisking: a texture met while the posture changes slowly beside the whisker's ringing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.advance import SLOW_TERMS, Advance, Meetings
from vibrissa.mechanics.drifting import drift
from vibrissa.mechanics.dynamics import Drive
from vibrissa.mechanics.panels import fit
from vibrissa.mechanics.path_table import PathTable, tabulate
from vibrissa.mechanics.posture_path import PosturePath
from vibrissa.mechanics.response import FOLLICLE
from vibrissa.mechanics.superposition import Scan
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import Troughs

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker

Array = NDArray[np.float64]

PANEL = 2e-3  # [s] longest panel
DRIFTING, FAST = 0.02, 0.2  # of the slow condition: remarked on, refused
BLURRED = 0.2  # change within one ring-down above which a line is no single posture's


@dataclass(frozen=True)
class SlowPrediction:
    """The whisker's predicted motion over one texture in a posture that changes; names as in ``Prediction``.

    Attributes
    ----------
    whisker, path, scan, texture
        What was asked.
    advance : Advance
        The contact's way along the texture.
    """

    whisker: Whisker
    path: PosturePath
    scan: Scan
    texture: Troughs
    advance: Advance

    def __post_init__(self) -> None:
        worst = self.condition
        for name in ("frequency_rate", "gain_rate", "mode_mixing"):
            i = int(worst[name].values.argmax())
            if (value := float(worst[name][i])) > FAST:
                rule = f"must be slow beside the ringing: {name} at most {FAST:g}"
                when = f"{value:.3g} at {worst.time.values[i]:.4g} s"
                raise InputError("posture path", rule, when, "move the base more slowly")

    @property
    def table(self) -> PathTable:
        """What depends on the posture."""
        return self.advance.table

    @property
    def meetings(self) -> Meetings:
        """When the gaps are met."""
        return self.advance.meetings

    @property
    def drive(self) -> Drive:
        """Quasi-static amplitudes of the modes, then what the follicle and the contact feel of them."""
        return self.advance.drive

    def kappa(self, t: ArrayLike) -> Array:
        """Adimensional frequencies of the modes at times t, (M, T)."""
        return self._at(t, self.table.rows.kappa)

    def omega(self, t: ArrayLike) -> Array:
        """Resonant angular frequencies at times t [rad/s], (M, T)."""
        return self.kappa(t) / self.whisker.timescale

    def c(self, t: ArrayLike) -> Array:
        """Linear couplings c_i of the modes to the excursion at times t, (M, T)."""
        return self._at(t, self.table.rows.c)

    def contact(self, t: ArrayLike) -> Array:
        """Contact ε over L at times t, (T,)."""
        return self._at(t, self.table.rows.contact)[0]

    def gain(self, t: ArrayLike) -> Array:
        """Jump of the vibration over λ at a gap of the mean width, (M, T); in the linear response, c."""
        t, n = self._inside(t), self.table.n_modes
        place, width = self.path.spline(t), np.full(t.shape, self.texture.width.mean() / self.whisker.length)
        before = self.table.deepest(place, width)
        return np.asarray((self.table.respond(place, before) - self.table.respond(place, before - width))[:n] / width)

    def travel(self, t: ArrayLike) -> Array:
        """Place X(t) of the contact's ground on the texture [m], (T,)."""
        return self.advance.travel(self._inside(t))

    def excursion(self, t: ArrayLike) -> Array:
        """d(t) over L at times t [s], (T,); 0 on the lands."""
        return self.advance.excursion(self._inside(t))

    @cached_property
    def mode_drive(self) -> Drive:
        """Quasi-static amplitudes Q_i of the modes."""
        n = self.table.n_modes
        return Drive(self.drive.time, self.drive.coefficients[:n], self.drive.before[:n])

    @cached_property
    def frequency(self) -> Drive:
        """ω_i(t) [rad/s] on the panels of the drive."""
        return fit(self.omega, np.append(self.drive.time, self.path.time[-1]), SLOW_TERMS)

    def vibration(self, t: ArrayLike) -> tuple[Array, Array]:
        """Vibration amplitudes q, over L, and q̇ [1/s], (M, T) each."""
        return drift(self._inside(t), self.mode_drive, self.frequency, self.scan.damping, self.scan.jump)

    def amplitudes(self, t: ArrayLike) -> Array:
        """Vibration amplitudes q_i(t), over L, (M, T), in the modes of the moment's contact."""
        return self.vibration(t)[0]

    def mode_displacement(self, t: ArrayLike) -> Array:
        """q_i + Q_i, over L, (M, T): the displacement about the moment's profile on the flat."""
        return self.amplitudes(t) + self.mode_drive(self._inside(t))

    def base_curvature(self, t: ArrayLike) -> Array:
        """Whole curvature at the base [1/m], (T,): posture, excursion and vibration."""
        return self._of_both(t, self.table.rows.bending, "base_curvature") / self.whisker.length

    def contact_load(self, t: ArrayLike) -> Array:
        """Vertical load on the contact over πEα⁴L²/4, (T,); where it is not positive the contact would lift off."""
        return self._of_both(t, self.table.rows.shear, "contact_load")

    def _of_both(self, t: ArrayLike, rows: slice, name: str) -> Array:
        t = self._inside(t)
        q = self.amplitudes(t)
        still = self.drive(t)[len(q) + FOLLICLE.index(name)]
        return still + np.einsum("it,it->t", self._at(t, rows), q)

    def _at(self, t: ArrayLike, rows: slice) -> Array:
        return self.advance.slow(self._inside(t))[rows]

    def _inside(self, t: ArrayLike) -> Array:
        t, (start, stop) = np.asarray(t, float), self.path.time[[0, -1]]
        if t.size and not (t[0] >= start and t[-1] <= stop):
            raise InputError(
                "times", f"must lie on the path, {start:.4g} to {stop:.4g} s", f"{t[0]:.4g} to {t[-1]:.4g}"
            )
        return t

    @cached_property
    def condition(self) -> xr.Dataset:
        """How slow the posture changes beside the ringing, along the path.

        Returns
        -------
        Dataset
            On (time), worst of the modes: ``frequency_rate`` |dω/dt|/ω², ``gain_rate`` |dc/dt|/(ω|c|), ``mode_mixing``,
            the share of a mode's ringing that the moving contact sends to other modes, which the model leaves out;
            ``ring_down_change``, relative change of mode 1's ω or c, the larger, within 1/(ζω): the model follows it,
            but beyond ``BLURRED`` a spectral line is no single posture's. The model asks that the first three be far
            below 1: above 0.02 :func:`remarks` says so, above 0.2 :func:`predict_slow` refuses.
        """
        return dataset({"table_error": self.table.error}, **self.rates(self.advance.slow.time))

    def rates(self, t: Array) -> dict[str, Any]:
        """What ``condition`` gives, at times t."""
        slow, rows = self.advance.slow, self.table.rows
        now, rate = slow(t), np.abs(slow.rate(t))
        omega = now[rows.kappa] / self.whisker.timescale
        frequency, gain = rate[rows.kappa] / now[rows.kappa], rate[rows.c] / np.abs(now[rows.c])
        mixing = rate[rows.contact] * now[rows.mixing] * self.whisker.timescale
        with np.errstate(divide="ignore", invalid="ignore"):
            blur = np.maximum(frequency[0], gain[0]) / (self.scan.damping * omega[0])
        return {
            "time": t,
            "frequency_rate": (frequency / omega).max(axis=0),
            "gain_rate": (gain / omega).max(axis=0),
            "mode_mixing": mixing.max(axis=0),
            "ring_down_change": np.nan_to_num(blur, nan=0.0, posinf=np.inf),
        }


def predict_slow(
    whisker: Whisker, path: PosturePath, texture: Troughs, scan: Scan, *, n_modes: int = 12, panel: float = PANEL
) -> SlowPrediction:
    """Prepare the prediction for a whisker whose posture changes while a texture is drawn past it.

    Eq. (6) with ω_i, c_i and Q_i(d) of the moment's posture: q̈ + 2ζω(t)q̇ + ω(t)²q = −d²Q/dt². The contact itself moves
    along the ground as the distance D of the base from it changes, so that it meets x at the time when
    X(t) = v t − L [D(t) − D(start)] = x; D that grows slows it down. Left out: that modes of one contact mix as those
    of the next take over (``condition`` bounds it), and the inertia of the slow motion of the whole whisker.

    Parameters
    ----------
    whisker : Whisker
        Its tip must not come off the ground.
    path : PosturePath
        The posture, of time; the gaps met after its end are left out.
    texture, scan
        What is drawn past, with the speed v of the base over the ground; x = 0 meets the contact of a posture at rest
        at time 0.
    n_modes : int
        Number of modes.
    panel : float
        Longest stretch of time [s] on which frequency and drive are polynomials, of degree 5 and 11.

    Raises
    ------
    InputError
        Named with the time: if the tip comes off the ground, a posture stands beyond the fold or cannot cross the
        gaps, the contact stands still or goes back, or the posture changes fast (``condition``); or if the first gap
        begins before the path.
    """
    table = tabulate(path, texture.width / whisker.length, scan.response, n_modes)
    advance = Advance.along(whisker, path, texture, scan.speed, table, panel)
    return SlowPrediction(whisker, path, scan, texture, advance)


def slow_signals(prediction: SlowPrediction, t: Array) -> xr.Dataset:
    """Signals of a prediction at times t.

    Parameters
    ----------
    prediction : SlowPrediction
        From :func:`predict_slow`.
    t : (T,) array
        Times on the path [s], four or more on an even grid.

    Returns
    -------
    Dataset
        ``mode_amplitude``, ``mode_displacement``, its ``envelope``, ``excursion``, whole ``base_curvature``; of the
        moment ``moment_contact``, ``moment_base_angle``, ``moment_frequency``, ``moment_coupling``; ``contact_advance``
        X; and what ``condition`` gives.
    """
    t = prediction._inside(t)
    shown, scan, whisker = prediction.mode_displacement(t), prediction.scan, prediction.whisker
    attrs = {
        "response": scan.response,
        "jump": scan.jump,
        "damping": scan.damping,
        "scan_speed": scan.speed,
        "friction": prediction.path.friction,
        **{f"whisker_{name}": float(value) for name, value in vars(whisker).items()},
        "gaps": len(prediction.texture.width),
        "gap_depth": prediction.texture.depth,
        "table_error": prediction.table.error,
    }
    return dataset(
        attrs,
        mode=np.arange(1, len(shown) + 1),
        mode_amplitude=prediction.amplitudes(t),
        mode_displacement=shown,
        envelope=analytic_envelope(shown)[0],
        excursion=prediction.excursion(t),
        base_curvature=prediction.base_curvature(t),
        moment_contact=prediction.contact(t),
        moment_base_angle=prediction.path.spline(t)[1],
        moment_frequency=prediction.omega(t) / (2 * np.pi),
        moment_coupling=prediction.c(t),
        contact_advance=prediction.travel(t),
        **prediction.rates(t),
    )


def remarks(prediction: SlowPrediction, t: Array | None = None) -> list[str]:
    """What can be said against a prediction, one line each, with the time of the worst; none if nothing.

    With times t, also whether the contact would lift off at them.
    """
    told = (
        ("frequency_rate", DRIFTING, "the frequency drifts by a share of {:.2g} per radian of ringing"),
        ("gain_rate", DRIFTING, "the gain drifts by a share of {:.2g} per radian of ringing"),
        ("mode_mixing", DRIFTING, "the moving contact would send a share of {:.2g} of a mode's ringing to others"),
        ("ring_down_change", BLURRED, "the resonance or its gain changes by {:.2g} within one ring-down"),
    )
    data, lines = prediction.condition, []
    for name, limit, line in told:
        i = int(data[name].values.argmax())
        if (value := float(data[name][i])) > limit:
            lines.append(f"{line.format(value)}, at {data.time.values[i]:.4g} s")
    if t is not None and (off := prediction.contact_load(t) <= 0).any():
        lines.append(f"the contact would lift off, first at {t[int(off.argmax())]:.4g} s")
    return lines
