"""Correlation of predicted with measured envelopes, and the share of it that is chance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import stdtr

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, InputError, TooFewError
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict_all
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset, require
from vibrissa.signals.correlation import best_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker
from vibrissa.whisker.cone import DAMPING, DENSITY

Series = Callable[[int], "xr.Dataset"]

MODES = 2
LARGEST_LAG = 50e-3  # [s], of the paper


def pearson_p(correlation: Array, count: Array) -> Array:
    """Two-sided p-value of Pearson's correlation, as if every sample were an independent normal draw.

    Parameters
    ----------
    correlation, count : (...) arrays
        Correlations, and samples each was taken over.

    Returns
    -------
    (...) array
        p-values.
    """
    t = np.abs(correlation) * np.sqrt((count - 2) / np.maximum(1 - correlation**2, 1e-300))
    return np.asarray(2 * stdtr(count - 2, -t))


def compare_envelopes(found: Array, predicted: Array, rate: float, chance: Array | None = None) -> xr.Dataset:
    """Correlation of measured and predicted envelopes over lags, and two tests of it.

    The paper allows a lag of 50 ms for the unknown position of the texture and prints no rule of significance; ours is
    Pearson's p < 0.05, ``pearson_p``, at the best lag and of all samples. It takes neighbouring samples for independent
    and forgets that the lag was chosen. ``pseudo_p`` does neither: it is the rank of the correlation among those of
    ``chance``, each with its own best lag. The lag alone makes the correlation of unrelated envelopes positive:
    ``chance_mean``.

    Parameters
    ----------
    found, predicted : (M, T) arrays
        Envelopes of modes, any unit.
    rate : float
        Samples per second [Hz].
    chance : (P, M, T) array, optional
        Envelopes predicted for other textures of the same statistics.

    Returns
    -------
    Dataset
        By ``mode``: ``unlagged_correlation``; ``correlation`` at ``best_lag`` [s] (positive where the measurement
        comes after); ``pearson_p``; ``pseudo_p``, (1 + chance as large)/(1 + P), ``chance_mean`` and ``chance_sd``,
        NaN without ``chance``. ``pseudo_count``: P.

    Raises
    ------
    InputError
        If shapes differ, the signals are too short, or one is constant.
    """
    pairs = list(zip(found, predicted, strict=True))
    max_lag = int(LARGEST_LAG * rate + 1e-9)
    if min(np.ptp(one, axis=-1).min() for one in (found, predicted)) == 0:
        raise TooFewError("signals", "must vary: a constant correlates with nothing")
    lag, rho = map(np.array, zip(*(best_correlation(a, b, max_lag) for a, b in pairs), strict=True))
    none = np.full(len(found), np.nan)
    columns: dict[str, Any] = {"pseudo_p": none, "chance_mean": none, "chance_sd": none}
    if chance is not None and len(chance):
        null = np.array([best_correlation(a, chance[:, m], max_lag)[1] for m, a in enumerate(found)])
        p = (1 + (null >= rho[:, None]).sum(axis=1)) / (1 + null.shape[1])
        columns = {"pseudo_p": p, "chance_mean": null.mean(axis=1), "chance_sd": null.std(axis=1)}
    return dataset(
        {"largest_lag": LARGEST_LAG},
        mode=np.arange(1, len(found) + 1),
        unlagged_correlation=np.array([best_correlation(a, b, 0)[1] for a, b in pairs]),
        correlation=rho,
        best_lag=lag / rate,
        pseudo_count=0 if chance is None else len(chance),
        pearson_p=pearson_p(rho, found.shape[1] - np.abs(lag)),
        **columns,
    )


def predicted_envelopes(whisker: Whisker, posture: Posture, scan: Scan, textures: Sequence[Gaps], time: Array) -> Array:
    """Envelopes of ``mode_displacement`` that the model predicts for textures under one posture, (P, M, T), over L.

    Parameters
    ----------
    whisker, posture, scan, textures
        As in :func:`vibrissa.mechanics.scan.texture_prediction.predict_all`.
    time : (T,) array
        [s].

    Returns
    -------
    (P, M, T) array
        Envelopes of each texture and mode, over L.
    """
    many = predict_all(whisker, posture, textures, scan, n_modes=MODES)
    return analytic_envelope(np.array([one.mode_displacement(time) for one in many]))[0]


def _pseudo_envelopes(whisker: Whisker, posture: Posture, scan: Scan, textures: Sequence[Gaps], time: Array) -> Array:
    """As :func:`predicted_envelopes`, of the textures that the posture can cross; the others are left out.

    The texture that was scanned could be crossed, so those it is held against must be of that kind.
    """
    left = sorted(textures, key=lambda texture: float(texture.width.max()))
    while left:
        try:
            return predicted_envelopes(whisker, posture, scan, left, time)
        except (InputError, ConvergenceError):
            left.pop()
    return np.empty((0, MODES, len(time)))


def found_scan(row: xr.Dataset) -> tuple[Whisker, Posture, Scan]:
    """Whisker, posture and scan of one sweep for the model, from what was measured.

    E is the one that gives the resonance found for mode 1; where ω or ζ was not found, the nominal E or ζ = 0.11.
    μ is 0.4 where it was not asked for.

    Parameters
    ----------
    row : Dataset
        One sweep of the table of sweeps.

    Returns
    -------
    whisker, posture, scan
        Arguments of the prediction.
    """
    length, angle, timescale = (float(row[name]) for name in ("length", "cone_angle", "timescale"))
    frequency, damping = float(row.resonant_frequency[0]), float(row.damping[0])
    friction = float(row.friction) if np.isfinite(row.friction) else 0.4
    posture = Posture(contact=float(row.contact), base_angle=float(row.base_angle), friction=friction)
    if known := bool(np.isfinite(frequency) and 0 <= damping < 1):
        timescale = float(cone_kappa(posture.contact, 1)[0]) / (2 * np.pi * frequency)
    stiffness = DENSITY * (2 * length / angle / timescale) ** 2
    whisker = Whisker(length=length, cone_angle=angle, youngs_modulus=stiffness, density=DENSITY)
    return whisker, posture, Scan(speed=float(row.scan_speed), damping=damping if known else DAMPING)


def compare_sweeps(sweeps: xr.Dataset, series: Series, pseudo: Sequence[Gaps] = ()) -> xr.Dataset:
    """Prediction against measurement in every sweep.

    Parameters
    ----------
    sweeps : Dataset
        The table of sweeps.
    series : callable
        Number of a sweep → its ``envelope`` and, where the texture is known, ``envelope_model`` (mode, time).
    pseudo : sequence of Gaps
        New gratings of the same statistics, for ``pseudo_p``; ``pseudo_count`` says how many a sweep's posture can
        cross. The least p is 1/(1 + that number).

    Returns
    -------
    Dataset
        As :func:`compare_envelopes` with ``sweep`` ahead; NaN where a sweep was not accepted or has no prediction.
    """
    require(sweeps, "contact", "base_angle", "resonant_frequency", "accepted")
    rows = [_compared(sweeps.isel(sweep=i), series, pseudo) for i in range(sweeps.sizes["sweep"])]
    names = ("unlagged_correlation", "correlation", "best_lag", "pearson_p", "pseudo_p", "chance_mean", "chance_sd")
    lost = np.full(MODES, np.nan)
    columns: dict[str, Any] = {
        name: np.array([lost if one is None else one[name].values for one in rows]) for name in names
    }
    columns["pseudo_count"] = np.array([0 if one is None else int(one.pseudo_count) for one in rows])
    attrs = {"largest_lag": LARGEST_LAG, "pseudo_textures": len(pseudo)}
    columns["sweep"], columns["mode"] = sweeps.sweep.values, np.arange(1, MODES + 1)
    return dataset(attrs, lead=("sweep",), **columns)


def _compared(row: xr.Dataset, series: Series, pseudo: Sequence[Gaps]) -> xr.Dataset | None:
    if not bool(row.accepted):
        return None
    one = series(int(row.sweep))
    if "envelope_model" not in one:
        return None
    found, predicted, time = one.envelope.values[:MODES], one.envelope_model.values[:MODES], one.time.values
    chance = _pseudo_envelopes(*found_scan(row), pseudo, time)
    return compare_envelopes(found, predicted, (len(time) - 1) / float(time[-1] - time[0]), chance)
