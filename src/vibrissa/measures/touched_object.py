"""Objects that whiskers touch, and the distance of a centreline to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import RangeError, require_not_negative

Point = tuple[float, float]
TRIED = 40  # frames whose nodes are tried as the place that stays
COMPARED = 400  # frames with which they are compared
STEPS = 10  # by which the place is refined


@dataclass(frozen=True, kw_only=True)
class Pole:
    """A round pole, seen along its axis.

    Attributes
    ----------
    centre : (float, float)
        Where it is, x and y [m].
    radius : float
        Its radius [m].
    """

    centre: Point
    radius: float = 0.0

    def __post_init__(self) -> None:
        require_not_negative("pole_radius", self.radius, "m")
        if not np.isfinite(self.centre).all():
            raise RangeError("pole", "must be at a finite place", self.centre)

    def distance(self, x: Array, y: Array) -> Array:
        """Distance of the seen line to the surface of the pole, negative where the line lies within.

        Parameters
        ----------
        x, y : (T, N) arrays
            Nodes [m], NaN where not measured.

        Returns
        -------
        (T,) array
            [m]; NaN where no two neighbouring nodes were seen.
        """
        return nearest_point(x, y, self.centre)[0] - self.radius


@dataclass(frozen=True, kw_only=True)
class Wall:
    """A straight wall, seen along its face.

    Attributes
    ----------
    ends : ((float, float), (float, float))
        Two points of it [m]; it goes on beyond them.
    """

    ends: tuple[Point, Point]

    def __post_init__(self) -> None:
        if not np.hypot(*np.subtract(*self.ends)) > 0:
            raise RangeError("wall", "must be two points apart from each other", self.ends)

    def distance(self, x: Array, y: Array) -> Array:
        """Distance of the nearest node, negative beyond the wall as seen from the bases.

        Parameters
        ----------
        x, y : (T, N) arrays
            Nodes [m], NaN where not measured.

        Returns
        -------
        (T,) array
            [m]; NaN where no node was seen.
        """
        (ax, ay), along = self.ends[0], np.subtract(self.ends[1], self.ends[0])
        off = ((x - ax) * along[1] - (y - ay) * along[0]) / np.hypot(*along)
        seen = np.isfinite(off)
        base = np.take_along_axis(off, seen.argmax(axis=1)[:, None], 1)[:, 0]
        side = np.sign(np.nanmedian(base)) if seen.any() else 1.0
        nearest = np.where(seen, off * side, np.inf).min(axis=1)
        return np.where(seen.any(axis=1), nearest, np.nan)


Touchable = Pole | Wall


def nearest_point(x: Array, y: Array, point: Point) -> tuple[Array, Array, Array]:
    """The point of each line that is nearest to a given one.

    Parameters
    ----------
    x, y : (T, N) arrays
        Nodes [m], NaN where not measured; only neighbours that were both seen are joined.
    point : (float, float)
        The given point [m].

    Returns
    -------
    distance, x, y : (T,) arrays
        [m]; NaN where no line was seen.
    """
    ax, ay, dx, dy = x[:, :-1], y[:, :-1], np.diff(x), np.diff(y)
    square = dx**2 + dy**2
    share = np.clip(((point[0] - ax) * dx + (point[1] - ay) * dy) / np.where(square > 0, square, 1.0), 0, 1)
    px, py = ax + share * dx, ay + share * dy
    off = np.hypot(px - point[0], py - point[1])
    seen = np.isfinite(off)
    best = np.where(seen, off, np.inf).argmin(axis=1)[:, None]
    distance, nx, ny = (np.take_along_axis(one, best, 1)[:, 0] for one in (off, px, py))
    return distance, nx, ny


def held_place(x: Array, y: Array, bent: Mask, near: float) -> Point | None:
    """The place at which lines are held while they are bent: the point through which they all pass.

    Of the nodes of some bent frames the one is taken whose median distance to the lines of bent frames is least, and
    moved to the median of the nearest points. The outer half of a line is tried alone: next to the base all lines pass
    close by.

    Parameters
    ----------
    x, y : (T, N) arrays
        Nodes [m].
    bent : (T,) array of bool
        Frames in which the whisker is bent.
    near : float
        Median distance above which no place is taken for held [m].

    Returns
    -------
    (float, float) or None
        x and y [m]; None where the lines pass through no common place.
    """
    frames = np.flatnonzero(bent & (np.isfinite(x).sum(axis=1) > 1))
    if frames.size < 2:
        return None
    among = frames[:: -(-frames.size // COMPARED)]
    lx, ly = x[among], y[among]
    outer = slice(x.shape[1] // 2, None)
    some = among[:: -(-among.size // TRIED)]
    tried = np.column_stack([x[some, outer].ravel(), y[some, outer].ravel()])
    tried = tried[np.isfinite(tried).all(axis=1)]
    if not len(tried):
        return None
    tried = tried[:: -(-len(tried) // COMPARED)]
    spread = [np.nanmedian(nearest_point(lx, ly, (px, py))[0]) for px, py in tried]
    place = tuple(map(float, tried[int(np.argmin(spread))]))
    for _ in range(STEPS):
        _, px, py = nearest_point(lx, ly, (place[0], place[1]))
        place = float(np.nanmedian(px)), float(np.nanmedian(py))
    spread_there = float(np.nanmedian(nearest_point(lx, ly, (place[0], place[1]))[0]))
    return (place[0], place[1]) if spread_there <= near else None
