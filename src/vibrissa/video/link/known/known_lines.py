"""Lines whose whisker a person knows, and the lines about them whose names are wrong with theirs.

Names go wrong for many frames at once: two whiskers are exchanged from one meeting to the next, or a name stays on a
neighbour while the whisker's own lines have none. Where a person says whose one line is, the names about it are put
right as far as that is likelier than as they were; beyond, nothing changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.chains.chain_kernel import LEAVES, TAILS, near
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.whisker_models import GATE, Model, deviations
from vibrissa.video.link.identities import OVERLAP
from vibrissa.video.link.known.tracks import far, longest, track

TRUST = 0.2  # weight of the log odds that a name is right: those of neighbouring lines are wrong together
SURE = 0.02, 0.98  # probabilities within which they count
KEEP = 0.92  # correlation of a deviation from frame to frame at most
ABSENT = 25.0  # negative logarithm of the chance that a whisker has no line in a frame though one goes on
KNOWN = 1e6  # weight of what is known
PLAIN, LIKELY, UNLIKELY = 0.97, 0.75, 0.55  # probability of a name that follows from a known line, see _sureness
ALIKE = 0.7  # length of a line over that of the known one, from which on it is as long
JUMPS = 4.0  # negative log likelihood of a step from which on it is a jump


class LineNames(NamedTuple):
    """Names of lines.

    Attributes
    ----------
    whisker, other : (S,) arrays of int
        Whisker of each segment, and another one that runs along the same line; −1 for none, −2 for one of another pad.
    sure : (S,) array
        Probability that the segment is that whisker's.
    """

    whisker: Integers
    other: Integers
    sure: Array


class _Pair(NamedTuple):
    """Lines of the whisker as named, and of the track that the known lines are on, in each frame; −1 for none.

    ``rival`` is the whisker whose name the track has, −1 if none; ``model`` gives place, swing, spread and correlation.
    """

    own: Integers
    track: Integers
    whisker: int
    rival: int
    model: Model


def with_known(
    solution: Solution, names: LineNames, lines: Integers, whisker: int, known: Mapping[int, int]
) -> LineNames:
    """Names of a pad after some lines have become known as a whisker's.

    Parameters
    ----------
    solution : Solution
        Of the pad; it is not changed.
    names : LineNames
        Before, by the whiskers of the pad.
    lines : (n,) array of int
        Segments.
    whisker : int
        Whose they are.
    known : mapping
        Whisker of lines that were known before, −1 for nobody's, −2 for one of another pad.

    Returns
    -------
    LineNames
        The lines have the whisker's name. If they had another's, the two are exchanged about them as far as that
        explains the lines better; if they had none, the lines that plainly go on from them have the name, too.
    """
    known = {**known, **dict.fromkeys(lines.tolist(), whisker)}
    before = names.whisker[lines]
    for rival in np.setdiff1d(before, [whisker, -2]):
        names = _corrected(solution, names, lines[before == rival], whisker, int(rival), known)
    return _certain(solution, names, lines, whisker)


def _certain(solution: Solution, names: LineNames, lines: Integers, whisker: int) -> LineNames:
    """Known lines are surely the whisker's, those of their plain stretch probably, and others beside them are not."""
    name, other, sure = names.whisker.copy(), names.other.copy(), names.sure.copy()
    reach = solution.lines.reach
    rivals = np.setdiff1d(np.flatnonzero(name == whisker), lines)
    one, two = np.nonzero(solution.frame[rivals, None] == solution.frame[lines])
    (a, b), (c, d) = reach[rivals[one]].T, reach[lines[two]].T
    shared = np.minimum(b, d) - np.maximum(a, c)
    name[rivals[one[shared > OVERLAP * np.minimum(b - a, d - c)]]] = -1
    name[lines], other[lines], sure[lines] = whisker, -1, 1.0
    plain = np.setdiff1d(solution.tracklet[lines], [-1])
    stretch = (name == whisker) & np.isin(solution.tracklet, plain)
    sure[stretch] = np.maximum(sure[stretch], PLAIN)
    return LineNames(name, other, np.where(name == -1, 0.0, sure))


def _corrected(
    solution: Solution, names: LineNames, lines: Integers, whisker: int, rival: int, known: Mapping[int, int]
) -> LineNames:
    """Names exchanged about some lines that had a rival's name or none."""
    pair, wrong = _pair(solution, names, lines, whisker, rival), np.zeros(solution.frames, np.bool_)
    wrong[solution.frame[lines]] = True
    for way in (1, -1):
        wrong[_wrong_frames(solution, names, pair, lines, known, way)] = True
    name, other, sure = names.whisker.copy(), names.other.copy(), names.sure.copy()
    now = wrong[solution.frame]
    mine, theirs = now & (names.whisker == whisker), now & (names.whisker == rival)
    if rival < 0:
        theirs = np.isin(np.arange(now.size), pair.track[wrong])
        name[mine] = -1
    else:
        other[now & (names.other == whisker)], other[now & (names.other == rival)] = rival, whisker
        name[mine], sure[mine] = np.where(_can_be(solution, rival)[mine], rival, -1), LIKELY
    name[theirs], sure[theirs] = whisker, _sureness(solution, pair, lines)[theirs]
    for line, who in known.items():
        name[line] = who
    return LineNames(name, other, sure)


