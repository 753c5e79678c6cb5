"""Where the pads are: the points from which the lines of a movie radiate, and which lines are whose.

Not all lines are whiskers': a lamp and its cables may have most of them. The point is sought from several places where
bases crowd, and taken where most lines lead away from it. Two pads are known as two by the gaps between their lines, by
directions too far apart for one, or as a pad behind the other. Pixels are those of the size at which lines are linked.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.pad.base_ends import turned
from vibrissa.video.link.pad.pads import SHORTEST, Pad
from vibrissa.video.link.pad.pieces import Pieces, novelty

GAP = 10, 25  # degrees without lines, on both sides, by which two pads are known as two: at least, and surely
APART = 2.0  # the same over what is usual between the lines of a frame
BLUR = 2.5  # standard deviation by which the density of directions is smoothed [°]
BARE = 0.04  # share of the densest direction below which there are no lines
LEAST = 0.15  # share of all lines that a pad has at least
CROWD = 80.0  # px within which bases are together
CROWDS = 4  # such places from which the point is sought
MOST = 0.5  # share of the lines that one pad leaves that a second one behind it has at least
SPLITS = 6  # times that lines are divided between two pads
UNLIKE = -0.17  # cosine of the angle between the middles of two pads, at most: 100°
MORE = 1.2  # lines that radiate from another point than all lines say, over those from that one, at least
NEAR = 40.0  # px by which a line may pass the point from which lines radiate
PULL = 0.02  # weight that keeps this point near the bases where all lines are parallel
RADIAL = 0.5  # least share of a line's length by which it leads away from its pad


def find_pads(pieces: Pieces) -> tuple[list[Pad], Integers, Mask]:
    """Pads from which the lines radiate, the pad of each segment, and whether it runs from tip to base.

    Parameters
    ----------
    pieces : Pieces
        Segments.

    Returns
    -------
    list of Pad, (S,) array of int, (S,) array of bool
        One pad, or one on either side of the face; −1 for lines of none; see ``turned``.
    """
    back, _ = turned(pieces)
    base, tip, length = _chords(pieces, back)
    weight = np.where(length >= SHORTEST, length * novelty(pieces), 0.0)
    every, clear = _radiating(base, tip, weight)
    if not clear.any():
        clear = weight > 0
    member = np.full(length.size, -1)
    member[clear] = _groups(pieces.frame[clear], base[clear], tip[clear], weight[clear], every)
    if member.max() == 0:
        member[_half(base, tip, weight, member == 0, every)] = 1
    if member.max() == 0:
        member[_other_side(base, tip, weight, member == 0)] = 1
    pads = [_pad(base[mine], tip[mine], weight[mine]) for mine in (member == k for k in range(member.max() + 1))]
    pad, inward = _nearest(base, tip, weight, pads)
    return pads, pad, back ^ inward


def pads_of_lines(pieces: Pieces, pads: list[Pad]) -> tuple[Integers, Mask]:
    """Pad of each segment of pads that are known, and whether it runs from tip to base, as of :func:`find_pads`."""
    back, _ = turned(pieces)
    base, tip, length = _chords(pieces, back)
    weight = np.where(length >= SHORTEST, length * novelty(pieces), 0.0)
    pad, inward = _nearest(base, tip, weight, pads)
    return pad, back ^ inward


def _chords(pieces: Pieces, turned: Mask) -> tuple[Array, Array, Array]:
    """Base and tip end (S, 2), and length of the chord."""
    first, last = pieces.ends
    base, tip = np.where(turned[:, None], last, first), np.where(turned[:, None], first, last)
    return base, tip, np.hypot(*(tip - base).T)


def _pivot(base: Array, tip: Array, weight: Array) -> Array:
    """Point that lines pass closest to, by iterated least squares of distances."""
    way = (tip - base) / np.hypot(*(tip - base).T)[:, None]
    normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
    home = np.average(base, axis=0, weights=weight)
    point, scale = home, weight.sum()
    for _ in range(20):
        off = np.abs(((base - point) * normal).sum(axis=1))
        w = weight / np.maximum(off, 3.0)
        left = np.einsum("i,ij,ik->jk", w, normal, normal) + PULL * PULL * scale / 3.0 * np.eye(2)
        right = np.einsum("i,ij,ik,ik->j", w, normal, normal, base) + PULL * PULL * scale / 3.0 * home
        point = np.linalg.solve(left, right)
    return np.asarray(point)


def _groups(frame: Integers, base: Array, tip: Array, weight: Array, pivot: Array) -> Integers:
    """Pad of each line by its direction from the pivot: two where both gaps between them are wide; −1 for none."""
    middle = (base + tip) / 2 - pivot
    angle = np.rad2deg(np.arctan2(middle[:, 1], middle[:, 0])) % 360
    count = np.bincount(angle.astype(int) % 360, weight, 360)
    smooth = gaussian_filter1d(count, BLUR, mode="wrap")
    bare = smooth < BARE * smooth.max()
    if not bare.any():
        return np.zeros(angle.size, np.int64)
    # runs of bare directions around the circle, from a direction that is not bare
    first = int(np.argmin(bare))
    turn = np.roll(bare, -first)
    edges = np.flatnonzero(np.diff(turn.astype(int), prepend=0, append=0))
    wide = np.clip(APART * _spacing(frame, angle), *GAP)
    runs = [(a, b) for a, b in edges.reshape(-1, 2) if b - a >= wide]
    cuts = np.array([(a + b) / 2 for a, b in runs])
    group = np.searchsorted(cuts, (angle - first) % 360) % max(len(runs), 1)
    shares = np.bincount(group, weight, max(len(runs), 1)) / weight.sum()
    return np.where(shares[group] >= LEAST, np.cumsum(shares >= LEAST)[group] - 1, -1)


def _spacing(frame: Integers, angle: Array) -> float:
    """Usual angle between neighbouring lines of a frame [°]; infinite where no frame has two."""
    order = np.lexsort((angle, frame))
    step = np.diff(angle[order])[np.diff(frame[order]) == 0]
    return float(np.median(step)) if step.size else np.inf


def _radiating(base: Array, tip: Array, weight: Array) -> tuple[Array, Mask]:
    """Point from which lines radiate, and which ones (S,) do; not all lines are whiskers' (a lamp, cables)."""
    long, found = weight > 0, []
    starts = [long, *(long & (np.hypot(*(base - home).T) < CROWD) for home in _crowds(base[long], weight[long]))]
    for n, some in enumerate(starts):
        pivot = _pivot(base[some], tip[some], weight[some])
        off, outward = _passing(base, tip, pivot)
        clear = long & (off < NEAR) & outward
        # all lines show it best, unless most of them are nobody's
        found.append((weight[clear].sum() * (MORE if n == 0 else 1.0), pivot, clear))
    _, point, radiating = max(found, key=lambda one: float(one[0]))
    return point, radiating


