"""Correlation of firing rate and envelope: whether the envelope drives the unit."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, TooFewError
from vibrissa.neural.coupling.nulls import BinnedRecord, Circular, Lags, circular_correlogram

ON_EDGE = 1e-9  # [s] 29·0.01 is not 0.29, and times less an onset at 1e5 s have an error of 15 ps
_BLOCK = 256  # units whose correlograms are held at a time


def bin_of(time: Array, start: float, bin_width: float) -> Integers:
    """Number of the half-open bin [start + k·width, start + (k+1)·width) that holds each time.

    Parameters
    ----------
    time : (T,) array
        Times [s]; within 1 ns of an edge they are on it.
    start, bin_width : float
        Start of the first bin and width of each [s].

    Returns
    -------
    (T,) array of int
        From 0; below it before the start.
    """
    return np.floor((time - start + ON_EDGE) / bin_width).astype(int)


def bin_means(time: Array, values: Array, *, start: float, n_bins: int, bin_width: float) -> Array:
    """Mean of the samples in each half-open bin.

    Parameters
    ----------
    time, values : (T,) arrays
        Times [s] and values.
    start, n_bins, bin_width
        Bins as in :func:`vibrissa.neural.coupling.response.spike_counts`.

    Returns
    -------
    (n_bins,) array
        Means, in the unit of the values.

    Raises
    ------
    InputError
        If a bin holds no sample.
    """
    column = bin_of(time, start, bin_width)
    inside = (column >= 0) & (column < n_bins)
    count = np.bincount(column[inside], minlength=n_bins)
    if np.any(count == 0):
        raise TooFewError("bin width", "must hold at least one sample in every bin", bin_width)
    return np.bincount(column[inside], values[inside], minlength=n_bins) / count


class Coupling(NamedTuple):
    """Correlation of many units with one envelope, and how often chance does as well.

    Attributes
    ----------
    correlation : (U,) array
        Largest Pearson's r over the lags; NaN where the rate is constant, as in a silent unit.
    lag : (U,) array
        That lag [bins], positive where the rate comes after the envelope; 0 where the correlation is NaN.
    p_value : (U,) array
        (1 + chance values at least as large) / (1 + chance values); NaN where the correlation is. Neighbouring shifts
        are alike, so the smallest of these values are met a few times as often by chance as they say.
    tail_p_value : (U,) array
        The same, but where no chance value is as large, a tail fitted to the largest tenth of them
        (:func:`tail_p_value`). Counting ends at about 0.001, too coarse to find one driven unit among many.
    peak : (U,) array
        Largest Pearson's r over all lags within the reach, tested or not.
    peak_lag : (U,) array
        That lag [bins].
    peak_p_value : (U,) array
        p-value of it by :class:`~vibrissa.neural.coupling.nulls.Circular` shifts, where that lag is not among those
        tested; NaN elsewhere and of other nulls.
    """

    correlation: Array
    lag: Integers
    p_value: Array
    tail_p_value: Array
    peak: Array
    peak_lag: Integers
    peak_p_value: Array


class Null(Protocol):
    """Null distribution: the values with which the observed correlation is compared."""

    def values(self, record: BinnedRecord, unit: int, correlogram: Array, lags: Lags) -> Array:
        """Chance values of one unit, whose correlogram at all circular shifts is given.

        Parameters
        ----------
        record : BinnedRecord
            Rates and envelope.
        unit : int
            Place of the unit.
        correlogram : (K,) array
            Its correlation with the envelope at all circular shifts.
        lags : (int, int)
            First and last lag tried [bins].

        Returns
        -------
        (C,) array
            Chance values of the correlation.
        """
        ...


def envelope_coupling(record: BinnedRecord, null: Null, *, lags: Lags = (-1, 1), reach: int = 5) -> Coupling:
    """Whether the envelope drives the units: largest correlation over a few lags against what chance gives.

    Parameters
    ----------
    record : BinnedRecord
        Rates and envelope.
    null : Null
        :class:`Circular` or :class:`Paper2014`, or envelopes of other textures as in ``benchmarks/cortex.py``.
    lags : (int, int)
        First and last lag tried [bins], both included; positive where the rate comes after the envelope. Lags wrap,
        which touches no pair that counts where the masks leave out the ends.
    reach : int
        Lags to either side at which the largest correlation is reported as well [bins].

    Returns
    -------
    Coupling
        For each unit.

    Raises
    ------
    InputError
        If the lags are not in order.
    """
    if not -len(record.envelope) // 4 < lags[0] <= lags[1] < len(record.envelope) // 4:
        raise RangeError("lags", "must ascend, and stay within a quarter of the record", lags)
    tried = np.arange(lags[0], lags[1] + 1)
    blocks = [_of_units(record, null, tried, reach, first) for first in range(0, max(len(record.rates), 1), _BLOCK)]
    return Coupling(*(np.concatenate(column) for column in zip(*blocks, strict=True)))


def _of_units(record: BinnedRecord, null: Null, tried: Integers, reach: int, first: int) -> Coupling:
    """Coupling of one block of units."""
    rates = record.rates[first : first + _BLOCK]
    every = circular_correlogram(rates, record.rate_valid, record.envelope, record.envelope_valid)
    observed, lag = _largest(every, tried)
    peak, peak_lag = _largest(every, np.arange(-reach, reach + 1))
    p, tail, peak_p = np.full((3, len(every)), np.nan)
    for unit in np.flatnonzero(np.isfinite(observed)).tolist():
        chance = null.values(record, first + unit, every[unit], (int(tried[0]), int(tried[-1])))
        p[unit] = _p_value(observed[unit], chance)
        tail[unit] = tail_p_value(observed[unit], chance)
        if isinstance(null, Circular) and not tried[0] <= peak_lag[unit] <= tried[-1]:
            peak_p[unit] = _p_value(peak[unit], null.values(record, first + unit, every[unit], (-reach, reach)))
    return Coupling(observed, lag, p, tail, peak, peak_lag, peak_p)


def _largest(correlogram: Array, lags: Integers) -> tuple[Array, Integers]:
    """Largest correlation of each unit over some lags, and that lag; 0 where it is NaN."""
    r = correlogram[:, lags]
    best = np.where(np.isnan(r), -np.inf, r).argmax(-1)
    found = r[np.arange(len(r)), best]
    return found, np.where(np.isnan(found), 0, lags[best])


def _p_value(observed: float, chance: Array) -> float:
    return float((1 + np.sum(chance >= observed - 1e-12)) / (1 + chance.size))  # the margin is round-off


def tail_p_value(observed: float, chance: Array) -> float:
    """p-value by counting, and beyond all chance values by a tail through the largest tenth of them.

    The tail is that of a value still to be drawn from an exponential whose scale is known from m independent values:
    (1 + z/m)^−m, the Pareto law that mixes exponentials. Where neighbours are alike, a value just beyond all others is
    not as rare as counting says, and as many are independent as there are runs of neighbours among the largest tenth,
    as extremes of a series are counted. Correlations have lighter tails than an exponential, so that far out the
    p-value is too large rather than too small.

    Parameters
    ----------
    observed : float
        The value.
    chance : (C,) array
        Values of chance, in the order of the shifts.

    Returns
    -------
    float
        Between 0 and 1.
    """
    largest = np.sort(np.argsort(chance)[-max(chance.size // 10, 2) :])
    top = chance[largest]
    excess = float((top - top.min()).mean())
    if observed <= top.max() or excess <= 0:
        return _p_value(observed, chance)
    independent = 1 + int(np.sum(np.diff(largest) > 1))
    beyond = (observed - top.min()) / excess
    return float(top.size / chance.size * (1 + beyond / independent) ** -independent)