def _sureness(solution: Solution, pair: _Pair, lines: Integers) -> Array:
    """Probability that lines about known ones have their name (S,).

    It is high for those that go on from them without an alternative, likely for those that are as long and, where they
    had no name, do not jump; the others are probably not seen by a profile.
    """
    reach = np.ptp(solution.lines.reach, axis=1)
    likely = reach >= ALIKE * reach[lines].max()
    if pair.rival < 0:
        step = _steps(solution, pair.model, _last(np.append(-1, pair.track)), pair.track, 1)
        likely &= (step < JUMPS)[solution.frame]
    plain = np.isin(solution.tracklet, np.setdiff1d(solution.tracklet[lines], [-1]))
    return np.where(plain, PLAIN, np.where(likely, LIKELY, UNLIKELY))


def _can_be(solution: Solution, whisker: int) -> Mask:
    """Lines that can be a whisker's by their place."""
    model, lines = solution.labels[whisker].model, solution.lines
    x = deviations(model, lines.place, solution.phase, solution.frame)
    out = np.zeros(len(x), np.bool_)
    out[near(x, lines.covariance, model.spread, GATE)[0]] = True
    return out


def _pair(solution: Solution, names: LineNames, lines: Integers, whisker: int, rival: int) -> _Pair:
    """Lines of a whisker, and of the track of some lines, in every frame."""
    model = solution.labels[whisker].model
    model = model._replace(keep=min(model.keep, KEEP))
    own = longest(solution, np.flatnonzero(names.whisker == whisker))
    if rival < 0:
        free = solution.who[names.whisker[solution.who] == -1]
        return _Pair(own, track(solution, free, lines, model), whisker, rival, model)
    theirs = solution.labels[rival].model
    mean = {name: (getattr(model, name) + getattr(theirs, name)) / 2 for name in ("place", "gain", "spread")}
    course = longest(solution, np.flatnonzero(names.whisker == rival))
    here = longest(solution, lines)
    return _Pair(own, np.where(here >= 0, here, course), whisker, rival, model._replace(**mean))


def _wrong_frames(
    solution: Solution, names: LineNames, pair: _Pair, lines: Integers, known: Mapping[int, int], way: int
) -> Integers:
    """Frames after the known lines (``way`` 1) or before them (−1) in which the names are probably wrong as theirs."""
    at = solution.frame[lines]
    begin = int(at.max() if way > 0 else at.min())
    walk = np.arange(begin + way, solution.frames if way > 0 else -1, way)
    own, course = pair.own[walk], pair.track[walk]
    own_before, before = (_last(np.append(one[begin], one[walk])) for one in (pair.own, pair.track))

    def step(one: Integers, other: Integers) -> Array:
        return _steps(solution, pair.model, one, other, way)

    as_named, along = step(own_before, own), step(before, course)
    each, back = TRUST * _log_odds(names, own), step(before, own) - as_named
    if pair.rival >= 0:
        each += TRUST * _log_odds(names, course)
        back += step(own_before, course) - along
    else:
        each += along - as_named + ABSENT * ((course < 0).astype(float) - (own < 0))
    own_known, course_known = (_as_known(known, pair.whisker, one) for one in (own, course))
    each -= KNOWN * ((course_known > 0) | (own_known < 0))
    stops = np.flatnonzero((own_known > 0) | (course_known < 0))[:1].tolist()
    if pair.rival < 0:
        stops.append(int(np.flatnonzero(course >= 0).max(initial=-1)) + 1)
    cost = np.append(0.0, np.cumsum(each)) + np.append(back, 0.0)
    return walk[: int(np.argmin(cost[: min(stops, default=walk.size) + 1]))]


def _as_known(known: Mapping[int, int], whisker: int, lines: Integers) -> Integers:
    """Whether lines are known as a whisker's, 1, or as not that whisker's, −1; else 0."""
    said = {line: 1 if who == whisker else -1 for line, who in known.items()}
    return np.array([said.get(line, 0) for line in lines.tolist()], np.int64)


def _last(lines: Integers) -> Integers:
    """The last line before each but the first, −1 for none."""
    seen = np.maximum.accumulate(np.where(lines >= 0, np.arange(lines.size), -1))
    return np.where(seen >= 0, lines[seen], -1)[:-1]


def _log_odds(names: LineNames, lines: Integers) -> Array:
    """Log odds that lines have the right name, 0 for no line."""
    sure = np.clip(names.sure[lines], *SURE)
    return np.where(lines >= 0, np.log(sure / (1 - sure)), 0.0)


def _steps(solution: Solution, model: Model, one: Integers, other: Integers, way: int) -> Array:
    """Negative log likelihoods of steps from lines to others, 0 where either is none."""
    frame, some = solution.frame, (one >= 0) & (other >= 0)
    early, late = (one[some], other[some]) if way > 0 else (other[some], one[some])
    after, before = solution.after[early], solution.before[late]
    left = ((after >= 0) & (frame[after] <= frame[late])).astype(float)
    left += (before >= 0) & (frame[before] >= frame[early])
    cost = np.zeros(one.size)
    cost[some] = 0.5 * (TAILS + 3) * np.log1p(_strayed(solution, model, early, late) / TAILS)
    cost[some] += LEAVES * np.where(after == late, 0.0, left)
    return cost


def _strayed(solution: Solution, model: Model, early: Integers, late: Integers) -> Array:
    """Squared distances of lines from where earlier ones would have gone, in standard deviations."""
    lines, frame = solution.lines, solution.frame
    x, y = (deviations(model, lines.place[s], solution.phase[s], frame[s]) for s in (early, late))
    kept = model.keep ** (frame[late] - frame[early])
    square = kept[:, None, None] ** 2
    spread = model.spread * (1 - square) + lines.covariance[early] * square + lines.covariance[late]
    return far(y - kept[:, None] * x, spread)
