"""Whiskers followed through a block of frames without leaving compiled code; it runs beside other threads.

The state of the whiskers between frames is in arrays (whisker, width): where they are ``expected``, their
``course`` as far as it was ever followed, and their ``typical`` contrast; and (whisker,) for how
many frames more a whisker that was lost must be just where it is expected.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit
from vibrissa.video.kernel.band import BACKGROUND_ROWS, Image, Places, Rows, Single, fetch
from vibrissa.video.kernel.centreline import read_line
from vibrissa.video.kernel.local_quadratic import SMOOTH, local_quadratic

GROW = 10  # columns beyond either end of the followed line that are read in the next frame
FEWEST = 25  # columns below which a line is not called a whisker
REGAIN = 1.0  # root mean square distance [px] from where it was lost within which a whisker is taken up again
ALIKE_LOW, ALIKE_HIGH = 0.5, 2.0  # contrast over this whisker's own, outside of which it is another or a crossing
ADAPT = 0.02  # share of a new frame in a whisker's own contrast
SURE = 20  # frames in which a whisker that is back must be where it is expected: others that pass are so for up to 7
APART = 2.0  # distance [px] below which two lines are one
FAINT, UNLIKE, SHARED, UNSURE_BACK = 1, 2, 3, 4  # places in REASONS


@njit(cache=True, nogil=True)
def expect(row: Rows, course: Rows, low: int, high: int, expected: Rows) -> None:
    """Write where a line is expected next, and its course as far as it was ever followed, over what they were.

    Beyond an end of the followed line its former course is carried along, as a hidden part comes back where
    it was; beyond that, ``GROW`` columns straight on.

    Parameters
    ----------
    row : (width,) array
        Rows that were read [px]; NaN where none.
    course : (width,) array
        Course as far as it was ever followed [px]; written over.
    low, high : int
        First and last column that are expected.
    expected : (width,) array
        Written: rows expected next [px], NaN in columns that are not.
    """
    value, slope = local_quadratic(row, np.int64(SMOOTH))
    n = row.size
    first, last = _ends(row)
    was_first, was_last = course[first], course[last]
    _fill(course, value, row, first, last)
    before, after = course[first] - was_first, course[last] - was_last
    for j in range(first):
        course[j] += before
    for j in range(last + 1, n):
        course[j] += after
    # the slope at the very end of a local quadratic is noisy: take its mean over half the window;
    # np.int64, else the kernels are compiled once for every number given here
    start, end = _mean_slope(slope, row, first, np.int64(1)), _mean_slope(slope, row, last, np.int64(-1))
    first, last = _ends(course)
    for j in range(n):
        expected[j] = course[j]
    for j in range(max(0, first - GROW), first):
        expected[j] = course[first] + start * (j - first)
    for j in range(last + 1, min(n, last + GROW + 1)):
        expected[j] = course[last] + end * (j - last)
    for j in range(n):
        if not low <= j <= high:
            expected[j] = np.nan


@njit(cache=True, nogil=True)
def _ends(row: Rows) -> tuple[int, int]:
    """First and last measured column."""
    first, last = 0, row.size - 1
    while row[first] != row[first]:
        first += 1
    while row[last] != row[last]:
        last -= 1
    return first, last


@njit(cache=True, nogil=True, error_model="numpy")
def _mean_slope(slope: Rows, row: Rows, first: int | np.int64, way: int | np.int64) -> float:
    """Mean over the first ``SMOOTH`` columns with a slope, from an end."""
    total, count, j = 0.0, 0, first
    while 0 <= j < row.size and count < SMOOTH:
        if slope[j] == slope[j] and row[j] == row[j]:
            total += slope[j]
            count += 1
        j += way
    return total / count


@njit(cache=True, nogil=True, error_model="numpy")
def _fill(now: Rows, value: Rows, row: Rows, first: int, last: int) -> None:
    """Values at the measured columns, straight across the others; at the ends as at the first and last of them."""
    known = -1
    for j in range(first, last + 1):
        if value[j] != value[j] or row[j] != row[j]:
            continue
        if j - known > 1:
            left = value[j] if known < 0 else value[known]
            begin = first if known < 0 else known + 1
            for i in range(begin, j):
                now[i] = left + (value[j] - left) * ((i - begin + 1) / (j - begin + 1))
        now[j] = value[j]
        known = j
    for j in range(known + 1, last + 1):
        now[j] = value[known]


@njit(cache=True, nogil=True)
def _count(values: Rows) -> int:
    count = 0
    for value in values:
        count += value == value
    return count


@njit(cache=True, nogil=True)
def _reason(row: Rows, contrast: Rows, expected: Rows, course: Rows, typical: Rows, unsure: int) -> int:
    """Place in ``REASONS``: whether the line that was read is the whisker."""
    if _count(row) < FEWEST:
        return FAINT
    if unsure and not _where_it_was(row, expected, course):
        return UNSURE_BACK
    common, fainter, darker = 0, 0, 0
    for j in range(row.size):
        # against zero contrast, whatever is seen is darker
        common += contrast[j] == contrast[j] and typical[j] == typical[j]
        fainter += contrast[j] <= ALIKE_LOW * typical[j]
        darker += contrast[j] >= ALIKE_HIGH * typical[j]
    return UNLIKE if 2 * max(fainter, darker) > common else 0


@njit(cache=True, nogil=True, error_model="numpy")
def _where_it_was(row: Rows, expected: Rows, course: Rows) -> bool:
    """Whether a lost whisker is back: at least half of its columns, where they were expected."""
    total, count = 0.0, 0
    for j in range(row.size):
        if row[j] == row[j]:
            total += (row[j] - expected[j]) ** 2
            count += 1
    return 2 * count >= _count(course) and total < REGAIN**2 * count


@njit(cache=True, nogil=True)
def _part(row: Rows, expected: Rows, reason: NDArray[np.int8], t: int) -> None:
    """Where two whiskers were read on one line, leave it to the one that was expected nearer to it."""
    for v in range(len(row)):
        for w in range(v):
            if reason[v, t] or reason[w, t]:
                continue
            common, near = 0, 0
            for j in range(row.shape[2]):
                distance = abs(row[v, t, j] - row[w, t, j])
                common += distance == distance
                near += distance < APART
            if common >= FEWEST and 2 * near > common:
                further = _distance(row[v, t], expected[v]) > _distance(row[w, t], expected[w])
                reason[v if further else w, t] = SHARED


@njit(cache=True, nogil=True)
def _distance(row: Rows, expected: Rows) -> float:
    """Median distance of a line from where it was expected [px]; no row was expected further off than 1e3 px."""
    low, high, number = 0.0, 1e3, _count(row)
    for _ in range(40):
        middle, below = (low + high) / 2, 0
        for j in range(row.size):
            below += abs(row[j] - expected[j]) < middle
        if 2 * below > number:
            high = middle
        else:
            low = middle
    return high


@njit(cache=True, nogil=True)
def _adapt(typical: Rows, contrast: Rows) -> None:
    """Let a whisker's own contrast follow what was seen, slowly; columns new to it start from there."""
    for j in range(typical.size):
        if contrast[j] == contrast[j]:
            step = ADAPT * (contrast[j] - typical[j])
            typical[j] = typical[j] + step if typical[j] == typical[j] else contrast[j]


