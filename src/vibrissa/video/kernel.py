"""Whiskers followed through a block of frames without leaving compiled code; it runs beside other threads.

The state of the whiskers between frames is in arrays (whisker, width): where they are ``expected``, their
``course`` as far as it was ever followed, and their ``typical`` contrast; and (whisker,) how often they were missed.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from vibrissa.video.centreline import SMOOTH, local_quadratic, read_line

GROW = 10  # columns beyond either end of the followed line that are read in the next frame
GAP = 12  # longest run of lost columns within one whisker
FEWEST = 25  # columns below which a line is not called a whisker
REGAIN = 1.0  # root mean square distance [px] from where it was lost within which a whisker is taken up again
ALIKE_LOW, ALIKE_HIGH = 0.5, 2.0  # contrast over this whisker's own, outside of which it is another or a crossing
ADAPT = 0.02  # share of a new frame in a whisker's own contrast
APART = 2.0  # distance [px] below which two lines are one
FAINT, UNLIKE, SHARED, UNSURE_BACK = 1, 2, 3, 4  # places in REASONS


@njit(cache=True, nogil=True)
def expect(row, course, low, high):  # type: ignore[no-untyped-def]
    """Where a line is expected next, and its course as far as it was ever followed.

    Beyond an end of the followed line its former course is carried along, as a hidden part comes back where
    it was; beyond that, ``GROW`` columns straight on. Columns outside ``low`` to ``high`` are not expected.
    """
    value, slope = local_quadratic(row, SMOOTH)
    known = np.flatnonzero(~np.isnan(value) & ~np.isnan(row))
    now = course.copy()
    measured = np.flatnonzero(~np.isnan(row))
    first, last = measured[0], measured[-1]
    _fill(now, value, known, first, last)
    before, after = now[first] - course[first], now[last] - course[last]
    for j in range(first):
        now[j] += before
    for j in range(last + 1, now.size):
        now[j] += after
    seen = np.flatnonzero(~np.isnan(now))
    first, last = seen[0], seen[-1]
    # the slope at the very end of a local quadratic is noisy: take its mean over half the window
    start, end = np.mean(slope[known[:SMOOTH]]), np.mean(slope[known[-SMOOTH:]])
    expected = now.copy()
    for j in range(max(0, first - GROW), first):
        expected[j] = now[first] + start * (j - first)
    for j in range(last + 1, min(now.size, last + GROW + 1)):
        expected[j] = now[last] + end * (j - last)
    expected[:low], expected[high + 1 :] = np.nan, np.nan
    return expected, now


@njit(cache=True, nogil=True)
def _fill(now, value, known, first, last):  # type: ignore[no-untyped-def]
    """Values from the first to the last column, straight across those that are not known."""
    now[first : known[0]] = value[known[0]]
    now[known[-1] : last + 1] = value[known[-1]]
    for i in range(known.size - 1):
        a, b = known[i], known[i + 1]
        for j in range(a, b):
            now[j] = value[a] + (value[b] - value[a]) * ((j - a) / (b - a))


@njit(cache=True, nogil=True)
def _count(values):  # type: ignore[no-untyped-def]
    count = 0
    for value in values:
        count += value == value
    return count


@njit(cache=True, nogil=True)
def _reason(row, contrast, expected, course, typical, missed):  # type: ignore[no-untyped-def]
    """Place in ``REASONS``: whether the line that was read is the whisker."""
    if _count(row) < FEWEST:
        return FAINT
    if missed and not _where_it_was(row, expected, course):
        return UNSURE_BACK
    common, fainter, darker = 0, 0, 0
    for j in range(row.size):
        # against zero contrast, whatever is seen is darker
        common += contrast[j] == contrast[j] and typical[j] == typical[j]
        fainter += contrast[j] <= ALIKE_LOW * typical[j]
        darker += contrast[j] >= ALIKE_HIGH * typical[j]
    return UNLIKE if 2 * max(fainter, darker) > common else 0


@njit(cache=True, nogil=True)
def _where_it_was(row, expected, course):  # type: ignore[no-untyped-def]
    """Whether a lost whisker is back: at least half of its columns, where they were expected."""
    off = (row - expected)[~np.isnan(row)]
    return off.size >= _count(course) / 2 and np.sqrt(np.mean(off**2)) < REGAIN


@njit(cache=True, nogil=True)
def _part(row, expected, reason):  # type: ignore[no-untyped-def]
    """Where two whiskers were read on one line, leave it to the one that was expected nearer to it."""
    for v in range(len(row)):
        for w in range(v):
            if reason[v] or reason[w]:
                continue
            common, near = 0, 0
            for j in range(row.shape[1]):
                distance = abs(row[v, j] - row[w, j])
                common += distance == distance
                near += distance < APART
            if common >= FEWEST and 2 * near > common:
                off_v, off_w = np.nanmedian(np.abs(row[v] - expected[v])), np.nanmedian(np.abs(row[w] - expected[w]))
                reason[v if off_v > off_w else w] = SHARED


@njit(cache=True, nogil=True)
def adapt(typical, contrast):  # type: ignore[no-untyped-def]
    """Let a whisker's own contrast follow what was seen, slowly; columns new to it start from there."""
    for j in range(typical.size):
        if contrast[j] == contrast[j]:
            step = ADAPT * (contrast[j] - typical[j])
            typical[j] = typical[j] + step if typical[j] == typical[j] else contrast[j]


@njit(cache=True, nogil=True)
def follow(block, background, sign, how, columns, state, lines, reason):  # type: ignore[no-untyped-def]
    """Follow whiskers through a block (T, height, width).

    Parameters
    ----------
    background, sign
        As of :func:`vibrissa.video.centreline.read_line`.
    how : (search, threshold, match)
        Likewise.
    columns : (int, int)
        First and last column that are read.
    state : (expected, course, typical, missed)
        Before the block; after it, written over.
    lines : (row, sd, contrast)
        Arrays (whisker, T, width), written.
    reason : (whisker, T) array
        Written.
    """
    expected, course, typical, missed = state
    row, sd, contrast = lines
    search, threshold, match = how
    for t in range(len(block)):
        for w in range(len(expected)):
            line = row[w, t], sd[w, t], contrast[w, t]
            # a line of 2 px full width at half maximum has a peak of half its sum
            ceiling = np.maximum(typical[w], 0) / 2
            read_line(
                block[t],
                background,
                sign,
                expected[w],
                ceiling,
                search,
                threshold,
                GAP,
                match,
                line[0],
                line[1],
                line[2],
            )
            reason[w, t] = _reason(line[0], line[2], expected[w], course[w], typical[w], missed[w])
        _part(row[:, t], expected, reason[:, t])
        for w in range(len(expected)):
            if reason[w, t]:
                missed[w] += 1
                row[w, t], sd[w, t], contrast[w, t] = np.nan, np.nan, np.nan
            else:
                expected[w], course[w] = expect(row[w, t], course[w], columns[0], columns[1])
                adapt(typical[w], contrast[w, t])
