"""Pads: the points from which lines radiate, and each line in polar coordinates about its pad."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import TooFewError
from vibrissa.video.link.pad.base_ends import turned
from vibrissa.video.link.pad.pieces import Pieces, novelty

GAP = 10, 25  # degrees without lines, on both sides, by which two pads are known as two: at least, and surely
APART = 2.0  # the same over what is usual between the lines of a frame
BLUR = 2.5  # standard deviation by which the density of directions is smoothed [°]
BARE = 0.04  # share of the densest direction below which there are no lines
LEAST = 0.15  # share of all lines that a pad has at least
CROWD = 80.0  # px within which bases are together
CROWDS = 4  # such places from which the point is sought
MORE = 1.2  # lines that radiate from another point than all lines say, over those from that one, at least
NEAR = 40.0  # px by which a line may pass the point from which lines radiate
PULL = 0.02  # weight that keeps this point near the bases where all lines are parallel
HIDDEN = 10.0  # px of each whisker that fur hides
BEYOND = 1.3  # of the range between inner and outer radius, from its middle, in which lines are fitted
SCATTER = 0.8  # standard deviation of a traced point, of 8 px each [px]
INDEPENDENT = 8.0  # px along a line over which errors are alike
RADIAL = 0.5  # least share of a line's length by which it leads away from its pad
SHORTEST = 12.0  # px of a line that can be a whisker's


class Pad(NamedTuple):
    """Where the whiskers of one side come from.

    Attributes
    ----------
    pivot : (2,) array
        Column and row of the point from which lines radiate [px].
    middle : float
        Direction of the middle of the pad, down from the right [rad].
    inner, outer : float
        Distances from the pivot between which lines are compared [px].
    """

    pivot: Array
    middle: float
    inner: float
    outer: float

    @property
    def centre(self) -> float:
        """Distance from the pivot at which the place of a line is given [px]."""
        return (self.inner + self.outer) / 2

    @property
    def degree(self) -> float:
        """Displacement at the middle distance of a whisker that turns by 1° about its base [px]."""
        return float(np.deg2rad(self.centre - self.inner + HIDDEN))

    def polar(self, column: Array, row: Array) -> tuple[Array, Array]:
        """Distance from the inner to the outer radius, as −1 to 1, and place across in degrees of swing."""
        x, y = column - self.pivot[0], row - self.pivot[1]
        angle = (np.arctan2(y, x) - self.middle + np.pi) % (2 * np.pi) - np.pi
        return (np.hypot(x, y) - self.centre) * 2 / (self.outer - self.inner), angle * self.centre / self.degree

    def points(self, along: Array, across: Array) -> tuple[Array, Array]:
        """Column and row of places as of :meth:`polar` [px]."""
        radius, angle = along * (self.outer - self.inner) / 2 + self.centre, across * self.degree / self.centre
        return (
            self.pivot[0] + radius * np.cos(angle + self.middle),
            self.pivot[1] + radius * np.sin(angle + self.middle),
        )


class Lines(NamedTuple):
    """Each segment as a line of its pad.

    Attributes
    ----------
    pad : (S,) array of int
        Which pad; −1 for lines that lead away from none.
    turned : (S,) array of bool
        Whether the last point is nearer to the base.
    place : (S, 3) array
        Place across at the inner, middle and outer radius, in degrees of swing.
    covariance : (S, 3, 3) array
        Of the place.
    reach : (S, 2) array
        First and last distance from the pivot, as −1 at the inner to 1 at the outer radius.
    look : (S, 2) array
        What it looks like: logarithm of contrast times width, mean over the line, and the second reach.
    """

    pad: Integers
    turned: Mask
    place: Array
    covariance: Array
    reach: Array
    look: Array


def _chords(pieces: Pieces, turned: Mask) -> tuple[Array, Array, Array]:
    """Base and tip end (S, 2), and length of the chord."""
    first = np.stack([pieces.column[pieces.start], pieces.row[pieces.start]], axis=1)
    last = np.stack([pieces.column[pieces.stop - 1], pieces.row[pieces.stop - 1]], axis=1)
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

    Raises
    ------
    InputError
        If no line is long enough to be a whisker's.
    """
    back, _ = turned(pieces)
    base, tip, length = _chords(pieces, back)
    if not np.any(length >= SHORTEST):
        raise TooFewError("segments", f"must hold a line of at least {SHORTEST:g} px", f"{length.max():g} px")
    weight = np.where(length >= SHORTEST, length * novelty(pieces), 0.0)
    every, clear = _radiating(base, tip, weight)
    if not clear.any():
        clear = weight > 0
    member = np.full(length.size, -1)
    member[clear] = _groups(pieces.frame[clear], base[clear], tip[clear], weight[clear], every)
    pads = [_pad(base[mine], tip[mine], weight[mine]) for mine in (member == k for k in range(member.max() + 1))]
    pad, inward = _nearest(base, tip, weight, pads)
    return pads, pad, back ^ inward


