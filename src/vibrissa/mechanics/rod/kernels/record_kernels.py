"""What is recorded of the rod after a step: projections, loads, contacts and energies."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.rod.kernels.contact_kernels import Touch
from vibrissa.mechanics.rod.kernels.elastic_kernels import SegmentWork
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.rod.kernels.state import Damping, RodState

COLUMNS = 21  # of the record beside the projections


@njit(cache=True, nogil=True, error_model="numpy")
def write_line(
    shaft: RodShaft, damping: Damping, project: Array, state: RodState, touch: Touch, work: SegmentWork, line: Array
) -> None:
    """Write one line of the record.

    Parameters
    ----------
    shaft : RodShaft
        The rod.
    damping : Damping
        Of it.
    project : (M, 2N + 3) array
        What is recorded of the positions, as their inner products.
    state, touch, work : RodState, Touch, SegmentWork
        After a step.
    line : (M + 21,) array
        Written, as :func:`vibrissa.mechanics.rod.kernels.step_kernels.advance` says.
    """
    count, modes = shaft.rest.size, project.shape[0]
    for mode in range(modes):
        line[mode] = 0.0
        for i in range(state.at.size):
            line[mode] += project[mode, i] * state.at[i]
    line[modes], line[modes + 1] = -work.force_x[count - 1], -work.force_y[count - 1]
    line[modes + 2] = work.moment[count]
    line[modes + 3 : modes + 14] = touch.summary
    line[modes + 14], line[modes + 15], line[modes + 16] = _energies(shaft, damping, state, work)
    line[modes + 17 : modes + 20] = state.totals
    line[modes + 20] = state.counts[1]


@njit(cache=True, nogil=True, error_model="numpy")
def _energies(shaft: RodShaft, damping: Damping, state: RodState, work: SegmentWork) -> tuple[float, float, float]:
    """Kinetic energy, elastic energy, and power of the viscous damping."""
    kinetic = elastic = lost = 0.0
    for i in range(shaft.s.size):
        kinetic += 0.5 * shaft.mass[i] * (state.rate[2 * i] ** 2 + state.rate[2 * i + 1] ** 2)
        lost += damping.mass * shaft.mass[i] * (state.drift[2 * i] ** 2 + state.drift[2 * i + 1] ** 2)
    for mode in range(damping.modal.size):
        lost += damping.modal[mode] * np.dot(damping.shape[mode], state.drift) ** 2
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
