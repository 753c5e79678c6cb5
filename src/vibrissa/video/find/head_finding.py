"""The head found: its silhouette in every frame, laid on that of a frame in which most of it is seen."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, grey_closing, label, maximum_filter
from scipy.spatial import cKDTree

from vibrissa.arrays import Array, Frames, Integers, Mask
from vibrissa.errors import RangeError, TooFewError
from vibrissa.head_pose import HeadPose

HAIR = 9  # width of what is removed before the outline is taken [px]
STILL = 0.5  # share of the frames in which an outline is at one place: an edge of the apparatus
LEAST = 60  # points of an outline that moves
STEPS, REACH, NEAR = 25, (12.0, 3.0), 1.5  # steps of registration, reach at first and at last, of points that fit [px]
FITS = 0.6  # share of the points near the head's outline that fit where the head is known
MODEL = 24  # frames of which the outline is made
POINTS = 400  # of that outline
EDGE = 3  # width of the image's border in which a tip is where the outline leaves the image [px]
FIRST = 24  # frames by which the grey level of the outline is chosen
CLEAR, ALIKE = 0.5, 0.1  # contrast of such a frame at least, and distance to their median level, over the most contrast
TRIED, OTHERS = 5, 0.1  # largest outlines that are laid on the others, and share of the frames that one of them fits
FACE = 0.6  # share of the outline nearest to the nose that is the face's

INSTEAD = "give two tracked points of it, or a table"
SEEN = f"leave out frames at the beginning that do not show it (`start`), or {INSTEAD}"


class Outline(NamedTuple):
    """Points of an outline (N, 2) [px] with normals (N, 2)."""

    points: Array
    normals: Array


def find_head(frames: Iterable[Frames], sign: float = 1.0) -> HeadPose:
    """Find the head of an animal that is darker than what surrounds it.

    Parameters
    ----------
    frames : iterable of (T, height, width) arrays
        Blocks of the movie.
    sign : float
        −1 where the animal is brighter.

    Returns
    -------
    HeadPose
        Place of the tip of the nose, and direction from where the body leaves the image to there; NaN where no
        outline fits.

    Raises
    ------
    InputError
        If no outline is found or none fits, or the nose lies outside the image or at its border in most frames.
    """
    outlines, mask, shape = _outlines(frames, sign)
    if max((len(one.points) for one in outlines), default=0) < LEAST:
        raise TooFewError("head", "must be seen as a dark or bright body with an outline", remedy=SEEN)
    reference, moves = _reference(outlines, mask)
    nose, heading = _nose(outlines[reference], mask[reference])
    model = _pooled(outlines, moves, nose, heading)
    moves, fit = _registered(outlines, model, reference, moves)
    moves[fit < FITS] = np.nan
    x, y = (values[:, 0] for values in _back(moves, nose[None, :]))
    _refuse_hidden(x, y, shape)
    return HeadPose(x, y, np.rad2deg(heading + moves[:, 2]))


def _refuse_hidden(x: Array, y: Array, shape: tuple[int, ...]) -> None:
    """Refuse a head that is in no frame, or whose nose is not in the image; an edge of the body was found instead."""
    known = np.isfinite(x)
    if not known.any():
        rule, found = "must have an outline that fits in some frames", f"none in {x.size} frames"
        raise TooFewError("head", rule, found, SEEN)
    inside = (x > EDGE) & (x < shape[1] - 1 - EDGE) & (y > EDGE) & (y < shape[0] - 1 - EDGE)
    outside = known & ~inside
    if 2 * np.count_nonzero(outside) > np.count_nonzero(known):
        found = f"a tip outside it or at its border in {np.count_nonzero(outside)} of {np.count_nonzero(known)} frames"
        raise RangeError("head", "must have its nose in the image", found, INSTEAD)


def _reference(outlines: list[Outline], mask: list[Array]) -> tuple[int, Array]:
    """Frame with the largest outline that fits others (one of another scene fits none), and the moves from it."""
    sizes = np.array([len(one.points) for one in outlines])
    largest, best, most = np.argsort(-sizes, kind="stable")[:TRIED], (0, np.empty((0, 3))), -1
    for reference in largest[sizes[largest] >= LEAST].tolist():
        model = _face(outlines[reference], *_nose(outlines[reference], mask[reference]))
        moves, fit = _registered(outlines, model, reference, None)
        count = int(np.count_nonzero(fit >= FITS))
        if count > most:
            best, most = (reference, moves), count
        if count > 1 and count >= OTHERS * len(outlines):
            break
    return best


def _outlines(blocks: Iterable[Frames], sign: float) -> tuple[list[Outline], list[Array], tuple[int, ...]]:
    """Outline of the body that moves in every frame, its place at the border and its centre; shape of a frame."""
    found, labels, count = [], [], None
    rest = iter(blocks)
    first = next(rest, np.empty((0, 0, 0), np.uint8))
    level = _level(_smooth(sign, frame) for frame in first[:FIRST]) if len(first) else np.nan
    for block in chain([first], rest):
        for frame in block:
            smooth = _smooth(sign, frame)
            body, _ = label(smooth < level)
            outline, of = _crossings(smooth - level, body)
            here = np.rint(outline.points).astype(int)
            count = np.zeros(smooth.shape) if count is None else count
            once = np.zeros(smooth.shape)
            once[here[:, 1], here[:, 0]] = 1
            count += maximum_filter(once, 3)
            found.append((outline, of))
            labels.append(_ends(body))
    if count is None:
        return [], [], (0, 0)
    still = count > STILL * len(found)
    return *_of_head(found, labels, still), still.shape


def _of_head(
    found: list[tuple[Outline, Integers]], labels: list[dict[int, Array]], still: Mask
) -> tuple[list[Outline], list[Array]]:
    """Outlines of the body that moves most, without still edges if most of it moves; and its two ends."""
    chosen, moves, ends = [], [], []
    for (outline, of), end in zip(found, labels, strict=True):
        moving = ~still[tuple(np.rint(outline.points).astype(int).T[::-1])]
        some = of[moving] if np.count_nonzero(moving) >= LEAST else of
        head = int(np.bincount(some).argmax()) if some.size else -1
        mine = of == head
        chosen.append(Outline(outline.points[mine], outline.normals[mine]))
        moves.append(moving[mine])
        ends.append(end.get(head, np.full((2, 2), np.nan)))
    if sum(map(np.count_nonzero, moves)) > sum(one.size for one in moves) / 2:
        chosen = [Outline(one.points[use], one.normals[use]) for one, use in zip(chosen, moves, strict=True)]
    return chosen, ends


def _smooth(sign: float, frame: NDArray[np.generic]) -> NDArray[np.float32]:
    """Frame without hairs, in which the head is dark."""
    return gaussian_filter(grey_closing(sign * frame.astype(np.float32), size=HAIR), 1.0)


def _level(images: Iterable[NDArray[np.float32]]) -> float:
    """Level between body and surroundings of the first image that is like most; not of a black or white one."""
    levels, contrasts = np.array([(_between(image), np.ptp(image)) for image in images]).T
    clear = levels[contrasts >= CLEAR * contrasts.max()]
    off = np.abs(clear - np.median(clear))
    return float(clear[np.argmax(off <= max(ALIKE * contrasts.max(), off.min()))])


def _between(image: NDArray[np.float32]) -> float:
    """Level between two classes of pixels: halfway between their means."""
    level = float(image.mean())
    if not float(np.ptp(image)) > 1:
        return float(image.min())  # nothing is below
    for _ in range(30):
        level = float(image[image < level].mean() + image[image >= level].mean()) / 2
    return level


def _crossings(height: np.ndarray, body: Integers) -> tuple[Outline, Integers]:
    """Points at which a level is crossed between neighbouring pixels, and the body that each bounds."""
    slope_y, slope_x = (np.gradient(height, axis=axis) for axis in (0, 1))
    parts, normals, of = [], [], []
    for axis in (0, 1):
        one = height[:-1] if axis == 0 else height[:, :-1]
        other = height[1:] if axis == 0 else height[:, 1:]
        row, column = np.nonzero((one < 0) != (other < 0))
        share = one[row, column] / (one[row, column] - other[row, column])
        x, y = (column, row + share) if axis == 0 else (column + share, row)
        parts.append(np.stack([x, y], axis=1))
        normals.append(np.stack([slope_x[row, column], slope_y[row, column]], axis=1))
        beside = body[row + 1, column] if axis == 0 else body[row, column + 1]
        of.append(np.maximum(body[row, column], beside))
    normal = np.concatenate(normals)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-9)[:, None]
    return Outline(np.concatenate(parts).astype(float), normal.astype(float)), np.concatenate(of)


def _ends(body: Integers) -> dict[int, Array]:
    """Of each body its mean place at the image's border, and its centre (2, 2) [px]."""
    edge = np.zeros(body.shape, bool)
    edge[[0, -1]], edge[:, [0, -1]] = True, True
    ends = {}
    for number in range(1, int(body.max()) + 1):
        inside = body == number
        at = inside & edge
        if at.any():
            ends[number] = np.array([np.argwhere(one)[:, ::-1].mean(axis=0) for one in (at, inside)])
    return ends


