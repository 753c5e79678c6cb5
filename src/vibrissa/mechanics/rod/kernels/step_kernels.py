"""The rod in time: steps of the backward differences of second order, each solved by Newton's method.

The scheme is implicit and damps what is faster than the step (the axial waves, the ringing of an impact), so that
impacts are inelastic; what rings in the first modes it damps by a share of (ω h)³/4 only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from vibrissa.arrays import Array, Integers
from vibrissa.mechanics.rod.kernels.band_kernels import HALF, WIDTH, solve_band
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness, Touch, add_contacts, find_near, keep_drag
from vibrissa.mechanics.rod.kernels.elastic_kernels import Segments, add_elastic, bend
from vibrissa.mechanics.rod.kernels.ground import Ground
from vibrissa.mechanics.rod.kernels.shaft import Shaft

_ITERATIONS, _CAREFUL = 40, 12  # at most; from where on by halves
_FARTHEST = 1e-3  # over L (an angle at the base: rad): no iteration moves a node farther

COLUMNS = 19  # of the record beside the projections


class Damping(NamedTuple):
    """Viscous damping: C = a₀M + a₁K + Σ cᵢ (Mφᵢ)(Mφᵢ)ᵀ.

    Attributes
    ----------
    mass, stiffness : float
        a₀ and a₁, over 1/k and k.
    shape : (M, 2N + 3) array
        Mφᵢ.
    modal : (M,) array
        cᵢ.
    """

    mass: float
    stiffness: float
    shape: Array
    modal: Array


class Follicle(NamedTuple):
    """How the base is held: by springs between it and what drives it, damped in proportion as the shaft is.

    Attributes
    ----------
    translation : float
        Stiffness against translation, over EI/L³ of the base; infinite where the base is clamped.
    rotation : float
        Stiffness against rotation, over EI/L of the base; infinite where the base is clamped.
    """

    translation: float = np.inf
    rotation: float = np.inf


CLAMPED = Follicle()


class State(NamedTuple):
    """Positions and rates of now and of the two steps before, (2N + 3,) each: x and y of the nodes, the base's angle.

    Attributes
    ----------
    at, before, earlier : (2N + 3,) arrays
        Positions.
    rate, rate_before, rate_earlier : (2N + 3,) arrays
        Rates.
    force : (2N + 8,) array
        Work space: see :func:`vibrissa.mechanics.rod.kernels.band_kernels.solve_band`.
    matrix : (2N + 8, 11) array
        Work space.
    totals : (3,) array
        Since the start: work of the ground on the shaft, work of what drives the base, energy that friction dissipated.
    counts : (2,) array
        Iterations, and steps that did not converge.
    """

    at: Array
    before: Array
    earlier: Array
    rate: Array
    rate_before: Array
    rate_earlier: Array
    force: Array
    matrix: Array
    totals: Array
    counts: Integers


def at_rest(at: Array) -> State:
    """A rod that does not move.

    Parameters
    ----------
    at : (2N + 3,) array
        Positions.

    Returns
    -------
    State
        With no rates.
    """
    return State(
        at=at.copy(),
        before=at.copy(),
        earlier=at.copy(),
        rate=np.zeros_like(at),
        rate_before=np.zeros_like(at),
        rate_earlier=np.zeros_like(at),
        force=np.zeros(at.size + HALF),
        matrix=np.zeros((at.size + HALF, WIDTH)),
        totals=np.zeros(3),
        counts=np.zeros(2, np.int64),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _add_inertia(shaft: Shaft, damping: Damping, step: float, state: State) -> None:
    """Set rates, inertia and the damping by mass; begin forces and their derivatives."""
    per_rate = 1.5 / step
    state.force[:] = 0.0
    state.matrix[:] = 0.0
    for i in range(state.at.size):
        state.rate[i] = (3 * state.at[i] - 4 * state.before[i] + state.earlier[i]) / (2 * step)
    for i in range(2 * shaft.s.size):
        faster = (3 * state.rate[i] - 4 * state.rate_before[i] + state.rate_earlier[i]) / (2 * step)
        mass = shaft.mass[i // 2]
        state.force[i] = -mass * (faster + damping.mass * state.rate[i])
        state.matrix[i, HALF] = mass * per_rate * (per_rate + damping.mass)
    for mode in range(damping.modal.size):
        if damping.modal[mode] == 0:
            continue
        along = 0.0
        for i in range(state.at.size):
            along += damping.shape[mode, i] * state.rate[i]
        for i in range(state.at.size):  # its derivative is left out: it is small, and not a band
            state.force[i] -= damping.modal[mode] * damping.shape[mode, i] * along


@njit(cache=True, nogil=True, error_model="numpy")
def _hold_base(follicle: Follicle, damping: Damping, drive: Array, moved: Array, step: float, state: State) -> None:
    """Clamp the base to the drive, or add the springs of the follicle. ``moved``: the drive's rate."""
    size = state.at.size
    for k in range(3):
        i = size - 3 + k
        spring = follicle.rotation if k == 2 else follicle.translation
        if np.isfinite(spring):
            stretch = state.at[i] - drive[2 + k] + damping.stiffness * (state.rate[i] - moved[2 + k])
            state.force[i] -= spring * stretch
            state.matrix[i, HALF] += spring * (1 + damping.stiffness * 1.5 / step)
        else:
            state.matrix[i, :] = 0.0
            state.matrix[i, HALF] = 1.0
            state.force[i] = drive[2 + k] - state.at[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(
    shaft: Shaft,
    ground: Ground,
    stiffness: Stiffness,
    damping: Damping,
    follicle: Follicle,
    drive: Array,
    moved: Array,
    step: float,
    tolerance: float,
    state: State,
    touch: Touch,
    work: Segments,
) -> None:
    """Newton's method for one step."""
    shift, travel = (drive[0], drive[1]), (moved[0] * step, moved[1] * step)
    for i in range(state.at.size):
        state.at[i] = state.before[i] + step * (1.5 * state.rate_before[i] - 0.5 * state.rate_earlier[i])
    for k in range(3):
        if not np.isfinite(follicle.rotation if k == 2 else follicle.translation):
            state.at[state.at.size - 3 + k] = drive[2 + k]
    find_near(shaft, ground, shift, state.at, touch)
    for iteration in range(_ITERATIONS):
        state.counts[0] += 1
        _add_inertia(shaft, damping, step, state)
        bend(shaft, damping.stiffness, state.at, state.rate, work)
        add_elastic(shaft, damping.stiffness, 1.5 / step, state.at, state.rate, work, state.force, state.matrix)
        add_contacts(shaft, ground, stiffness, shift, travel, state.at, state.before, touch, state.force, state.matrix)
        _hold_base(follicle, damping, drive, moved, step, state)
        solve_band(state.matrix, state.force)
        largest = 0.0
        for i in range(state.at.size):
            largest = max(largest, abs(state.force[i]))
        part = min(1.0 if iteration < _CAREFUL else 0.5, _FARTHEST / max(largest, _FARTHEST))
        for i in range(state.at.size):
            state.at[i] += part * state.force[i]
        if not largest > tolerance:
            return
    state.counts[1] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def advance(
    shaft: Shaft,
    ground: Ground,
    stiffness: Stiffness,
    damping: Damping,
    follicle: Follicle,
    drive: Array,
    step: float,
    tolerance: float,
    every: int,
    project: Array,
    state: State,
    touch: Touch,
    work: Segments,
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
    step : float
        Time of one step, over k.
    tolerance : float
        Largest motion of the last iteration, over L.
    every : int
        Steps for each line of the record.
    project : (M, 2N + 3) array
        What is recorded of the positions, as their inner products.
    state, touch, work : State, Touch, Segments
        Changed.
    record : (T // every, M + 19) array
        Written: the products; force of the shaft on the follicle (x, y) and moment; what ``Touch.summary`` names;
        kinetic energy, energy of bending and stretching, power of viscous damping; ``State.totals``; steps that did not
        converge.
    shapes : (T // every, 2N + 3) or (0, 0) array
        Written: the positions.
    """
    moved = np.zeros(5)
    for k in range(1, drive.shape[0]):
        for axis in range(5):
            moved[axis] = (drive[k, axis] - drive[k - 1, axis]) / step
        _solve(shaft, ground, stiffness, damping, follicle, drive[k], moved, step, tolerance, state, touch, work)
        keep_drag(touch)
        for i in range(state.at.size):
            state.rate[i] = (3 * state.at[i] - 4 * state.before[i] + state.earlier[i]) / (2 * step)
        bend(shaft, damping.stiffness, state.at, state.rate, work)
        state.totals[0] += touch.summary[7]
        state.totals[1] += step * _power_at_base(shaft, damping, moved, step, state, work)
        state.totals[2] += touch.summary[8]
        state.earlier[:], state.before[:] = state.before, state.at
        state.rate_earlier[:], state.rate_before[:] = state.rate_before, state.rate
        if k % every == 0:
            _write(shaft, damping, project, state, touch, work, record[k // every - 1])
            if shapes.size:
                shapes[k // every - 1] = state.at


@njit(cache=True, nogil=True, error_model="numpy")
def _power_at_base(shaft: Shaft, damping: Damping, moved: Array, step: float, state: State, work: Segments) -> float:
    """Power of the base on the shaft, as of a clamp: it bears the last segment and moves the last half cell."""
    count = shaft.rest.size
    power = moved[4] * work.moment[count]
    for axis in range(2):
        i = 2 * count + axis
        faster = (3 * state.rate[i] - 4 * state.rate_before[i] + state.rate_earlier[i]) / (2 * step)
        pull = work.force_x[count - 1] if axis == 0 else work.force_y[count - 1]
        power += moved[2 + axis] * (pull + shaft.mass[count] * (faster + damping.mass * state.rate[i]))
    return power


@njit(cache=True, nogil=True, error_model="numpy")
def _write(
    shaft: Shaft, damping: Damping, project: Array, state: State, touch: Touch, work: Segments, line: Array
) -> None:
    """One line of the record."""
    count, modes = shaft.rest.size, project.shape[0]
    for mode in range(modes):
        line[mode] = 0.0
        for i in range(state.at.size):
            line[mode] += project[mode, i] * state.at[i]
    line[modes], line[modes + 1] = -work.force_x[count - 1], -work.force_y[count - 1]
    line[modes + 2] = work.moment[count]
    line[modes + 3 : modes + 12] = touch.summary
    line[modes + 12], line[modes + 13], line[modes + 14] = _energies(shaft, damping, state, work)
    line[modes + 15 : modes + 18] = state.totals
    line[modes + 18] = state.counts[1]


@njit(cache=True, nogil=True, error_model="numpy")
def _energies(shaft: Shaft, damping: Damping, state: State, work: Segments) -> tuple[float, float, float]:
    """Kinetic energy, elastic energy, and power of the viscous damping."""
    kinetic = elastic = lost = 0.0
    for i in range(shaft.s.size):
        square = state.rate[2 * i] ** 2 + state.rate[2 * i + 1] ** 2
        kinetic += 0.5 * shaft.mass[i] * square
        lost += damping.mass * shaft.mass[i] * square
    for mode in range(damping.modal.size):
        lost += damping.modal[mode] * np.dot(damping.shape[mode], state.rate) ** 2
    for j in range(shaft.rest.size):
        ex, ey = state.at[2 * j + 2] - state.at[2 * j], state.at[2 * j + 3] - state.at[2 * j + 1]
        length = np.sqrt(ex * ex + ey * ey)
        along = ex * (state.rate[2 * j + 2] - state.rate[2 * j]) + ey * (state.rate[2 * j + 3] - state.rate[2 * j + 1])
        elastic += 0.5 * shaft.axial[j] * (length - shaft.rest[j]) ** 2
        lost += damping.stiffness * shaft.axial[j] * (along / length) ** 2
    for i in range(1, shaft.s.size):
        last = i == shaft.rest.size
        after = state.at[-1] if last else work.angle[i]
        after_rate = state.rate[-1] if last else work.angle_rate[i]
        turn, turning = after - work.angle[i - 1] - shaft.rest_angle[i], after_rate - work.angle_rate[i - 1]
        elastic += 0.5 * shaft.bending[i] * turn**2
        lost += damping.stiffness * shaft.bending[i] * turning**2
    return kinetic, elastic, lost
