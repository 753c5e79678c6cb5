"""How well one smooth curve goes through two parts of lines, one beyond the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.video.link.pad.pieces import Pieces

Values = NDArray[np.float64]
Places = NDArray[np.int64]

ORDER = 3  # of the polynomial: a whisker bends, and more towards its tip
ROUGH = 0.15  # deviation of whiskers from smooth curves [px]
UNREAD, UNKNOWN = 1.0, 0.3  # standard deviation of points that were not measured, and where none is known [px]


def scatter(pieces: Pieces) -> Array:
    """Standard deviation of points from a smooth curve through their line.

    Parameters
    ----------
    pieces : Pieces
        Segments.

    Returns
    -------
    (P,) array
        Across the line [px].
    """
    known = np.isfinite(pieces.sd)
    return np.hypot(np.where(known, pieces.sd, UNREAD if known.any() else UNKNOWN), ROUGH)


@njit(cache=True)
def polynomial(x: Values, y: Values, sd: Values, order: int) -> tuple[Values, float]:
    """Least squares polynomial.

    Parameters
    ----------
    x, y, sd : (n,) arrays
        Readings ``y`` at ``x``, of magnitude about 1, and their standard deviations.
    order : int
        Of the polynomial.

    Returns
    -------
    coefficients : (order + 1,) array
        From the constant on.
    misfit : float
        Sum of squares of what is left, over the standard deviations.
    """
    powers = np.ones((x.size, order + 1))
    for k in range(1, order + 1):
        powers[:, k] = powers[:, k - 1] * x
    scaled, target = powers / sd.reshape(-1, 1), y / sd
    normal = scaled.T @ scaled
    for k in range(order + 1):
        normal[k, k] += 1e-12 * normal[0, 0]  # of points that do not spread some powers are 0
    found = np.empty(order + 1)
    found[:] = np.linalg.solve(normal, scaled.T @ target)
    return found, float(((scaled @ found - target) ** 2).sum())


@njit(cache=True)
def misfit(points: Values, sd: Values, before: Places, beyond: Places) -> float:
    """Sum of squares by which points miss one cubic through two parts, over their standard deviations.

    Parameters
    ----------
    points : (n, 2) array
        Points of lines [px].
    sd : (n,) array
        Standard deviations across the line [px].
    before, beyond : arrays of int
        Points of either part, from the gap between them outwards.

    Returns
    -------
    float
        Infinite if the second part does not lie beyond the first, or either turns back.
    """
    chosen = np.concatenate((before[::-1], beyond))
    x, y = points[chosen, 0], points[chosen, 1]
    du, dv = x[-1] - x[0], y[-1] - y[0]
    length = max(np.hypot(du, dv), 1e-9)
    u = ((x - x.mean()) * du + (y - y.mean()) * dv) / length
    v = ((y - y.mean()) * du - (x - x.mean()) * dv) / length
    gap = before.size
    if not u[0] < u[gap - 1] <= u[gap] < u[-1]:
        return np.inf
    return polynomial(u / length, v, sd[chosen], ORDER)[1]
