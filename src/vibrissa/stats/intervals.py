"""False discoveries among many tests, intervals of shares, jackknife by cluster."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit, ndtri, stdtrit
from scipy.stats import false_discovery_control

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, ShapeError, TooFewError, require_fraction

Scale = Literal["plain", "correlation", "share", "r2"]

UPPER = 0.975  # quantile at the upper end of a 95 % interval

# Of each scale: the range of its numbers, the function that opens the range to the whole line, and its inverse
RANGES: dict[Scale, tuple[float, float]] = {
    "plain": (-np.inf, np.inf),
    "correlation": (-1.0, 1.0),
    "share": (0.0, 1.0),
    "r2": (-np.inf, 1.0),
}
_OPENED: dict[Scale, tuple[Callable[..., Array], Callable[..., Array]]] = {
    "plain": (lambda x: x, lambda y: y),
    "correlation": (np.arctanh, np.tanh),
    "share": (logit, expit),
    "r2": (lambda x: -np.log1p(-x), lambda y: -np.expm1(-y)),
}


def adjusted_p_values(p: Array) -> Array:
    """Benjamini and Hochberg's adjusted p-values.

    Rejecting where they do not exceed q keeps the expected share of false among all rejections at q.

    Parameters
    ----------
    p : (U,) array
        p-values; NaN marks a test that could not be made, and does not count among the tests.

    Returns
    -------
    (U,) array
        Adjusted p-values, NaN where p is.

    Raises
    ------
    InputError
        If a p-value lies outside 0…1.

    Examples
    --------
    >>> adjusted_p_values(np.array([0.01, 0.02, 0.03, 0.5])).round(3).tolist()
    [0.04, 0.04, 0.04, 0.5]
    """
    p = np.asarray(p, float)
    made = ~np.isnan(p)
    if np.any((p[made] < 0) | (p[made] > 1)):
        raise RangeError("p-values", "must lie between 0 and 1", f"{p[made].min()}…{p[made].max()}")
    adjusted = np.full(p.shape, np.nan)
    if made.any():
        adjusted[made] = false_discovery_control(p[made], method="bh")
    return adjusted


def wilson_interval(successes: float, n: float, *, level: float = 0.95) -> tuple[float, float]:
    """Wilson's interval of a share.

    Parameters
    ----------
    successes, n : float
        Successes among n independent cases; not whole where n is an effective number of cases.
    level : float
        Confidence.

    Returns
    -------
    low, high : float
        Ends of the interval, within 0…1.

    Raises
    ------
    InputError
        If there is no case, or the successes do not lie between 0 and n, or the level between 0 and 1.

    Examples
    --------
    >>> [round(end, 3) for end in wilson_interval(45, 170)]
    [0.204, 0.336]
    """
    require_fraction("level", level)
    if not 0 <= successes <= n or not n > 0:
        raise TooFewError("share", "must be of at least one case, with successes from 0 to all", f"{successes} of {n}")
    z = float(ndtri(0.5 + level / 2))
    share = successes / n
    centre = (share + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    return max(0.0, float(centre - half)), min(1.0, float(centre + half))


def share_interval(passed: Array, *, clusters: NDArray[np.generic]) -> tuple[float, float]:
    """Wilson's interval of a share whose cases come in clusters.

    The number of cases is divided by the design effect: the variance of the share by leaving out one cluster at a time
    over that of independent cases, times (t/z)² for the few clusters that it is found from. It is never raised. Where
    all cases pass or none, clusters show no scatter and all cases count.

    Parameters
    ----------
    passed : (U,) array
        1 where a case passes, 0 where not; NaN, not measured, is left out.
    clusters : (U,) array
        Cluster of each case, such as its whisker.

    Returns
    -------
    low, high : float
        Ends of the 95 % interval, within 0…1; NaN where no case was measured.

    Raises
    ------
    InputError
        If values and clusters differ in number.
    """
    values, labels = _measured(passed, clusters)
    if not values.size:
        return np.nan, np.nan
    share, n = float(values.mean()), float(values.size)
    whole, parts = _left_out(values, np.mean, labels)
    free = len(parts) - 1
    if free and 0 < share < 1:
        variance = free / len(parts) * float(np.sum((parts - whole) ** 2))
        effect = variance * n / (share * (1 - share)) * float(stdtrit(free, UPPER) / ndtri(UPPER)) ** 2
        n /= max(1.0, effect)
    return wilson_interval(share * n, n)


def jackknife_half_width(parts: Array, centre: Array | float, *, upper: float = UPPER) -> Array:
    """Half width of an interval by Student's t of N − 1, from leaving out each of N draws in turn.

    Parameters
    ----------
    parts : (..., N) array
        Statistic without each draw.
    centre : (...) array
        Statistic of all draws, or the mean of the parts.
    upper : float
        Quantile at the upper end: 0.975 of a 95 % interval.

    Returns
    -------
    (...) array
        In the unit of the statistic.
    """
    n = parts.shape[-1]
    scatter = np.sum((parts - np.asarray(centre)[..., None]) ** 2, axis=-1)
    return np.asarray(stdtrit(n - 1, upper) * np.sqrt((n - 1) / n * scatter))


def jackknife_interval(
    values: Array,
    statistic: Callable[[Array], float] = np.mean,
    *,
    clusters: NDArray[np.generic],
    scale: Scale = "plain",
) -> tuple[float, float]:
    """Interval of a smooth statistic by leaving out one whole cluster at a time, with Student's t of G − 1.

    With a dozen clusters it covers the truth as often as it says; percentiles of resampled clusters are then too
    narrow. Not for medians or extremes, which hang on single values.

    Parameters
    ----------
    values : (U,) array
        Values; NaN, not measured, is left out.
    statistic : callable
        Number of an array of values.
    clusters : (U,) array
        Cluster of each value, such as its whisker.
    scale : {"plain", "correlation", "share", "r2"}
        What the statistic is. A correlation (−1 to 1), a share (0 to 1) and R² (up to 1) are taken through Fisher's z,
        the logit or −ln(1 − R²) and back, so that the interval stays within the range.

    Returns
    -------
    low, high : float
        Ends of the 95 % interval; NaN where fewer than two clusters hold a value, or where the statistic lies at an end
        of its range.

    Raises
    ------
    InputError
        If values and clusters differ in number.

    Examples
    --------
    >>> r = np.array([0.90, 0.97, 0.99, 0.99])
    >>> [round(end, 3) for end in jackknife_interval(r, clusters=np.arange(4), scale="correlation")]
    [0.643, 0.997]
    """
    values, labels = _measured(values, clusters)
    if len(np.unique(labels)) < 2:
        return np.nan, np.nan
    opened, closed = _OPENED[scale]
    with np.errstate(divide="ignore", invalid="ignore"):
        whole, parts = map(opened, _left_out(values, statistic, labels))
        half = jackknife_half_width(parts, whole)
        low, high = float(closed(whole - half)), float(closed(whole + half))
    return (low, high) if np.isfinite(whole) and np.isfinite(half) else (np.nan, np.nan)


def _measured(values: Array, clusters: NDArray[np.generic]) -> tuple[Array, NDArray[np.generic]]:
    """Values that were measured, and their clusters."""
    values, labels = np.asarray(values, float), np.asarray(clusters)
    if labels.shape != values.shape:
        raise ShapeError("clusters", "must be as many as the values", f"{labels.shape}, {values.shape}")
    made = np.isfinite(values)
    return values[made], labels[made]


def _left_out(values: Array, statistic: Callable[[Array], float], labels: NDArray[np.generic]) -> tuple[Array, Array]:
    """The statistic of all values, and of those without each cluster in turn; of one cluster that of all."""
    names = np.unique(labels)
    parts = [statistic(values[labels != name]) for name in names] if len(names) > 1 else [statistic(values)]
    return np.asarray(statistic(values), float), np.array(parts, float)
