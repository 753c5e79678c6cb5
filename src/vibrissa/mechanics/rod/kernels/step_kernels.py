"""The rod in time: steps of the backward differences of second order, each solved by Newton's method.

The scheme is implicit and damps what is faster than the step (the axial waves, the ringing of an impact), so that
impacts are inelastic; what rings in the first modes it damps by a share of (ω h)³/4 only. A step whose iterations do
not end is redone in halves, and those in halves again, by the formula for steps of unequal length.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.rod.kernels.band_kernels import HALF, solve_band
from vibrissa.mechanics.rod.kernels.base_kernels import Frame, base_frame, hold_base, relative_rates, work_at_base
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness, Touch, add_contacts, find_near, keep_drag
from vibrissa.mechanics.rod.kernels.elastic_kernels import SegmentWork, add_elastic, bend
from vibrissa.mechanics.rod.kernels.ground import Ground
from vibrissa.mechanics.rod.kernels.record_kernels import write_line
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.rod.kernels.state import Damping, Follicle, RodState, Scheme

_ITERATIONS, _CAREFUL = 40, 12  # at most; from where on by halves
_FARTHEST = 1e-3  # over L (an angle at the base: rad): no iteration moves a node farther


class Method(NamedTuple):
    """How the steps are solved.

    Attributes
    ----------
    step : float
        Time of one step, over k.
    tolerance : float
        Largest motion of the last iteration, over L.
    halvings : int
        How often a step that does not converge is halved; 0 leaves it as it is.
    """

    step: float
    tolerance: float
    halvings: int


@njit(cache=True, nogil=True, error_model="numpy")
def _even(step: float) -> Scheme:
    """The formula for steps of one length."""
    return Scheme(step, 3.0, 4.0, 1.0, 2 * step, 1.5 / step, 1.5, 0.5)


@njit(cache=True, nogil=True, error_model="numpy")
def _uneven(step: float, last: float) -> Scheme:
    """The formula for a step after one of another length."""
    ratio = step / last
    now = (1 + 2 * ratio) / (1 + ratio)
    return Scheme(step, now, 1 + ratio, ratio**2 / (1 + ratio), step, now / step, 1 + ratio / 2, ratio / 2)


@njit(cache=True, nogil=True, error_model="numpy")
def _set_rates(scheme: Scheme, state: RodState) -> None:
    """Rates of the positions."""
    for i in range(state.at.size):
        past = scheme.now * state.at[i] - scheme.before * state.before[i] + scheme.earlier * state.earlier[i]
        state.rate[i] = past / scheme.scale


@njit(cache=True, nogil=True, error_model="numpy")
def _add_inertia(shaft: RodShaft, damping: Damping, scheme: Scheme, frame: Frame, state: RodState) -> None:
    """Set rates, inertia and the damping by mass; begin forces and their derivatives."""
    state.force[:] = 0.0
    state.matrix[:] = 0.0
    _set_rates(scheme, state)
    relative_rates(frame, state)
    for node in range(shaft.s.size):
        mass, x, y = shaft.mass[node], state.drift[2 * node], state.drift[2 * node + 1]
        drift = (frame.cosine * x - frame.sine * y, frame.cosine * y + frame.sine * x)
        for axis in range(2):
            i = 2 * node + axis
            past = scheme.now * state.rate[i] - scheme.before * state.rate_before[i]
            faster = (past + scheme.earlier * state.rate_earlier[i]) / scheme.scale
            state.force[i] = -mass * (faster + damping.mass * (drift[0] if axis == 0 else drift[1]))
            state.matrix[i, HALF] = mass * scheme.per_rate * (scheme.per_rate + damping.mass)
    for mode in range(damping.modal.size):
        if damping.modal[mode] == 0:
            continue
        along = 0.0
        for i in range(state.at.size):
            along += damping.shape[mode, i] * state.drift[i]
        for node in range(shaft.s.size):  # its derivative is left out: it is small, and not a band
            x, y = damping.shape[mode, 2 * node], damping.shape[mode, 2 * node + 1]
            state.force[2 * node] -= damping.modal[mode] * (frame.cosine * x - frame.sine * y) * along
            state.force[2 * node + 1] -= damping.modal[mode] * (frame.cosine * y + frame.sine * x) * along


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(
    shaft: RodShaft,
    ground: Ground,
    stiffness: Stiffness,
    damping: Damping,
    follicle: Follicle,
    drive: Array,
    moved: Array,
    scheme: Scheme,
    tolerance: float,
    state: RodState,
    touch: Touch,
    work: SegmentWork,
) -> bool:
    """Newton's method for one step; whether its iterations ended."""
    step, frame = scheme.step, base_frame(damping.angle, drive, scheme, state)
    shift, travel = (drive[0], drive[1]), (moved[0] * step, moved[1] * step)
    for i in range(state.at.size):
        ahead = scheme.ahead * state.rate_before[i] - scheme.behind * state.rate_earlier[i]
        state.at[i] = state.before[i] + step * ahead
    for k in range(3):
        if not np.isfinite(follicle.rotation if k == 2 else follicle.translation):
            state.at[state.at.size - 3 + k] = drive[2 + k]
    find_near(shaft, ground, shift, state.at, touch)
    for iteration in range(_ITERATIONS):
        state.counts[0] += 1
        _add_inertia(shaft, damping, scheme, frame, state)
        bend(shaft, damping.stiffness, state.at, state.rate, work)
        add_elastic(shaft, damping.stiffness, scheme.per_rate, state.at, state.rate, work, state.force, state.matrix)
        add_contacts(shaft, ground, stiffness, shift, travel, state.at, state.before, touch, state.force, state.matrix)
        hold_base(follicle, damping, drive, frame, scheme, state)
        solve_band(state.matrix, state.force)
        largest = 0.0
        for i in range(state.at.size):
            largest = max(largest, abs(state.force[i]))
        part = min(1.0 if iteration < _CAREFUL else 0.5, _FARTHEST / max(largest, _FARTHEST))
        for i in range(state.at.size):
            state.at[i] += part * state.force[i]
        if not largest > tolerance:
            return bool(np.isfinite(largest))
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _finish(
    shaft: RodShaft, damping: Damping, drive: Array, moved: Array, scheme: Scheme, state: RodState, touch: Touch,
    work: SegmentWork,
) -> None:  # fmt: skip
    """Keep what a step, or a part of one, has found; count its work."""
    keep_drag(touch)
    _set_rates(scheme, state)
    frame = base_frame(damping.angle, drive, scheme, state)
    relative_rates(frame, state)
    bend(shaft, damping.stiffness, state.at, state.rate, work)
    state.totals[0] += touch.summary[7]
    state.totals[1] += work_at_base(shaft, damping, moved, scheme, frame, state, work)
    state.totals[2] += touch.summary[8]
    state.earlier[:], state.before[:] = state.before, state.at
    state.rate_earlier[:], state.rate_before[:] = state.rate_before, state.rate
    state.held[1], state.held[0] = state.held[0], drive[2:]


