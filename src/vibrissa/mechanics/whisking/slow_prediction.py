"""The motion that a posture which changes slowly beside the whisker's ringing gives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.limits import require_samples
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE
from vibrissa.mechanics.scan.free_end import free_end_facts, gaps_allowed
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.vibration.dynamics import Drive
from vibrissa.mechanics.whisking.advance import SLOW_TERMS, Advance
from vibrissa.mechanics.whisking.drifting_oscillator import drift
from vibrissa.mechanics.whisking.panels import fit
from vibrissa.mechanics.whisking.path_table import PathTable
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.quantities import dataset
from vibrissa.signals.even_times import whole_steps
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

DRIFTING, FAST = 0.02, 0.2  # of the slow condition: remarked on, refused


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
    texture: Gaps
    advance: Advance

    def __post_init__(self) -> None:
        worst = self.condition
        for name in ("frequency_rate", "gain_rate", "mode_mixing"):
            i = int(worst[name].values.argmax())
            if (value := float(worst[name][i])) > FAST:
                rule = f"must be slow beside the ringing: {name} at most {FAST:g}"
                when = f"{value:.3g} at {worst.time.values[i]:.4g} s"
                raise RangeError("posture path", rule, when, "move the base more slowly")

    @property
    def table(self) -> PathTable:
        """What depends on the posture."""
        return self.advance.table

    def times(self, rate: float) -> Array:
        """Times at which it is sampled at a rate [s].

        Parameters
        ----------
        rate : float
            Samples per second [Hz].

        Returns
        -------
        (T,) array
            From the start of the path on; its end, if a sample falls on it.

        Raises
        ------
        InputError
            If the record is too long.
        """
        start, stop = self.path.time[[0, -1]]
        require_samples("scan", stop - start, rate)
        return np.minimum(start + np.arange(whole_steps(stop - start, rate) + 1) / rate, stop)

    def kappa(self, t: ArrayLike) -> Array:
        """Adimensional frequencies of the modes at times t, (M, T).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            κ_i [1].
        """
        return self._at(t, self.table.rows.kappa)

    def omega(self, t: ArrayLike) -> Array:
        """Resonant angular frequencies at times t [rad/s], (M, T).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            ω_i [rad/s].
        """
        return self.kappa(t) / self.whisker.timescale

    def c(self, t: ArrayLike) -> Array:
        """Linear couplings c_i of the modes to the excursion at times t, (M, T).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            c_i [1].
        """
        return self._at(t, self.table.rows.c)

    def contact(self, t: ArrayLike) -> Array:
        """Contact ε over L at times t, (T,).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (T,) array
            ε over L.
        """
        return self._at(t, self.table.rows.contact)[0]

    def gain(self, t: ArrayLike) -> Array:
        """Jump of the vibration over λ at a gap of the mean width, (M, T); in the linear response, c.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            Jump over λ [1].
        """
        t, n = self._inside(t), self.table.n_modes
        place, width = self.path.spline(t), np.full(t.shape, self.texture.width.mean() / self.whisker.length)
        before = self.table.deepest(place, width)
        return np.asarray((self.table.respond(place, before) - self.table.respond(place, before - width))[:n] / width)

    def travel(self, t: ArrayLike) -> Array:
        """Place X(t) of the contact's ground on the texture [m], (T,).

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (T,) array
            X [m].
        """
        return self.advance.travel(self._inside(t))

    def excursion(self, t: ArrayLike) -> Array:
        """d(t) over L at times t [s], (T,); 0 on the lands.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (T,) array
            d over L.
        """
        return self.advance.excursion(self._inside(t))

    @cached_property
    def free_end(self) -> dict[str, Any]:
        """Shortest free end at a jump [m], or at the path's end where there is none, and the jumps that it allows.

        As :func:`vibrissa.mechanics.scan.free_end.free_end_facts` gives them.
        """
        met, length = self.advance.meetings.jump, self.whisker.length
        happen = met <= self.path.time[-1]
        t, width = met[happen], self.texture.width[: len(met)][happen]
        place = self.path.spline(t)
        after = self.table.deepest(place, width / length) - width / length
        angle = self.table.respond(place, after)[self.table.n_modes + FOLLICLE.index("contact_angle")]
        free = (self.contact(np.append(t, self.path.time[-1])) - self.whisker.tip) * length
        shortest = float(free[: t.size or 1].min())
        return free_end_facts(shortest, gaps_allowed(free[: t.size], width, angle, self.texture.depth))

    @cached_property
    def mode_drive(self) -> Drive:
        """Quasi-static amplitudes Q_i of the modes."""
        n = self.table.n_modes
        return Drive(self.advance.drive.time, self.advance.drive.coefficients[:n], self.advance.drive.before[:n])

    @cached_property
    def frequency(self) -> Drive:
        """ω_i(t) [rad/s] on the panels of the drive."""
        return fit(self.omega, np.append(self.advance.drive.time, self.path.time[-1]), SLOW_TERMS)

    def vibration(self, t: ArrayLike) -> tuple[Array, Array]:
        """Vibration amplitudes q, over L, and q̇ [1/s], (M, T) each.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        q, rate : (M, T) arrays
            Over L, and over L [1/s].
        """
        return drift(self._inside(t), self.mode_drive, self.frequency, self.scan.damping, self.scan.jump)

    def amplitudes(self, t: ArrayLike) -> Array:
        """Vibration amplitudes q_i(t), over L, (M, T), in the modes of the moment's contact.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            q over L.
        """
        return self.vibration(t)[0]

    def mode_displacement(self, t: ArrayLike) -> Array:
        """q_i + Q_i, over L, (M, T): the displacement about the moment's profile on the flat.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            Over L.
        """
        return self.amplitudes(t) + self.mode_drive(self._inside(t))

    def base_curvature(self, t: ArrayLike) -> Array:
        """Whole curvature at the base [1/m], (T,): posture, excursion and vibration.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (T,) array
            [1/m], positive where the shaft bends away from the substrate.
        """
        return self._of_both(t, self.table.rows.bending, "base_curvature") / self.whisker.length

    def contact_load(self, t: ArrayLike) -> Array:
        """Vertical load on the contact over πEα⁴L²/4, (T,); where it is not positive the contact would lift off.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (T,) array
            Over πEα⁴L²/4.
        """
        return self._of_both(t, self.table.rows.shear, "contact_load")

    def _of_both(self, t: ArrayLike, rows: slice, name: str) -> Array:
        t = self._inside(t)
        q = self.amplitudes(t)
        still = self.advance.drive(t)[len(q) + FOLLICLE.index(name)]
        return still + np.einsum("it,it->t", self._at(t, rows), q)

    def _at(self, t: ArrayLike, rows: slice) -> Array:
        return self.advance.slow(self._inside(t))[rows]

    def _inside(self, t: ArrayLike) -> Array:
        t, (start, stop) = np.asarray(t, float), self.path.time[[0, -1]]
        if t.size and not (t[0] >= start and t[-1] <= stop):
            raise RangeError(
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
            below 1: above 0.02 ``remarks`` says so, above 0.2 ``predict_slow`` refuses.
        """
        return dataset(
            {"table_error": self.table.error}, **self.advance.rates(self.scan.damping, self.advance.slow.time)
        )
