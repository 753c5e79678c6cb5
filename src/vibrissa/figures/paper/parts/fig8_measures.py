"""What Figure 8 measures of a rate and an envelope: lags, chance, pairs of bins, classes of the envelope."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.neural.coupling.nulls import BinnedRecord, Circular, circular_correlogram
from vibrissa.signals.correlation import lagged_correlation

REACH, GUARD = 0.2, 0.06  # [s] lags shown, at most; shifts left out about 0, where the envelope is like itself
FEWEST_BINS = 60  # below these chance is not estimated
LEVELS = 12  # classes of the envelope, equally full


def largest(rate: Array, envelope: Array, tested: tuple[int, int]) -> tuple[int, float]:
    """Lag [bins] of the largest correlation among the lags tested, and that; 0 and NaN where there is none.

    Parameters
    ----------
    rate, envelope : (n,) arrays
        In bins.
    tested : (int, int)
        First and last lag [bins].

    Returns
    -------
    lag, correlation : int, float
        The lag is positive where the rate is late.
    """
    lags, r = lagged_correlation(rate, envelope, max(map(abs, tested)))
    r = r[(lags >= tested[0]) & (lags <= tested[1])]
    return (0, np.nan) if np.isnan(r).all() else (tested[0] + int(np.nanargmax(r)), float(np.nanmax(r)))


def correlogram(rate: Array, envelope: Array, width: float, tested: tuple[int, int]) -> tuple[Array, Array, float]:
    """Lags [s], correlation at each, and the 99th percentile of the largest of those tested under circular shifts.

    Parameters
    ----------
    rate, envelope, tested
        As :func:`largest` takes them.
    width : float
        Of a bin [s].

    Returns
    -------
    lag, correlation, chance : (m,) array, (m,) array, float
        Chance is NaN where bins are too few to estimate it.
    """
    n = len(rate)
    lags, found = lagged_correlation(rate, envelope, min(round(REACH / width), max(1, n // 4)))
    chance = np.array([np.nan])
    if n >= FEWEST_BINS and np.isfinite(found).all():
        record = BinnedRecord.whole(rate, envelope)
        around = circular_correlogram(record.rates, record.rate_valid, envelope, record.envelope_valid)[0]
        chance = Circular(guard=max(1, round(GUARD / width))).values(record, 0, around, tested)
    return np.asarray(lags * width, float), found, float(np.quantile(chance, 0.99))


def pairs(envelope: Array, rate: Array, lag: int) -> tuple[Array, Array]:
    """Envelope and the rate that follows it by a lag [bins], where both are there.

    Parameters
    ----------
    envelope, rate : (n,) arrays
        In bins.
    lag : int
        In bins.

    Returns
    -------
    envelope, rate : arrays
        Of one length.
    """
    n = len(rate)
    return envelope[max(-lag, 0) : n - max(lag, 0)], rate[max(lag, 0) : n + min(lag, 0)]


def levels(envelope: Array, rate: Array) -> dict[str, Array]:
    """Means over classes of the envelope that hold equally many bins.

    Parameters
    ----------
    envelope, rate : (n,) arrays
        In bins.

    Returns
    -------
    dict of arrays
        ``level_envelope``, ``level_rate`` and its standard error, ``level_rate_se``.
    """
    classes = np.array_split(np.argsort(envelope), min(LEVELS, len(rate) // 3))
    return {
        "level_envelope": np.array([envelope[one].mean() for one in classes]),
        "level_rate": np.array([rate[one].mean() for one in classes]),
        "level_rate_se": np.array([rate[one].std(ddof=1) / np.sqrt(one.size) for one in classes]),
    }
