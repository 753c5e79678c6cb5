"""A Gaussian profile on a background that may slope, fitted by least squares to the pixels about one point of a line.

The pixels themselves are fitted, nothing is interpolated between them, so a line is read alike in every direction.
Those within one pixel along the line count, weighted by a tent: a pixel's weights at neighbouring points add to one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit

Single = NDArray[np.float32]

FEWEST = 0.75  # sum of the weights of a point's pixels at least, over that away from the edge of the image


@njit(cache=True, nogil=True, error_model="numpy")
def _inverted(matrix: Array, n: int, out: Array) -> bool:
    """Invert the leading n × n part of a positive matrix, which is written over; False if it is singular."""
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot = matrix[k, k]
        if not pivot > 1e-9:
            return False
        for j in range(n):
            matrix[k, j] /= pivot
            out[k, j] /= pivot
        for i in range(n):
            if i != k:
                factor = matrix[i, k]
                for j in range(n):
                    matrix[i, j] -= factor * matrix[k, j]
                    out[i, j] -= factor * out[k, j]
    return True


@njit(cache=True, nogil=True, fastmath=True)
def _dot(one: Array, other: Array, n: int) -> float:
    total = 0.0
    for k in range(n):
        total += one[k] * other[k]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(grey: Single, x: float, y: float, c: float, s: float, sigma: float, reach: float, cells: Array) -> int:
    """Pixels about a point: rows of ``cells`` are the functions fitted, the values, and both times the weights."""
    height, width = grey.shape
    half_u, half_v = abs(s) * reach + abs(c), abs(c) * reach + abs(s)
    centre = grey[int(y + 0.5), int(x + 0.5)]
    m = 0
    for i in range(max(int(np.ceil(y - half_v)), 0), min(int(y + half_v), height - 1) + 1):
        for j in range(max(int(np.ceil(x - half_u)), 0), min(int(x + half_u), width - 1) + 1):
            along, off = (j - x) * c + (i - y) * s, (i - y) * c - (j - x) * s
            w = 1.0 - abs(along)
            if w <= 0 or abs(off) > reach or m >= cells.shape[1]:
                continue
            u = off / sigma
            e = np.exp(-0.5 * u * u)
            cells[0, m], cells[1, m], cells[2, m], cells[3, m], cells[4, m] = e, u * e, 1.0, u, u * u * e
            cells[5, m], cells[6, m] = centre - grey[i, j], w
            for p in range(6):
                cells[7 + p, m] = w * cells[p, m]
            m += 1
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def fit_profile(
    grey: Single,
    x: float,
    y: float,
    c: float,
    s: float,
    sigma: float,
    reach: float,
    n: int,
    room: Array,
    cells: Array,
    found: Array,
) -> None:
    """Fit a profile about a point.

    Parameters
    ----------
    grey : (height, width) array
        Grey levels, lines darker than their sides.
    x, y : float
        Column and row of the point [px].
    c, s : float
        Direction of the line, a unit vector.
    sigma : float
        Standard deviation of the profile [px].
    reach : float
        Distance across the line up to which pixels are fitted [px].
    n : int
        4: depth, shift, level and tilt of the background are fitted; 5: the change of the profile's width, too.
    room : (16, 5) array
        Room for work.
    cells : (13, most) array
        Room for the pixels.
    found : (8,) array
        Written: depth [grey levels], shift across the line [px], change of sigma [px], tilt [grey levels / px],
        variance of the shift and of the depth for pixels of unit noise, weighted sum of squares of the residual, and
        its expectation for pixels of unit noise. NaN if there is no fit.
    """
    normal, squared, inverse, sums = room[0:5], room[5:10], room[10:15], room[15]
    found[:] = np.nan
    m = _gather(grey, x, y, c, s, sigma, reach, cells)
    weight = _dot(cells[2], cells[9], m)
    if weight < 2 * FEWEST * reach:
        return
    for p in range(n):
        sums[p] = _dot(cells[7 + p], cells[5], m)
        for q in range(p + 1):
            normal[p, q] = normal[q, p] = _dot(cells[7 + p], cells[q], m)
            squared[p, q] = squared[q, p] = _dot(cells[7 + p], cells[7 + q], m)
    if not _inverted(normal, n, inverse):
        return
    _solve(inverse, squared, sums, n, sigma, found)
    # Σ w value² − coefficients · sums; the expectation is Σ w − tr(N⁻¹ M)
    power, expected = _dot(cells[12], cells[5], m), weight
    for p in range(n):
        value = 0.0
        for q in range(n):
            value += inverse[p, q] * sums[q]
            expected -= inverse[p, q] * squared[q, p]
        power -= value * sums[p]
    found[6], found[7] = max(power, 0.0), expected


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(inverse: Array, squared: Array, sums: Array, n: int, sigma: float, found: Array) -> None:
    """Depth, shift and the rest from the normal equations."""
    depth, moved, tilt, wider = 0.0, 0.0, 0.0, 0.0
    for q in range(n):
        depth += inverse[0, q] * sums[q]
        moved += inverse[1, q] * sums[q]
        tilt += inverse[3, q] * sums[q]
        if n == 5:
            wider += inverse[4, q] * sums[q]
    shift_power, depth_power = 0.0, 0.0
    for p in range(n):
        for q in range(n):
            shift_power += inverse[1, p] * squared[p, q] * inverse[1, q]
            depth_power += inverse[0, p] * squared[p, q] * inverse[0, q]
    found[0] = depth
    if depth > 0:
        found[1] = sigma * moved / depth
        found[2] = sigma * wider / depth
        found[3] = tilt / sigma
        found[4] = sigma * sigma * shift_power / (depth * depth)
    found[5] = depth_power
