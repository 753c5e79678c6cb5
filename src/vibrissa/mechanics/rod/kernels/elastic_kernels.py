"""Elastic forces of the rod, with damping in proportion to them, and their derivatives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.rod.kernels.band_kernels import HALF, add_block
from vibrissa.mechanics.rod.kernels.shaft import RodShaft


class SegmentWork(NamedTuple):
    """Work space: what is computed for each segment and node at every iteration.

    Attributes
    ----------
    angle, angle_rate : (N,) arrays
        Of each segment to the substrate, and its rate.
    turn_x, turn_y : (N,) arrays
        Derivatives of the angle by the two components of the segment.
    moment : (N + 1,) array
        Bending moment at each node.
    force_x, force_y : (N,) arrays
        Force that each segment exerts on its node nearer to the tip; the other bears the opposite.
    """

    angle: Array
    angle_rate: Array
    turn_x: Array
    turn_y: Array
    moment: Array
    force_x: Array
    force_y: Array


def segments(count: int) -> SegmentWork:
    """Work space of a rod of this number of segments.

    Parameters
    ----------
    count : int
        N.

    Returns
    -------
    SegmentWork
        Zeros.
    """
    sizes = (count, count, count, count, count + 1, count, count)
    return SegmentWork(*(np.zeros(size) for size in sizes))


@njit(cache=True, nogil=True, error_model="numpy")
def bend(shaft: RodShaft, damping: float, at: Array, rate: Array, work: SegmentWork) -> None:
    """Angles of the segments and moments at the nodes.

    Parameters
    ----------
    shaft : RodShaft
        N segments.
    damping : float
        Time by which the strain's rate counts beside the strain, over k.
    at, rate : (2N + 3,) arrays
        x and y of the nodes in turn, then the angle of the base; and their rates.
    work : SegmentWork
        Written.
    """
    count = shaft.rest.size
    for j in range(count):
        ex, ey = at[2 * j + 2] - at[2 * j], at[2 * j + 3] - at[2 * j + 1]
        square = ex * ex + ey * ey
        work.turn_x[j], work.turn_y[j] = -ey / square, ex / square
        work.angle[j] = np.arctan2(ey, ex)
        across = work.turn_x[j] * (rate[2 * j + 2] - rate[2 * j])
        work.angle_rate[j] = across + work.turn_y[j] * (rate[2 * j + 3] - rate[2 * j + 1])
    work.moment[0] = 0.0
    for i in range(1, count + 1):
        after, after_rate = at[2 * count + 2], rate[2 * count + 2]
        if i < count:
            after, after_rate = work.angle[i], work.angle_rate[i]
        strain = after - work.angle[i - 1] - shaft.rest_angle[i]
        work.moment[i] = shaft.bending[i] * (strain + damping * (after_rate - work.angle_rate[i - 1]))


@njit(cache=True, nogil=True, error_model="numpy")
def add_elastic(
    shaft: RodShaft,
    damping: float,
    per_rate: float,
    at: Array,
    rate: Array,
    work: SegmentWork,
    force: Array,
    matrix: Array,
) -> None:
    """Add the elastic forces, and minus their derivatives by the motion.

    Parameters
    ----------
    shaft : RodShaft
        N segments.
    damping : float
        Time by which the strain's rate counts beside the strain, over k.
    per_rate : float
        Derivative of the rate by the position, in the step in time.
    at, rate : (2N + 3,) arrays
        State, see :func:`bend`.
    work : SegmentWork
        From :func:`bend`; the forces of the segments are written.
    force : (2N + 3,) array
        Added to.
    matrix : (2N + 3, 11) array
        Added to.
    """
    count = shaft.rest.size
    stiffer = 1 + damping * per_rate
    for j in range(count):
        ex, ey = at[2 * j + 2] - at[2 * j], at[2 * j + 3] - at[2 * j + 1]
        square = ex * ex + ey * ey
        length = np.sqrt(square)
        tx, ty = ex / length, ey / length
        along = tx * (rate[2 * j + 2] - rate[2 * j]) + ty * (rate[2 * j + 3] - rate[2 * j + 1])
        tension = shaft.axial[j] * (length - shaft.rest[j] + damping * along)
        shear = work.moment[j] - work.moment[j + 1]
        fx, fy = tension * tx + shear * work.turn_x[j], tension * ty + shear * work.turn_y[j]
        work.force_x[j], work.force_y[j] = fx, fy
        force[2 * j] += fx
        force[2 * j + 1] += fy
        force[2 * j + 2] -= fx
        force[2 * j + 3] -= fy
        stretch, string = shaft.axial[j] * stiffer, tension / length
        bx, by = 2 * ex * ey / square**2, (ey * ey - ex * ex) / square**2  # second derivatives of the angle
        angular = stiffer * (shaft.bending[j] + shaft.bending[j + 1])
        xx = stretch * tx * tx + string * ty * ty + shear * bx + angular * work.turn_x[j] ** 2
        xy = (stretch - string) * tx * ty + shear * by + angular * work.turn_x[j] * work.turn_y[j]
        yy = stretch * ty * ty + string * tx * tx - shear * bx + angular * work.turn_y[j] ** 2
        _add_pair(matrix, j, j, (xx, xy, xy, yy))
        if j > 0:
            _couple(matrix, j, stiffer * shaft.bending[j], work)
    _couple_base(matrix, count, stiffer * shaft.bending[count], work, force)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_pair(matrix: Array, i: int, j: int, block: tuple[float, float, float, float]) -> None:
    """What couples segment j's difference of positions to segment i's force."""
    minus = (-block[0], -block[1], -block[2], -block[3])
    add_block(matrix, i, j, block)
    add_block(matrix, i, j + 1, minus)
    add_block(matrix, i + 1, j, minus)
    add_block(matrix, i + 1, j + 1, block)


@njit(cache=True, nogil=True, error_model="numpy")
def _couple(matrix: Array, j: int, stiffness: float, work: SegmentWork) -> None:
    """The bending at node j couples the segments j − 1 and j."""
    ax, ay, bx, by = -stiffness * work.turn_x[j - 1], -stiffness * work.turn_y[j - 1], work.turn_x[j], work.turn_y[j]
    _add_pair(matrix, j - 1, j, (ax * bx, ax * by, ay * bx, ay * by))
    _add_pair(matrix, j, j - 1, (ax * bx, ay * bx, ax * by, ay * by))


@njit(cache=True, nogil=True, error_model="numpy")
def _couple_base(matrix: Array, count: int, stiffness: float, work: SegmentWork, force: Array) -> None:
    """The bending at the base couples the last segment to the base's angle; the moment turns the base."""
    last = 2 * count + 2
    force[last] -= work.moment[count]
    matrix[last, HALF] += stiffness
    turns = (work.turn_x[count - 1], work.turn_y[count - 1])
    for axis in range(2):
        near, far = 2 * count - 2 + axis, 2 * count + axis
        pull = stiffness * turns[axis]  # the angle of the segment rises with its far node
        matrix[last, HALF + near - last] += pull
        matrix[near, HALF + last - near] += pull
        matrix[last, HALF + far - last] -= pull
        matrix[far, HALF + last - far] -= pull
