"""Stretches of frames in which it is plain which line is which, and the phase of the pad that they share."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.pad.common_swing import REACH, Pairs
from vibrissa.video.link.pad.phase import Along, gains_at, quartered

WORST = 9.0  # cost of a plain link at most
MARGIN = 2.5  # by which every other link of either line costs more
SWING_ERROR = 0.7  # standard deviation of the pad's swing in a frame [°]
LEAST_WEIGHT = 1e-3  # of a line for its tracklet's place
OWN = 1.5  # standard deviation of a whisker about the pad's phase [°]


def expected(frame: Integers, pairs: Pairs, swing: Array, across: Array) -> Array:
    """Swing of the pad between the frames of each pair [°].

    Parameters
    ----------
    frame : (S,) array
        Frame of each segment.
    pairs : Pairs
        Lines.
    swing : (frames − 1, 2) array
        Of :func:`vibrissa.video.link.pad.common_swing.common_swing`.
    across : (S,) array
        Place of each line at the middle radius [°].

    Returns
    -------
    (N,) array
        Of each pair.
    """
    here, gap = frame[pairs.first], frame[pairs.second] - frame[pairs.first]
    at = across[pairs.first].copy()
    for g in range(REACH):
        step = np.minimum(here + g, len(swing) - 1)
        at += np.where(g < gap, swing[step, 0] + swing[step, 1] * at, 0.0)
    return np.asarray(at - across[pairs.first])


def _least_two(key: Integers, other: Integers, cost: Array, count: int, reach: Array | None) -> tuple[Array, Array]:
    """Least cost of each key, and that of the next line that is not, perhaps, another piece of the first one."""
    least, second = np.full((2, count), np.inf)
    nearest = np.zeros(count, np.int64)
    order = np.lexsort((cost, key))
    first = order[np.flatnonzero(np.diff(key[order], prepend=-1))]
    least[key[first]], nearest[key[first]] = cost[first], other[first]
    best = nearest[key]
    more = other != best
    if reach is not None:
        more &= np.minimum(reach[other, 1], reach[best, 1]) > np.maximum(reach[other, 0], reach[best, 0])
    np.minimum.at(second, key[more], cost[more])
    return least, second


def tracklets(frame: Integers, pairs: Pairs, cost: Array, usable: Mask, reach: Array | None = None) -> Integers:
    """Number of the tracklet of each segment (S,), −1 where it has none: chains of links without a near alternative.

    Parameters
    ----------
    frame : (S,) array
        Frame of each segment.
    pairs : Pairs
        Lines that may be one whisker.
    cost : (N,) array
        Of each pair.
    usable : (S,) array of bool
        Segments that can be whiskers.
    reach : (S, 2) array, optional
        First and last distance of each from the pad. If given, a line that begins beyond the end of another one is no
        alternative to it: the two may be pieces of one.

    Returns
    -------
    (S,) array of int
        The longest tracklets are not sorted in any way.
    """
    count = frame.size
    following, before = np.full((2, count), -1)
    gap = frame[pairs.second] - frame[pairs.first]
    for g in range(1, REACH + 1):
        free = (gap == g) & (following[pairs.first] < 0) & (before[pairs.second] < 0)
        i, j, c = pairs.first[free], pairs.second[free], cost[free]
        (out, out2), (into, into2) = _least_two(i, j, c, count, reach), _least_two(j, i, c, count, reach)
        plain = (c < WORST) & (c <= out[i]) & (c <= into[j]) & (out2[i] > c + MARGIN) & (into2[j] > c + MARGIN)
        following[i[plain]], before[j[plain]] = j[plain], i[plain]
    name = np.full(count, -1)
    for number, s in enumerate(np.flatnonzero(usable & (before < 0))):
        while s >= 0:
            name[s] = number
            s = following[s]
    return name


def phase_of_tracklets(
    frames: int, frame: Integers, name: Integers, across: Array, swing: Array, along: Along, least: int, weight: Array
) -> Array:
    """Phase A of the pad in each frame, so that lines of a tracklet at m are at m + A (1 + β m) + A' λ m.

    Parameters
    ----------
    frames : int
        Frames of the movie.
    frame, name, across : (S,) arrays
        Frame and tracklet of each segment, its place at the middle radius [°].
    swing : (frames − 1, 2) array
        Swing of the pad from each frame to the next.
    along : Along
        Growth β of the gain and λ of the lead along the pad; A' is the quarter of the phase.
    least : int
        Frames of the tracklets that count.
    weight : (S,) array
        How much each segment says of the phase, 0 to 1.

    Returns
    -------
    (frames, 2) array
        Phase, mean 0, and its quarter [°].
    """
    phase, place = _phase_and_places(frames, frame, name, across, swing, along, least, weight)
    lead = gains_at(place, along)[:, 1][name] * quartered(phase, along)[frame, 1]
    across = across - np.where(name >= 0, lead, 0.0)
    phase, _ = _phase_and_places(frames, frame, name, across, swing, along, least, weight)
    return quartered(phase, along)


def _phase_and_places(
    frames: int, frame: Integers, name: Integers, across: Array, swing: Array, along: Along, least: int, weight: Array
) -> tuple[Array, Array]:
    """Phase (frames,) as if no whisker lagged, and places (tracklets,), 0 of tracklets that do not count."""
    sizes = np.bincount(name[name >= 0], minlength=1)
    use = np.flatnonzero((name >= 0) & (sizes[np.maximum(name, 0)] >= least))
    place = np.zeros(sizes.size)
    kept = np.unique(name[use])
    column = frames + np.searchsorted(kept, name[use])
    n, steps = use.size, np.arange(frames - 1)
    rows = np.concatenate([np.arange(n)] * 2 + [n + steps] * 2 + [[n + frames - 1]])
    cols = np.concatenate([frame[use], column, steps, steps + 1, [0]])
    w, v = np.sqrt(np.maximum(weight[use], LEAST_WEIGHT)) / OWN, 1 / SWING_ERROR
    middles = np.bincount(column - frames, across[use], minlength=kept.size) / np.maximum(
        np.bincount(column - frames, minlength=kept.size), 1
    )
    gains = gains_at(middles, along)[:, 0]
    gain = gains[column - frames]
    data = np.concatenate([gain * w, w, np.full(frames - 1, -v), np.full(frames - 1, v), [1e-3]])
    middle = across[use].mean() if n else 0.0
    right = np.concatenate([(across[use] - middle) * w, swing[:, 0] * v, [0.0]])
    left = coo_array((data, (rows, cols)), shape=(n + frames, frames + kept.size)).tocsr()
    found = np.atleast_1d(spsolve((left.T @ left).tocsc(), left.T @ right))
    phase = found[:frames]
    place[kept] = found[frames:] + phase.mean() * gains + middle
    return phase - phase.mean(), place


def smoothed_phase(measured: Array, weight: Array, swing: Array) -> Array:
    """Phase from measurements in each frame and the swing from frame to frame.

    Parameters
    ----------
    measured, weight : (T,) arrays
        Phase [°] and its inverse variance; 0 where there is none.
    swing : (T − 1,) array
        Expected change to the next frame [°].

    Returns
    -------
    (T,) array
        Phase [°].
    """
    v = 1 / SWING_ERROR**2
    diagonal = weight + 1e-6
    diagonal[1:] += v
    diagonal[:-1] += v
    right = weight * measured
    right[1:] += v * swing
    right[:-1] -= v * swing
    bands = np.stack([np.concatenate([[0.0], np.full(measured.size - 1, -v)]), diagonal])
    return np.asarray(solveh_banded(bands[-measured.size :], right))  # a single frame has no neighbour
