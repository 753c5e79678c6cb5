"""The ground under the rod: a line of straight pieces, walls among them, solid below."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError
from vibrissa.loops import njit
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps

_FAR = 1e3  # over L: how far the ground goes on, flat, beyond its ends
_SAGITTA = 3e-9  # [m] by which the straight pieces of a rounded edge miss its arc at most
_EVEN = 1e-9  # [rad]: pieces that turn by less are one, whose points are rounded
_LIP = 2.5e-5  # over L: what is less than this below an edge slides over it


class Ground(NamedTuple):
    """The ground, in its own frame; lengths over L.

    Attributes
    ----------
    x, y : (P,) arrays
        Corners of the line, x not descending: two equal ones make a wall.
    edge : (C,) array
        Numbers of the convex corners, on which a shaft may rest between its nodes.
    edge_x : (C,) array
        Their x.
    top : float
        Greatest height.
    """

    x: Array
    y: Array
    edge: Integers
    edge_x: Array
    top: float

    def raised(self, by: float) -> Ground:
        """The same ground at another height.

        Parameters
        ----------
        by : float
            Over L, upwards.

        Returns
        -------
        Ground
            With its corners moved.
        """
        return self._replace(y=self.y + by, top=self.top + by)


def ground_of(surface: Gaps | HeightProfile | None, length: float, edge_radius: float = 0.0) -> Ground:
    """The ground of a surface, flat beyond its ends; x = 0 of the surface stays x = 0.

    The surface meets the contact in the order of x, and the ground moves towards −x under the shaft's base, so that
    gaps of the surface are laid out towards +x.

    Parameters
    ----------
    surface : Gaps or HeightProfile, optional
        In metres; a flat without one.
    length : float
        L of the whisker [m].
    edge_radius : float
        Radius of the upper edges of gaps [m]; sharp without one.

    Returns
    -------
    Ground
        Over L.

    Raises
    ------
    InputError
        If the radius is negative, larger than the depth or half a land.
    """
    if surface is None:
        return _ground(np.array([-_FAR, _FAR]), np.zeros(2))
    if isinstance(surface, HeightProfile):
        x, y = surface.position / length, surface.height / length
    else:
        x, y = (part / length for part in _gap_line(surface, edge_radius))
    return _ground(np.concatenate([[-_FAR], x, [_FAR]]), np.concatenate([y[:1], y, y[-1:]]))


def _ground(x: Array, y: Array) -> Ground:
    step_x, step_y = np.diff(x), np.diff(y)
    length = np.hypot(step_x, step_y)
    convex = step_x[:-1] * step_y[1:] - step_y[:-1] * step_x[1:] < -_EVEN * length[1:] * length[:-1]
    edge = 1 + np.flatnonzero(convex)
    return Ground(x=x, y=y, edge=edge, edge_x=x[edge], top=float(y.max()))


def _gap_line(gaps: Gaps, radius: float) -> tuple[Array, Array]:
    """Corners of the walls and of the arcs of rounded edges [m]."""
    land = np.diff(gaps.position, prepend=-np.inf) - np.concatenate([[0.0], gaps.width[:-1]])
    if not 0 <= radius <= min(gaps.depth, land.min() / 2):
        most = min(gaps.depth, land.min() / 2)
        raise RangeError("edge_radius", f"must lie in 0 to {most:.3g} m, the depth or half a land", radius)
    turn = np.linspace(0, np.pi / 2, _pieces(radius) + 1) if radius else np.zeros(1)
    along, down = radius * (np.sin(turn) - 1) if radius else np.zeros(1), radius * (np.cos(turn) - 1)
    left = gaps.position[:, None] + along  # the land ends in an arc, then the wall
    right = (gaps.end[:, None] - along)[:, ::-1]
    floor = np.full((len(gaps.width), 1), -gaps.depth)
    x = np.hstack([left, gaps.position[:, None], gaps.end[:, None], right])
    y = np.hstack([np.broadcast_to(down, left.shape), floor, floor, np.broadcast_to(down[::-1], right.shape)])
    return x.ravel(), y.ravel()


def _pieces(radius: float) -> int:
    """Straight pieces of a quarter of a circle, so that none is farther from it than a sagitta [m]."""
    half = np.arccos(max(1 - _SAGITTA / radius, 0.0))
    return int(np.ceil(np.pi / 4 / half))


@njit(cache=True, nogil=True, error_model="numpy")
def _from_piece(ground: Ground, piece: int, x: float, y: float) -> tuple[float, float, float, bool]:
    """Square of the distance of a point from a piece, the vector to the point, and whether an end is nearest."""
    ax, ay = ground.x[piece], ground.y[piece]
    ex, ey = ground.x[piece + 1] - ax, ground.y[piece + 1] - ay
    square = ex * ex + ey * ey
    share = ((x - ax) * ex + (y - ay) * ey) / square if square > 0 else 0.0
    if 0 < share < 1:  # from the cross product, which is exact for points that are close to a long piece
        off = (ex * (y - ay) - ey * (x - ax)) / square
        return off * off * square, -ey * off, ex * off, False
    share = min(1.0, max(0.0, share))
    dx, dy = x - ax - share * ex, y - ay - share * ey
    return dx * dx + dy * dy, dx, dy, True


@njit(cache=True, nogil=True, error_model="numpy")
def _passable(ground: Ground, piece: int, last: float) -> bool:
    """Whether a piece is a wall over whose top a point was, at height ``last``, after the step before."""
    rise = abs(ground.y[piece + 1] - ground.y[piece])
    if rise <= ground.x[piece + 1] - ground.x[piece]:
        return False
    return last > max(ground.y[piece], ground.y[piece + 1]) - _LIP


@njit(cache=True, nogil=True, error_model="numpy")
def _under(x: Array, place: float) -> int:
    """Number of the piece under a place, by halves."""
    low, high = 0, x.size - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if x[middle] <= place:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, nogil=True, error_model="numpy")
def clearance(ground: Ground, x: float, y: float, last: float, radius: float) -> tuple[float, float, float, bool]:
    """Distance of a point from the ground, negative within it, and the direction away from the ground.

    A wall holds only what was below its top: a tip that slides off an edge is not caught by the wall under it. Only
    pieces nearer than the radius are looked at for a point above the ground; without one nothing can touch it.

    Parameters
    ----------
    ground : Ground
        The ground.
    x, y : float
        The point, in the frame of the ground.
    last : float
        Its height after the step before.
    radius : float
        What is farther above the ground than this is of no interest.

    Returns
    -------
    tuple of 3 floats and a bool
        Distance, the unit vector's components, and whether a corner is nearest; the radius for what is farther above.
    """
    under = _under(ground.x, x)
    slope = (ground.y[under + 1] - ground.y[under]) / (ground.x[under + 1] - ground.x[under])
    height = ground.y[under] + slope * (x - ground.x[under])
    best, dx, dy, at_end = _from_piece(ground, under, x, y)
    if y > height and best > radius * radius:
        best, dx, dy = radius * radius, 0.0, radius
        if radius == 0:
            return 0.0, 0.0, 1.0, False
    for way in (-1, 1):
        piece = under + way
        while 0 <= piece < ground.x.size - 1:
            nearer = x - ground.x[piece + 1] if way < 0 else ground.x[piece] - x
            if nearer * nearer >= best:
                break
            if not _passable(ground, piece, last):
                other, ox, oy, end = _from_piece(ground, piece, x, y)
                if other < best:
                    best, dx, dy, at_end = other, ox, oy, end
            piece += way
    distance = np.sqrt(best)
    if distance == 0:
        return 0.0, -slope / np.sqrt(1 + slope * slope), 1 / np.sqrt(1 + slope * slope), False
    if y < height:
        return -distance, -dx / distance, -dy / distance, at_end
    return distance, dx / distance, dy / distance, at_end
