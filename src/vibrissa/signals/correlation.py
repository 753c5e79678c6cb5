"""Correlation of two signals over a range of lags."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError

Array = NDArray[np.float64]


def lagged_correlation(signal: Array, reference: Array, max_lag: int) -> tuple[NDArray[np.int64], Array]:
    """Pearson correlation at each lag, over the samples that overlap.

    Parameters
    ----------
    signal, reference : (T,) arrays
        On one even grid.
    max_lag : int
        Largest lag, in samples; positive where the signal comes after the reference.

    Returns
    -------
    lag, correlation : (2·max_lag + 1,) arrays
        NaN where one of them is constant.

    Raises
    ------
    InputError
        If the lengths differ or fewer than 3 samples overlap.

    Examples
    --------
    >>> reference = np.sin(np.arange(60.0))
    >>> lag, correlation = lagged_correlation(np.roll(reference, 2), reference, 3)
    >>> int(lag[correlation.argmax()])  # the signal comes two samples late
    2
    """
    if signal.shape != reference.shape or len(signal) < max_lag + 3:
        raise InputError("signals", "must have equal length, above max_lag + 2", f"{signal.shape}, {reference.shape}")
    lags = np.arange(-max_lag, max_lag + 1)
    n = len(signal)
    pairs = [(signal[max(k, 0) : n + min(k, 0)], reference[max(-k, 0) : n - max(k, 0)]) for k in lags.tolist()]
    return lags, np.array([_pearson(a, b) for a, b in pairs])


def _pearson(a: Array, b: Array) -> float:
    if np.ptp(a) == 0 or np.ptp(b) == 0:  # a constant less its mean leaves round-off, which correlates with anything
        return np.nan
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b) / float(np.sqrt((a @ a) * (b @ b)))
