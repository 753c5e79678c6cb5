"""Which line of the fan is which whisker, over a whole movie.

Whiskers of one pad swing together, further in one frame than they are apart, and through one another. So
first the common motion from each frame to the next is estimated, δ(φ) = a + b (φ − φ₀), for all frames at
once. Then lines of frames up to ``SKIP`` apart are linked where they lie on the common motion, and each
whisker is the chain of links of least cost through the lines marked as its own. A link costs its deviation
from the common motion and the change of this deviation, of the offset and of the density; most of it counts
only as far as it exceeds the best link that either line has, or the smoothest whisker would attract all
others. What the second best chain costs more, one that is elsewhere in a frame, is the margin in that frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Values = NDArray[np.float64]
SHIFTS = np.arange(-16.0, 16.5, 0.5)  # a: common motion between two frames at the middle of the fan [°]
SPREADS = np.arange(-0.24, 0.25, 0.06)  # b: its growth along the fan
ALIKE = np.array([1.2, 3.0, 0.5])  # angle [°], offset [px], log density by which the same line may differ
CHANGE = np.array([3.5, 0.08])  # standard deviations of the changes of a [°] and b between frames
KEEP = 0.8  # share of the common motion that is expected again in the next frame
USUAL = 0.15  # standard deviation of b
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
SKIPPED = 2.0  # what is added to it in a frame that either chain skips


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
    seen: NDArray[np.bool_]
    margin: Values


class Links(NamedTuple):
    """Pairs of lines that may be one whisker: in frame and place ``start`` and ``stop``; sorted by the frames.

    ``deviation`` is from the common motion [° per frame]; ``cost`` is its own, ``turn`` the standard
    deviation of its change [°], ``least_out`` and ``least_in`` those of the best next and previous link.
    """

    start: NDArray[np.int64]
    stop: NDArray[np.int64]
    deviation: Values
    cost: Values
    turn: Values
    least_out: Values
    least_in: Values


@njit(cache=True)
def _agreement(here, there, shift, spread, centre):  # type: ignore[no-untyped-def]
    """How many lines, weighted by their density, are found again after a common motion."""
    total = 0.0
    for i in range(here.shape[0]):
        if not here[i, 2] > 0:
            break
        best = 0.0
        for j in range(there.shape[0]):
            if not there[j, 2] > 0:
                break
            u = (there[j, 0] - here[i, 0] - shift - spread * (here[i, 0] - centre)) / ALIKE[0]
            if abs(u) < 2.5:
                v = (there[j, 1] - here[i, 1]) / ALIKE[1]
                w = np.log(there[j, 2] / here[i, 2]) / ALIKE[2]
                best = max(best, np.exp(-0.5 * (u * u + v * v + w * w)))
        total += best * min(here[i, 2], 0.2) / 0.1
    return total


@njit(cache=True)
def common_motion(lines, centre):  # type: ignore[no-untyped-def]
    """Common motion from each frame to the next, a [°] and b: (T − 1, 2), by Viterbi over all frames.

    Parameters
    ----------
    lines : (T, n, 3) array
        Of :func:`vibrissa.video.fan.fan_lines`.
    centre : float
        Middle of the fan φ₀ [°].
    """
    steps, m, n = lines.shape[0] - 1, SHIFTS.size, SPREADS.size
    score = np.zeros((m, n))
    came = np.zeros((steps, m, n, 2), np.int8)
    for t in range(steps):
        before = score.copy()
        for i in range(m):
            for j in range(n):
                best = -np.inf if t else 0.0
                for k in range(m if t else 0):
                    du = (SHIFTS[i] - KEEP * SHIFTS[k]) / CHANGE[0]
                    for h in range(n if abs(du) < 3 else 0):
                        dv = (SPREADS[j] - KEEP * SPREADS[h]) / CHANGE[1]
                        value = before[k, h] - 0.5 * (du * du + dv * dv)
                        if value > best:
                            best = value
                            came[t, i, j, 0], came[t, i, j, 1] = k, h
                score[i, j] = best - 0.5 * (SPREADS[j] / USUAL) ** 2
                score[i, j] += _agreement(lines[t], lines[t + 1], SHIFTS[i], SPREADS[j], centre)
    motion = np.zeros((steps, 2))
    best_of_all = int(np.argmax(score))
    i, j = best_of_all // n, best_of_all % n
    for t in range(steps - 1, -1, -1):
        motion[t] = SHIFTS[i], SPREADS[j]
        i, j = came[t, i, j]
    return motion


@njit(cache=True)
def _pairs(lines, motion, centre):  # type: ignore[no-untyped-def]
    """Frame and place of both lines, deviation and cost of every possible link."""
    start, stop, values = [], [], []
    for t in range(lines.shape[0] - 1):
        for i in range(lines.shape[1]):
            if not lines[t, i, 2] > 0:
                break
            angle = lines[t, i, 0]
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
def _from(start, frames, places):  # type: ignore[no-untyped-def]
    """First link that starts in each line, and the next one of each link; −1 for none."""
    head, following = np.full((frames, places), -1), np.full(start.shape[0], -1)
    for k in range(start.shape[0] - 1, -1, -1):
        following[k] = head[start[k, 0], start[k, 1]]
        head[start[k, 0], start[k, 1]] = k
    return head, following


@njit(cache=True)
def _joint(deviation, cost, turn, k, q):  # type: ignore[no-untyped-def]
    """Cost of link q after link k."""
    sd = max(turn[k], turn[q])
    return cost[q] + 0.5 * min(((deviation[q] - AGAIN * deviation[k]) / sd) ** 2, SUDDEN)


@njit(cache=True)
def _least(stop, deviation, cost, turn, head, following):  # type: ignore[no-untyped-def]
    least_out, least_in = np.full(cost.size, np.inf), np.full(cost.size, np.inf)
    for k in range(cost.size):
        q = head[stop[k, 0], stop[k, 1]]
        while q >= 0:
            value = _joint(deviation, cost, turn, k, q)
            least_out[k], least_in[q] = min(least_out[k], value), min(least_in[q], value)
            q = following[q]
    return least_out, least_in


def link(lines: Values, centre: float) -> Links:
    """All links between lines of frames up to ``SKIP`` apart; parameters as in :func:`common_motion`."""
    start, stop, values = _pairs(lines, common_motion(lines, centre), centre)
    first, last = (np.array(x, np.int64).reshape(-1, 2) for x in (start, stop))
    deviation, cost, turn = np.array(values, float).reshape(-1, 3).T.copy()
    head, following = _from(first, *lines.shape[:2])
    return Links(first, last, deviation, cost, turn, *_least(last, deviation, cost, turn, head, following))


@njit(cache=True)
def _chains(start, stop, deviation, cost, turn, least_out, least_in, allowed, first, last, frames, places):  # type: ignore[no-untyped-def]
    """Least cost up to each link and from each link on, and the link before; Viterbi in both directions."""
    head, following = _from(start, frames, places)
    ahead, back = np.full(cost.size, np.inf), np.full(cost.size, np.inf)
    came = np.full(cost.size, -1)
    for k in range(cost.size):
        if allowed[k] and start[k, 0] <= first:
            ahead[k] = min(ahead[k], END * start[k, 0] + cost[k])
        q = head[stop[k, 0], stop[k, 1]] if ahead[k] < np.inf else -1
        while q >= 0:
            both = _joint(deviation, cost, turn, k, q)
            value = ahead[k] + both - (1 - ABSOLUTE) * 0.5 * (least_out[k] + least_in[q])
            if allowed[q] and value < ahead[q]:
                ahead[q], came[q] = value, k
            q = following[q]
    for k in range(cost.size - 1, -1, -1):
        if allowed[k] and stop[k, 0] >= last:
            back[k] = END * (frames - 1 - stop[k, 0])
        q = head[stop[k, 0], stop[k, 1]] if allowed[k] else -1
        while q >= 0:
            both = _joint(deviation, cost, turn, k, q)
            value = back[q] + both - (1 - ABSOLUTE) * 0.5 * (least_out[k] + least_in[q])
            back[k] = min(back[k], value)
            q = following[q]
    return ahead, back, came


@njit(cache=True)
def _margins(start, stop, total, lines, angle, seen):  # type: ignore[no-untyped-def]
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


def _through(links: Links, marks: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which links pass by no mark: in its frame they have the marked line, and none skips it."""
    allowed = np.ones(links.cost.size, np.bool_)
    for t, i in marks:
        for end in (links.start, links.stop):
            allowed &= (end[:, 0] != t) | (end[:, 1] == i)
        allowed &= (links.start[:, 0] >= t) | (links.stop[:, 0] <= t)
    return allowed


