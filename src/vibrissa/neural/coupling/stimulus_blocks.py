"""Blocks of the stimulus as draws, beside trials or in place of few: their length, and errors over both together."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from vibrissa.arrays import Array, Integers
from vibrissa.errors import TooFewError
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge

SHORTEST = 5  # bins of a block, at least
FEWEST = 12  # blocks, at least: fewer say little of their own scatter
GUARD = 0.06  # [s] shifts left out on both sides of none, at least: there a drive is like itself
NEAR = 1e-3  # step of the derivatives, over the envelope's spread and 10 ms
TIMESCALE = 0.01  # [s]
_QUIET = 5  # lags in a row at which an autocorrelation must stay within chance


def memory(series: Array) -> int:
    """Lag beyond which a series is no longer like itself, by the rule of [PolitisWhite2004]_.

    The first lag after which the autocorrelation stays within ±2 √(log₁₀ K / K) for five lags.

    Parameters
    ----------
    series : (K,) array
        In even bins.

    Returns
    -------
    int
        [bins]; 0 for noise that has no memory.
    """
    centred = series - series.mean()
    n = centred.size
    power = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    own = np.fft.irfft(power)[: n // 2]
    if not own[0] > 0:
        return 0
    loud = np.abs(own[1:] / own[0]) > 2 * np.sqrt(np.log10(n) / n)
    quiet = np.convolve(loud, np.ones(_QUIET), "valid") == 0
    return int(np.argmax(quiet)) if quiet.any() else n // 2


def block_starts(*series: Array) -> Integers:
    """First bin of each block: twice as long as the longest memory of the series, but no fewer than twelve blocks.

    Parameters
    ----------
    *series : (K,) arrays
        In the bins that count, such as the drive and the residual of a fit.

    Returns
    -------
    (M,) array of int
        Ascending, from 0; the blocks are equally long to within a bin.
    """
    n = series[0].size
    return even_starts(n, min(_length(*series), max(n // FEWEST, 1)))


def independent_blocks(*series: Array, width: float, fewest_trials: int, least: float = 0.0) -> Integers:
    """First bin of each block, twice as long as the longest memory of the series; too few of them are refused.

    Parameters
    ----------
    *series : (K,) arrays
        As in :func:`block_starts`.
    width : float
        Width of a bin [s].
    fewest_trials : int
        Trials from which the analysis draws these instead.
    least : float
        Shortest block [s], such as the reach of a kernel.

    Returns
    -------
    (M,) array of int
        Ascending, from 0.

    Raises
    ------
    InputError
        If there are fewer than twelve.
    """
    n, length = series[0].size, max(_length(*series), round(least / width))
    if n < FEWEST * length:
        rule = f"must be at least {FEWEST} where trials are fewer than {fewest_trials}"
        found = f"{n // length} of {length * width:.3g} s, twice as long as the autocorrelation of stimulus or rate"
        remedy = f"present it for {FEWEST * length * width:.4g} s after the skip, or {fewest_trials} times"
        raise TooFewError("blocks of the stimulus", rule, found, remedy)
    return even_starts(n, length)


def even_starts(n: int, length: int) -> Integers:
    """First bin of each of the blocks, equally long to within a bin.

    Parameters
    ----------
    n : int
        Bins, all blocks together.
    length : int
        Of a block, at least [bins]; one block where there are fewer bins.

    Returns
    -------
    (M,) array of int
        Ascending, from 0.
    """
    count = max(n // length, 1)
    return np.arange(count) * n // count


def guard_bins(width: float, n_bins: int, starts: Integers | None) -> int:
    """Shifts left out on both sides of none [bins]: as long as the stimulus stays like itself.

    Parameters
    ----------
    width : float
        Width of a bin [s].
    n_bins : int
        Bins that count.
    starts : (M,) array of int or None
        First bin of each block, twice as long as the stimulus stays like itself; None where trials are the draws.

    Returns
    -------
    int
        At least 60 ms.
    """
    return max(round(GUARD / width), 0 if starts is None else n_bins // (2 * starts.size))


def _length(*series: Array) -> int:
    return max(2 * max(memory(one) for one in series), SHORTEST)


def sensitivities(drive: BinnedDrive, fit: Hinge) -> Array:
    """Change of the rate of each bin with threshold, slope, latency and baseline, in the order of ``Hinge``.

    Parameters
    ----------
    drive : BinnedDrive
        The stimulus.
    fit : Hinge
        Where.

    Returns
    -------
    (4, K') array
        In Hz per unit of each parameter.
    """
    theta, tau, hinge = fit.threshold, fit.latency, drive.hinged(fit.threshold, fit.latency)
    step, late = NEAR * drive.spread(), NEAR * TIMESCALE
    by_threshold = (drive.hinged(theta + step, tau) - drive.hinged(theta - step, tau)) / (2 * step)
    by_latency = (drive.hinged(theta, tau + late) - drive.hinged(theta, tau - late)) / (2 * late)
    return np.array([fit.slope * by_threshold, hinge, fit.slope * by_latency, np.ones_like(hinge)])


def own_share(slopes: Array, weights: Array, rates: Array, starts: Integers) -> Array:
    """Share of the variance between trials that each block of each trial has for itself, to first order.

    1 for Poisson counts; less where trials differ as wholes, as by a gain.

    Parameters
    ----------
    slopes : (P, K') array
        From :func:`sensitivities`.
    weights : (K',) array
        Weight of each bin.
    rates : (N, K') array
        Rate of each trial [Hz].
    starts : (M,) array of int
        First bin of each block.

    Returns
    -------
    (P,) array
        0 to 1.
    """
    scaled = slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-300)
    pulls = np.linalg.pinv((scaled * weights) @ scaled.T, hermitian=True) @ (scaled * weights)
    scatter = rates - rates.mean(0)
    cells = np.array([np.add.reduceat(scatter * one, starts, axis=1) for one in pulls])
    together = (cells.sum(2) ** 2).sum(1)
    return np.clip((cells**2).sum((1, 2)) / np.where(together > 0, together, np.inf), 0, 1)


def over_both(trials: Array, blocks: Array, share: Array, free: int) -> Array:
    """Deviations that vary as the estimate does over trials and over blocks of the stimulus together.

    Variances are added, less what both contain, as of two crossed clusters [CameronGelbachMiller2011]_, but never below
    that of either. Few draws are widened as Student's t is.

    Parameters
    ----------
    trials, blocks : (P, B) arrays
        Deviations of resampled trials and of resampled blocks.
    share : (P,) array
        Of the variance between trials, what is contained in that between blocks; see :func:`own_share`.
    free : int
        Degrees of freedom: trials or blocks, whichever are fewer, less one.

    Returns
    -------
    (P, B) array
        Deviations.
    """
    by_trials, by_blocks = trials.var(1), blocks.var(1)
    wanted = np.maximum(np.maximum(by_trials, by_blocks), by_blocks + (1 - share) * by_trials)
    both = by_trials + by_blocks
    widened = stdtrit(free, 0.975) / stdtrit(np.inf, 0.975)
    return np.asarray(widened * np.sqrt(wanted / np.where(both > 0, both, 1))[:, None] * (trials + blocks))
