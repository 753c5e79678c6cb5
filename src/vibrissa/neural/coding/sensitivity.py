"""Sensitivity to the difference of two textures: area under the ROC curve, d′, and their intervals."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri
from scipy.stats import rankdata

from vibrissa.arrays import Array
from vibrissa.errors import FormatError


def roc_area(first: Array, second: Array) -> float:
    """Chance that a value of the first is larger than one of the second, ties counted half.

    Parameters
    ----------
    first, second : (M,), (N,) arrays
        Decision variable in trials of either texture.

    Returns
    -------
    float
        0 to 1.

    Raises
    ------
    InputError
        If one of them has no value.
    """
    m, n = len(first), len(second)
    if not (m and n):
        raise FormatError("trials", "must be at least one of either texture", f"{m} and {n}")
    ranks = rankdata(np.concatenate([first, second]))
    return float((ranks[:m].sum() - m * (m + 1) / 2) / (m * n))


def roc_area_interval(area: float, m: int, n: int) -> tuple[float, float]:
    """95 % interval of an area under the ROC curve, also where it is 0 or 1: method 5 of [Newcombe2006]_.

    As Wilson's for a share, it takes the areas that the one found would not surprise: (found − θ)² ≤ z² V(θ), with
    Hanley and McNeil's variance at the true area θ. It takes trials for independent.

    Parameters
    ----------
    area : float
        Area found.
    m, n : int
        Trials of either texture.

    Returns
    -------
    low, high : float
        Within 0…1.

    Raises
    ------
    InputError
        If the area is no share, or a texture has no trial.
    """
    if not (0 <= area <= 1 and min(m, n) >= 1):
        raise FormatError("area under the ROC curve", "must be a share, of at least one trial of either texture", area)
    z, half = float(ndtri(0.975)), (m + n) / 2 - 1

    def surprise(theta: float) -> float:
        spread = 1 + half * ((1 - theta) / (2 - theta) + theta / (1 + theta))
        return (area - theta) ** 2 - z**2 * theta * (1 - theta) * spread / (m * n)

    near = 1e-9  # the area itself is no end, though 0 and 1 solve the equation too
    low = 0.0 if area == 0 else float(brentq(surprise, 0, area * (1 - near)))
    high = 1.0 if area == 1 else float(brentq(surprise, area + (1 - area) * near, 1))
    return low, high


def d_prime(area: float) -> float:
    """Distance of two normal distributions of equal spread, in that spread, that have this area: √2 Φ⁻¹(area).

    Infinite where the trials are separated without an error, NaN where the area is.

    Parameters
    ----------
    area : float
        Area under the ROC curve.

    Returns
    -------
    float
        d′.
    """
    return float(np.sqrt(2) * ndtri(area))


def roc_curve(first: Array, second: Array, false: Array) -> Array:
    """Share of the first's values above the criterion that a share ``false`` of the second's passes; (F,).

    Parameters
    ----------
    first, second : (M,), (N,) arrays
        Decision variable in trials of either texture.
    false : (F,) array
        Shares of the second that pass the criterion, ascending.

    Returns
    -------
    (F,) array
        Shares of the first that pass it.
    """
    cuts = np.unique([*first, *second, np.inf])[::-1]
    hits, alarms = (1 - np.searchsorted(np.sort(values), cuts) / len(values) for values in (first, second))
    return np.interp(false, alarms, hits)
