"""Does the envelope drive the unit: correlation of firing rate and envelope."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
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
