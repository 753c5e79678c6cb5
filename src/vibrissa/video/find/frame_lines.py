"""All lines of one frame: body, second derivatives, traces, joined over gaps, placed across their own direction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Mask
from vibrissa.loops import njit
from vibrissa.video.find.body_mask import cell_levels, leave_small, mark_body
from vibrissa.video.find.curvature_maps import Maps, derivative_taps, second_derivatives
from vibrissa.video.find.line_joining import join_lines
from vibrissa.video.find.line_placing import FULL_WIDTH, place_line, resampled
from vibrissa.video.find.line_placing import SHARPEST as SHARPEST_LINE
from vibrissa.video.find.line_seeds import SAMPLED, find_seeds, null_responses
from vibrissa.video.find.line_tracing import TraceRule, trace_lines

Single = NDArray[np.float32]
Marks = NDArray[np.uint8]
Places = NDArray[np.int64]

FILTER, SHARPEST = 1.2, 0.9  # standard deviation of the filters over that of a line, and at least [px]
CLEAR, FAINT, SEEN = 6.0, 3.5, 2.0  # responses at which a trace starts, goes on, is seen, over their scatter
LEAST_DEPTH = 0.002  # depth of a line over the range of the light, at least: below, compression leaves false lines
STEP, AHEAD = 0.75, 6.0  # step of a trace and length of the arcs ahead, over the width of a line
GAP, SHARED, JOINED = 8.0, 12.0, 24.0  # lengths hidden, along another line, between two parts, over the width at most
TOUCHING = 3.0  # gap between two parts that touch, over the width
CELL = 2.0  # side of the cells of seeds and of the body, over the width
MEASURED, SURE = 0.5, 0.3  # share of the points of a line that must be measured, with that SD over the width at most
GHOST = 0.5  # contrast in the frame over that in the difference from the scenery, below which a line is none
END = 0.6  # the same, near its ends
LINES = 2000  # of a frame at most


class LineShape(NamedTuple):
    """How wide the lines of a movie are, and the rules that follow.

    Attributes
    ----------
    sigma : float
        Standard deviation of their profiles [px].
    width : float
        Full width at half depth [px].
    blur : float
        Standard deviation of the filters [px].
    least : float
        Least length of a line [px].
    cell : int
        Side of a cell [px].
    zero : float
        Grey level of no light; −∞ where lines are brighter than the background.
    """

    sigma: float
    width: float
    blur: float
    least: float
    cell: int
    zero: float


def line_shape(sigma: float, least: float | None, zero: float) -> LineShape:
    """Shape of lines of a profile.

    Parameters
    ----------
    sigma : float
        Standard deviation of the profile [px].
    least : float, optional
        Least length of a line [px]; ten widths by default.
    zero : float
        As in :class:`LineShape`.

    Returns
    -------
    LineShape
    """
    width = FULL_WIDTH * sigma
    cell = max(round(CELL * width), 3)
    return LineShape(sigma, width, max(FILTER * sigma, SHARPEST), least or 10 * width, cell, zero)


class FrameRoom(NamedTuple):
    """Room for the work on frames of one size, one for each thread."""

    taps: Single
    levels: Single
    dark: Marks
    body: Marks
    wall: Marks
    queue: Places
    taken: Marks
    rows: Maps
    maps: Maps
    line: Single
    strength: Array
    place: Places
    path: Array
    points: Array
    joined: Array
    first: Places
    start: Places
    arcs: Array
    near: Array
    course: Array
    fit: Array
    cells: Array
    work: Array
    good: Mask
    found: Array
    begin: Places
    crowded: Places


def frame_room(height: int, width: int, shape: LineShape) -> FrameRoom:
    """Make the room for frames of one size.

    Parameters
    ----------
    height, width : int
        Of the frames [px].
    shape : LineShape
        Of the lines.

    Returns
    -------
    FrameRoom
    """
    rows, columns = -(-height // shape.cell), -(-width // shape.cell)
    most, long, lines = max(height * width // 8, 1000), 4 * (height + width), LINES + 1
    return FrameRoom(
        taps=derivative_taps(shape.blur),
        levels=np.empty((rows, columns), np.float32),
        dark=np.empty((rows, columns), np.uint8),
        body=np.empty((height, width), np.uint8),
        wall=np.empty((height, width), np.uint8),
        queue=np.empty(rows * columns, np.int64),
        taken=np.empty((height, width), np.uint8),
        rows=np.empty((3, height, width), np.float32),
        maps=np.empty((3, height, width), np.float32),
        line=np.empty(width, np.float32),
        strength=np.empty(rows * columns),
        place=np.empty(rows * columns, np.int64),
        path=np.empty((2, long, 3)),
        points=np.empty((most, 3)),
        joined=np.empty((most, 3)),
        first=np.empty(lines, np.int64),
        start=np.empty(lines, np.int64),
        arcs=np.empty(SAMPLED),
        near=np.empty(SAMPLED),
        course=np.empty((2 * long, 2)),
        fit=np.empty((16, 5)),
        cells=np.empty((13, int(60 * (2 + shape.width) ** 2))),
        work=np.empty((2 * long, 16)),
        good=np.empty(2 * long, np.bool_),
        found=np.empty((most, 5)),
        begin=np.empty(lines, np.int64),
        crowded=np.zeros(1, np.int64),
    )


@njit(cache=True, nogil=True)
def _rule(shape: LineShape, room: FrameRoom) -> TraceRule:
    """Rule of the traces in this frame, from the responses where there is no line."""
    width = shape.width
    step = max(STEP * width, 1.0)
    ahead = max(int(AHEAD * width / step + 0.5), 4)
    _, along, here = null_responses(room.maps, room.body, step, ahead, room.arcs, room.near)
    low, high = room.levels.min(), room.levels.max()
    span = high - (shape.zero if shape.zero > -1e30 else low)
    # response of a line of unit depth
    unit = shape.sigma / (shape.sigma**2 + shape.blur**2) ** 1.5
    along = max(along, LEAST_DEPTH * span * unit)
    bend = width / (ahead * step) ** 2
    return TraceRule(
        step,
        ahead,
        bend,
        max(0.4 * width, 0.7),
        CLEAR * along,
        FAINT * along,
        SEEN * max(here, LEAST_DEPTH * span * unit),
        GAP * width,
        SHARED * width,
        shape.least,
        max(int(0.6 * width + 0.5), 1),
    )


@njit(cache=True, nogil=True)
def _ends(good: Mask, reach: int) -> tuple[int, int]:
    """First and last point near which most points are measured; the last lies before the first if there is none."""
    n = good.size
    first, last = 0, n - 1
    while first < n and not (good[first] and good[first : first + reach].mean() >= END):
        first += 1
    while last >= 0 and not (good[last] and good[max(last - reach + 1, 0) : last + 1].mean() >= END):
        last -= 1
    return first, last


@njit(cache=True, nogil=True)
def _contrast(image: Single, points: Array, reach: float) -> float:
    """Sum over the points of a line of the grey levels on either side less that in the middle."""
    height, width = image.shape
    total = 0.0
    for k in range(1, len(points) - 1):
        du, dv = points[k + 1, 0] - points[k - 1, 0], points[k + 1, 1] - points[k - 1, 1]
        length = max(np.hypot(du, dv), 1e-9)
        u, v = -dv * reach / length, du * reach / length
        for side in range(-1, 2):
            i = min(max(int(points[k, 1] + side * v + 0.5), 0), height - 1)
            j = min(max(int(points[k, 0] + side * u + 0.5), 0), width - 1)
            total += image[i, j] * (-2.0 if side == 0 else 1.0)
    return total


@njit(cache=True, nogil=True)
def _place(frame: Single, grey: Single, points: Array, used: int, shape: LineShape, room: FrameRoom) -> int:
    """Place a line, and write its points to ``room.found`` from ``used`` on; how many, 0 if it is none."""
    n = resampled(points, room.course)
    if used + n > len(room.found):
        room.crowded[0] += 1
        return 0
    good, found = room.good[:n], room.found[used : used + n]
    measured = place_line(grey, room.course[:n], shape.sigma, room.fit, room.cells, room.work[:n], good, found)
    if measured < MEASURED * shape.least:
        return 0
    low, high = _ends(good, int(4 * shape.width))
    kept = high - low + 1
    surest = SURE * max(shape.width, SHARPEST_LINE)
    if kept < shape.least or (found[low : high + 1, 4] < surest).mean() < MEASURED:
        return 0
    there = _contrast(frame, found[low : high + 1], 1.5 * shape.width)
    if there < GHOST * _contrast(grey, found[low : high + 1], 1.5 * shape.width):
        return 0
    for q in range(kept):
        found[q] = found[low + q]
    return kept


def find_lines(grey: Single, shape: LineShape, room: FrameRoom) -> int:
    """Find all lines of a frame.

    Parameters
    ----------
    grey : (height, width) array
        Grey levels, lines darker than their sides.
    shape : LineShape
        Of the lines.
    room : FrameRoom
        Room for work. Written are ``room.begin`` (lines + 1,) and ``room.found`` (points, 5): column, row, full
        width at half depth [px], depth [grey levels], standard deviation across the line [px], NaN if not measured;
        and ``room.crowded`` (1,), lines for which there was no room.

    Returns
    -------
    int
        Lines.
    """
    cell_levels(grey, shape.cell, room.levels)
    mark_body(grey, room.levels, shape.zero, shape.cell, room.dark, room.body)
    return int(find_moving(grey, grey, shape, room))


@njit(cache=True, nogil=True)
def find_moving(frame: Single, grey: Single, shape: LineShape, room: FrameRoom) -> int:
    """Find the lines of a frame less its scenery that are lines of the frame itself, and not where scenery was.

    Parameters
    ----------
    frame : (height, width) array
        The frame, whose body is marked in ``room.body``.
    grey : (height, width) array
        The frame less the scenery; the frame itself where none is subtracted.
    shape, room
        As in :func:`find_lines`.

    Returns
    -------
    int
        Lines.
    """
    second_derivatives(grey, room.taps, room.rows, room.maps)
    rule = _rule(shape, room)
    room.begin[0], room.crowded[0] = 0, 0
    if not rule.clear < np.inf:
        return 0
    seeds = find_seeds(room.maps, room.body, rule.clear, shape.cell, room.line, room.strength, room.place)
    lines, room.crowded[0] = trace_lines(
        room.maps, room.body, room.taken, room.place, seeds, rule, room.path, room.points, room.first
    )
    room.wall[:] = room.body
    leave_small(room.dark, shape.cell, JOINED * shape.width, room.queue, room.wall)
    lines = join_lines(
        room.points,
        room.first,
        lines,
        TOUCHING * shape.width,
        JOINED * shape.width,
        rule.ahead,
        room.wall,
        room.joined,
        room.start,
    )
    count, used = 0, 0
    for k in range(lines):
        kept = _place(frame, grey, room.joined[room.start[k] : room.start[k + 1]], used, shape, room)
        if kept:
            used += kept
            count += 1
            room.begin[count] = used
    return count
