"""Refractory violations of a train of spikes, on the clock of the recording, and the contamination they imply."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import gammaincinv

from vibrissa.arrays import Array
from vibrissa.neural.simulated.refractoriness import ROUNDING, below

SHORT = 0.05  # [s] of the intervals from which the step of a clock is found
FINEST = 0.9e-6  # [s] below which a clock counts as continuous
LEAST_INTERVALS = 20  # different ones from which a step is found
TOLERANCE = 1e-7  # [s] within which intervals are multiples of a step
TAIL = 0.025  # of a 95 % interval on either side


class Dead(NamedTuple):
    """The refractory period on a clock.

    Attributes
    ----------
    limit : float
        Intervals below are violations [s]; 0 where the clock is too coarse for any.
    effective : float
        Length of time in which a foreign spike violates, on either side of a spike [s].
    """

    limit: float
    effective: float


def clock_step(intervals: Array) -> float:
    """Step of a clock, from intervals between spikes on it.

    Parameters
    ----------
    intervals : (N,) array
        Between spikes of one unit [s].

    Returns
    -------
    float
        Largest time of which all intervals are multiples [s]; 0 where there is none of a microsecond or more, or there
        are fewer than 20 different intervals below 50 ms.
    """
    short = np.unique(intervals[(intervals > TOLERANCE) & (intervals < SHORT)])
    short = short[np.diff(short, prepend=-1.0) > TOLERANCE]
    if short.size < LEAST_INTERVALS:
        return 0.0
    step = float(short[0])
    for one in short[1:]:
        step = _common(step, float(one))
        if step < FINEST:
            return 0.0
    return float(short.sum() / np.round(short / step).sum())


def _common(one: float, other: float) -> float:
    """Largest common measure of two times, by Euclid's algorithm; what is left of rounding counts as nothing."""
    while other > TOLERANCE:
        rest = one % other
        one, other = other, 0.0 if other - rest < TOLERANCE else rest
    return one


def dead_time(period: float, step: float) -> Dead:
    """Refractory period as whole steps of a clock.

    A time is rounded to the clock, so an interval of k steps was between k − 1 and k + 1 steps long. It is certainly
    shorter than the period only if k + 1 steps are not longer. A foreign spike falls on k steps of either side with a
    chance of one step, and on the very step of a spike with that of half a step on either side.

    Parameters
    ----------
    period : float
        Refractory period [s].
    step : float
        Step of the clock [s]; 0 for a continuous one.

    Returns
    -------
    Dead
        Limit and effective length.
    """
    if step <= 0:
        return Dead(period, period)
    steps = int(np.floor(period / step + 1e-6))
    return Dead(steps * step, max(steps - 0.5, 0.0) * step)


def violating_share(time: Array, dead: Dead) -> float:
    """Share of the intervals that are refractory violations.

    Parameters
    ----------
    time : (N,) array
        Spikes, ascending [s].
    dead : Dead
        From :func:`dead_time`.

    Returns
    -------
    float
        NaN with fewer than two spikes, or on a clock that is too coarse.
    """
    return float(np.mean(below(np.diff(time), dead.limit))) if time.size > 1 and dead.limit > 0 else np.nan


def violating_pairs(time: Array, dead: Dead) -> int:
    """Pairs of spikes closer than the refractory period, neighbours or not.

    Parameters
    ----------
    time : (N,) array
        Spikes, ascending [s].
    dead : Dead
        From :func:`dead_time`.

    Returns
    -------
    int
        Their number.
    """
    first = np.searchsorted(time, time - (dead.limit - ROUNDING), side="right")
    return int((np.arange(time.size) - first).sum())


def contamination(n_spikes: int, n_violations: float, duration: float, period: float) -> float:
    """Share of a unit's spikes that belong to other neurons, from its refractory violations.

    Foreign spikes that know nothing of each other or of the unit, a share f of all N, give 2 f (1 − f/2) N² τ/T
    violations when each of them may violate with any other spike: f = 1 − √(1 − n T/(N² τ)) (Llobet et al. 2022).

    Parameters
    ----------
    n_spikes : int
        Spikes N.
    n_violations : float
        Pairs n of them closer than the period.
    duration : float
        Time T observed [s].
    period : float
        Refractory period τ [s].

    Returns
    -------
    float
        Between 0 and 1; 1 where there are as many violations as in a Poisson train or more; NaN without a spike.
    """
    if n_spikes == 0 or period <= 0:
        return np.nan
    share = n_violations * duration / (n_spikes**2 * period)
    return float(1 - np.sqrt(max(1 - share, 0.0)))


def contamination_interval(n_spikes: int, n_violations: int, duration: float, period: float) -> tuple[float, float]:
    """95 % interval of the contamination: that of the mean of a Poisson number of violations (Garwood 1936).

    Parameters
    ----------
    n_spikes, n_violations, duration, period
        As in :func:`contamination`.

    Returns
    -------
    (float, float)
        Its ends. With few spikes it reaches from 0 to 1: their violations say nothing.
    """
    low = float(gammaincinv(n_violations, TAIL)) if n_violations else 0.0
    high = float(gammaincinv(n_violations + 1, 1 - TAIL))
    ends = (contamination(n_spikes, n, duration, period) for n in (low, high))
    return next(ends), next(ends)
