"""Tracklets joined over gaps: a line that ends goes on as the one that comes next where the pad has carried it.

How far the pad carries lines from frame to frame, a + bφ at each of the three radii, is read from the plain links
themselves, so whatever the whole pad does (it whisks, opens, or the head moves) needs no model. All gaps are closed at
once (matching of least cost).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.chain_kernel import TAILS
from vibrissa.video.link.chains.whisker_models import prior_spread
from vibrissa.video.link.pad.pads import Lines

WIDTH = 30.0  # place across the pad that counts as 1 [°]
LEAST = 4  # lines of a tracklet that is joined
ENDS = 5  # lines that give its place at either end
STEP = 0.8  # standard deviation of a whisker's own step [°]
TRUST = 1.0, 4.0  # precision of the pad's swing as a prior, in the middle, and of the middle's for both ends [°⁻²]
GAP = 200  # frames that a whisker may be gone
GONE = 0.01  # cost of each
STRAY = 1.8  # variance of what whiskers stray in a long gap, over that of a deviation
KEEP = 0.94  # correlation of where they strayed from frame to frame
STRENGTH = 0.3  # standard deviation of the logarithm of a tracklet's strength
NEW = 12.0  # negative log density of a line that is another whisker's
BIG = 1000.0  # keeps all costs positive


class Ends(NamedTuple):
    """Tracklets at their first and their last line.

    Attributes
    ----------
    number, first, last : (n,) arrays of int
        Tracklet, first and last frame.
    across, strength : (n,) arrays
        Mean place in units of ``WIDTH``, and strength.
    place, error : (2, n, 3) and (2, n, 3, 3) arrays
        Place less what the pad has carried it, and its covariance.
    """

    number: Integers
    first: Integers
    last: Integers
    across: Array
    strength: Array
    place: Array
    error: Array


def carried(frames: int, frame: Integers, name: Integers, lines: Lines, swing: Array, lever: Array) -> Array:
    """How far the pad has carried lines since the first frame, at the three radii.

    Parameters
    ----------
    frames : int
        Frames of the movie.
    frame, name : (S,) arrays of int
        Frame and tracklet of each segment.
    lines : Lines
        All lines.
    swing : (frames − 1, 2) array
        Swing of the pad from each frame to the next.
    lever : (3,) array
        Displacement at the three radii over that at the middle one.

    Returns
    -------
    (frames, 2, 3) array
        a [°], and b ``WIDTH``, of a + bφ.
    """
    order = np.lexsort((frame, name))
    i, j = order[:-1], order[1:]
    plain = (name[i] >= 0) & (name[i] == name[j]) & (frame[j] - frame[i] == 1)
    i, j = i[plain], j[plain]
    terms = np.stack([np.ones(i.size), lines.place[i, 1] / WIDTH], axis=1)
    out = np.zeros((frames - 1, 2, 3))
    for m in (1, 0, 2):
        expected = swing * [1.0, WIDTH] if m == 1 else out[..., 1] * lever[m]
        variance = (lines.covariance[i] + lines.covariance[j])[:, m, m] + STEP**2
        step = lines.place[j, m] - lines.place[i, m]
        out[..., m] = _common(frame[i], terms, step, variance, expected, TRUST[int(m != 1)])
    return np.concatenate([np.zeros((1, 2, 3)), np.cumsum(out, axis=0)])


def _common(frame: Integers, terms: Array, step: Array, variance: Array, expected: Array, trust: float) -> Array:
    """Motion (frames − 1, 2) common to the steps of each frame, by iterated least squares."""
    prior = trust * np.eye(2)
    motion: Array = expected.copy()
    for _ in range(4):
        off = step - (motion[frame] * terms).sum(axis=1)
        weight = 1 / (1 + off**2 / variance / 4) / variance
        left, right = np.zeros((len(expected), 2, 2)), np.zeros((len(expected), 2))
        np.add.at(left, frame, weight[:, None, None] * terms[:, :, None] * terms[:, None])
        np.add.at(right, frame, (weight * step)[:, None] * terms)
        motion = np.asarray(np.linalg.solve(left + prior, (right + expected @ prior)[..., None])[..., 0], np.float64)
    return motion


def _ends(frame: Integers, name: Integers, lines: Lines, motion: Array) -> Ends:
    """Both ends of all tracklets that are long enough."""
    order = np.lexsort((frame, name))
    order = order[name[order] >= 0]
    parts = [p for p in np.split(order, np.flatnonzero(np.diff(name[order])) + 1) if p.size >= LEAST]
    across = np.array([lines.place[p, 1].mean() for p in parts]) / WIDTH
    place, error = np.zeros((2, len(parts), 3)), np.zeros((2, len(parts), 3, 3))
    for n, part in enumerate(parts):
        for side, few in enumerate((part[:ENDS], part[-ENDS:])):
            rest = lines.place[few] - motion[frame[few], 0] - across[n] * motion[frame[few], 1]
            weight = np.linalg.inv(lines.covariance[few])
            error[side, n] = np.linalg.inv(weight.sum(axis=0))
            place[side, n] = error[side, n] @ np.einsum("nij,nj->i", weight, rest)
    first, last = (np.array([frame[p[at]] for p in parts], np.int64) for at in (0, -1))
    strength = np.array([np.median(lines.look[p, 0]) for p in parts])
    return Ends(np.array([name[p[0]] for p in parts], np.int64), first, last, across, strength, place, error)


def _costs(ends: Ends, motion: Array, lever: Array) -> tuple[Integers, Integers, Array]:
    """Tracklets that may follow each other, and at what cost; below 0 where that is likelier than a new whisker."""
    order = np.argsort(ends.first, kind="stable")
    spread = 2 * STRAY * prior_spread(lever)
    found = []
    for u in range(ends.first.size):
        low, high = np.searchsorted(ends.first[order], [ends.last[u] + 1, ends.last[u] + GAP + 1])
        v = order[low:high]
        gap = ends.first[v] - ends.last[u]
        # either place has been taken back by its own gain; both count with their mean one
        half = (ends.across[v] - ends.across[u])[:, None] / 2
        off = ends.place[0, v] - ends.place[1, u] + half * (motion[ends.first[v], 1] + motion[ends.last[u], 1])
        cov = spread * (1 - KEEP**gap)[:, None, None] + ends.error[0, v] + ends.error[1, u]
        far = np.einsum("ni,nij,nj->n", off, np.linalg.inv(cov), off)
        density = -0.5 * np.log(np.linalg.det(2 * np.pi * cov)) - 0.5 * (TAILS + 3) * np.log1p(far / TAILS)
        density -= 2.5 * np.log1p(((ends.strength[v] - ends.strength[u]) / STRENGTH) ** 2 / 4)
        cost = GONE * (gap - 1) - density - NEW
        found.append(np.stack([np.full(v.size, u), v, cost])[:, cost < 0])
    table = np.concatenate([*found, np.zeros((3, 0))], axis=1)
    return table[0].astype(np.int64), table[1].astype(np.int64), table[2]


def joined(frame: Integers, name: Integers, lines: Lines, motion: Array, lever: Array) -> Integers:
    """Tracklets joined over gaps.

    Parameters
    ----------
    frame, name : (S,) arrays of int
        Frame and tracklet of each segment; −1 where it has none.
    lines : Lines
        All lines.
    motion : (frames, 2, 3) array
        Of :func:`carried`.
    lever : (3,) array
        Displacement at the three radii over that at the middle one.

    Returns
    -------
    (S,) array of int
        Number of the joined tracklet of each segment, −1 where it has none.
    """
    ends = _ends(frame, name, lines, motion)
    count = ends.first.size
    if not count:
        return name
    u, v, cost = _costs(ends, motion, lever)
    each = np.arange(count)
    value, place = np.append(cost, np.zeros(count)) + BIG, (np.append(u, each), np.append(v, count + each))
    rows, columns = min_weight_full_bipartite_matching(coo_array((value, place), shape=(count, 2 * count)).tocsr())
    number = np.arange(int(name.max()) + 1)
    # in the order of time, so that each takes the number that the one before it has by then
    for k in rows[np.argsort(ends.first[rows], kind="stable")]:
        if columns[k] < count:
            number[ends.number[columns[k]]] = number[ends.number[k]]
    _, dense = np.unique(number, return_inverse=True)
    return np.where(name >= 0, dense[np.maximum(name, 0)], -1)