@njit(cache=True, nogil=True, error_model="numpy")
def _in_parts(
    shaft: RodShaft,
    ground: Ground,
    stiffness: Stiffness,
    damping: Damping,
    follicle: Follicle,
    drives: Array,
    place: Array,
    moved: Array,
    method: Method,
    state: RodState,
    touch: Touch,
    work: SegmentWork,
) -> None:
    """Redo a step in halves, and those that do not converge in halves again; ``place`` is work space."""
    start, held_x, held_y, held_angle = state.kept, state.held[0, 0], state.held[0, 1], state.held[0, 2]
    start[0], start[1] = state.before, state.earlier
    start[2], start[3] = state.rate_before, state.rate_earlier
    state.counts[2] += 1
    level, done, last = 1, 0.0, method.step
    while done < 1:
        part = 0.5**level
        scheme = _uneven(part * method.step, last)
        for axis in range(drives.shape[1]):
            moved[axis] = (drives[1, axis] - drives[0, axis]) / method.step
            place[axis] = drives[0, axis] + (done + part) * (drives[1, axis] - drives[0, axis])
        ended = _solve(
            shaft, ground, stiffness, damping, follicle, place, moved, scheme, method.tolerance, state, touch, work
        )
        if not ended and level < method.halvings:
            level += 1
            continue
        if not ended:
            state.counts[1] += 1
        _finish(shaft, damping, place, moved, scheme, state, touch, work)
        done, last = done + part, scheme.step
    state.earlier[:], state.rate_earlier[:] = start[0], start[2]
    state.held[1, 0], state.held[1, 1], state.held[1, 2] = held_x, held_y, held_angle


@njit(cache=True, nogil=True, error_model="numpy")
def advance(
    shaft: RodShaft,
    ground: Ground,
    stiffness: Stiffness,
    damping: Damping,
    follicle: Follicle,
    drive: Array,
    method: Method,
    every: int,
    project: Array,
    state: RodState,
    touch: Touch,
    work: SegmentWork,
    record: Array,
    shapes: Array,
) -> None:
    """Carry the rod through the steps of a drive.

    Parameters
    ----------
    shaft, ground, stiffness, damping, follicle
        The rod, the ground, and what is between them.
    drive : (T + 1, 5) array
        Before the first step and after each: x and y of the ground's origin, x and y of the base, its angle.
    method : Method
        How the steps are solved.
    every : int
        Steps for each line of the record.
    project : (M, 2N + 3) array
        What is recorded of the positions, as their inner products.
    state, touch, work : RodState, Touch, SegmentWork
        Changed. Of a state that was at rest, the base was at rest where the drive begins.
    record : (T // every, M + 21) array
        Written: the products; force of the shaft on the follicle (x, y) and moment; what ``Touch.summary`` names;
        kinetic energy, energy of bending and stretching, power of viscous damping; ``RodState.totals``; steps that
        did not converge.
    shapes : (T // every, 2N + 3) or (0, 0) array
        Written: the positions.
    """
    moved, place, scheme = np.zeros(5), np.zeros(5), _even(method.step)
    if state.counts[3] == 0:
        state.held[0], state.held[1] = drive[0, 2:], drive[0, 2:]
    for k in range(1, drive.shape[0]):
        for axis in range(5):
            moved[axis] = (drive[k, axis] - drive[k - 1, axis]) / method.step
        ended = _solve(
            shaft, ground, stiffness, damping, follicle, drive[k], moved, scheme, method.tolerance, state, touch, work
        )
        if ended or method.halvings == 0:
            state.counts[1] += not ended
            _finish(shaft, damping, drive[k], moved, scheme, state, touch, work)
        else:
            both = drive[k - 1 : k + 1]
            _in_parts(
                shaft, ground, stiffness, damping, follicle, both, place, moved, method, state, touch, work
            )  # fmt: skip
        state.counts[3] += 1
        if k % every == 0:
            write_line(shaft, damping, project, state, touch, work, record[k // every - 1])
            if shapes.size:
                shapes[k // every - 1] = state.at
