"""Whiskers of a long movie linked in windows first, in which nothing drifts far; windows that overlap share lines.

Over hundreds of frames the phase of the pad, which is summed up from frame to frame, and the places of whiskers drift
by more than whiskers are apart. Whoever looks for a whisker at one place over the whole movie finds another one's lines
there. In a window of a second or so places hold; the next window has half of its lines, and so the same whiskers.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.swap_moves import best_lines
from vibrissa.video.link.pad.pads import Lines

LENGTHS = 200, 300, 450  # frames of a window; each gives one start
FEWEST = 1.5  # lengths of a window that a movie has at least
SHARED = 0.5, 0.3  # more of the lines that either has where windows overlap: of the fewer, and of the more
LEAST = 8  # lines that they share at least

Window = tuple[int, int, list[Integers]]  # first frame, the one after the last, segments of each whisker


def lengths(frames: int) -> list[int]:
    """Lengths of the windows in which a movie of some frames can be linked; none of a short one."""
    return [length for length in LENGTHS if frames >= FEWEST * length]


def linked_in_windows(
    frames: int, frame: Integers, length: int, linked: Callable[[Integers, int, int], Solution]
) -> Integers:
    """Names of lines from windows, each half over the next one.

    Parameters
    ----------
    frames : int
        Frames of the movie.
    frame : (S,) array
        Frame of each segment.
    length : int
        Frames of a window.
    linked : callable
        Gives the whiskers of some segments, from the first frame of their window and the one after its last.

    Returns
    -------
    (S,) array of int
        A name has one line in a frame at most; −1 for lines of none.
    """
    windows: list[Window] = []
    for first in _starts(frames, length):
        here = np.flatnonzero((frame >= first) & (frame < first + length))
        best = best_lines(linked(here, first, first + length)) if here.size else ()
        windows.append((first, first + length, [here[one[one >= 0]] for one in best]))
    return _named(frame, windows, _numbers(frame, windows))


def _starts(frames: int, length: int) -> list[int]:
    """First frames of windows that lie half on one another or a little more, and end with the movie."""
    last = max(frames - length, 0)
    return [int(first) for first in np.linspace(0, last, int(np.ceil(2 * last / length)) + 1).round()]


def some_lines(lines: Lines, here: Integers) -> Lines:
    """Some of the lines."""
    return Lines._make(values[here] for values in lines)


def _numbers(frame: Integers, windows: list[Window]) -> list[Integers]:
    """Number of each whisker of each window: the same where whiskers of two windows are one."""
    first = np.cumsum([0, *(len(whiskers) for _, _, whiskers in windows)])
    pairs = [np.zeros((2, 0), np.int64)]
    for n in range(len(windows) - 1):
        one, other = _same(frame, windows[n], windows[n + 1])
        pairs.append(np.stack([first[n] + one, first[n + 1] + other]))
    i, j = np.concatenate(pairs, axis=1)
    graph = coo_array((np.ones(i.size), (i, j)), shape=(first[-1], first[-1]))
    return list(np.split(connected_components(graph, directed=False)[1], first[1:-1]))


def _same(frame: Integers, before: Window, after: Window) -> tuple[Integers, Integers]:
    """Whiskers of two windows that are one, as most of their lines in common frames are the same."""
    start, stop = after[0], before[1]
    each = [[one[(frame[one] >= start) & (frame[one] < stop)] for one in window[2]] for window in (before, after)]
    shared = np.array([[np.intersect1d(one, other).size for other in each[1]] for one in each[0]])
    shared = shared.reshape(len(each[0]), len(each[1]))
    one, other = linear_sum_assignment(-shared)
    sizes = np.array([[each[0][a].size, each[1][b].size] for a, b in zip(one, other, strict=True)]).reshape(-1, 2)
    both, (fewer, more) = shared[one, other], np.sort(sizes, axis=1).T
    kept = (both >= LEAST) & (both > SHARED[0] * fewer) & (both > SHARED[1] * more)
    return one[kept], other[kept]


def _named(frame: Integers, windows: list[Window], numbers: list[Integers]) -> Integers:
    """Name of each line, by the window in whose middle it is nearest."""
    name, far = np.full(frame.size, -1), np.full(frame.size, np.inf)
    for (first, stop, whiskers), number in zip(windows, numbers, strict=True):
        for one, its in zip(whiskers, number, strict=True):
            off = np.abs(frame[one] - (first + stop - 1) / 2)
            near = off < far[one]
            name[one[near]], far[one[near]] = its, off[near]
    _once(frame, name, far)
    some = name >= 0
    name[some] = np.unique(name[some], return_inverse=True)[1]
    return name


def _once(frame: Integers, name: Integers, far: Array) -> None:
    """Take the name from the second line that has it in a frame, where two windows say otherwise."""
    order = np.lexsort((far, frame, name))
    again = (np.diff(name[order], prepend=-2) == 0) & (np.diff(frame[order], prepend=-2) == 0)
    name[order[again]] = -1
