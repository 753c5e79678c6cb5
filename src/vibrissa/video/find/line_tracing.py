"""Lines traced through maps of second derivatives: step by step along the arc ahead that has most of a line.

At each step a fan of arcs is tried, all tangent to the line so far. Their curvatures lie about that of the line so
far, and a change of curvature costs: so a line goes straight on through another one that it crosses, and over a gap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.video.find.curvature_maps import Maps, across

ARCS = 4  # arcs to either side of the one with the line's own curvature
BEND_COST = 0.08  # share of the response that a change of curvature by one arc costs
STRONGER = 1.3  # response over the line's own mean, above which it counts no more
OWN_GAIN = 0.1  # share of the response at a step in that mean
DRAWN = 4  # steps before a stretch with another line, at which a line is not its own
STRIDE = 2  # steps on one arc
ROUND = 1.25 * np.pi  # turn of a line from its seed to an end at most [rad]
CURVATURE_GAIN = 0.5  # share of the found change that is taken over
ALIGNED = 0.4  # largest angle between two lines that are one [rad]
TURNS = 64  # directions of a line that are stored, from 0 to 180°


class TraceRule(NamedTuple):
    """How lines are traced, in pixels and in units of the response.

    Attributes
    ----------
    step : float
        Of a trace [px].
    ahead : int
        Steps of an arc.
    bend : float
        Difference of curvature between two arcs [1/px].
    aside : float
        Distance at which the response on either side is compared [px].
    clear, faint : float
        Mean response along an arc at which a trace starts, and goes on.
    seen : float
        Response over three steps at which the line is seen there.
    gap : float
        Length over which a line may be hidden [px].
    shared : float
        Length over which it may run along another [px].
    least : float
        Least length of a line [px].
    reach : int
        Pixels to either side of a line that belong to it.
    """

    step: float
    ahead: int
    bend: float
    aside: float
    clear: float
    faint: float
    seen: float
    gap: float
    shared: float
    least: float
    reach: int


@njit(cache=True, nogil=True)
def arc_response(
    maps: Maps,
    body: NDArray[np.uint8],
    x: float,
    y: float,
    c: float,
    s: float,
    turn: float,
    step: float,
    ahead: int,
    most: float,
) -> float:
    """Mean response along an arc whose direction turns by ``turn`` a step; −1 where it leaves the image.

    Parameters
    ----------
    maps : (3, height, width) array
        Second derivatives.
    body : (height, width) array of uint8
        Where no whisker can be seen.
    x, y : float
        Where the arc begins [px].
    c, s : float
        Its direction there, a unit vector.
    turn : float
        Change of direction in a step [rad].
    step, ahead
        As in :class:`TraceRule`.
    most : float
        Up to which a response counts: a stronger line than the own one draws no more.

    Returns
    -------
    float
        [grey levels / px²]
    """
    height, width = body.shape
    total, count = 0.0, 0
    half = 0.5 * turn
    for _ in range(ahead):
        # the chord has the direction halfway
        x += step * (c - half * s)
        y += step * (s + half * c)
        c, s = c - turn * s - 0.5 * turn * turn * c, s + turn * c - 0.5 * turn * turn * s
        if not (0 <= x < width - 1 and 0 <= y < height - 1) or body[int(y + 0.5), int(x + 0.5)]:
            break
        total += min(across(maps, x, y, c, s), most)
        count += 1
    return total / count if 3 * count >= ahead else -1.0


@njit(cache=True, nogil=True)
def _best_arc(
    maps: Maps, body: NDArray[np.uint8], x: float, y: float, angle: float, bend: float, most: float, rule: TraceRule
) -> tuple[float, float]:
    """Response of the best arc, and its place in the fan."""
    c, s = np.cos(angle), np.sin(angle)
    best, response, at = -np.inf, -1.0, 0
    last, low, high = -1.0, -1.0, -1.0
    for k in range(-ARCS, ARCS + 1):
        mean = arc_response(maps, body, x, y, c, s, (bend + k * rule.bend) * rule.step, rule.step, rule.ahead, most)
        score = mean * (1 - BEND_COST * abs(k)) if mean > 0 else mean
        if score > best:
            best, response, at, low = score, mean, k, last
        elif k == at + 1:
            high = score
        last = score
    shift = 0.0
    if -ARCS < at < ARCS:
        curve = low - 2 * best + high
        shift = 0.5 * (low - high) / curve if curve < 0 else 0.0
    return response, at + shift


@njit(cache=True, nogil=True)
def _beside(maps: Maps, x: float, y: float, angle: float, rule: TraceRule) -> tuple[float, float]:
    """Mean response over three steps about a point, and how far to the side it is largest [px]."""
    height, width = maps.shape[1:]
    c, s = np.cos(angle), np.sin(angle)
    left, here, right = 0.0, 0.0, 0.0
    for k in range(-1, 2):
        u, v = x + k * rule.step * c, y + k * rule.step * s
        du, dv = -rule.aside * s, rule.aside * c
        u, v = min(max(u, 0.0), width - 1.001), min(max(v, 0.0), height - 1.001)
        ul, vl = min(max(u - du, 0.0), width - 1.001), min(max(v - dv, 0.0), height - 1.001)
        ur, vr = min(max(u + du, 0.0), width - 1.001), min(max(v + dv, 0.0), height - 1.001)
        left += across(maps, ul, vl, c, s)
        here += across(maps, u, v, c, s)
        right += across(maps, ur, vr, c, s)
    curve = left - 2 * here + right
    shift = 0.0
    if curve < 0:
        shift = 0.5 * rule.aside * (left - right) / curve
        shift = min(max(shift, -0.5 * rule.aside), 0.5 * rule.aside)
    return here / 3, shift


@njit(cache=True, nogil=True)
def _is_taken(taken: NDArray[np.uint8], x: float, y: float, angle: float) -> bool:
    """Whether a line in about this direction is there already."""
    there = taken[int(y + 0.5), int(x + 0.5)]
    if there == 0:
        return False
    off = abs(angle - (there - 1) * np.pi / TURNS) % np.pi
    return min(off, np.pi - off) < ALIGNED


@njit(cache=True, nogil=True)
def _trace(
    maps: Maps,
    body: NDArray[np.uint8],
    taken: NDArray[np.uint8],
    x: float,
    y: float,
    angle: float,
    rule: TraceRule,
    path: Array,
) -> int:
    """Trace a line one way from a point; steps (x, y, response) are written to ``path``, and counted."""
    height, width = body.shape
    bend, now, hidden, shared = 0.0, 0.0, 0, 0
    count, largest, outset, own = 0, ARCS * rule.bend, angle, np.inf
    while count < len(path) and abs(angle - outset) < ROUND:
        if count % STRIDE == 0:
            response, at = _best_arc(maps, body, x, y, angle, bend, STRONGER * own, rule)
            if response < rule.faint:
                at = 0.0  # nothing ahead: on as before
            now = bend + at * rule.bend
            bend = min(max(bend + CURVATURE_GAIN * at * rule.bend, -largest), largest)
        turn = now * rule.step
        x += rule.step * np.cos(angle + 0.5 * turn)
        y += rule.step * np.sin(angle + 0.5 * turn)
        angle += turn
        if not (0 <= x < width - 1 and 0 <= y < height - 1) or body[int(y + 0.5), int(x + 0.5)]:
            break
        here, shift = _beside(maps, x, y, angle, rule)
        if here > rule.seen:
            hidden = 0
            own = here if own == np.inf else own + OWN_GAIN * (here - own)
            x -= 0.5 * shift * np.sin(angle)
            y += 0.5 * shift * np.cos(angle)
            x, y = min(max(x, 0.0), width - 1.001), min(max(y, 0.0), height - 1.001)
        else:
            hidden += 1
        shared = shared + 1 if _is_taken(taken, x, y, angle) else 0
        path[count, 0], path[count, 1], path[count, 2] = x, y, here
        count += 1
        if hidden * rule.step > rule.gap or shared * rule.step > rule.shared:
            break
    # before two lines run together each is drawn to the other
    cut = shared + DRAWN if shared * rule.step > rule.shared else shared
    return max(count - max(hidden, cut), 0)


@njit(cache=True, nogil=True)
def _take(taken: NDArray[np.uint8], points: Array, reach: int) -> None:
    """Mark all that belongs to a line."""
    height, width = taken.shape
    for k in range(len(points)):
        j = min(k + 1, len(points) - 1)
        i = max(k - 1, 0)
        angle = np.arctan2(points[j, 1] - points[i, 1], points[j, 0] - points[i, 0]) % np.pi
        code = np.uint8(1 + int(angle / np.pi * TURNS + 0.5) % TURNS)
        x, y = int(points[k, 0] + 0.5), int(points[k, 1] + 0.5)
        for v in range(max(y - reach, 0), min(y + reach + 1, height)):
            for u in range(max(x - reach, 0), min(x + reach + 1, width)):
                taken[v, u] = code


@njit(cache=True, nogil=True)
def trace_lines(
    maps: Maps,
    body: NDArray[np.uint8],
    taken: NDArray[np.uint8],
    place: NDArray[np.int64],
    seeds: int,
    rule: TraceRule,
    path: Array,
    points: Array,
    first: NDArray[np.int64],
) -> tuple[int, int]:
    """Trace a line from every seed that none traced before has taken.

    Parameters
    ----------
    maps : (3, height, width) array
        Second derivatives.
    body, taken : (height, width) arrays of uint8
        Where no whisker can be seen; room for what is taken.
    place : (cells,) array
        Seeds, from ``find_seeds``.
    seeds : int
        How many.
    rule : TraceRule
        How.
    path : (2, steps, 3) array
        Room for work.
    points : (room, 3) array
        Written: column, row and response of the lines, one after another.
    first : (lines + 1,) array
        Written: first point of each line, and after the last.

    Returns
    -------
    int, int
        Lines, and those for which there was no room.
    """
    width = body.shape[1]
    taken[:] = 0
    lines, used, crowded = 0, 0, 0
    first[0] = 0
    for k in range(seeds):
        y, x = float(place[k] // width), float(place[k] % width)
        i, j = int(y), int(x)
        # across the line the curvature is largest
        angle = 0.5 * np.arctan2(2 * maps[1, i, j], maps[0, i, j] - maps[2, i, j]) + 0.5 * np.pi
        if taken[i, j] and _is_taken(taken, x, y, angle):
            continue
        c, s = np.cos(angle), np.sin(angle)
        there = arc_response(maps, body, x, y, c, s, 0.0, rule.step, rule.ahead, np.inf)
        if there + arc_response(maps, body, x, y, -c, -s, 0.0, rule.step, rule.ahead, np.inf) < rule.clear:
            continue
        there = _best_arc(maps, body, x, y, angle, 0.0, np.inf, rule)[0]
        back = _best_arc(maps, body, x, y, angle + np.pi, 0.0, np.inf, rule)[0]
        if there + back < 2 * rule.clear:
            continue
        n = _trace(maps, body, taken, x, y, angle, rule, path[0])
        m = _trace(maps, body, taken, x, y, angle + np.pi, rule, path[1])
        if (n + m) * rule.step < rule.least:
            continue
        if used + n + m + 1 > len(points) or lines + 2 > first.size:
            crowded += 1
            continue
        for q in range(m):
            points[used + q] = path[1, m - 1 - q]
        points[used + m, 0], points[used + m, 1], points[used + m, 2] = x, y, 0.5 * (there + back)
        for q in range(n):
            points[used + m + 1 + q] = path[0, q]
        _take(taken, points[used : used + m + n + 1], rule.reach)
        used += m + n + 1
        lines += 1
        first[lines] = used
    return lines, crowded