def _nose(outline: Outline, ends: Array) -> tuple[Array, float]:
    """Tip of the nose [px], and direction of the head [rad]."""
    way = ends[1] - ends[0] if np.isfinite(ends).all() else np.array([1.0, 0.0])
    way = way / max(float(np.hypot(*way)), 1e-9)
    along = outline.points @ way
    nose = outline.points[along >= np.quantile(along, 0.98)].mean(axis=0)
    return np.asarray(nose), float(np.arctan2(way[1], way[0]))


def _face(outline: Outline, nose: Array, heading: float) -> Outline:
    """Part of an outline towards the nose."""
    way = np.array([np.cos(heading), np.sin(heading)])
    behind = -(outline.points - nose) @ way
    use = behind <= np.quantile(behind, FACE)
    return Outline(outline.points[use], outline.normals[use])


def _back(moves: Array, places: Array) -> tuple[Array, Array]:
    """Places of the reference (N, 2) in all frames (T, N); a move is a shift and a turn about the origin."""
    cos, sin = np.cos(moves[:, 2:]), np.sin(moves[:, 2:])
    x, y = places[:, 0], places[:, 1]
    return cos * x - sin * y + moves[:, :1], sin * x + cos * y + moves[:, 1:2]


def _registered(outlines: list[Outline], model: Outline, reference: int, start: Array | None) -> tuple[Array, Array]:
    """Move of the head in every frame (T, 3), and the share of the outline that fits (T,)."""
    moves, fit = np.zeros((len(outlines), 3)), np.zeros(len(outlines))
    for way in (range(reference, len(outlines)), range(reference - 1, -1, -1)):
        step = 1 if way.step > 0 else -1
        for t in way:
            if start is not None:
                guess = start[t]
            elif t == reference:
                guess = np.zeros(3)
            else:
                before, earlier = moves[t - step], moves[t - 2 * step if 0 <= t - 2 * step < len(moves) else t - step]
                same = (t - 2 * step - reference) * step >= 0
                guess = 2 * before - earlier if same else before
            moves[t], fit[t] = _laid(model, outlines[t], guess)
            if start is None and fit[t] < FITS and t != reference:
                moves[t] = moves[t - step]
    return moves, fit


