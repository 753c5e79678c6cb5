"""Significance of a test, and the least p-value that a permutation test can give."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtrc

from vibrissa.arrays import Array, Mask

LEVEL = 0.05  # the paper's α


def significant(p: ArrayLike, level: float = LEVEL) -> Mask:
    """Whether p lies below the level; NaN, not tested, does not.

    Parameters
    ----------
    p : array
        p-values.
    level : float
        Level of significance.

    Returns
    -------
    array of bool
        In the shape of ``p``.
    """
    return np.asarray(p, float) < level


def least_p(draws: ArrayLike) -> Array:
    """Least p-value that a rank among N random draws can give, 1/(1 + N).

    Parameters
    ----------
    draws : array of int
        Draws N, such as textures of the same statistics.

    Returns
    -------
    array
        Least p-value, in the shape of ``draws``; 1 without draws.

    Examples
    --------
    >>> least_p([19, 39]).tolist()
    [0.05, 0.025]
    """
    return 1 / (1 + np.asarray(draws, float))


def reaches(draws: ArrayLike, level: float = LEVEL) -> Mask:
    """Whether this number of draws can give a significant p-value: 19 cannot give one below 0.05, 20 can.

    Parameters
    ----------
    draws : array of int
        Draws N.
    level : float
        Level of significance.

    Returns
    -------
    array of bool
        In the shape of ``draws``.
    """
    return significant(least_p(draws), level)


def fewest_draws(level: float = LEVEL) -> int:
    """Fewest draws that :func:`reaches` a level.

    Parameters
    ----------
    level : float
        Level of significance.

    Returns
    -------
    int
        Draws.

    Examples
    --------
    >>> fewest_draws()
    20
    """
    return int(np.floor(1 / level * (1 + 1e-12)))


def hotelling_p_value(statistic: ArrayLike, size: int, draws: int) -> Array:
    """p-value of x'S⁻¹x, where the covariance S of x was estimated from few draws (Hotelling's T²).

    Parameters
    ----------
    statistic : array
        x'S⁻¹x.
    size : int
        Length of x.
    draws : int
        Draws from which S was estimated.

    Returns
    -------
    array
        In the shape of ``statistic``; NaN where the draws are not more than the numbers.
    """
    left = draws - size
    if left <= 0:
        return np.full(np.shape(statistic), np.nan)
    return np.asarray(fdtrc(size, left, np.asarray(statistic, float) * left / (size * (draws - 1))))
