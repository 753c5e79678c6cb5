"""How far the whole pad swings from each frame to the next, δ = a + b φ, before it is known who is who.

Any two lines of successive frames that may be one whisker give a swing. The swing of the pad is the one on which
most of them agree, over the whole movie (Viterbi), as a pad may swing further in a frame than whiskers are apart.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers
from vibrissa.loops import njit
from vibrissa.video.link.pad.pads import Lines

Values = NDArray[np.float64]
Places = NDArray[np.int64]

SHIFTS = np.arange(-24.0, 24.25, 0.75)  # a: swing between two frames in the middle of the pad [°]
SPREADS = np.arange(-0.2, 0.25, 0.1)  # b: its growth along the pad
LONG = 1.0  # length, over half the radii's distance, from which on a line says all it can of the swing
CHANGE = np.array([3.5, 0.08])  # standard deviations of the changes of a [°] and b between frames
KEEP = 0.8  # share of the swing that is expected again in the next frame
USUAL = 0.12  # standard deviation of b
STEP = np.array([0.8, 0.6, 1.0])  # standard deviations of each whisker's own change in a frame, at the three radii [°]
OWN = 1.2  # standard deviation of its own swing in a frame [°]
STRENGTH = 0.4  # standard deviation of the change of the logarithm of its strength
REACH = 3  # frames over which two lines may be linked
UNLIKE = 14.0  # squared distance above which two lines are not one whisker, whatever the swing
AGREE = 2.0  # weight of a whisker's agreement
GRID, POLISH = np.array([0.75, 0.05]), 4  # standard deviations of what the grid leaves open; rounds
KNOWN, CALMEST = 100, 0.3  # plain links that show how much whiskers change on their own; the least share of the usual


class Pairs(NamedTuple):
    """Lines up to ``REACH`` frames apart that may be one whisker.

    Attributes
    ----------
    first, second : (N,) arrays of int
        Segments.
    swing, sd : (N,) arrays
        Swing that would bring one on the other, and its standard deviation [°].
    unlike : (N,) array
        Squared distance that is left then.
    weight : (N,) array
        How much it says of the pad, 0 to 1; see :func:`weight_of`.
    """

    first: Integers
    second: Integers
    swing: Values
    sd: Values
    unlike: Values
    weight: Values


def weight_of(reach: Array) -> Array:
    """How much lines (S,) say of the swing, by their ``reach`` (S, 2): hairs say little."""
    return np.asarray(np.clip((reach[:, 1] - reach[:, 0]) / LONG, 0.0, 1.0) ** 2)


def lever(inner: float, centre: float, outer: float, hidden: float) -> Array:
    """Displacement of a whisker at the three radii, over that at the middle one, when it turns about its base.

    Parameters
    ----------
    inner, centre, outer : float
        Radii [px].
    hidden : float
        Distance of the bases below the inner one [px].

    Returns
    -------
    (3,) array
        Without unit; 1 in the middle.
    """
    turn = 1 - (inner - hidden) / np.array([inner, centre, outer])
    return np.asarray(turn / turn[1])


@njit(cache=True)
def _inverse(m: Values) -> Values:
    """Inverse of a symmetric 3 × 3 matrix."""
    out = np.empty((3, 3))
    out[0, 0] = m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2]
    out[0, 1] = m[0, 2] * m[1, 2] - m[0, 1] * m[2, 2]
    out[0, 2] = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
    out[1, 1] = m[0, 0] * m[2, 2] - m[0, 2] * m[0, 2]
    out[1, 2] = m[0, 1] * m[0, 2] - m[0, 0] * m[1, 2]
    out[2, 2] = m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]
    det = m[0, 0] * out[0, 0] + m[0, 1] * out[0, 1] + m[0, 2] * out[0, 2]
    for i in range(3):
        for j in range(i, 3):
            out[i, j] /= det
            out[j, i] = out[i, j]
    return out


@njit(cache=True)
def _pairs(
    bounds: Places, who: Places, place: Values, cov: Values, strength: Values, gain: Values, calm: float
) -> list[tuple[int, int, float, float, float]]:
    """All pairs of lines of a pad; ``who`` are its segments, those of frame t ``bounds[t]`` to ``bounds[t + 1]``."""
    out = []
    for t in range(bounds.size - 2):
        for g in range(1, min(REACH, bounds.size - 2 - t) + 1):
            for i in who[bounds[t] : bounds[t + 1]]:
                for j in who[bounds[t + g] : bounds[t + g + 1]]:
                    delta = place[j] - place[i]
                    if abs(delta[1]) > SHIFTS[-1] * 1.3 * min(g, 2):
                        continue
                    c = cov[i] + cov[j]
                    for m in range(3):
                        c[m, m] += g * (calm * STEP[m]) ** 2
                    w = _inverse(c)
                    # the distance is a parabola of the swing: its bottom, and its width
                    wg = w @ gain
                    steep = gain @ wg
                    best = (delta @ wg) / steep
                    rest = delta - best * gain
                    unlike = rest @ w @ rest + min(((strength[j] - strength[i]) / STRENGTH) ** 2, 6.0)
                    if unlike < UNLIKE:
                        out.append(
                            (i, j, float(best), float(np.sqrt(1 / steep + g * (calm * OWN) ** 2)), float(unlike))
                        )
    return out


def pairs_of(frames: int, frame: Integers, who: Integers, lines: Lines, gain: Array, calm: float) -> Pairs:
    """Pairs of lines of a pad that may be one whisker.

    Parameters
    ----------
    frames : int
        Frames of the movie.
    frame : (S,) array
        Frame of each segment.
    lines : Lines
        Segments as lines of their pads.
    who : (N,) array of int
        Segments of the pad, by frames.
    gain : (3,) array
        Of :func:`lever`.
    calm : float
        Standard deviations of a whisker's own changes over the usual ones, see :func:`calmness`.

    Returns
    -------
    Pairs
        By frames.
    """
    bounds = np.searchsorted(frame[who], np.arange(frames + 1))
    found = _pairs(bounds, who, lines.place, lines.covariance, lines.look[:, 0].copy(), gain, calm)
    if not found:
        return Pairs(*np.zeros((2, 0), np.int64), *np.zeros((4, 0)))
    table = np.array(found)
    first, second = table[:, :2].astype(np.int64).T.copy()
    weight = weight_of(lines.reach)
    swing, sd, unlike = table[:, 2:].T.copy()
    return Pairs(first, second, swing, sd, unlike, np.minimum(weight[first], weight[second]))


def calmness(frame: Integers, pairs: Pairs, off: Array, name: Integers) -> float:
    """How little whiskers of a movie change on their own from frame to frame, over what is usual.

    Parameters
    ----------
    frame, name : (S,) arrays of int
        Frame and tracklet of each segment; −1 where it has none.
    pairs : Pairs
        Lines that may be one whisker.
    off : (N,) array
        Swing of each pair less that of the pad [°].

    Returns
    -------
    float
        1 where nothing is known, never more.
    """
    linked = (name[pairs.first] == name[pairs.second]) & (name[pairs.first] >= 0)
    linked &= frame[pairs.second] - frame[pairs.first] == 1
    if np.count_nonzero(linked) < KNOWN:
        return 1.0
    return float(np.clip(1.48 * np.median(np.abs(off[linked])) / OWN, CALMEST, 1.0))


@njit(cache=True)
def _agreements(
    frames: int, frame: Places, first: Places, second: Places, swing: Values, sd: Values, like: Values, across: Values
) -> Values:
    """How many lines are found again in the next frame after each swing (a, b); (frames − 1, a, b)."""
    out = np.zeros((frames - 1, SHIFTS.size, SPREADS.size))
    best = np.zeros((SHIFTS.size, SPREADS.size))
    for k in range(first.size):
        i = first[k]
        new = k == 0 or first[k - 1] != i
        if new:
            best[:] = 0.0
        if frame[second[k]] == frame[i] + 1:
            for n in range(SPREADS.size):
                middle = swing[k] - SPREADS[n] * across[i]
                for m in range(SHIFTS.size):
                    u = (SHIFTS[m] - middle) / sd[k]
                    if abs(u) < 3:
                        best[m, n] = max(best[m, n], like[k] * np.exp(-0.5 * u * u))
        if k + 1 == first.size or first[k + 1] != i:
            out[frame[i] if frame[i] < frames - 1 else frames - 2] += best
    return out


@njit(cache=True)
def _viterbi(agreements: Values) -> Values:
    """Swing (a, b) from each frame to the next: (frames − 1, 2)."""
    steps, m, n = agreements.shape
    score = np.zeros((m, n))
    came = np.zeros((steps, m, n, 2), np.int16)
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
                score[i, j] = best - 0.5 * (SPREADS[j] / USUAL) ** 2 + AGREE * agreements[t, i, j]
    motion = np.zeros((steps, 2))
    last = int(np.argmax(score))
    i, j = last // n, last % n
    for t in range(steps - 1, -1, -1):
        motion[t] = SHIFTS[i], SPREADS[j]
        i, j = came[t, i, j]
    return motion


def common_swing(frames: int, frame: Integers, pairs: Pairs, across: Array) -> Array:
    """Swing of the pad from each frame to the next.

    Parameters
    ----------
    frames : int
        Frames of the movie.
    frame : (S,) array
        Frame of each segment.
    pairs : Pairs
        Lines that may be one whisker.
    across : (S,) array
        Place of each line at the middle radius φ [°].

    Returns
    -------
    (frames − 1, 2) array
        a [°] and b of δ = a + b φ.
    """
    if frames < 2:
        return np.zeros((0, 2))
    order = np.argsort(pairs.first, kind="stable")
    first, second = pairs.first[order], pairs.second[order]
    swing, sd, like = pairs.swing[order], pairs.sd[order], _likeness(pairs)[order]
    table = _agreements(frames, frame, first, second, swing, sd, like, across)
    return _polished(np.asarray(_viterbi(table)), frame, pairs, across)


def _likeness(pairs: Pairs) -> Array:
    """How much each pair says of the pad if both lines are one whisker, (N,)."""
    return np.asarray(pairs.weight * np.exp(-0.5 * pairs.unlike))


def _polished(motion: Array, frame: Integers, pairs: Pairs, across: Array) -> Array:
    """Swing between the steps of the grid, by iterated least squares over the pairs that agree with it."""
    next_one = np.flatnonzero(frame[pairs.second] - frame[pairs.first] == 1)
    here = frame[pairs.first[next_one]]
    place, like = across[pairs.first[next_one]], _likeness(pairs)[next_one]
    terms = np.stack([np.ones(place.size), place], axis=1)
    prior = np.diag(1 / GRID**2)
    found = motion
    for _ in range(POLISH):
        off = pairs.swing[next_one] - (found[here] * terms).sum(axis=1)
        weight = like * np.exp(-0.5 * (off / pairs.sd[next_one]) ** 2) / pairs.sd[next_one] ** 2
        left, right = np.zeros((len(motion), 2, 2)), np.zeros((len(motion), 2))
        np.add.at(left, here, weight[:, None, None] * terms[:, :, None] * terms[:, None])
        np.add.at(right, here, (weight * pairs.swing[next_one])[:, None] * terms)
        found = np.asarray(np.linalg.solve(left + prior, (right + motion @ prior)[..., None])[..., 0], np.float64)
    return found