def _radiating(base: Array, tip: Array, weight: Array) -> tuple[Array, Mask]:
    """Point from which lines radiate, and which ones (S,) do; not all lines are whiskers' (a lamp, cables)."""
    long = weight > 0
    starts = [long, *(long & (np.hypot(*(base - home).T) < CROWD) for home in _crowds(base[long], weight[long]))]
    best, most = (_pivot(base[long], tip[long], weight[long]), np.zeros(weight.size, bool)), -1.0
    for n, some in enumerate(starts):
        pivot = _pivot(base[some], tip[some], weight[some])
        off, outward = _passing(base, tip, pivot)
        clear = long & (off < NEAR) & outward
        # all lines show it best, unless most of them are nobody's
        share = weight[clear].sum() * (MORE if n == 0 else 1.0)
        if share > most:
            best, most = (pivot, clear), share
    return best


def _crowds(base: Array, weight: Array) -> Array:
    """Centres (at most ``CROWDS``, 2) of the cells in which most bases lie."""
    cell, where = np.unique(base // CROWD, axis=0, return_inverse=True)
    most = np.argsort(-np.bincount(where.ravel(), weight), kind="stable")[:CROWDS]
    return np.asarray((cell[most] + 0.5) * CROWD)


def pads_of_lines(pieces: Pieces, pads: list[Pad]) -> tuple[Integers, Mask]:
    """Pad of each segment of pads that are known, and whether it runs from tip to base, as of :func:`find_pads`."""
    back, _ = turned(pieces)
    base, tip, length = _chords(pieces, back)
    weight = np.where(length >= SHORTEST, length * novelty(pieces), 0.0)
    pad, inward = _nearest(base, tip, weight, pads)
    return pad, back ^ inward


def _nearest(base: Array, tip: Array, weight: Array, pads: list[Pad]) -> tuple[Integers, Mask]:
    """Pad that each line passes nearest, −1 for none, and whether it leads towards it."""
    pad, inward = np.full(weight.size, -1), np.zeros(weight.size, bool)
    nearest = np.full(weight.size, np.inf)
    for number, one in enumerate(pads):
        off, outward = _passing(base, tip, one.pivot)
        # tips may gather, too, at an edge that hides them: where a line comes from the pad, its base is at the pad
        _, towards = _passing(tip, base, one.pivot)
        side = np.cos(np.arctan2(*(base / 2 + tip / 2 - one.pivot).T[::-1]) - one.middle) > -0.2
        better = (weight > 0) & (outward | towards) & side & (off < 2 * NEAR) & (off < nearest)
        pad[better], nearest[better], inward[better] = number, off[better], towards[better]
    return pad, inward


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


def lines_of(pieces: Pieces, pads: list[Pad], pad: Integers, back: Mask) -> Lines:
    """Polynomials of second degree through the segments in the polar coordinates of their pads.

    Parameters
    ----------
    pieces : Pieces
        Segments.
    pads, pad, back
        From :func:`find_pads`.

    Returns
    -------
    Lines
        Of all segments; NaN for those of no pad.
    """
    count, owner = pad.size, pieces.owner
    place, covariance, reach = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan), np.full((count, 2), np.nan)
    for number, one in enumerate(pads):
        along, across = one.polar(pieces.column, pieces.row)
        low, high = (f.reduceat(along, pieces.start) for f in (np.minimum, np.maximum))
        mine = pad == number
        # a line that hardly overlaps the range is fitted as a whole
        part = (np.minimum(high, BEYOND) - np.maximum(low, -BEYOND)) * (one.outer - one.inner) / 2
        use = (np.abs(along) <= BEYOND) | (part < SHORTEST)[owner]
        radius = np.maximum(along * (one.outer - one.inner) / 2 + one.centre, 1.0)
        error = SCATTER * one.centre / radius / one.degree
        weight = np.where(use, 1 / (INDEPENDENT * error**2), 0.0)
        fitted = _fit(pieces, along, across, weight, mine)
        place[mine], covariance[mine], reach[mine] = fitted[0][mine], fitted[1][mine], np.stack([low, high], 1)[mine]
    strength = np.log(pieces.sums(pieces.width * pieces.contrast) / (pieces.stop - pieces.start))
    return Lines(pad, back, place, covariance, reach, np.stack([strength, reach[:, 1]], axis=1))


AT = np.array([[1.0, -1.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0]])  # from coefficients to places at −1, 0, 1


def _fit(pieces: Pieces, along: Array, across: Array, weight: Array, mine: Mask) -> tuple[Array, Array]:
    """Places (S, 3) and covariances (S, 3, 3) of parabolas; slope and bend have the pad's as a prior."""
    powers = np.stack([np.ones(along.size), along, along**2], axis=1)
    left = pieces.sums(weight[:, None, None] * powers[:, :, None] * powers[:, None, :])
    right = pieces.sums((weight * across)[:, None] * powers)
    mean, prior = np.zeros(3), np.diag([1e-6, 1e-3, 1e-1])
    for _ in range(3):
        found = np.linalg.inv(left + prior)
        best = np.einsum("sij,sj->si", found, right + prior @ mean)
        # slope and bend of this pad's whiskers, from the lines that show them
        clear = mine & (found[:, 2, 2] < np.quantile(found[mine, 2, 2], 0.3))
        mean[1:] = np.median(best[clear, 1:], axis=0)
        sd = 1.5 * np.median(np.abs(best[clear, 1:] - mean[1:]), axis=0) + 0.5
        prior = np.diag([1e-6, *(1 / (2 * sd) ** 2)])
    return best @ AT.T, AT @ found @ AT.T
