"""How the head moves, from the lines of its whiskers alone.

A whisker turns about its follicle, so its base part points at one place of the head, however it whisks. Where all these
places move in common, the head does. In coordinates that move with it whiskers stay nearer to their places.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from vibrissa.arrays import Array, Integers
from vibrissa.head_pose import HeadPose
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.pieces import Pieces

FEWEST = 5  # lines of a tracklet from which on it says where its follicle is
BASE, SHARE = 15.0, 0.35  # length of the base part [px], and its share of the line: the longer of the two
WHOLE = 60.0  # length from which on a line says all it can [px]
DEPTH, DEPTHS = 25.0, 15.0  # from the middle of the base part back to the follicle, and its standard deviation [px]
MISS = 0.5  # standard deviation of the distance at which a base part passes its follicle [px]
BENT = 0.06  # the same, for each pixel from the one to the other: whiskers are not straight
STRAY = 1.5  # standard deviations of that distance from which on a line counts less
KNOT = 5.0  # frames between which the motion is a straight line
SWERVES = 0.15, 0.5, 2.0  # standard deviation of the change of its step from knot to knot [px], the least that will do
EXPLAINED = 3.0, 5.0, 5.0  # times that the squares of these distances are smaller then, lest lines that are cut move
FAR, CLEARLY = 6.0, 2.0  # the same if the motion is larger (standard deviation, px) than what cut lines seem to move
WHISKERS = 3.0  # base parts of a frame, on average, that show a motion
FARTHEST, TURNED = 100.0, 3.0  # standard deviations of the head's place [px] and turn [°]
ARM = 80.0  # distance at which a turn is as large as a shift of as many px
ROUNDS = 8


class BaseParts(NamedTuple):
    """Base parts of lines.

    Attributes
    ----------
    frame, tracklet : (n,) arrays of int
        Of each; tracklets are numbered from 0.
    middle, way : (n, 2) arrays
        Middle [px], and unit vector towards the tip.
    weight : (n,) array
        How much each says.
    """

    frame: Integers
    tracklet: Integers
    middle: Array
    way: Array
    weight: Array

    @property
    def normal(self) -> Array:
        """Unit vector across each, (n, 2)."""
        return np.stack([-self.way[:, 1], self.way[:, 0]], axis=1)

    def means(self, values: Array) -> Array:
        """Weighted mean of values (n, 2) over each tracklet."""
        total = np.bincount(self.tracklet, self.weight)
        return np.stack([np.bincount(self.tracklet, self.weight * one) / total for one in values.T], axis=1)


def motion_of(placed: Pieces, lines: Lines, tracklet: Integers, novel: Array, moves: bool = False) -> HeadPose | None:
    """The head in every frame, as far as lines show it.

    Parameters
    ----------
    placed : Pieces
        Segments, at the size at which lines are linked.
    lines : Lines
        The same about their pads.
    tracklet : (S,) array of int
        Stretch of plain links that each segment is in, −1 for none.
    novel : (S,) array
        Weights of lines, small for edges of things, see :func:`vibrissa.video.link.pad.pieces.novelty`.
    moves : bool
        Whether the head is known to move: then what is left of its motion is given, however little it explains.

    Returns
    -------
    HeadPose or None
        At the same size: a place among the bases, and the turn since the first frame; constant before the first frame
        with base parts and after the last one. None where the head does not move, or lines do not show it: its motion
        must make the squares of the distances at which base parts pass their follicles smaller by ``EXPLAINED``, or by
        ``CLEARLY`` if it is large.
    """
    parts = base_parts(placed, lines, tracklet, novel)
    if parts.frame.size < WHISKERS * np.unique(parts.frame).size or not parts.frame.size:
        return None
    first, frames = int(parts.frame[0]), int(np.ptp(parts.frame)) + 1
    parts, outside = parts._replace(frame=parts.frame - first), (first, placed.frames - first - frames)
    centre = np.average(parts.middle, axis=0, weights=parts.weight)
    found, unexplained = None, np.inf if moves else _fitted(parts, frames, centre, None)[1]
    for swerve, explained in zip(SWERVES, EXPLAINED, strict=True):
        way, left = _fitted(parts, frames, centre, swerve)
        far = np.hypot(*way[:, :2].std(axis=0))
        if unexplained > (explained if far < FAR else CLEARLY) * left:
            found, unexplained = way, left
    if found is None:
        return None
    right, down, turn = np.pad(found, (outside, (0, 0)), mode="edge").T
    return HeadPose(centre[0] + right, centre[1] + down, np.rad2deg(turn / ARM))


def base_parts(placed: Pieces, lines: Lines, tracklet: Integers, novel: Array) -> BaseParts:
    """Straight lines through the base parts of the lines of plain stretches; arguments as of :func:`motion_of`."""
    size = np.bincount(tracklet[tracklet >= 0], minlength=1)
    who = np.flatnonzero((tracklet >= 0) & (size[np.maximum(tracklet, 0)] >= FEWEST))
    first, last = (one[who] for one in placed.ends)
    count, length = (placed.stop - placed.start)[who], np.maximum(np.hypot(*(last - first).T), 1e-9)
    few = np.clip(np.ceil(count * np.maximum(BASE / length, SHARE)).astype(int), np.minimum(2, count), count)
    back = lines.turned[who]
    start = np.where(back, placed.stop[who] - few, placed.start[who])
    x, y = placed.column, placed.row
    moments = np.stack([x, y, x * x, x * y, y * y], axis=1)
    total = np.concatenate([np.zeros((1, 5)), np.cumsum(moments - moments.mean(axis=0), axis=0)])
    mx, my, xx, xy, yy = ((total[start + few] - total[start]) / few[:, None] + moments.mean(axis=0)).T
    angle = 0.5 * np.arctan2(2 * (xy - mx * my), xx - mx**2 - yy + my**2)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outward = np.where(back[:, None], first - last, last - first)
    way *= np.where((way * outward).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    number, weight = np.unique(tracklet[who], return_inverse=True)[1], novel[who] * np.minimum(length / WHOLE, 1.0)
    return BaseParts(placed.frame[who], number, np.stack([mx, my], axis=1), way, weight)


def _fitted(parts: BaseParts, frames: int, centre: Array, swerve: float | None) -> tuple[Array, float]:
    """Motion (frames, 3), right, down and turn times ``ARM`` [px], mean 0; and the mean square of what is left.

    Follicles and motion are found by least squares, in turn with the weights of lines. None is no motion.
    """
    knots = 0 if swerve is None else max(int(np.ceil(frames / KNOT)) + 1, 3)
    normal, number = parts.normal, parts.tracklet
    follicle = parts.means(parts.middle - DEPTH * parts.way)
    prior = np.concatenate([follicle.ravel(), np.zeros(3 * knots)])
    precision = _precision(follicle.size, knots, swerve or 1.0)
    seen, weight = (normal * parts.middle).sum(axis=1), parts.weight
    for _ in range(ROUNDS):
        terms = _terms(parts, follicle[number] - centre, frames, knots)
        weighted = terms.T @ sparse.diags_array(weight)
        found = spsolve((weighted @ terms + precision).tocsc(), weighted @ seen + precision @ prior)
        follicle, off = found[: follicle.size].reshape(-1, 2), seen - terms @ found
        far = ((parts.middle - follicle[number]) * parts.way).sum(axis=1)
        variance = MISS**2 + (BENT * far) ** 2
        weight = parts.weight / (variance + (off / STRAY) ** 2)
    free = max(off.size - found.size, 1) / off.size
    left = float(np.average(off**2, weights=weight)) / free
    if not knots:
        return np.zeros((frames, 3)), left
    at = np.linspace(0, knots - 1, frames)
    way = np.stack([np.interp(at, np.arange(knots), one) for one in found[follicle.size :].reshape(-1, 3).T], axis=1)
    return way - way.mean(axis=0), left


def _terms(parts: BaseParts, arm: Array, frames: int, knots: int) -> sparse.csr_array:
    """Distance at which each base part passes the origin by places of follicles and by motion at the knots."""
    count, normal, rows = parts.frame.size, parts.normal, np.arange(parts.frame.size)
    entries = [(rows, 2 * parts.tracklet + k, normal[:, k]) for k in range(2)]
    first = 2 * (parts.tracklet.max() + 1)
    if knots:
        at = parts.frame * ((knots - 1) / max(frames - 1, 1))
        low = np.minimum(at.astype(int), knots - 2)
        turn = (normal[:, 1] * arm[:, 0] - normal[:, 0] * arm[:, 1]) / ARM
        for k, lever in enumerate((normal[:, 0], normal[:, 1], turn)):
            entries += [(rows, first + 3 * low + k, lever * (1 - at + low))]
            entries += [(rows, first + 3 * low + 3 + k, lever * (at - low))]
    row, column, value = (np.concatenate(one) for one in zip(*entries, strict=True))
    return sparse.coo_array((value, (row, column)), shape=(count, first + 3 * knots)).tocsr()


def _precision(places: int, knots: int, swerve: float) -> sparse.csr_array:
    """Inverse covariance of places of follicles and of the motion before lines are seen."""
    own = sparse.diags_array(np.full(places, DEPTHS**-2.0))
    if not knots:
        return own.tocsr()
    bend = sparse.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(knots - 2, knots))
    size = np.array([FARTHEST, FARTHEST, np.deg2rad(TURNED) * ARM])
    smooth = sparse.kron(bend.T @ bend, sparse.eye_array(3)) / swerve**2
    return sparse.block_diag([own, smooth + sparse.diags_array(np.tile(size**-2, knots))]).tocsr()
