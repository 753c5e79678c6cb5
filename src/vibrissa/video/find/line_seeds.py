"""Where traces begin, and how large a response is where there is no line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.video.find.curvature_maps import Maps, line_strength
from vibrissa.video.find.line_tracing import arc_response

SAMPLED = 1500  # places at which the response where there is no line is measured


@njit(cache=True, nogil=True)
def null_responses(
    maps: Maps, body: NDArray[np.uint8], step: float, ahead: int, arcs: Array, points: Array
) -> tuple[int, float, float]:
    """Scatter of the response along straight arcs, and at three steps, in places and directions chosen at random.

    Parameters
    ----------
    maps : (3, height, width) array
        Second derivatives.
    body : (height, width) array of uint8
        Where no whisker can be seen.
    step, ahead
        As in :class:`TraceRule`.
    arcs, points : (SAMPLED,) arrays
        Room for work.

    Returns
    -------
    count : int
        Places outside the body.
    along, here : float
        Standard deviations, from the median magnitude.
    """
    height, width = body.shape
    count = 0
    state = np.uint64(88172645463325252)
    for _ in range(SAMPLED):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
        u = np.float64(state & np.uint64(0xFFFFF)) / 1048576.0
        v = np.float64((state >> np.uint64(20)) & np.uint64(0xFFFFF)) / 1048576.0
        w = np.float64((state >> np.uint64(40)) & np.uint64(0xFFFFF)) / 1048576.0
        x, y = u * (width - 2), v * (height - 2)
        if body[int(y + 0.5), int(x + 0.5)]:
            continue
        c, s = np.cos(2 * np.pi * w), np.sin(2 * np.pi * w)
        mean = arc_response(maps, body, x, y, c, s, 0.0, step, ahead, np.inf)
        near = arc_response(maps, body, x, y, c, s, 0.0, step, 3, np.inf)
        if mean != -1.0 and near != -1.0:
            arcs[count], points[count] = abs(mean), abs(near)
            count += 1
    if count < 30:
        return count, np.inf, np.inf
    return count, np.median(arcs[:count]) / 0.6745, np.median(points[:count]) / 0.6745


@njit(cache=True, nogil=True)
def find_seeds(
    maps: Maps,
    body: NDArray[np.uint8],
    least: float,
    size: int,
    row: NDArray[np.float32],
    strength: Array,
    place: NDArray[np.int64],
) -> int:
    """Strongest point of a line in each cell of the image, the strongest of all first.

    Parameters
    ----------
    maps : (3, height, width) array
        Second derivatives.
    body : (height, width) array of uint8
        Where no whisker can be seen.
    least : float
        Strength at least.
    size : int
        Side of a cell [px].
    row : (width,) array
        Room for work.
    strength : (cells,) array
        Room for work.
    place : (cells,) array
        Written: row × width + column.

    Returns
    -------
    int
        How many.
    """
    height, width = body.shape
    across_cells = (width + size - 1) // size
    strength[:] = -1.0
    for i in range(height):
        line_strength(maps[0, i], maps[1, i], maps[2, i], row)
        first = (i // size) * across_cells
        for j in range(width):
            if row[j] > least and row[j] > strength[first + j // size] and not body[i, j]:
                strength[first + j // size] = row[j]
                place[first + j // size] = i * width + j
    count = 0
    for k in range(strength.size):
        if strength[k] > 0:
            strength[count], place[count] = strength[k], place[k]
            count += 1
    order = np.argsort(-strength[:count])
    place[:count] = place[order]
    return count
