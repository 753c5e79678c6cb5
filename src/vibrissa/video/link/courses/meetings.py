"""Where the end of a line would go on as another one, smoother than that one goes on itself.

Two whiskers that cross at a small angle run as one over a long stretch. There a line goes on as the whisker that is
clearer, and the other whisker's line ends. Where the latter, continued, fits what lies beyond better than the part of
the longer line before it does, that line may have gone over from one whisker to the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit
from vibrissa.video.link.courses.smooth_curve import misfit, polynomial

Values = NDArray[np.float64]
Places = NDArray[np.int64]

ARM, SHORTEST = 30.0, 8.0  # length of a part that a curve is fitted to, over the width of a line; and at least
DRAWN = 4.0  # length to either side of the meeting, over the width, in which lines are drawn to each other
AHEAD, BESIDE = 45.0, 3.0  # how far an end is continued, and distance of what it meets, over the width
BEHIND = 2.0  # how far behind its end a line may meet another one, over the width
TOGETHER = 0.5  # distance beyond the least one, over the width, up to which two lines are together
STEPS = 5  # points to either side from which the direction of a line is taken
ALONG = np.cos(np.radians(25.0))  # angle at which lines meet at most


@njit(cache=True)
def _part(start: int, way: int, low: int, high: int, most: int) -> Places:
    """Up to ``most`` points from ``start`` one way, within ``low`` and ``high``, the latter not included."""
    count = min(most, high - start if way > 0 else start - low + 1)
    return start + way * np.arange(max(count, 0))


@njit(cache=True)
def _carried_on(points: Values, sd: Values, part: Places) -> tuple[float, float, float, Values]:
    """Direction, length and parabola of a part whose first point is an end, to carry it on beyond."""
    end, inner = points[part[0]], points[part[-1]]
    du, dv = end[0] - inner[0], end[1] - inner[1]
    length = max(np.hypot(du, dv), 1e-9)
    du, dv = du / length, dv / length
    x, y = points[part, 0] - end[0], points[part, 1] - end[1]
    curve, _ = polynomial((x * du + y * dv) / length, y * du - x * dv, sd[part], 2)
    return du, dv, length, curve


@njit(cache=True)
def _met(points: Values, sd: Values, part: Places, low: int, high: int, width: float) -> tuple[int, int]:
    """Point from ``low`` to ``high`` that an end continued comes nearest to, and the way it goes on; way 0 if none."""
    du, dv, length, curve = _carried_on(points, sd, part)
    end = points[part[0]]
    ahead, off = np.full(high - low, np.inf), np.full(high - low, np.inf)
    for k in range(low, high):
        x, y = points[k, 0] - end[0], points[k, 1] - end[1]
        u = x * du + y * dv
        if -BEHIND * width <= u <= AHEAD * width:
            s = u / length
            ahead[k - low] = u
            off[k - low] = abs(y * du - x * dv - curve[0] - s * (curve[1] + s * curve[2]))
    nearest = off.min()
    if nearest >= BESIDE * width:
        return low, 0
    # the two may run on together: the meeting is where that begins
    place = low + int(np.argmin(np.where(off <= nearest + TOGETHER * width, ahead, np.inf)))
    one, other = points[max(place - STEPS, low)], points[min(place + STEPS, high - 1)]
    s = ((points[place, 0] - end[0]) * du + (points[place, 1] - end[1]) * dv) / length
    slope = (curve[1] + 2 * s * curve[2]) / length
    x, y = other[0] - one[0], other[1] - one[1]
    cosine = (x * (du - slope * dv) + y * (dv + slope * du)) / max(np.hypot(x, y) * np.hypot(1.0, slope), 1e-9)
    return place, 0 if abs(cosine) < ALONG else 1 if cosine > 0 else -1


@njit(cache=True)
def meetings(points: Values, sd: Values, ends: Places, width: float) -> list[tuple[int, int, float]]:
    """All meetings of an end with a line that goes on better from it than from its own part.

    Parameters
    ----------
    points : (n, 2) array
        Points of the lines of a frame, one line after another, about a pixel apart [px].
    sd : (n,) array
        Their standard deviations across the line [px].
    ends : (lines + 1,) array of int
        First point of each line, and after the last.
    width : float
        Of the lines [px].

    Returns
    -------
    list of (int, int, float)
        Line, point of it, and by how much the misfit of a cubic beyond that point falls if the end that meets it is
        what comes before, in place of the line's own part.
    """
    most, least, drawn = int(ARM * width), int(SHORTEST * width), int(DRAWN * width)
    found = [(0, 0, 0.0) for _ in range(0)]
    for end in range(2 * (ends.size - 1)):
        low, high = ends[end // 2], ends[end // 2 + 1]
        part = _part(low, 1, low, high, most) if end % 2 == 0 else _part(high - 1, -1, low, high, most)
        if part.size < least:
            continue
        for line in range(ends.size - 1):
            first, stop = ends[line], ends[line + 1]
            place, way = _met(points, sd, part, first, stop, width) if line != end // 2 else (first, 0)
            own = _part(place - way * drawn, -way, first, stop, most)
            beyond = _part(place + way * drawn, way, first, stop, most)
            if way and min(own.size, beyond.size) >= least:
                gain = misfit(points, sd, own, beyond) - misfit(points, sd, part, beyond)
                if gain > 0:
                    found.append((line, place, gain))
    return found
