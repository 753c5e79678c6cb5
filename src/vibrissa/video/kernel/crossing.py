"""Whiskers that meet: where two lines are seen as one, each is expected on the course that it has beside it."""

from __future__ import annotations

import numpy as np

from vibrissa.loops import njit
from vibrissa.video.kernel.band import Rows
from vibrissa.video.kernel.tracking_kernel import FEWEST, expect

MEET = 3.0  # distance [px] below which lines draw each other: half the pixels that place one are the other's


@njit(cache=True, nogil=True)
def alone(row: Rows, w: int) -> Rows:
    """Rows of one line where no other line is near.

    Parameters
    ----------
    row : (whisker, width) array
        Rows of all lines [px].
    w : int
        Number of the whisker.

    Returns
    -------
    (width,) array
        Its rows, NaN within ``MEET`` of another line.
    """
    own = row[w].copy()
    for v in range(len(row)):
        for j in range(own.size):
            if v != w and abs(row[v, j] - row[w, j]) < MEET:
                own[j] = np.nan
    return own


@njit(cache=True, nogil=True)
def part(row: Rows, before: Rows, columns: tuple[int, int], course: Rows, expected: Rows) -> None:
    """Expect whiskers that meet as if they had not been seen where they do.

    Else each is drawn to the other a little further in every frame, until both run on along one of them.

    Parameters
    ----------
    row : (whisker, width) array
        What was read.
    before : (whisker, width) array
        Their courses before it was.
    columns : (int, int)
        First and last column that are read.
    course, expected : (whisker, width) arrays
        As :func:`vibrissa.video.kernel.tracking_kernel.expect` has them; written over for whiskers that meet, if
        enough of them is alone.
    """
    for w in range(len(row)):
        own, seen, rest = alone(row, w), 0, 0
        for j in range(own.size):
            seen += row[w, j] == row[w, j]
            rest += own[j] == own[j]
        if FEWEST <= rest < seen:
            course[w] = before[w]
            expect(own, course[w], columns[0], columns[1], expected[w])
