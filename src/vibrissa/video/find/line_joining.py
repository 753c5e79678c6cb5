"""Parts of one line made one: ends that lie one behind the other in one direction, the nearest first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit

Places = NDArray[np.int64]

STRAIGHT = np.cos(np.radians(12.0))  # bend at either end of a gap at most
ALIKE = 2.5  # ratio of the responses of two parts at most


@njit(cache=True, nogil=True)
def _end(points: Array, last: bool, steps: int) -> tuple[float, float, float, float, float]:
    """Place of an end of a line, the direction in which it leaves, and the mean response there."""
    n = len(points)
    m = min(steps, n - 1)
    here, inner = (n - 1, n - 1 - m) if last else (0, m)
    du, dv = points[here, 0] - points[inner, 0], points[here, 1] - points[inner, 1]
    length = max(np.hypot(du, dv), 1e-9)
    low, high = (inner, here) if last else (here, inner)
    return points[here, 0], points[here, 1], du / length, dv / length, points[low : high + 1, 2].mean()


@njit(cache=True, nogil=True)
def _is_free(body: NDArray[np.uint8], x: float, y: float, u: float, v: float) -> bool:
    """Whether the straight way between two points is clear of the body."""
    steps = int(np.hypot(u - x, v - y)) + 1
    for k in range(steps + 1):
        if body[int(y + (v - y) * k / steps + 0.5), int(x + (u - x) * k / steps + 0.5)]:
            return False
    return True


@njit(cache=True, nogil=True)
def _gap(one: Array, other: Array, near: float, furthest: float, body: NDArray[np.uint8]) -> float:
    """Length of the gap between two ends, infinite if they are not of one line."""
    du, dv = other[0] - one[0], other[1] - one[1]
    gap = np.hypot(du, dv)
    if gap > furthest or one[4] > ALIKE * other[4] or other[4] > ALIKE * one[4]:
        return np.inf
    if -(one[2] * other[2] + one[3] * other[3]) < STRAIGHT:
        return np.inf
    ahead, behind = one[2] * du + one[3] * dv, -(other[2] * du + other[3] * dv)
    # ends that nearly touch have no direction from one to the other
    if gap > near and min(ahead, behind) < STRAIGHT * gap:
        return np.inf
    return gap if _is_free(body, one[0], one[1], other[0], other[1]) else np.inf


@njit(cache=True, nogil=True)
def join_lines(
    points: Array,
    first: Places,
    lines: int,
    near: float,
    furthest: float,
    steps: int,
    body: NDArray[np.uint8],
    out: Array,
    start: Places,
) -> int:
    """Join lines that continue beyond a gap.

    Parameters
    ----------
    points : (n, 3) array
        Column, row and response of the lines, one after another.
    first : (lines + 1,) array
        First point of each line, and after the last.
    lines : int
        How many.
    near : float
        Gap up to which two ends touch [px].
    furthest : float
        Length of a gap at most [px].
    steps : int
        Points from which the direction of an end is taken.
    body : (height, width) array of uint8
        Where no whisker can be seen.
    out : (n, 3) array
        Written: the points of the joined lines.
    start : (lines + 1,) array
        Written: as ``first``, of the joined lines.

    Returns
    -------
    int
        Joined lines.
    """
    ends = np.empty((2 * lines, 5))
    for k in range(lines):
        for side in range(2):
            ends[2 * k + side] = _end(points[first[k] : first[k + 1]], side == 1, steps)
    partner = _partners(ends, near, furthest, body)
    # each chain is written from one of its free ends
    done = np.zeros(lines, np.bool_)
    count, used = 0, 0
    start[0] = 0
    for free in range(2 * lines):
        if done[free // 2] or partner[free] >= 0:
            continue
        end = free
        while end >= 0:
            k = end // 2
            done[k] = True
            n = first[k + 1] - first[k]
            for q in range(n):
                out[used + q] = points[first[k] + q] if end % 2 == 0 else points[first[k + 1] - 1 - q]
            used += n
            end = partner[end ^ 1]
        count += 1
        start[count] = used
    return count


@njit(cache=True, nogil=True)
def _partners(ends: Array, near: float, furthest: float, body: NDArray[np.uint8]) -> Places:
    """Partner of each end, −1 if none; nearest pairs first, and no rings."""
    n = len(ends)
    found = [(np.inf, 0, 0)]
    for i in range(n):
        for j in range(i):
            if i // 2 != j // 2:
                gap = _gap(ends[i], ends[j], near, furthest, body)
                if gap < np.inf:
                    found.append((gap, i, j))
    found.sort()
    partner = np.full(n, -1)
    chain = np.arange(n // 2)
    for gap, one, other in found:
        if gap == np.inf or partner[one] >= 0 or partner[other] >= 0 or chain[one // 2] == chain[other // 2]:
            continue
        partner[one], partner[other] = other, one
        gone, kept = chain[one // 2], chain[other // 2]
        for k in range(chain.size):
            if chain[k] == gone:
                chain[k] = kept
    return partner
