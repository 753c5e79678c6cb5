"""Does the envelope drive the unit: correlation of firing rate and envelope."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.neural.nulls import Lags, Record, circular_correlogram
from vibrissa.signals.correlation import lagged_correlation

Array = NDArray[np.float64]


def bin_means(time: Array, values: Array, *, start: float, n_bins: int, bin_width: float) -> Array:
    """Mean of the samples in each half-open bin.

    Parameters
    ----------
    time, values : (T,) arrays
        Times [s] and values.
    start, n_bins, bin_width
        Bins as in :func:`vibrissa.neural.response.spike_counts`.

    Returns
    -------
    (n_bins,) array
        Means, in the unit of the values.

    Raises
    ------
    InputError
        If a bin holds no sample.
    """
    column = np.floor((time - start) / bin_width + 1e-9).astype(int)
    inside = (column >= 0) & (column < n_bins)
    count = np.bincount(column[inside], minlength=n_bins)
    if np.any(count == 0):
        raise InputError("bin width", "must hold at least one sample in every bin", bin_width)
    return np.bincount(column[inside], values[inside], minlength=n_bins) / count


def maximal_correlation(rate: Array, envelope: Array, *, max_lag: int = 1) -> tuple[float, int]:
    """Largest correlation of rate and envelope within a few bins of shift.

    The paper's measure: both in 10 ms bins, shifted by at most one. No test of significance by itself.

    Parameters
    ----------
    rate, envelope : (K,) arrays
        Trial-averaged firing rate and envelope, in the same bins.
    max_lag : int
        Largest shift, in bins; positive where the rate comes after the envelope.

    Returns
    -------
    correlation : float
        Pearson's r at the best lag; NaN, at lag 0, where one of them is constant, as for a silent unit.
    lag : int
        That lag, in bins.
    """
    lags, r = lagged_correlation(rate, envelope, max_lag)
    if np.isnan(r).all():
        return np.nan, 0
    best = int(np.nanargmax(r))
    return float(r[best]), int(lags[best])


class Coupling(NamedTuple):
    """Correlation of many units with one envelope, and how often chance does as well.

    Attributes
    ----------
    correlation : (U,) array
        Largest Pearson's r over the lags; NaN where the rate is constant, as in a silent unit.
    lag : (U,) array
        That lag [bins], positive where the rate comes after the envelope; 0 where the correlation is NaN.
    p_value : (U,) array
        (1 + chance values at least as large) / (1 + chance values); NaN where the correlation is.
    tail_p_value : (U,) array
        The same, but where no chance value is as large: at most that, continued beyond the largest by an exponential
        tail. Counting ends at about 0.001, too coarse to find one driven unit among many.
    """

    correlation: Array
    lag: NDArray[np.int64]
    p_value: Array
    tail_p_value: Array


class Null(Protocol):
    """What chance does: gives the values the observed correlation is compared with."""

    def values(self, record: Record, unit: int, correlogram: Array, lags: Lags) -> Array:
        """Give the chance values of one unit, whose correlogram at all circular shifts is given."""
        ...


def envelope_coupling(record: Record, null: Null, *, lags: Lags = (-1, 1)) -> Coupling:
    """Whether the envelope drives the units: largest correlation over a few lags against what chance gives.

    Parameters
    ----------
    record : Record
        Rates and envelope.
    null : Null
        :class:`Circular`, :class:`PseudoTexture` or :class:`Paper2014`.
    lags : (int, int)
        First and last lag tried [bins], both included; positive where the rate comes after the envelope. Lags wrap,
        which touches no pair that counts where the masks leave out the ends.

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
        raise InputError("lags", "must ascend, and stay within a quarter of the record", lags)
    tried = np.arange(lags[0], lags[1] + 1)
    every = circular_correlogram(record.rates, record.rate_valid, record.envelope, record.envelope_valid)
    r = every[:, tried]
    best = np.where(np.isnan(r), -np.inf, r).argmax(-1)
    observed = r[np.arange(len(r)), best]
    p, tail = np.full((2, len(r)), np.nan)
    for unit in np.flatnonzero(np.isfinite(observed)).tolist():
        chance = null.values(record, unit, every[unit], lags)
        p[unit] = _p_value(observed[unit], chance)
        tail[unit] = _tail_p_value(observed[unit], chance)
    return Coupling(observed, np.where(np.isnan(observed), 0, tried[best]), p, tail)


def _p_value(observed: float, chance: Array) -> float:
    return float((1 + np.sum(chance >= observed - 1e-12)) / (1 + chance.size))  # the margin is round-off


def _tail_p_value(observed: float, chance: Array) -> float:
    """p-value by counting, or by an exponential through the largest tenth of the chance values beyond all of them.

    Correlations have lighter tails than that, so the p-value comes out too large rather than too small.
    """
    counted = _p_value(observed, chance)
    top = np.sort(chance)[-max(chance.size // 10, 2) :]
    excess = float((top - top[0]).mean())
    if observed <= top[-1] or excess <= 0:
        return counted
    return min(counted, float(top.size / chance.size * np.exp(-(observed - top[0]) / excess)))
