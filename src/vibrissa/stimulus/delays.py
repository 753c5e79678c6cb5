"""Delays between circularly shifted copies of one loop, and how the copies correlate."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError

# The 24 most caudal: the straddlers and four columns of five rows. The paper gives their number, not their names.
WHISKERS = tuple(
    name
    for row, straddler in zip("ABCDE", ("alpha", "beta", "gamma", "delta", None), strict=True)
    for name in (*([straddler] if straddler else []), *(f"{row}{column}" for column in range(1, 5)))
)
UNCORRELATED = 0.1  # largest |r| between copies that are called uncorrelated
_LAGS = 20_000  # lags among which the search for delays chooses
_SWEEPS = 20  # over all whiskers; the search mostly rests after 5


def circular_correlation(loop: Array) -> Array:
    """Correlation of a loop with its circularly shifted copies at every lag: exact, by the Fourier series.

    Parameters
    ----------
    loop : (T,) array
        One period, any unit.

    Returns
    -------
    (T,) array
        Pearson's r between the loop and itself shifted by 0, 1, … samples.

    Raises
    ------
    InputError
        If the loop does not move.
    """
    power = np.abs(np.fft.rfft(loop - loop.mean())) ** 2
    product = np.fft.irfft(power, len(loop))
    if not product[0] > 0:
        raise RangeError("stimulus", "must move within the band", "a constant")
    return product / product[0]


def pair_correlations(correlation: Array, shifts: Integers) -> Array:
    """Pearson's r of every pair of copies, (W, W) array, from :func:`circular_correlation` and their shifts.

    Parameters
    ----------
    correlation : (T,) array
        Of the loop with itself, by lag.
    shifts : (W,) array of int
        [samples].

    Returns
    -------
    (W, W) array
        r of each pair.
    """
    return correlation[(shifts[:, None] - shifts[None, :]) % len(correlation)]


def even_shifts(count: int, length: int) -> Integers:
    """Shifts of ``count`` copies spread evenly over a loop of ``length`` samples, to the nearest sample.

    Parameters
    ----------
    count, length : int
        Copies; samples of the loop.

    Returns
    -------
    (count,) array of int
        Shifts [samples].
    """
    return np.round(np.arange(count) * length / count).astype(np.int64)


def random_shifts(count: int, length: int, separation: int, *, rng: np.random.Generator) -> Integers:
    """Random shifts, any two at least ``separation`` samples apart around the loop; the first copy's is 0.

    The gaps between neighbours are the separation and a random partition of the rest, by cuts drawn one by one: sets in
    which cuts fall on one sample are a little rarer than others.

    Parameters
    ----------
    count, length, separation : int
        Copies; samples of the loop; least distance [samples].
    rng : Generator
        Source of randomness.

    Returns
    -------
    (count,) array of int
        Shifts [samples].

    Raises
    ------
    InputError
        If the copies do not fit.
    """
    free = _free(count, length, separation)
    cuts = np.sort(rng.integers(0, free + 1, count - 1))
    shifts = np.arange(1, count) * separation + cuts
    return np.concatenate([[0], rng.permutation(shifts)]).astype(np.int64)


def least_shifts(correlation: Array, count: int, separation: int) -> Integers:
    """Shifts that make the largest |r| between copies small, any two ``separation`` samples apart.

    Each copy in turn goes where its largest |r| with those placed is least; then each is lifted and placed again
    until none moves. A good set, not surely the best of all.

    Parameters
    ----------
    correlation : (T,) array
        From :func:`circular_correlation`.
    count, separation : int
        Number of copies; least distance between two of them [samples].

    Returns
    -------
    (count,) array of int
        Shifts [samples].

    Raises
    ------
    InputError
        If the copies do not fit.
    """
    stride = max(len(correlation) // _LAGS, 1)
    size = len(correlation) // stride
    apart = -(-separation // stride)
    _free(count, size, apart)
    cost = np.abs(correlation[: size * stride : stride]).copy()
    if apart:
        cost[np.minimum(np.arange(size), size - np.arange(size)) < apart] = np.inf
    chosen = even_shifts(count, size).tolist()
    for _ in range(_SWEEPS):
        before = list(chosen)
        for index in range(1, count):
            others = [np.roll(cost, shift) for shift in chosen[:index] + chosen[index + 1 :]]
            worst = np.max(others, axis=0)
            best = int(np.argmin(worst))
            chosen[index] = best if worst[best] < worst[chosen[index]] else chosen[index]
        if chosen == before:
            break
    return np.array(chosen, np.int64) * stride


def largest_separation(count: int, length: int, *, searched: bool) -> int:
    """Largest separation of copies for which there is room.

    Parameters
    ----------
    count, length : int
        Copies; samples of the loop.
    searched : bool
        By :func:`least_shifts`, which searches on a coarser grid; else by :func:`random_shifts`.

    Returns
    -------
    int
        [samples].
    """
    stride = max(length // _LAGS, 1) if searched else 1
    return length // stride // count * stride


def _free(count: int, length: int, separation: int) -> int:
    free = length - count * separation
    if separation < 0 or free < 0:
        rule = f"must leave room for {count} copies in the record of {length} samples"
        raise RangeError("separation", rule, f"{separation} samples", "lower the separation or record longer")
    return free


def correlation_note(correlation: Array, largest: float, count: int) -> str:
    """Reason why copies are correlated, in one line; empty where the largest |r| is below 0.1.

    Parameters
    ----------
    correlation : (T,) array
        Of the loop with itself, by lag.
    largest : float
        Largest |r| of two copies.
    count : int
        Copies.

    Returns
    -------
    str
        The line.
    """
    if largest < UNCORRELATED:
        return ""
    share = float(np.mean(np.abs(correlation) >= UNCORRELATED))
    rms = float(np.sqrt(np.mean(correlation**2)))
    text = f"largest |r| between copies is {largest:.3f}, not below {UNCORRELATED:g}"
    if share * count < 1:
        return f"{text}: these delays meet peaks of the autocorrelation; `delays='least'` avoids them"
    often = f"|r| reaches {UNCORRELATED:g} at {share:.0%} of all lags (rms {rms:.3f})"
    return f"{text}: {often}; record longer, or less regular textures"