def _crowds(base: Array, weight: Array) -> Array:
    """Centres (at most ``CROWDS``, 2) of the cells in which most bases lie."""
    cell, where = np.unique(base // CROWD, axis=0, return_inverse=True)
    most = np.argsort(-np.bincount(where.ravel(), weight), kind="stable")[:CROWDS]
    return np.asarray((cell[most] + 0.5) * CROWD)


def _half(base: Array, tip: Array, weight: Array, mine: Mask, pivot: Array) -> Mask:
    """Lines (S,) of one of two halves that point so far apart that they are of either side of a face; or none."""
    way = base / 2 + tip / 2 - pivot
    middle = _pad(base[mine], tip[mine], weight[mine]).way
    second = mine & (middle[0] * way[:, 1] - middle[1] * way[:, 0] < 0)
    for _ in range(SPLITS):
        halves = mine & ~second, second
        if min(weight[one].sum() for one in halves) < LEAST * weight[mine].sum():
            return np.zeros(mine.size, bool)
        pads = [_pad(base[one], tip[one], weight[one]) for one in halves]
        off = [np.where(_beside(base, tip, one), _passing(base, tip, one.pivot)[0], np.inf) for one in pads]
        second = mine & (off[1] < off[0])
    return halves[1] if pads[0].way @ pads[1].way < UNLIKE else np.zeros(mine.size, bool)


def _other_side(base: Array, tip: Array, weight: Array, mine: Mask) -> Mask:
    """Lines (S,) of a pad behind that of other lines: it leads the other way from a point that theirs do not show."""
    one = _pad(base[mine], tip[mine], weight[mine])
    off, outward = _passing(base, tip, one.pivot)
    left = np.where((off < 2 * NEAR) & outward & _beside(base, tip, one), 0.0, weight)
    nobody = np.zeros(mine.size, bool)
    if left.sum() < LEAST * weight.sum():
        return nobody
    _, clear = _radiating(base, tip, left)
    if left[clear].sum() < max(LEAST * weight.sum(), MOST * left.sum()):
        return nobody
    other = _pad(base[clear], tip[clear], weight[clear])
    apart = other.pivot - one.pivot
    behind = one.way @ apart < 0 and other.way @ apart > 0 and one.way @ other.way < 0
    return clear if behind else nobody


def _nearest(base: Array, tip: Array, weight: Array, pads: list[Pad]) -> tuple[Integers, Mask]:
    """Pad that each line passes nearest, −1 for none, and whether it leads towards it."""
    pad, inward = np.full(weight.size, -1), np.zeros(weight.size, bool)
    nearest = np.full(weight.size, np.inf)
    for number, one in enumerate(pads):
        off, outward = _passing(base, tip, one.pivot)
        # tips may gather, too, at an edge that hides them: where a line comes from the pad, its base is at the pad
        _, towards = _passing(tip, base, one.pivot)
        side = _beside(base, tip, one)
        better = (weight > 0) & (outward | towards) & side & (off < 2 * NEAR) & (off < nearest)
        pad[better], nearest[better], inward[better] = number, off[better], towards[better]
    return pad, inward


def _beside(base: Array, tip: Array, pad: Pad) -> Mask:
    """Whether each line lies on the side that a pad leads to."""
    return np.asarray(np.cos(np.arctan2(*(base / 2 + tip / 2 - pad.pivot).T[::-1]) - pad.middle) > -0.2)


def _passing(base: Array, tip: Array, pivot: Array) -> tuple[Array, Mask]:
    """Distance at which each line passes the pivot [px], and whether it leads away from it."""
    way = (tip - base) / np.maximum(np.hypot(*(tip - base).T), 1e-9)[:, None]
    rel = base - pivot
    off = np.abs(way[:, 0] * rel[:, 1] - way[:, 1] * rel[:, 0])
    near, far = np.hypot(*rel.T), np.hypot(*(tip - pivot).T)
    return off, far - near > RADIAL * np.hypot(*(tip - base).T)


def _pad(base: Array, tip: Array, weight: Array) -> Pad:
    """Pad of lines that are known to be of one."""
    pivot = _pivot(base, tip, weight)
    middle = (base + tip) / 2 - pivot
    angle = np.arctan2(middle[:, 1], middle[:, 0])
    centre = np.arctan2((weight * np.sin(angle)).sum(), (weight * np.cos(angle)).sum())
    near, far = np.hypot(*(base - pivot).T), np.hypot(*(tip - pivot).T)
    long = far - near >= np.median(far - near)
    inner = float(np.quantile(near[long], 0.3))
    return Pad(pivot, float(centre), inner, inner + max(0.8 * float(np.median((far - near)[long])), 20.0))