def _one_after_the_other(early: Chain, late: Chain, before: NDArray[np.bool_], after: NDArray[np.bool_]) -> Chain:
    """One chain in the frames before, another in those after; nothing between."""

    def either(one: Values, other: Values) -> Values:
        return np.select([before, after], [one, other], np.nan)

    return Chain(
        either(early.angle, late.angle),
        either(early.offset, late.offset),
        (early.seen & before) | (late.seen & after),
        either(early.margin, late.margin),
    )


def chain(lines: Values, links: Links, marks: NDArray[np.int64]) -> Chain:
    """The whisker that goes through marked lines; lost from one mark to the next where no links join them.

    Parameters
    ----------
    lines : (T, n, 3) array
        As in :func:`common_motion`.
    links : Links
        Of these lines.
    marks : (n, 2) array of int
        Frame and place of the lines marked, sorted by the frames.
    """
    frames = np.arange(lines.shape[0])
    ahead, back, came = _chains(*links, _through(links, marks), marks[0, 0], marks[-1, 0], *lines.shape[:2])
    reached = np.isin(marks[:, 0], links.stop[np.isfinite(ahead), 0])
    reached[0] = True
    if not reached.all():
        n = int(np.argmin(reached))
        early, late = chain(lines, links, marks[:n]), chain(lines, links, marks[n:])
        return _one_after_the_other(early, late, frames <= marks[n - 1, 0], frames >= marks[n, 0])
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
