"""What holds the base of the rod: its motion, the springs of the follicle, and its work on the shaft.

The damping by mass and by modes acts on the motion against what holds the base, in axes that turn with it: as dashpots
would between the shaft and a frame that the base carries. A shaft that swings as a stiff one is not damped.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.rod.kernels.band_kernels import HALF
from vibrissa.mechanics.rod.kernels.elastic_kernels import SegmentWork
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.rod.kernels.state import Damping, Follicle, RodState, Scheme


class Frame(NamedTuple):
    """Motion of what holds the base.

    Attributes
    ----------
    x, y : float
        Where it is.
    cosine, sine : float
        Of the angle by which it has turned since the damping's shapes were taken.
    along, up, turning : float
        Rates of x, y and angle, by the formula of the step.
    """

    x: float
    y: float
    cosine: float
    sine: float
    along: float
    up: float
    turning: float


@njit(cache=True, nogil=True, error_model="numpy")
def base_frame(angle: float, drive: Array, scheme: Scheme, state: RodState) -> Frame:
    """Frame that the base carries, at the end of a step.

    Parameters
    ----------
    angle : float
        Of what held the base where the damping's shapes were taken.
    drive : (5,) array
        Ground and base at the end of the step.
    scheme : Scheme
        Of the step.
    state : RodState
        Before it.

    Returns
    -------
    Frame
        Place, turn and rates.
    """
    turn = drive[4] - angle
    along, up = _held_rate(0, drive, scheme, state), _held_rate(1, drive, scheme, state)
    return Frame(drive[2], drive[3], np.cos(turn), np.sin(turn), along, up, _held_rate(2, drive, scheme, state))


@njit(cache=True, nogil=True, error_model="numpy")
def _held_rate(axis: int, drive: Array, scheme: Scheme, state: RodState) -> float:
    """By differences, so that the rate of a base at rest is exactly 0."""
    held = state.held
    step, last = drive[2 + axis] - held[0, axis], held[0, axis] - held[1, axis]
    return (scheme.now * step - scheme.earlier * last) / scheme.scale


@njit(cache=True, nogil=True, error_model="numpy")
def relative_rates(frame: Frame, state: RodState) -> None:
    """Rates against the frame of the base, in its axes.

    Parameters
    ----------
    frame : Frame
        Of the base.
    state : RodState
        ``drift`` is written.
    """
    for i in range(0, state.at.size - 1, 2):
        ux = state.rate[i] - (frame.along - frame.turning * (state.at[i + 1] - frame.y))
        uy = state.rate[i + 1] - (frame.up + frame.turning * (state.at[i] - frame.x))
        state.drift[i] = frame.cosine * ux + frame.sine * uy
        state.drift[i + 1] = frame.cosine * uy - frame.sine * ux
    state.drift[state.at.size - 1] = state.rate[state.at.size - 1] - frame.turning


@njit(cache=True, nogil=True, error_model="numpy")
def hold_base(
    follicle: Follicle, damping: Damping, drive: Array, frame: Frame, scheme: Scheme, state: RodState
) -> None:
    """Clamp the base to the drive, or add the springs of the follicle.

    Parameters
    ----------
    follicle : Follicle
        How the base is held.
    damping : Damping
        Of the shaft, and of the springs.
    drive : (5,) array
        Ground and base at the end of the step.
    frame : Frame
        Of the base.
    scheme : Scheme
        Of the step.
    state : RodState
        ``force`` and ``matrix`` are changed.
    """
    size = state.at.size
    rates = (frame.along, frame.up, frame.turning)
    for k in range(3):
        i = size - 3 + k
        spring = follicle.rotation if k == 2 else follicle.translation
        if np.isfinite(spring):
            stretch = state.at[i] - drive[2 + k] + damping.stiffness * (state.rate[i] - rates[k])
            state.force[i] -= spring * stretch
            state.matrix[i, HALF] += spring * (1 + damping.stiffness * scheme.per_rate)
        else:
            state.matrix[i, :] = 0.0
            state.matrix[i, HALF] = 1.0
            state.force[i] = drive[2 + k] - state.at[i]


@njit(cache=True, nogil=True, error_model="numpy")
def work_at_base(
    shaft: RodShaft, damping: Damping, moved: Array, scheme: Scheme, frame: Frame, state: RodState, work: SegmentWork
) -> float:
    """Work of what holds the base on the shaft in a step, as of a clamp, by the mean of the loads at its two ends.

    The load is that on the last segment and the last half cell, less what the damping's dashpots bear.

    Parameters
    ----------
    shaft : RodShaft
        The rod.
    damping : Damping
        Of it.
    moved : (5,) array
        Mean rates of ground and base in the step.
    scheme : Scheme
        Of the step.
    frame : Frame
        Of the base.
    state : RodState
        At the end of the step; ``load`` is written.
    work : SegmentWork
        At the end of the step.

    Returns
    -------
    float
        Over force unit and L.
    """
    count = shaft.rest.size
    before = (state.load[0], state.load[1], state.load[2])
    drag_x, drag_y, drag_turn = _dashpots(shaft, damping, frame, state)
    for axis in range(2):
        i = 2 * count + axis
        past = scheme.now * state.rate[i] - scheme.before * state.rate_before[i]
        faster = (past + scheme.earlier * state.rate_earlier[i]) / scheme.scale
        pull = work.force_x[count - 1] if axis == 0 else work.force_y[count - 1]
        state.load[axis] = pull + shaft.mass[count] * faster - (drag_x if axis == 0 else drag_y)
    state.load[2] = work.moment[count] - drag_turn
    if state.counts[3] == 0:
        before = (state.load[0], state.load[1], state.load[2])
    done = 0.0
    for k in range(3):
        done += 0.5 * scheme.step * moved[2 + k] * (before[k] + state.load[k])
    return done


@njit(cache=True, nogil=True, error_model="numpy")
def _dashpots(shaft: RodShaft, damping: Damping, frame: Frame, state: RodState) -> tuple[float, float, float]:
    """Force of the shaft on the dashpots of the damping by mass and by modes, x, y and moment about the base.

    The clamp's own half cell does not move against it.
    """
    fx = fy = turn = 0.0
    for term in range(damping.modal.size + 1):
        size = damping.mass
        if term > 0:
            size = damping.modal[term - 1]
            size *= np.dot(damping.shape[term - 1], state.drift) if size != 0 else 0.0
        for node in range(shaft.rest.size if size != 0 else 0):
            ix, iy = 2 * node, 2 * node + 1
            if term == 0:
                dx, dy = shaft.mass[node] * state.drift[ix], shaft.mass[node] * state.drift[iy]
            else:
                dx, dy = damping.shape[term - 1, ix], damping.shape[term - 1, iy]
            gx, gy = size * (frame.cosine * dx - frame.sine * dy), size * (frame.cosine * dy + frame.sine * dx)
            fx, fy = fx + gx, fy + gy
            turn += (state.at[ix] - frame.x) * gy - (state.at[iy] - frame.y) * gx
    return fx, fy, turn
