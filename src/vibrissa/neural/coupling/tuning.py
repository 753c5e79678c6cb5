"""Threshold, slope and latency of a unit from its counts: likelihood, resampled trials, trials not seen."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq, minimize
from scipy.special import kl_div

from vibrissa.arrays import Array
from vibrissa.neural.coupling.stimulus_blocks import block_starts, over_both, own_share, sensitivities
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge, HingeGrid

ENDS = (0.025, 0.975)  # of the 95 % interval


def poisson_deviance(counts: Array, expected: Array) -> float:
    """Twice the log-likelihood lost against the counts themselves; infinite where a count meets no expectation.

    Parameters
    ----------
    counts, expected : arrays of one shape
        Counts and their expectations.

    Returns
    -------
    float
        [nat].
    """
    return float(2 * kl_div(counts, expected).sum())


def poisson_line(counts: Array, hinge: Array, exposure: float) -> tuple[float, float]:
    """Slope and baseline of most likelihood for Poisson counts, both kept at or above zero.

    Parameters
    ----------
    counts : (K,) array
        Counts summed over trials.
    hinge : (K,) array
        Binned hinge [m].
    exposure : float
        Trials times width of a bin [s].

    Returns
    -------
    slope, baseline : float
        s [1/(s m)] and b [Hz].
    """
    level, scale = counts.mean() / exposure, hinge.mean()
    if scale <= 0 or level <= 0:
        return 0.0, float(level)
    # total expected equals total counted at any maximum, so b = level − s·scale and s alone is free
    fire, x = counts > 0, hinge - scale
    top = level / scale if np.all(hinge[fire] > 0) else level / scale * (1 - 1e-9)

    def gain(slope: float) -> float:
        return float(np.sum(counts[fire] * x[fire] / (level + slope * x[fire])))

    if gain(0.0) <= 0:
        return 0.0, float(level)
    if np.all(hinge[fire] > 0) and gain(top) >= 0:
        return float(top), 0.0
    # the likelihood is concave: its slope falls from above 0 to below
    slope = float(brentq(gain, 0.0, top, xtol=1e-15 * top, rtol=1e-15))
    return slope, float(level - slope * scale)


def forward_fit(grid: HingeGrid, counts: Array, exposure: float) -> Hinge:
    """Threshold-linear fit of the largest Poisson likelihood, averaged over the bins.

    The rate of bin k is b + s · mean over the bin of max(A(t − τ) − θ, 0): threshold before averaging, and a latency
    that need not be a number of bins. Slope and baseline follow from θ and τ, which are searched on the grid by
    weighted least squares and then refined by likelihood.

    Parameters
    ----------
    grid : HingeGrid
        The stimulus.
    counts : (K',) array
        Counts summed over trials, in the bins that count.
    exposure : float
        Trials times width of a bin [s].

    Returns
    -------
    Hinge
        Within the ranges of the grid.
    """
    drive, rates = grid.drive, counts[None] / exposure
    start = grid.best(rates, np.ones(counts.size))
    start = grid.best(rates, _weights(drive, Hinge(*start[:, 0])))
    scale = np.array([np.ptp(grid.thresholds), np.ptp(grid.latencies)])
    origin = np.array([grid.thresholds[0], grid.latencies[0]])

    def lost(position: Array) -> float:
        threshold, latency = origin + position * scale
        hinge = drive.hinged(threshold, latency)
        slope, baseline = poisson_line(counts, hinge, exposure)
        return poisson_deviance(counts, exposure * (baseline + slope * hinge))

    first = (start[[0, 2], 0] - origin) / scale
    simplex = np.clip(first + np.array([[0, 0], [0.02, 0], [0, 0.02]]) * np.where(first > 0.5, -1, 1), 0, 1)
    found = minimize(
        lost,
        np.clip(first, 0, 1),
        method="Nelder-Mead",
        bounds=[(0, 1), (0, 1)],
        options={"initial_simplex": simplex, "xatol": 2e-4, "fatol": 1e-4},
    )
    threshold, latency = (float(one) for one in origin + found.x * scale)
    slope, baseline = poisson_line(counts, drive.hinged(threshold, latency), exposure)
    return Hinge(threshold, slope, latency, baseline)


def predicted(drive: BinnedDrive, fit: Hinge) -> Array:
    """Rate [Hz] of a threshold-linear fit in each bin that counts.

    Parameters
    ----------
    drive : BinnedDrive
        The stimulus.
    fit : Hinge
        The hinge.

    Returns
    -------
    (K',) array
        [Hz].
    """
    return fit.baseline + fit.slope * drive.hinged(fit.threshold, fit.latency)


def _weights(drive: BinnedDrive, fit: Hinge) -> Array:
    """Inverse of the rate, the variance of Poisson counts, with a floor where next to nothing is expected."""
    rate = predicted(drive, fit)
    return 1 / np.maximum(rate, 0.05 * rate.mean() + 1e-12)


def bootstrap_fits(
    grid: HingeGrid, trial_counts: Array, width: float, fit: Hinge, *, n_resamples: int = 400, rng: np.random.Generator
) -> Array:
    """Fits that vary as the fit does over trials and over the stimulus together.

    Trials are drawn whole, so that whatever varies from one to the next is kept. Blocks of the stimulus are drawn with
    their own piece of the response, so that what else the unit answers to, in every trial alike, counts as well. Both
    are fitted by least squares with the weights of the likelihood's fit, centred on its value, and put together by
    :func:`vibrissa.neural.coupling.stimulus_blocks.over_both`.

    Parameters
    ----------
    grid : HingeGrid
        The stimulus.
    trial_counts : (N, K') array
        Counts of each trial in the bins that count.
    width : float
        Width of a bin [s].
    fit : Hinge
        Fit to all trials.
    n_resamples : int
        Draws of trials; half as many of blocks, each used twice.
    rng : Generator
        Source of randomness.

    Returns
    -------
    (4, n_resamples) array
        Rows in the order of :class:`Hinge`, within the ranges of the grid.
    """
    n, rate, weights = len(trial_counts), trial_counts.mean(0) / width, _weights(grid.drive, fit)
    fitted = predicted(grid.drive, fit)
    starts = block_starts(rate - fitted, fitted)
    # how often each trial and block is drawn; the first row, each once, gives the value that the draws are centred on
    trials, blocks = _drawn(n, n_resamples, rng), _drawn(starts.size, (n_resamples + 1) // 2, rng)
    by_trials = _deviations(grid.best(trials @ trial_counts / (n * width), weights), n)
    by_blocks = _deviations(grid.best_of_blocks(rate, weights, starts, blocks), starts.size)
    by_blocks = np.tile(by_blocks, 2)[:, :n_resamples]
    share = own_share(sensitivities(grid.drive, fit), weights, trial_counts / width, starts)
    centred = over_both(by_trials, by_blocks, share, min(n, starts.size) - 1) + np.array(fit)[:, None]
    least = np.array([grid.thresholds[0], 0, grid.latencies[0], 0])
    most = np.array([grid.thresholds[-1], np.inf, grid.latencies[-1], np.inf])
    return np.clip(centred, least[:, None], most[:, None])


def _drawn(n: int, n_resamples: int, rng: np.random.Generator) -> Array:
    """How often each of n is drawn; in the first row each once."""
    return np.vstack([np.ones((1, n), int), rng.multinomial(n, np.full(n, 1 / n), n_resamples)])


def _deviations(found: Array, n: int) -> Array:
    """Fits of resampled less that of all; resampled means vary by (n − 1)/n of what means of n draws do."""
    return np.sqrt(n / max(n - 1, 1)) * (found[:, 1:] - found[:, :1])


def r_squared(rate: Array, prediction: Array) -> float:
    """Share of the rate's variance over bins that a prediction explains; NaN for a constant rate.

    Parameters
    ----------
    rate, prediction : (K,) arrays
        In one unit.

    Returns
    -------
    float
        At most 1.
    """
    total = float(np.sum((rate - rate.mean()) ** 2))
    return np.nan if np.ptp(rate) == 0 else 1 - float(np.sum((rate - prediction) ** 2)) / total


def cross_validated(grid: HingeGrid, trial_counts: Array, width: float) -> tuple[float, float]:
    """R² on trials that the fit has not seen, and its ceiling.

    Odd trials are predicted from the even ones, and the other way round. The ceiling is the correlation of the two
    halves: the R² of the true rate against one half.

    Parameters
    ----------
    grid, trial_counts, width
        As in :func:`bootstrap_fits`.

    Returns
    -------
    r_squared, ceiling : float
        NaN where there are fewer than 2 trials, or a half is constant.
    """
    halves = [trial_counts[k::2] for k in (0, 1)]
    if len(halves[1]) == 0 or any(np.ptp(half.sum(0)) == 0 for half in halves):
        return np.nan, np.nan
    rates = [half.mean(0) / width for half in halves]
    fits = [forward_fit(grid, half.sum(0), len(half) * width) for half in halves]
    unseen = [r_squared(rates[1 - k], predicted(grid.drive, fits[k])) for k in (0, 1)]
    return float(np.mean(unseen)), float(np.corrcoef(rates[0], rates[1])[0, 1])


def weakness(grid: HingeGrid, samples: Array) -> str:
    """Reason why resampled trials do not determine threshold and slope; empty where they do.

    Parameters
    ----------
    grid : HingeGrid
        The stimulus.
    samples : (4, B) array
        Hinges of resampled trials.

    Returns
    -------
    str
        The first reason found.
    """
    low, high = np.quantile(samples, ENDS, axis=1)
    least, most = grid.drive.identifiable_range()
    if not low[1] > 0:
        return "slope not above 0"
    if low[0] <= least:
        return "threshold may lie below the envelope's range (its 5th percentile)"
    if high[0] >= most:
        return "threshold may lie above the envelope's range (its 95th percentile)"
    if high[0] - low[0] > grid.drive.spread():
        return "interval of the threshold wider than the envelope's standard deviation"
    if high[2] >= grid.latencies[-1]:
        return f"latency may be longer than the {grid.latencies[-1]:g} s searched"
    if high[2] <= grid.latencies[0]:
        return f"latency may be below the {grid.latencies[0]:g} s from which on it is searched: the rate may lead"
    return ""
