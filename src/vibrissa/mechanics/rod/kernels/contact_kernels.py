"""Contact of the rod with the ground: nodes on its pieces, the shaft between nodes on its edges, friction that sticks.

The ground yields as a stiff spring along the normal of the contact. Friction is a spring along the tangent whose force
is held back to what the contact law allows (the return mapping of plasticity): below it the contact sticks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.loops import njit
from vibrissa.mechanics.rod.kernels.band_kernels import add_block
from vibrissa.mechanics.rod.kernels.ground import Ground, clearance
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.statics.contact_law import ContactLaw, friction_ratio

_BEARS = 1e-2  # normal force over s² above which a contact counts: a hundredth of what it bears at rest, or less
MARGIN = 1e-3  # over L: what is farther from the ground cannot touch it within a step
_CLOSE = 2.5e-4  # the same of an edge under the shaft
_CLEAR = 1e-12  # over L: above the errors of rounding

Point = tuple[float, float, float, float, float, float]  # normal, tangent, gap, slip
Push = tuple[float, float, float, float, float, float, float, bool]  # force, its four derivatives, drag, sticks


class Stiffness(NamedTuple):
    """Stiffness of the ground, over force unit and L, and the law of friction.

    Attributes
    ----------
    normal, tangential : float
        Of the two springs.
    law : ContactLaw
        What friction allows.
    """

    normal: float
    tangential: float
    law: ContactLaw


class Touch(NamedTuple):
    """What the contacts remember from step to step, and their work space.

    Attributes
    ----------
    node_drag, edge_drag : (N + 1,) and (C,) arrays
        Force of friction on each node, and at each edge, after the last step.
    node_drag_now, edge_drag_now : (N + 1,) and (C,) arrays
        The same at this iteration.
    edge, segment : (C,) arrays
        Edges that may touch within this step, and the segments over them.
    near : (2,) array
        How many nodes from the tip on may touch, and how many of the edges.
    summary : (11,) array
        Of this iteration: normal force, force of friction, s of the first contact and of the last, how many contacts,
        how many of them stick; energy stored in the ground, work of the ground on the shaft in this step, energy that
        friction dissipated in it; x of those two contacts, in the frame of the ground.
    """

    node_drag: Array
    edge_drag: Array
    node_drag_now: Array
    edge_drag_now: Array
    edge: Integers
    segment: Integers
    near: Integers
    summary: Array


def untouched(nodes: int, edges: int) -> Touch:
    """No contact as yet.

    Parameters
    ----------
    nodes, edges : int
        Of the rod and of the ground.

    Returns
    -------
    Touch
        Zeros.
    """
    whole = np.zeros(edges, np.int64)
    drag = (np.zeros(nodes), np.zeros(edges), np.zeros(nodes), np.zeros(edges))
    return Touch(*drag, whole, whole.copy(), np.zeros(2, np.int64), np.zeros(11))


@njit(cache=True, nogil=True, error_model="numpy")
def find_near(shaft: RodShaft, ground: Ground, shift: tuple[float, float], at: Array, touch: Touch) -> None:
    """Find the nodes and the edges that may touch within this step.

    Parameters
    ----------
    shaft : RodShaft
        The rod.
    ground : Ground
        The ground.
    shift : tuple of 2 floats
        Where the ground's origin is.
    at : (U,) array
        Positions.
    touch : Touch
        ``edge``, ``segment`` and ``near`` are written.
    """
    reach = ground.top + shift[1] + MARGIN
    near = 0
    for i in range(shaft.s.size):
        if at[2 * i + 1] - shaft.radius[i] < reach:
            near = i + 1
    touch.near[0], touch.near[1] = near, 0
    if near == 0:
        return
    count = shaft.rest.size
    last = min(near, count)
    low = np.searchsorted(ground.edge_x, min(at[0], at[2]) - shift[0] - MARGIN)
    j = 0
    for k in range(low, ground.edge.size):
        x, y = ground.edge_x[k] + shift[0], ground.y[ground.edge[k]] + shift[1]
        if x > at[2 * last] + MARGIN:
            break
        while j < count - 1 and at[2 * j + 2] <= x:
            j += 1
        while j > 0 and at[2 * j] > x:
            j -= 1
        lower = min(at[2 * j + 1], at[2 * j + 3]) - shaft.radius[j + 1]
        if lower - y < _CLOSE:
            touch.edge[touch.near[1]], touch.segment[touch.near[1]] = k, j
            touch.near[1] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _push(point: Point, drag: float, local: float, stiffness: Stiffness) -> Push:
    """Force of one contact on the shaft and minus its derivatives (xx, xy, yx, yy) by the motion of the point."""
    nx, ny, tx, ty, gap, slip = point
    normal = -stiffness.normal * gap
    trial = drag - stiffness.tangential * slip
    ratio, slope = friction_ratio(stiffness.law, normal / local**2)
    most = normal * ratio
    along, by_normal, sticks = stiffness.tangential, 0.0, abs(trial) <= most
    if not sticks:
        sign = 1.0 if trial > 0 else -1.0
        trial, along, by_normal = sign * most, 0.0, -sign * (ratio + slope) * stiffness.normal
    across = stiffness.normal
    xx = across * nx * nx + along * tx * tx - by_normal * tx * nx
    xy = across * nx * ny + along * tx * ty - by_normal * tx * ny
    yx = across * ny * nx + along * ty * tx - by_normal * ty * nx
    yy = across * ny * ny + along * ty * ty - by_normal * ty * ny
    return normal * nx + trial * tx, normal * ny + trial * ty, xx, xy, yx, yy, trial, sticks


@njit(cache=True, nogil=True, error_model="numpy")
def _note(
    summary: Array,
    point: Point,
    push: Push,
    drag: float,
    s: float,
    x: float,
    travel: tuple[float, float],
    stiffness: Stiffness,
) -> None:
    """Add one contact to the summary; what bears next to nothing is not counted as a contact."""
    normal, now = -stiffness.normal * point[4], push[6]
    if normal > _BEARS * s**2:
        if summary[4] == 0 or s < summary[2]:
            summary[2], summary[9] = s, x
        if summary[4] == 0 or s > summary[3]:
            summary[3], summary[10] = s, x
        summary[4] += 1
        summary[5] += push[7]
    summary[0] += normal
    summary[1] += now
    summary[6] += 0.5 * (normal**2 / stiffness.normal + now**2 / stiffness.tangential)
    summary[7] += push[0] * travel[0] + push[1] * travel[1]
    summary[8] -= now * (point[5] - (drag - now) / stiffness.tangential)


@njit(cache=True, nogil=True, error_model="numpy")
def add_contacts(
    shaft: RodShaft,
    ground: Ground,
    stiffness: Stiffness,
    shift: tuple[float, float],
    travel: tuple[float, float],
    at: Array,
    before: Array,
    touch: Touch,
    force: Array,
    matrix: Array,
) -> None:
    """Add the forces of all contacts, and minus their derivatives by the motion.

    Parameters
    ----------
    shaft : RodShaft
        The rod.
    ground : Ground
        The ground.
    stiffness : Stiffness
        Of the ground, and friction.
    shift, travel : tuple of 2 floats
        Where the ground's origin is, and how far it moved in this step.
    at, before : (U,) arrays
        Positions now and after the last step.
    touch : Touch
        From :func:`find_near`; ``node_drag_now``, ``edge_drag_now`` and ``summary`` are written.
    force : (U,) array
        Added to.
    matrix : (U, 11) array
        Added to.
    """
    touch.summary[:] = 0.0
    for i in range(touch.near[0]):
        touch.node_drag_now[i] = 0.0
        if at[2 * i + 1] - shaft.radius[i] > ground.top + shift[1]:
            continue
        last = before[2 * i + 1] - shift[1] + travel[1]
        gap, nx, ny, corner = clearance(ground, at[2 * i] - shift[0], at[2 * i + 1] - shift[1], last, shaft.radius[i])
        gap -= shaft.radius[i]
        if gap >= 0 or (corner and i > 0):  # the shaft between nodes meets edges below
            continue
        slip = (at[2 * i] - before[2 * i] - travel[0]) * ny - (at[2 * i + 1] - before[2 * i + 1] - travel[1]) * nx
        point = (nx, ny, ny, -nx, gap, slip)
        push = _push(point, touch.node_drag[i], shaft.s[i], stiffness)
        force[2 * i] += push[0]
        force[2 * i + 1] += push[1]
        add_block(matrix, i, i, push[2:6])
        touch.node_drag_now[i] = push[6]
        _note(touch.summary, point, push, touch.node_drag[i], shaft.s[i], at[2 * i] - shift[0], travel, stiffness)
    for i in range(touch.near[0], shaft.s.size):
        touch.node_drag_now[i] = 0.0
    for k in range(touch.near[1]):
        j, corner = touch.segment[k], ground.edge[touch.edge[k]]
        touch.edge_drag_now[touch.edge[k]] = 0.0
        ex, ey = at[2 * j + 2] - at[2 * j], at[2 * j + 3] - at[2 * j + 1]
        dx, dy = ground.x[corner] + shift[0] - at[2 * j], ground.y[corner] + shift[1] - at[2 * j + 1]
        if dx * ey - dy * ex > (max(shaft.radius[j], shaft.radius[j + 1]) + _CLEAR) * (abs(ex) + abs(ey)):
            continue  # most edges of a relief
        _add_edge(shaft, ground, stiffness, shift, travel, at, before, touch, k, force, matrix)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_edge(
    shaft: RodShaft,
    ground: Ground,
    stiffness: Stiffness,
    shift: tuple[float, float],
    travel: tuple[float, float],
    at: Array,
    before: Array,
    touch: Touch,
    k: int,
    force: Array,
    matrix: Array,
) -> None:
    """The shaft between two nodes on one edge of the ground."""
    edge, j = touch.edge[k], touch.segment[k]
    ax, ay = at[2 * j], at[2 * j + 1]
    ex, ey = at[2 * j + 2] - ax, at[2 * j + 3] - ay
    corner = ground.edge[edge]
    dx, dy = ground.x[corner] + shift[0] - ax, ground.y[corner] + shift[1] - ay
    length = np.sqrt(ex * ex + ey * ey)
    tx, ty = ex / length, ey / length
    share = (dx * tx + dy * ty) / length
    if share < 0 or share > 1:
        if j == 0 and share < 0:
            return  # the tip's own node meets it
        share = min(1.0, max(0.0, share))
    near, far = 1 - share, share
    gap = dx * ty - dy * tx - near * shaft.radius[j] - far * shaft.radius[j + 1]
    if gap >= 0 or gap < -MARGIN:
        return
    slip = 0.0
    for axis, direction in ((0, tx), (1, ty)):
        moved = near * (at[2 * j + axis] - before[2 * j + axis]) + far * (
            at[2 * j + 2 + axis] - before[2 * j + 2 + axis]
        )
        slip += (moved - travel[axis]) * direction
    local = near * shaft.s[j] + far * shaft.s[j + 1]
    point = (-ty, tx, tx, ty, gap, slip)
    push = _push(point, touch.edge_drag[edge], local, stiffness)
    touch.edge_drag_now[edge] = push[6]
    for a, share_a in ((j, near), (j + 1, far)):
        force[2 * a] += share_a * push[0]
        force[2 * a + 1] += share_a * push[1]
        for b, share_b in ((j, near), (j + 1, far)):
            both = share_a * share_b
            add_block(matrix, a, b, (both * push[2], both * push[3], both * push[4], both * push[5]))
    _note(touch.summary, point, push, touch.edge_drag[edge], local, ground.x[corner], travel, stiffness)


@njit(cache=True, nogil=True, error_model="numpy")
def keep_drag(touch: Touch) -> None:
    """Keep the friction of this step for the next.

    Parameters
    ----------
    touch : Touch
        ``node_drag`` and ``edge_drag`` are written.
    """
    touch.node_drag[:] = touch.node_drag_now
    for k in range(touch.near[1]):
        touch.edge_drag[touch.edge[k]] = touch.edge_drag_now[touch.edge[k]]