@njit(cache=True, nogil=True)
def follow(
    block: Image,
    background: Single,
    sign: Image,
    how: tuple[int, float, int],
    columns: tuple[int, int],
    state: tuple[Rows, Rows, Rows, Places],
    lines: tuple[Rows, Rows, Rows],
    reason: NDArray[np.int8],
) -> int:
    """Follow whiskers through a block of frames.

    Parameters
    ----------
    block : (T, height, width) array
        Grey levels.
    background, sign, how
        As of :func:`vibrissa.video.kernel.centreline.read_line`.
    columns : (int, int)
        First and last column that are read.
    state : (expected, course, typical, unsure)
        Before the block; after it, written over.
    lines : (row, sd, contrast)
        Arrays (whisker, T, width), written.
    reason : (whisker, T) array
        Written.

    Returns
    -------
    int
        Sum of the pixels that were fetched early, of no meaning.
    """
    expected, course, typical, unsure = state
    row, sd, contrast = lines
    search, _, _ = how
    ceiling, touched = np.empty(block.shape[2]), 0
    for t in range(len(block)):
        # read every whisker where the frame before lets expect it
        for w in range(len(expected)):
            touched += fetch(block[t], expected[w], search + BACKGROUND_ROWS + 6)
            # a line of 2 px full width at half maximum has a peak of half its sum
            for j in range(ceiling.size):
                ceiling[j] = 0.0 if typical[w, j] < 0 else typical[w, j] / 2
            line = row[w, t], sd[w, t], contrast[w, t]
            read_line(block[t], background, sign, expected[w], ceiling, how, line)
            reason[w, t] = _reason(row[w, t], contrast[w, t], expected[w], course[w], typical[w], unsure[w])
        _part(row, expected, reason, t)
        # of a lost whisker nothing is kept: it is expected where it was; a followed one moves course and contrast on
        for w in range(len(expected)):
            if reason[w, t]:
                unsure[w] = SURE
                for j in range(ceiling.size):
                    row[w, t, j], sd[w, t, j], contrast[w, t, j] = np.nan, np.nan, np.nan
            else:
                unsure[w] = max(unsure[w] - 1, 0)
                expect(row[w, t], course[w], columns[0], columns[1], expected[w])
                _adapt(typical[w], contrast[w, t])
    return touched
