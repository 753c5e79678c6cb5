"""Which end of a line is its base: where ends gather over the movie, and where the line is thicker."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from vibrissa.arrays import Array, Mask
from vibrissa.video.link.pad.pieces import Pieces, novelty

CELL = 4.0  # side of the cells in which ends are counted [px]
BLUR = 2.0  # standard deviation by which the counts are smoothed [cells]
TAPER = 3.0  # weight of the logarithm of the ratio of widths at either end
ROUNDS = 3


def _density(x: Array, y: Array, weight: Array, origin: Array, shape: tuple[int, int]) -> Array:
    """Smoothed count of ends in cells."""
    count = np.zeros(shape)
    at = ((x - origin[0]) // CELL).astype(int), ((y - origin[1]) // CELL).astype(int)
    np.add.at(count, at, weight)
    out: Array = gaussian_filter(count, BLUR)
    return out


def _ends(pieces: Pieces, values: Array) -> tuple[Array, Array]:
    """Mean of values over the first and over the last quarter of each segment."""
    size = pieces.stop - pieces.start
    few = np.maximum(size // 4, 1)
    total = np.concatenate([[0.0], np.cumsum(values)])
    first = (total[pieces.start + few] - total[pieces.start]) / few
    last = (total[pieces.stop] - total[pieces.stop - few]) / few
    return first, last


def turned(pieces: Pieces) -> tuple[Mask, Array]:
    """Whether each segment runs from tip to base, and how sure that is.

    Bases stay where they are while tips sweep the image, so base ends gather; and a whisker tapers. The densities of
    base ends and of tip ends are estimated in turn with the choice.

    Parameters
    ----------
    pieces : Pieces
        Segments.

    Returns
    -------
    (S,) array of bool, (S,) array
        True where the last point is nearer to the base; the absolute log-odds of that choice.
    """
    x = np.stack([pieces.column[pieces.start], pieces.column[pieces.stop - 1]])
    y = np.stack([pieces.row[pieces.start], pieces.row[pieces.stop - 1]])
    origin = np.array([x.min(), y.min()])
    shape = int((x.max() - origin[0]) // CELL) + 1, int((y.max() - origin[1]) // CELL) + 1
    first, last = _ends(pieces, pieces.width)
    depth_first, depth_last = _ends(pieces, pieces.contrast)
    taper = TAPER * (np.log(first / last) + np.log(depth_first / depth_last))
    # a long line has its ends far apart: it says more of where bases and tips are
    length = np.hypot(x[1] - x[0], y[1] - y[0]) * novelty(pieces)
    at = ((x - origin[0]) // CELL).astype(int), ((y - origin[1]) // CELL).astype(int)
    floor = 0.02 * pieces.frames / CELL**2
    odds = np.clip(taper, -2, 2)
    for again in range(ROUNDS):
        sure = 1 / (1 + np.exp(-odds))
        bases = sum(_density(x[i], y[i], length * (sure if i == 0 else 1 - sure), origin, shape) for i in range(2))
        tips = sum(_density(x[i], y[i], length * (1 - sure if i == 0 else sure), origin, shape) for i in range(2))
        scale = floor * np.median(length)
        gain = np.log(bases + scale) - (np.log(tips + scale) if again else 0.0)
        odds = np.clip(taper, -3, 3) + gain[at[0][0], at[1][0]] - gain[at[0][1], at[1][1]]
    return odds < 0, np.abs(odds)
