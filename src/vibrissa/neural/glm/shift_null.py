"""Chance of a whisker's term: its columns shifted circularly against what the other whiskers leave of the rate."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from vibrissa.arrays import Array
from vibrissa.neural.coupling.envelope_coupling import tail_p_value

GUARD = 0.06  # [s] shifts left out on both sides of none: there a drive is like itself


def shift_p_values(columns: Array, rest: Array, weights: Array, guard: int, reach: int = 0) -> Array:
    """p-value of each whisker's columns, from all shifts at which they cannot have driven the unit.

    What a unit answers in every trial alike, such as some other feature of the stimulus, goes with a whisker's columns
    by chance at every shift; the scatter between trials does not show it. The statistic is the weighted sum of squares
    that the columns explain of the rate without the other whiskers' share, at every shift by the Fourier transform; of
    more than counting can tell, an exponential tail.

    Parameters
    ----------
    columns : (W, C, K) array
        Columns of each whisker in the bins that count.
    rest : (W, K) array
        For each whisker, what all the others and the constant leave of the rate, in any unit.
    weights : (K,) array
        Weight of each bin.
    guard : int
        Shifts left out on both sides of no shift [bins].
    reach : int
        Lags over which the statistic was maximised before, by choosing a latency [bins].

    Returns
    -------
    (W,) array
        Not adjusted over whiskers.
    """
    return np.array([_of_whisker(one, left, weights, guard, reach) for one, left in zip(columns, rest, strict=True)])


def _of_whisker(columns: Array, rest: Array, weights: Array, guard: int, reach: int) -> float:
    explained = _explained(columns, rest, weights)
    observed, shifted = explained[0], np.roll(explained, -1)[:-1]
    chance = shifted[guard : len(shifted) - guard]
    if reach:  # each shift is given the freedom that the latency had
        wide = maximum_filter1d(explained, 2 * reach + 1, mode="wrap")
        chance = np.roll(wide, -1)[guard + reach : len(shifted) - guard - reach]
    return tail_p_value(float(observed), chance)


def _explained(columns: Array, rest: Array, weights: Array) -> Array:
    """Weighted sum of squares that columns and a constant explain, at every circular shift; (K,)."""
    n, total = rest.size, weights.sum()
    rest = rest - weights @ rest / total
    w, wr, x = np.fft.rfft(weights), np.fft.rfft(weights * rest), np.fft.rfft(columns)
    # columns shifted by s: sums over bins of weight · column(k − s) for all s at once
    pull, mean = (np.fft.irfft(one * x.conj(), n) for one in (wr, w))
    first, second = np.triu_indices(len(columns))
    products = np.fft.irfft(w * np.fft.rfft(columns[first] * columns[second]).conj(), n)
    gram = np.empty((n, len(columns), len(columns)))
    gram[:, first, second] = gram[:, second, first] = products.T
    gram -= np.einsum("cn,dn->ncd", mean, mean) / total
    ridge = 1e-9 * np.trace(gram[0]) / len(columns) * np.eye(len(columns))
    found = np.linalg.solve(gram + ridge, pull.T[..., None])[..., 0]
    return np.asarray((found * pull.T).sum(1))
