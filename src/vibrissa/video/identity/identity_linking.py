"""Which line of the fan is which whisker, over a whole movie.

Whiskers of one pad swing together, further in one frame than they are apart, and through one another. So
first their `common_motion` from each frame to the next is estimated, for all frames at once. Then lines of
frames up to ``SKIP`` apart are linked where they lie on the common motion, and each whisker is the chain of
links of least cost through the lines marked as its own. A link costs its deviation from the common motion and
the change of this deviation, of the offset and of the density; most of it counts only as far as it exceeds the
best link that either line has, or the smoothest whisker would attract all others. The margin in a frame is the
additional cost of the second best chain, of those that are elsewhere in that frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Integers, Mask
from vibrissa.loops import njit
from vibrissa.video.identity.common_motion import common_motion

Values = NDArray[np.float64]
Places = NDArray[np.int64]
Pair = tuple[int, int]  # frame and place of a line
SKIP = 4  # frames over which a link may reach: lines that cross may be one for three frames
APART = 6.0  # deviation from the common motion [° per frame] above which there is no link
OFF = np.array([1.5, 2.0, 0.5])  # standard deviations of deviation [°], change of offset [px], of log density
MOST_OFF = np.array([9.0, 6.0])  # bounds of the squares of the latter two: a crossing changes both
HIDDEN = 5.0  # cost of a frame skipped
AGAIN = 0.7  # share of a whisker's deviation from the common motion that is expected again
TURN = 0.6  # standard deviation of the change of this deviation [°]
SWINGING = 0.4  # growth of both standard deviations with the common motion: whiskers do not swing all alike
SUDDEN = 16.0  # bound of its square
ABSOLUTE = 0.25  # share of the cost that counts whether or not there is a better link
END = 1.0  # cost of each frame before the chain begins or after it ends
ELSEWHERE = 1.0  # distance [°] from the best chain at which another one is elsewhere
SKIPPED = 2.0  # added to it in a frame that either chain skips


class Chain(NamedTuple):
    """One whisker over time.

    Attributes
    ----------
    angle, offset : (T,) arrays
        Its line at the fan's middle radius [°], distance from the pivot [px]; NaN where there is none.
    seen : (T,) array of bool
        Whether there is a line in the frame; the other two are interpolated where not.
    margin : (T,) array
        Cost of the cheapest chain that is elsewhere in that frame, over the cost of this one.
    """

    angle: Values
    offset: Values
    seen: Mask
    margin: Values


class Links(NamedTuple):
    """Pairs of lines that may be one whisker: in frame and place ``start`` and ``stop``; sorted by the frames.

    ``deviation`` is from the common motion [° per frame]; ``cost`` is its own, ``turn`` the standard
    deviation of its change [°], ``least_out`` and ``least_in`` those of the best next and previous link.
    """

    start: Integers
    stop: Integers
    deviation: Values
    cost: Values
    turn: Values
    least_out: Values
    least_in: Values


@njit(cache=True)
def _pairs(
    lines: Values, motion: Values, centre: float
) -> tuple[list[Pair], list[Pair], list[tuple[float, float, float]]]:
    """Frame and place of both lines, deviation and cost of every possible link."""
    start, stop, values = [], [], []
    for t in range(lines.shape[0] - 1):
        for i in range(lines.shape[1]):
            if not lines[t, i, 2] > 0:
                break
            angle = lines[t, i, 0]
            # the line is carried along by the common motion of one frame after the other
            for g in range(1, min(SKIP, lines.shape[0] - 1 - t) + 1):
                angle += motion[t + g - 1, 0] + motion[t + g - 1, 1] * (angle - centre)
                for j in range(lines.shape[1]):
                    there = lines[t + g, j]
                    if not there[2] > 0:
                        break
                    deviation, wider = (there[0] - angle) / g, SWINGING * abs(angle - lines[t, i, 0]) / g
                    u, v = deviation / (OFF[0] + wider), (there[1] - lines[t, i, 1]) / OFF[1]
                    if abs(deviation) > APART * 2 / (1 + g) or abs(v) > 4:
                        continue
                    w = np.log(there[2] / lines[t, i, 2]) / OFF[2]
                    cost = 0.5 * (u * u + min(v * v / g, MOST_OFF[0]) + min(w * w, MOST_OFF[1])) + HIDDEN * (g - 1)
                    start.append((t, i))
                    stop.append((t + g, j))
                    values.append((deviation, cost, TURN + wider))
    return start, stop, values


@njit(cache=True)
def _from(start: Places, frames: int, places: int) -> tuple[Places, Places]:
    """First link that starts in each line, and the next one of each link; −1 for none."""
    head, following = np.full((frames, places), -1), np.full(start.shape[0], -1)
    for k in range(start.shape[0] - 1, -1, -1):
        following[k] = head[start[k, 0], start[k, 1]]
        head[start[k, 0], start[k, 1]] = k
    return head, following


@njit(cache=True)
def _joint(links: Links, k: int, q: int) -> float:
    """Cost of link q after link k."""
    sd = max(links.turn[k], links.turn[q])
    return links.cost[q] + 0.5 * min(((links.deviation[q] - AGAIN * links.deviation[k]) / sd) ** 2, SUDDEN)


@njit(cache=True)
def _compare(links: Links, frames: int, places: int) -> None:
    """Write the costs of the best next and previous link of each."""
    head, following = _from(links.start, frames, places)
    for k in range(links.cost.size):
        q = head[links.stop[k, 0], links.stop[k, 1]]
        while q >= 0:
            value = _joint(links, k, q)
            links.least_out[k], links.least_in[q] = min(links.least_out[k], value), min(links.least_in[q], value)
            q = following[q]


def link(lines: Values, centre: float) -> Links:
    """All links between lines of frames up to ``SKIP`` apart.

    Parameters
    ----------
    lines, centre
        As in :func:`vibrissa.video.identity.common_motion.common_motion`.

    Returns
    -------
    Links
        Sorted by the frames.
    """
    start, stop, values = _pairs(lines, common_motion(lines, centre), centre)
    first, last = (np.array(x, np.int64).reshape(-1, 2) for x in (start, stop))
    deviation, cost, turn = np.array(values, float).reshape(-1, 3).T.copy()
    links = Links(first, last, deviation, cost, turn, *np.full((2, cost.size), np.inf))
    _compare(links, *lines.shape[:2])
    return links


@njit(cache=True)
def _onward(links: Links, k: int, q: int, rest: float) -> float:
    """Cost of a chain that costs ``rest`` without the step from link k to link q."""
    return rest + _joint(links, k, q) - (1 - ABSOLUTE) * 0.5 * (links.least_out[k] + links.least_in[q])


@njit(cache=True)
def _chains(
    links: Links, allowed: Mask, first: int, last: int, frames: int, places: int
) -> tuple[Values, Values, Places]:
    """Least cost up to each link and from each link on, and the link before; Viterbi in both directions."""
    start, stop = links.start, links.stop
    head, following = _from(start, frames, places)
    ahead, back = np.full(allowed.size, np.inf), np.full(allowed.size, np.inf)
    came = np.full(allowed.size, -1)
    # links are sorted by their frames: all that lead to a link come before it
    for k in range(allowed.size):
        if allowed[k] and start[k, 0] <= first:
            ahead[k] = min(ahead[k], END * start[k, 0] + links.cost[k])
        q = head[stop[k, 0], stop[k, 1]] if ahead[k] < np.inf else -1
        while q >= 0:
            value = _onward(links, k, q, ahead[k])
            if allowed[q] and value < ahead[q]:
                ahead[q], came[q] = value, k
            q = following[q]
    # the same from the end: what the rest of a chain costs at least from each link on
    for k in range(allowed.size - 1, -1, -1):
        if allowed[k] and stop[k, 0] >= last:
            back[k] = END * (frames - 1 - stop[k, 0])
        q = head[stop[k, 0], stop[k, 1]] if allowed[k] else -1
        while q >= 0:
            back[k] = min(back[k], _onward(links, k, q, back[q]))
            q = following[q]
    return ahead, back, came


@njit(cache=True)
def _margins(start: Places, stop: Places, total: Values, lines: Values, angle: Values, seen: Mask) -> Values:
    """Cost over the best of the cheapest chain that is elsewhere, in every frame."""
    margin = np.full(angle.size, np.inf)
    for k in range(total.size):
        if not total[k] < np.inf:
            continue
        (t, i), (s, j) = start[k], stop[k]
        for f in range(t, s + 1):
            there = lines[t, i, 0] + (lines[s, j, 0] - lines[t, i, 0]) * (f - t) / (s - t)
            skipped = SKIPPED if (t < f < s) or not seen[f] else 0.0
            if not abs(there - angle[f]) <= ELSEWHERE + skipped:
                margin[f] = min(margin[f], total[k])
    return margin


def _through(links: Links, marks: Integers) -> Mask:
    """Which links pass by no mark: in its frame they have the marked line, and none skips it."""
    allowed = np.ones(links.cost.size, np.bool_)
    for t, i in marks:
        for end in (links.start, links.stop):
            allowed &= (end[:, 0] != t) | (end[:, 1] == i)
        allowed &= (links.start[:, 0] >= t) | (links.stop[:, 0] <= t)
    return allowed


def chain(lines: Values, links: Links, marks: Integers) -> Chain:
    """The whisker that goes through marked lines; lost from one mark to the next where no links join them.

    Parameters
    ----------
    lines : (T, n, 3) array
        Lines of the fan, as of :func:`vibrissa.video.identity.whisker_fan.fan_lines`.
    links : Links
        Of these lines.
    marks : (n, 2) array of int
        Frame and place of the lines marked, sorted by the frames.

    Returns
    -------
    Chain
        Its line in every frame.
    """
    frames = np.arange(lines.shape[0])
    ahead, back, came = _chains(links, _through(links, marks), marks[0, 0], marks[-1, 0], *lines.shape[:2])
    # a mark that no chain reaches from the marks before it: the whisker is lost in between
    reached = np.isin(marks[:, 0], links.stop[np.isfinite(ahead), 0])
    reached[0] = True
    if not reached.all():
        n = int(np.argmin(reached))
        early, late = chain(lines, links, marks[:n]), chain(lines, links, marks[n:])
        before, after = frames <= marks[n - 1, 0], frames >= marks[n, 0]
        # of the early chain before the gap, of the late one after it; nothing between
        angle, offset, seen, margin = (
            np.select([before, after], pair, np.nan) for pair in zip(early, late, strict=True)
        )
        return Chain(angle, offset, seen == 1, margin)
    total = ahead + back
    ends = ahead + np.where(links.stop[:, 0] >= marks[-1, 0], END * (frames[-1] - links.stop[:, 0]), np.inf)
    nothing = np.full(frames.size, np.nan)
    if not np.isfinite(ends).any():
        return Chain(nothing, nothing, np.zeros(frames.size, np.bool_), nothing)
    least, k, nodes = ends.min(), int(np.argmin(ends)), []
    while k >= 0:
        nodes += [links.stop[k], links.start[k]]
        k = came[k]
    t, i = np.unique(nodes, axis=0).T
    angle, offset = (np.interp(frames, t, lines[t, i, v], left=np.nan, right=np.nan) for v in range(2))
    seen = np.isin(frames, t)
    return Chain(angle, offset, seen, _margins(links.start, links.stop, total - least, lines, angle, seen))
