"""Where, next to the skin, the line that was followed begins to be the whisker.

In the fur the tracker goes on along hairs and the head's edge. The shaft is smooth there: a cubic through 50 columns
foretells the next five to 0.01 pixel on every posture of the paper's experiment. What departs from it is not the shaft.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from vibrissa.video.follow.following import Centrelines

Values = NDArray[np.float64]

FRAMES = 200  # whose mean is examined: it has a tenth of the noise of one frame
LOOKED_AT = 100  # columns from the base end: the longest hair of the virtual fur was followed for 60
WINDOW = 50  # columns whose cubic foretells the next
NEXT = 5  # columns whose mean is compared with it
LEAST = 0.03  # departure [px] that is not taken for the whisker: three times the estimator's own bias
SURE = 10.0  # the same, in standard deviations about the cubic: what a quartic leaves of a smooth shaft is below eight
MARGIN = 8  # columns beyond the departure that are not taken either: a hair along the shaft draws the line by degrees


def first_frames(lines: Iterable[Centrelines]) -> tuple[Centrelines | None, Iterator[Centrelines]]:
    """The first ``FRAMES`` frames, whatever the blocks, None if there are none; and all blocks again.

    Parameters
    ----------
    lines : iterable of Centrelines
        Blocks of a movie.

    Returns
    -------
    first : Centrelines or None
        The first frames.
    lines : iterator of Centrelines
        All blocks.
    """
    blocks, seen, rest = [], 0, iter(lines)
    while seen < FRAMES and (block := next(rest, None)) is not None:
        blocks.append(block)
        seen += block.row.shape[1]
    if not blocks:
        return None, rest
    kinds = (np.concatenate(kind, axis=1)[:, :FRAMES] for kind in zip(*blocks, strict=True))
    return Centrelines(*kinds), chain(blocks, rest)


def mean_course(lines: Centrelines, w: int) -> Values:
    """Mean row of a whisker in each column over the frames in which it is followed; NaN where half of them lack it.

    Parameters
    ----------
    lines : Centrelines
        Some frames.
    w : int
        Number of the whisker.

    Returns
    -------
    (width,) array
        Rows [px].
    """
    rows = lines.row[w, lines.reason[w] == 0]
    seen = ~np.isnan(rows)
    total, count = np.where(seen, rows, 0.0).sum(axis=0), seen.sum(axis=0)
    return np.where(2 * count > len(rows), total / np.maximum(count, 1), np.nan)


def whisker_from(course: Values) -> int:
    """First column, counted from the base's side, in which the course is the whisker's.

    From ``LOOKED_AT`` columns inwards, the mean of five columns is compared with the cubic of the 50 beyond them.

    Parameters
    ----------
    course : (width,) array
        Rows [px], NaN where not measured; the base is on the side of column 0.

    Returns
    -------
    int
        0 if all of the course is smooth.
    """
    columns = np.flatnonzero(~np.isnan(course))
    rows = course[columns]
    # from the shaft towards the skin: the first departure from the cubic ends the shaft
    for j in range(min(LOOKED_AT, columns.size - WINDOW - NEXT), -1, -1):
        beyond, here = slice(j + NEXT, j + NEXT + WINDOW), slice(j, j + NEXT)
        cubic = Polynomial.fit(columns[beyond], rows[beyond], 3)
        scatter = np.sqrt(np.sum((rows[beyond] - cubic(columns[beyond])) ** 2) / (WINDOW - 4))
        if abs(np.mean(rows[here] - cubic(columns[here]))) > max(LEAST, SURE * scatter):
            return int(columns[min(j + NEXT + MARGIN, columns.size - 1)])
    return 0
