"""Active whisking: a texture met while the posture changes slowly beside the whisker's ringing."""

from __future__ import annotations

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.mechanics.contact.gap_events import check_gaps
from vibrissa.mechanics.scan.free_end import free_end_lines
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.verdict import verdict
from vibrissa.mechanics.whisking.advance import Advance
from vibrissa.mechanics.whisking.path_diagnostics import path_diagnostics
from vibrissa.mechanics.whisking.path_tabulation import tabulate
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.mechanics.whisking.slow_prediction import DRIFTING, SlowPrediction
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

PANEL = 2e-3  # [s] longest panel
BLURRED = 0.2  # change within one ring-down above which a line is no single posture's


def predict_slow(
    whisker: Whisker, path: PosturePath, texture: Gaps, scan: Scan, *, n_modes: int = 12, panel: float = PANEL
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

    Returns
    -------
    SlowPrediction
        At any time on the path.

    Raises
    ------
    InputError
        Named with the time: if the tip comes off the ground, a posture is beyond the fold or cannot cross the
        gaps, the contact stops or goes back, or the posture changes fast (``condition``); or if the first gap
        begins before the path.
    """
    check_gaps(texture, "a posture that changes is known over gaps alone; hold it still for predict_relief")
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
        ``mode_amplitude``, ``mode_displacement``, its ``envelope`` [m], ``excursion``, whole ``base_curvature``; of the
        moment ``moment_contact``, ``moment_base_angle``, ``moment_frequency``, ``moment_coupling``; ``contact_advance``
        X; what ``condition`` and :func:`vibrissa.mechanics.whisking.path_diagnostics.path_diagnostics` give; the
        attribute ``verdict``.
    """
    t = prediction._inside(t)
    shown, scan, whisker = prediction.mode_displacement(t), prediction.scan, prediction.whisker
    attrs = {
        "response": scan.response,
        "jump": scan.jump,
        "damping": scan.damping,
        "scan_speed": scan.speed,
        "friction": prediction.path.friction,
        **whisker.attributes,
        "gaps": len(prediction.texture.width),
        "gap_depth": prediction.texture.depth,
        "table_error": prediction.table.error,
    }
    judged = path_diagnostics(prediction, t)
    signals = dataset(
        attrs | {"verdict": verdict(judged)},
        mode=np.arange(1, len(shown) + 1),
        mode_amplitude=prediction.amplitudes(t),
        mode_displacement=shown,
        envelope=whisker.length * analytic_envelope(shown)[0],
        excursion=prediction.excursion(t),
        base_curvature=prediction.base_curvature(t),
        moment_contact=prediction.contact(t),
        moment_base_angle=prediction.path.spline(t)[1],
        moment_frequency=prediction.omega(t) / (2 * np.pi),
        moment_coupling=prediction.c(t),
        contact_advance=prediction.travel(t),
        **prediction.advance.rates(scan.damping, t),
    )
    return signals.merge(judged, combine_attrs="override")


def remarks(prediction: SlowPrediction, t: Array) -> list[str]:
    """What can be said against a prediction, one line each, with the time of the worst; the verdict first.

    Parameters
    ----------
    prediction : SlowPrediction
        To be judged.
    t : (T,) array
        Times [s] at which the contact is looked at.

    Returns
    -------
    list of str
        The lines.
    """
    limits = (
        ("frequency_rate", DRIFTING, "the frequency drifts by a share of {:.2g} per radian of ringing"),
        ("gain_rate", DRIFTING, "the gain drifts by a share of {:.2g} per radian of ringing"),
        ("mode_mixing", DRIFTING, "the moving contact would send a share of {:.2g} of a mode's ringing to others"),
        ("ring_down_change", BLURRED, "the resonance or its gain changes by {:.2g} within one ring-down"),
    )
    data, lines = prediction.condition, [verdict(path_diagnostics(prediction, t)), *free_end_lines(prediction.free_end)]
    for name, limit, line in limits:
        i = int(data[name].values.argmax())
        if (value := float(data[name][i])) > limit:
            lines.append(f"{line.format(value)}, at {data.time.values[i]:.4g} s")
    if (off := prediction.contact_load(t) <= 0).any():
        lines.append(f"the contact would lift off, first at {t[int(off.argmax())]:.4g} s")
    return lines
