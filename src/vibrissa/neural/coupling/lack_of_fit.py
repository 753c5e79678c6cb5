"""Whether a threshold-linear rate describes a unit and, if not, what does: tests of the residual, other curves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.neural.coupling.stimulus_blocks import block_starts, sensitivities
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge
from vibrissa.neural.coupling.tuning import predicted
from vibrissa.stats import hotelling_p_value

LEVEL = 0.01  # largest p-value of the residual's structure at which another description is looked for
WORTH = 0.02  # of the explainable variance: a description that adds less is not worth another name
KNOTS = (0.0, 0.35, 0.65, 0.9)  # shares of the time at which a curve over the envelope may bend
MEMORIES = (0.05, 0.3)  # [s] over which the past drive may add to or take from the rate
CLASSES = 12  # of the envelope, equally filled: points of the response curve
_THRESHOLDS = 30  # tried of the other curves


class Description(NamedTuple):
    """Curve that describes a unit, and how well.

    Attributes
    ----------
    model : str
        threshold-linear, saturation, rectified square, adaptation, smooth curve, or other where none of these does.
    p_value : float
        Of the structure that the residual of the threshold-linear rate has over the envelope and its past.
    share : float
        Of the variance of the mean rate that the description explains.
    at : float
        Envelope at which the rate saturates [m], or time over which it adapts [s]; NaN of the others.
    """

    model: str
    p_value: float
    share: float
    at: float


def structure_p_value(extra: Array, slopes: Array, residual: Array, weights: Array, starts: Integers) -> float:
    """p-value of columns that a weighted fit has left out, from blocks of the stimulus.

    A score test: what the columns add to those fitted, times the residual, summed over each block; Hotelling's T² of
    these sums. What else the unit answers to, in every trial alike, scatters over blocks and is not structure.

    Parameters
    ----------
    extra : (Q, K) array
        Columns left out.
    slopes : (P, K) array
        Columns fitted, or the rate's change with each parameter.
    residual, weights : (K,) arrays
        Rate less the fit, and weight of each bin.
    starts : (M,) array of int
        First bin of each block.

    Returns
    -------
    float
        NaN where there are too few blocks, or the columns add nothing to those fitted, as with an envelope of two
        values.
    """
    new = _beyond(extra, slopes, weights)
    rank, n_blocks = len(new), starts.size
    if not rank or n_blocks <= rank + 2:
        return np.nan
    sums = np.add.reduceat(new * weights * residual, starts, axis=1)
    total = sums.sum(1)
    scatter = np.cov(sums) * n_blocks if rank > 1 else np.atleast_2d(np.var(sums, ddof=1) * n_blocks)
    statistic = float(total @ np.linalg.pinv(scatter, hermitian=True) @ total)
    return float(hotelling_p_value(statistic, rank, n_blocks))


def _beyond(extra: Array, slopes: Array, weights: Array) -> Array:
    """Orthonormal columns of what the extra ones add to the fitted ones, under the weights; (R, K)."""
    root = np.sqrt(weights)
    known = np.linalg.svd(_unit(slopes * root), full_matrices=False)
    base = known[2][known[1] > 1e-8 * known[1][0]]
    rest = _unit(extra * root)
    rest = rest - (rest @ base.T) @ base
    _, values, rows = np.linalg.svd(rest, full_matrices=False)
    return np.asarray(rows[values > 1e-2] / root)  # columns all but within the fit would be round-off and its errors


def _unit(columns: Array) -> Array:
    return columns / np.maximum(np.linalg.norm(columns, axis=1, keepdims=True), 1e-300)


def describe(drive: BinnedDrive, rate: Array, fit: Hinge, ceiling: float) -> Description:
    """Say whether a threshold-linear rate describes a unit, or which other curve does.

    Parameters
    ----------
    drive : BinnedDrive
        The stimulus.
    rate : (K',) array
        Mean rate over trials [Hz].
    fit : Hinge
        The threshold-linear fit, of slope above 0.
    ceiling : float
        Share of the variance of this rate that can be explained.

    Returns
    -------
    Description
        The fit itself, unless the residual is structured and another curve explains more by a fiftieth of what can be
        explained.
    """
    fitted = predicted(drive, fit)
    weights = 1 / np.maximum(fitted, 0.05 * fitted.mean() + 1e-12)
    starts = block_starts(rate - fitted, fitted)
    slopes = sensitivities(drive, fit)
    curve, past = _curve(drive, fit.latency), _past(drive.hinged(fit.threshold, fit.latency), _width(drive))
    tests = [structure_p_value(one, slopes, rate - fitted, weights, starts) for one in (curve, past)]
    p_value = min(1.0, 2 * float(np.nanmin(tests))) if np.isfinite(tests).any() else np.nan
    own = 1 - float(np.mean((rate - fitted) ** 2)) / float(rate.var())
    if not p_value <= LEVEL:
        return Description("threshold-linear", p_value, own, np.nan)
    found = _best_other(drive, rate, fit, weights)
    if found.share < own + WORTH * ceiling:
        return Description("threshold-linear", p_value, own, np.nan)
    return found._replace(p_value=p_value)


def _width(drive: BinnedDrive) -> float:
    return float(drive.edges[1] - drive.edges[0])


def _curve(drive: BinnedDrive, latency: float) -> Array:
    """Columns of a bent line over the envelope, (4, K')."""
    knots = np.quantile(drive.counted(), KNOTS)
    return np.array([drive.hinged(knot, latency) for knot in knots])


def _past(hinge: Array, width: float) -> Array:
    """Running means of the drive before each bin, over the memories; the bins before the first count as the mean."""
    found = []
    for memory in MEMORIES:
        lags = np.arange(1, min(int(5 * memory / width), hinge.size - 1) + 1)
        kernel = np.exp(-lags * width / memory)
        centred = np.convolve(hinge - hinge.mean(), np.concatenate([[0.0], kernel / kernel.sum()]))
        found.append(centred[: hinge.size])
    return np.array(found)


def _best_other(drive: BinnedDrive, rate: Array, fit: Hinge, weights: Array) -> Description:
    """Curve of the least misfit, each further number of it priced as by the Bayesian information criterion."""
    thresholds = np.linspace(*drive.range(), _THRESHOLDS)
    hinges = np.array([drive.hinged(one, fit.latency) for one in thresholds])
    candidates = [
        _saturation(hinges, thresholds),
        _squares(drive, thresholds, fit.latency),
        _adaptation(hinges, _width(drive)),
        [("smooth curve", np.nan, _curve(drive, fit.latency))],
    ]
    fits = [min((_fitted(*one, rate, weights) for one in kind), key=lambda one: one[0]) for kind in candidates]
    # the scatter of a bin about the truth is not larger than about the best curve
    scatter = min(misfit / rate.size for misfit, *_ in fits)
    numbers = (4, 3, 4, 5)
    cost = [one[0] / scatter + n * np.log(rate.size) for one, n in zip(fits, numbers, strict=True)]
    _, model, at, share = fits[int(np.argmin(cost))]
    return Description(model, np.nan, share, at)


Candidate = tuple[str, float, Array]


def _saturation(hinges: Array, thresholds: Array) -> list[Candidate]:
    """Threshold-linear curves that are flat again above a second level."""
    pairs = [(low, high) for low in range(0, _THRESHOLDS, 2) for high in range(low + 3, _THRESHOLDS, 2)]
    return [("saturation", float(thresholds[high]), (hinges[low] - hinges[high])[None]) for low, high in pairs]


def _squares(drive: BinnedDrive, thresholds: Array, latency: float) -> list[Candidate]:
    """Squares of the envelope above a threshold."""
    above = [np.maximum(drive.envelope - one, 0) ** 2 for one in thresholds[::2]]
    return [("rectified square", np.nan, drive.seen(one, latency)[None]) for one in above]


def _adaptation(hinges: Array, width: float) -> list[Candidate]:
    """Threshold-linear curves less a share of their own recent past."""
    found = []
    for hinge in hinges[::2]:
        found += [
            ("adaptation", memory, np.array([hinge, past]))
            for memory, past in zip(MEMORIES, _past(hinge, width), strict=True)
        ]
    return found


def _fitted(model: str, at: float, columns: Array, rate: Array, weights: Array) -> tuple[float, str, float, float]:
    """Weighted misfit of a constant and these columns, their name, and the share of the variance explained."""
    design = np.vstack([np.ones(rate.size), _unit(columns)])
    weighted = design * weights
    b = np.linalg.pinv(weighted @ design.T, hermitian=True, rcond=1e-12) @ (weighted @ rate)
    residual = rate - b @ design
    if model == "adaptation" and b[2] >= 0:  # the past adds: not adaptation
        return np.inf, model, at, -np.inf
    share = 1 - float(np.mean(residual**2)) / float(rate.var())
    return float(weights @ residual**2), model, at, share


def response_curve(drive: BinnedDrive, rates: Array, latency: float, fitted: Array) -> dict[str, Array]:
    """Mean rate in classes of the envelope at a latency, beside that of a fit.

    Parameters
    ----------
    drive : BinnedDrive
        The stimulus.
    rates : (N, K') array
        Rate of each trial [Hz].
    latency : float
        Delay from envelope to rate [s].
    fitted : (K',) array
        Rate of the fit [Hz]; NaN where there is none.

    Returns
    -------
    dict of (12,) arrays
        ``response_envelope`` [m], ``response_rate`` with its standard error over trials ``response_rate_se`` and
        ``response_rate_fitted`` [Hz], in the order of the envelope.
    """
    envelope = drive.seen(drive.envelope, latency)
    order = np.array_split(np.argsort(envelope, kind="stable"), CLASSES)
    member = np.zeros((CLASSES, envelope.size))
    for one, places in zip(member, order, strict=True):
        one[places] = 1 / len(places)
    means = rates @ member.T
    error = means.std(0, ddof=1) / np.sqrt(len(means)) if len(means) > 1 else np.full(CLASSES, np.nan)
    return {
        "response_envelope": member @ envelope,
        "response_rate": means.mean(0),
        "response_rate_se": error,
        "response_rate_fitted": np.array([fitted[places].mean() for places in order]),
    }
