"""The line of the face: angles to it, and the names of whiskers by their places along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, UnknownError
from vibrissa.measures.sides import axis_between, sides_along, sides_of

Side = Literal["left", "right", "top", "bottom"]
Point = tuple[float, float]
SIDES: dict[str, Point] = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "top": (0.0, -1.0), "bottom": (0.0, 1.0)}
LEAST_BASES = 3  # through two any line passes
FARTHEST = 60.0  # [°] of the line from the side of the nose: one side is nearer than 45°, another may be meant
LEADS, NEAREST = np.cos(np.radians([FARTHEST, 45.0]))


@dataclass(frozen=True, kw_only=True)
class Face:
    """The line of the face, in the plane of the movie.

    Attributes
    ----------
    caudal, rostral : (float, float)
        A point of it further back, and one further to the nose [m].
    origin : str
        Where it is from, in words.
    direction_sd : float
        Standard error of its direction [rad], where it was fitted to bases; NaN elsewhere.
    between : bool
        Whether it is the axis between pads of both sides.
    """

    caudal: Point
    rostral: Point
    origin: str = "two points"
    direction_sd: float = np.nan
    between: bool = False

    def __post_init__(self) -> None:
        if not np.hypot(*np.subtract(self.rostral, self.caudal)) > 0:
            raise RangeError("face", "must be two points, caudal and rostral, apart from each other", self.rostral)

    @property
    def direction(self) -> Array:
        """Unit vector along the line to the nose, (2,)."""
        along = np.subtract(self.rostral, self.caudal)
        return np.asarray(along / np.hypot(*along))

    def turn(self, direction: Array) -> int:
        """Sense in which a whisker protracts: 1 from the x towards the y axis, −1 the other way.

        Parameters
        ----------
        direction : (T,) array
            Directions of the shaft [rad], NaN where not measured: they say on which side of the face it grows.

        Returns
        -------
        int
            1 or −1.
        """
        f = self.direction
        # the whisker's side: mean of the component across the face, f turned by +90°
        side = np.nanmean(np.sin(direction) * f[0] - np.cos(direction) * f[1]) if np.isfinite(direction).any() else 1.0
        return -1 if side > 0 else 1

    def angle(self, direction: Array, turn: int) -> Array:
        """Angle to the face: 0 along it to the back, π/2 across it, π along it to the nose.

        Parameters
        ----------
        direction : array
            Of the shaft, from the x towards the y axis [rad].
        turn : int
            From :meth:`turn`.

        Returns
        -------
        array
            In [−π/2, 3π/2) [rad].
        """
        back = np.arctan2(-self.direction[1], -self.direction[0])
        return np.asarray((turn * (direction - back) + np.pi / 2) % (2 * np.pi) - np.pi / 2)


def face_through(
    bases: Array, nose: Side, frames: Array | None = None, *, ways: Array | None = None, downwards: bool = True
) -> Face:
    """The line fitted to the bases of three whiskers or more; of fewer, an axis of the image.

    Where pads of both sides are seen, it is the axis between them.

    Parameters
    ----------
    bases : (W, 2) array
        Mean base of each whisker, x and y [m]; NaN where it was never seen.
    nose : {"left", "right", "top", "bottom"}
        Side of the image to which the nose points.
    frames : (W,) array, optional
        Frames in which each was seen: a base counts so often; all alike if not given.
    ways : (W, 2) array, optional
        Mean direction of each; all are of one side if not given.
    downwards : bool
        Whether y grows downwards, as in images.

    Returns
    -------
    Face
        Its origin says which of these.

    Raises
    ------
    InputError
        If the side is unknown, or the line through the bases leads to another one, by more than 60° from this, or
        from one pad to the other.
    """
    if nose not in SIDES:
        raise UnknownError("nose", f"must be one of {', '.join(SIDES)}", repr(nose))
    towards = np.array(SIDES[nose]) * (1 if downwards else (1, -1))
    seen = np.isfinite(bases).all(axis=1)
    known, weight = bases[seen], np.ones(len(bases))[seen] if frames is None else np.asarray(frames, float)[seen]
    centre = np.average(known, axis=0, weights=weight) if len(known) else np.zeros(2)
    along, origin = towards, f"the image's axis to the {nose}"
    axis, error = towards, np.nan
    if len(known) >= LEAST_BASES:
        axis = np.linalg.svd(np.sqrt(weight)[:, None] * (known - centre))[2][0]
        axis = axis * np.sign(axis @ towards)
    side, way = _both_sides(known, None if ways is None else ways[seen], towards, axis)
    if side.any():
        if way @ towards < NEAREST:
            rule = f"must lie across the line from one pad to the other, {_leads_to(way, NEAREST)}"
            raise RangeError("nose", rule, nose, "or give two points of face")
        along = axis_between(known, side, way)
        origin = f"the axis between pads of {(side > 0).sum()} and {(side < 0).sum()} whiskers"
    elif len(known) >= LEAST_BASES:
        along, origin = axis, f"a line fitted to the bases of {len(known)} whiskers"
        if axis @ towards < LEADS:
            rule = f"must be a side to which the line through the bases leads, {_leads_to(axis, LEADS)}"
            raise RangeError("nose", rule, nose, "or give two points of face")
        error = _direction_sd(known - centre, weight, axis)
    ends = [(float(one[0]), float(one[1])) for one in (centre, centre + along)]
    return Face(caudal=ends[0], rostral=ends[1], origin=origin, direction_sd=error, between=bool(side.any()))


def _direction_sd(bases: Array, weight: Array, axis: Array) -> float:
    """Standard error of the direction of a line by the scatter of its bases about it [rad]."""
    along, across = bases @ axis, bases @ np.array([-axis[1], axis[0]])
    length = weight @ along**2
    return float(np.sqrt((weight @ across**2) / (len(bases) - 2) / length)) if length > 0 else np.nan


def _both_sides(bases: Array, ways: Array | None, towards: Array, axis: Array) -> tuple[Integers, Array]:
    """Side of each whisker, and the way to the nose: as given, or else across the line through the bases."""
    across = np.array([-axis[1], axis[0]])
    across = across if across @ towards >= 0 else -across
    side = np.zeros(len(bases), np.int64)
    for way in (towards, across):
        if ways is not None and (side := sides_of(bases, ways, way)).any():
            return side, way
    return side, towards


def _leads_to(axis: Array, least: float) -> str:
    """Sides of the image to which an axis leads, in words."""
    return " or ".join(side for side, way in SIDES.items() if abs(axis @ way) > least)


def whisker_names(
    bases: Array,
    face: Face,
    dorsal: Side | None = None,
    *,
    ways: Array | None = None,
    downwards: bool = True,
    given: Sequence[str] = (),
) -> list[str]:
    """Names of whiskers by the places of their bases: 1, 2, 3 … from caudal to rostral, or row and column.

    Where pads of both sides are seen, each is numbered by itself: L1, L2 …, R1, R2 …, left and right of an animal that
    is seen from above.

    Rows need ``dorsal`` (a view from the side) and bases that fall into rows: a row has two whiskers or more, and the
    gap between rows is more than twice the width of any row. The letters and numbers count what is seen, the most
    dorsal row as A and the most caudal whisker of a row as 1: where a row or a caudal whisker is out of view, they are
    not those of the anatomy.

    Names that were given stay, and their whiskers are counted too; a number that was given as a name is left out.

    Parameters
    ----------
    bases : (W, 2) array
        Mean base of each whisker, x and y [m].
    face : Face
        The line of the face.
    dorsal : {"left", "right", "top", "bottom"}, optional
        Side of the image to which the back points.
    ways : (W, 2) array, optional
        Mean direction of each; all are of one side if not given.
    downwards : bool
        Whether y grows downwards.
    given : sequence of str
        Name that was given to each whisker, "" to those without; none has one by default.

    Returns
    -------
    list of str
        A name for each whisker; no two are the same, if those given are not.
    """
    along = bases @ face.direction
    rows = None if dorsal is None else _rows(bases @ (np.array(SIDES[dorsal]) * (1 if downwards else (1, -1))))
    if face.between:
        side = sides_along(bases, np.array(face.caudal), face.direction)
    else:
        side = np.zeros(len(bases), int) if ways is None else sides_of(bases, ways, face.direction)
    left, right = (1, -1) if not downwards else (-1, 1)
    groups = {name: np.flatnonzero(side == one) for name, one in (("L", left), ("", 0), ("R", right))}
    if rows is not None:
        groups = {chr(ord("A") + letter): row for letter, row in enumerate(rows)}
    names = list(given) or [""] * len(bases)
    taken = {one.casefold() for one in names}  # on the page of `correct` upper and lower case are alike, too
    for letter, row in groups.items():
        number = 0
        for place, w in enumerate(row[np.argsort(along[row], kind="stable")], 1):
            if names[w]:
                continue
            number = max(place, number + 1)
            while f"{letter}{number}".casefold() in taken:
                number += 1
            names[w] = f"{letter}{number}"
    return names


def _rows(height: Array) -> list[np.ndarray] | None:
    """Whiskers of each row, the most dorsal first; None where the heights do not fall into rows."""
    order = np.argsort(-height, kind="stable")
    gaps = -np.diff(height[order])
    for cuts in range(min(len(order) // 2, 6) - 1, 0, -1):  # the most rows that hold
        where = np.sort(np.argsort(-gaps)[:cuts])
        rows = np.split(order, where + 1)
        widest = max(np.ptp(height[row]) for row in rows)
        if min(map(len, rows)) > 1 and gaps[where].min() > 2 * widest:
            return rows
    return None