def _laid(model: Outline, outline: Outline, guess: Array) -> tuple[Array, float]:
    """Move that lays the model's outline on that of a frame, by distances along its normals."""
    if len(outline.points) < LEAST // 2:
        return guess, 0.0
    tree, move = cKDTree(outline.points), guess.copy()
    share = 0.0
    for step in range(STEPS):
        reach = max(REACH[0] * (REACH[1] / REACH[0]) ** (step / 12), REACH[1])
        cos, sin = np.cos(move[2]), np.sin(move[2])
        turn = np.array([[cos, -sin], [sin, cos]])
        at, normal = model.points @ turn.T + move[:2], model.normals @ turn.T
        far, nearest = tree.query(at)
        use: Mask = (far < reach) & ((normal * outline.normals[np.minimum(nearest, len(tree.data) - 1)]).sum(1) > 0.5)
        if use.sum() < LEAST // 2:
            return guess, 0.0
        off = ((outline.points[nearest[use]] - at[use]) * normal[use]).sum(axis=1)
        rel = at[use] - move[:2]
        arm = normal[use, 1] * rel[:, 0] - normal[use, 0] * rel[:, 1]
        design = np.column_stack([normal[use], arm])
        weight = 1 / (1 + (off / NEAR) ** 2)
        left = (design * weight[:, None]).T @ design + np.diag([1e-6, 1e-6, 1e-2])
        change = np.linalg.solve(left, (design * weight[:, None]).T @ off)
        move = move + change
        share = float((far < NEAR).mean())
        if step > 12 and np.abs(change[:2]).max() < 1e-3:
            break
    return move, share


def _pooled(outlines: list[Outline], moves: Array, nose: Array, heading: float) -> Outline:
    """Outline of the face from many frames."""
    points, normals = [], []
    for t in np.unique(np.linspace(0, len(outlines) - 1, MODEL).astype(int)):
        cos, sin = np.cos(moves[t, 2]), np.sin(moves[t, 2])
        turn = np.array([[cos, -sin], [sin, cos]])
        points.append((outlines[t].points - moves[t, :2]) @ turn)
        normals.append(outlines[t].normals @ turn)
    every = _face(Outline(np.concatenate(points), np.concatenate(normals)), nose, heading)
    thin = slice(None, None, max(len(every.points) // POINTS, 1))
    return Outline(every.points[thin], every.normals[thin])
