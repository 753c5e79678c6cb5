"""Correlation of two signals over a range of lags."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import ShapeError


def lagged_correlation(signal: Array, reference: Array, max_lag: int) -> tuple[Integers, Array]:
    """Pearson correlation of a signal with one reference or many, at each lag over the samples that overlap.

    Parameters
    ----------
    signal, reference : (T,), (..., T) arrays
        On one even grid.
    max_lag : int
        Largest lag, in samples; positive where the signal comes after the reference.

    Returns
    -------
    lag, correlation : (2·max_lag + 1,), (2·max_lag + 1, ...) arrays
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
    if signal.shape != reference.shape[-1:] or len(signal) < max_lag + 3:
        raise ShapeError("signals", "must have equal length, above max_lag + 2", f"{signal.shape}, {reference.shape}")
    lags = np.arange(-max_lag, max_lag + 1)
    n = len(signal)
    pairs = [(signal[max(k, 0) : n + min(k, 0)], reference[..., max(-k, 0) : n - max(k, 0)]) for k in lags.tolist()]
    return lags, np.array([_pearson(a, b) for a, b in pairs])


def best_correlation(signal: Array, reference: Array, max_lag: int) -> tuple[Integers, Array]:
    """Largest Pearson correlation of a signal with one reference or many, within a range of lags.

    The paper's measure of rate and envelope, in bins of 10 ms with lags of at most one bin. It is no test by itself.

    Parameters
    ----------
    signal, reference, max_lag
        As in :func:`lagged_correlation`.

    Returns
    -------
    lag, correlation : (...) arrays
        Lag of the largest correlation [samples], and its value; 0 and NaN where one of them is constant.
    """
    lags, r = lagged_correlation(signal, reference, max_lag)
    best = np.where(np.isnan(r), -np.inf, r).argmax(axis=0)
    found = np.take_along_axis(r, best[None], axis=0)[0]
    return np.where(np.isnan(found), 0, lags[best]), found


def _pearson(a: Array, b: Array) -> Array:
    constant = (np.ptp(a) == 0) | (np.ptp(b, axis=-1) == 0)  # less its mean it leaves round-off, which correlates
    a, b = a - a.mean(), b - b.mean(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(constant, np.nan, np.vecdot(b, a) / np.sqrt(np.vecdot(a, a) * np.vecdot(b, b)))
