"""The opaque body, a holder, the unlit surround: where no whisker can be seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit

Cells = NDArray[np.uint8]

LEVELS = 64  # of the histogram
VALLEY = 0.08  # share of the cells in the middle third between two levels, above which they are no two levels
APART = 0.6  # of the brighter level, below which the darker one is a body
UNLIT = 0.15  # of the brightest level: below, nothing is a dark whisker


@njit(cache=True, nogil=True)
def cell_levels(grey: NDArray[np.float32], size: int, out: NDArray[np.float32]) -> None:
    """Largest grey level in cells of ``size`` pixels, in which lines narrower than a cell vanish.

    Parameters
    ----------
    grey : (height, width) array
        Grey levels, lines darker than their sides.
    size : int
        Side of a cell [px].
    out : (ceil(height / size), ceil(width / size)) array
        Written.
    """
    height, width = grey.shape
    out[:] = -np.inf
    for i in range(height):
        for j in range(width):
            if grey[i, j] > out[i // size, j // size]:
                out[i // size, j // size] = grey[i, j]


@njit(cache=True, nogil=True)
def _otsu(levels: NDArray[np.float32], low: float, high: float) -> tuple[float, float, float]:
    """Level that separates two classes best, and the means of both."""
    counts = np.zeros(LEVELS)
    for i in range(levels.shape[0]):
        for j in range(levels.shape[1]):
            counts[min(int((levels[i, j] - low) / (high - low) * LEVELS), LEVELS - 1)] += 1
    total, moment = counts.sum(), (counts * np.arange(LEVELS)).sum()
    best, at, below, above = -1.0, 0, 0.0, 0.0
    n, m = 0.0, 0.0
    for k in range(LEVELS - 1):
        n += counts[k]
        m += counts[k] * k
        if 0 < n < total:
            one, other = m / n, (moment - m) / (total - n)
            between = n * (total - n) * (one - other) ** 2
            if between > best:
                best, at, below, above = between, k, one, other
    unit = (high - low) / LEVELS
    return low + (at + 1) * unit, low + (below + 0.5) * unit, low + (above + 0.5) * unit


@njit(cache=True, nogil=True)
def _threshold(levels: NDArray[np.float32], zero: float) -> float:
    """Level below which a cell is dark: between two levels where there are two, else near that of no light."""
    low, high = levels.min(), levels.max()
    if not high > low:
        return -np.inf
    level, dark, light = _otsu(levels, float(low), float(high))
    third = (light - dark) / 3
    between = ((levels > dark + third) & (levels < light - third)).mean()
    two = between < VALLEY
    if zero > -1e30:  # lines are darker than the light, whose level of no light is known
        if two and dark - zero < APART * (light - zero):
            return level
        return zero + UNLIT * (float(high) - zero)
    return level if two and abs(light) < APART * abs(dark) else -np.inf


@njit(cache=True, nogil=True)
def mark_body(
    grey: NDArray[np.float32], levels: NDArray[np.float32], zero: float, size: int, dark: Cells, out: Cells
) -> None:
    """Mark the pixels of the body: those of dark cells, and dark ones beside them.

    Parameters
    ----------
    grey : (height, width) array
        Grey levels, lines darker than their sides.
    levels : (rows, columns) array
        From :func:`cell_levels`.
    zero : float
        Level of no light; −∞ where lines are brighter than the background (their body is bright).
    size : int
        Side of a cell [px].
    dark : (rows, columns) array of uint8
        Room for work.
    out : (height, width) array of uint8
        Written: 1 where no whisker can be seen.
    """
    level = _threshold(levels, zero)
    rows, columns = levels.shape
    for i in range(rows):
        for j in range(columns):
            dark[i, j] = 2 * (levels[i, j] < level)
    for i in range(rows):
        for j in range(columns):
            if dark[i, j] == 0:
                for k in range(max(i - 1, 0), min(i + 2, rows)):
                    for m in range(max(j - 1, 0), min(j + 2, columns)):
                        if dark[k, m] == 2:
                            dark[i, j] = 1
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            cell = dark[i // size, j // size]
            out[i, j] = cell == 2 or (cell == 1 and grey[i, j] < level)


@njit(cache=True, nogil=True)
def leave_small(dark: Cells, size: int, most: float, queue: NDArray[np.int64], wall: Cells) -> None:
    """Leave bodies that hide a part of a line out of the body that ends it: a pole, dirt.

    Parameters
    ----------
    dark : (rows, columns) array of uint8
        From :func:`mark_body`.
    size : int
        Side of a cell [px].
    most : float
        Width and height of such a body at most [px].
    queue : (rows * columns,) array of int
        Room for work.
    wall : (height, width) array of uint8
        The marked body; those that are small are taken out of it.
    """
    rows, columns = dark.shape
    for start in range(rows * columns):
        if dark[start // columns, start % columns] != 2:
            continue
        n = _spread(dark, start, queue)
        up, left, down, right = rows, columns, -1, -1
        for k in range(n):
            i, j = queue[k] // columns, queue[k] % columns
            up, left, down, right = min(up, i), min(left, j), max(down, i), max(right, j)
        if max(down - up, right - left) * size < most:
            # with the dark pixels beside its cells
            wall[max(up - 1, 0) * size : (down + 2) * size, max(left - 1, 0) * size : (right + 2) * size] = 0


@njit(cache=True, nogil=True)
def _spread(dark: Cells, start: int, queue: NDArray[np.int64]) -> int:
    """Mark the body of a cell by 3 and list its cells; how many."""
    rows, columns = dark.shape
    queue[0], n, done = start, 1, 0
    dark[start // columns, start % columns] = 3
    while done < n:
        i, j = queue[done] // columns, queue[done] % columns
        done += 1
        for k in range(max(i - 1, 0), min(i + 2, rows)):
            for m in range(max(j - 1, 0), min(j + 2, columns)):
                if dark[k, m] == 2:
                    dark[k, m] = 3
                    queue[n] = k * columns + m
                    n += 1
    return n
