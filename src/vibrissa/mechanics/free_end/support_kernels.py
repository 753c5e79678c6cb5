"""Which support the motion asks for: contacts that roll, turn, touch or let go."""

from __future__ import annotations

import numpy as np

from vibrissa.loops import njit
from vibrissa.mechanics.free_end.phases import BRIDGE, FAR, FLOOR, LAND, MODES, NEAR, TIP, Passage, Work
from vibrissa.mechanics.free_end.tables import Tables
from vibrissa.mechanics.vibration.excitation import horner

NEVER = -1


@njit(inline="always", error_model="numpy")
def next_support(
    support: int, t: float, tau: float, gap: int, last: int, tables: Tables, course: Passage, work: Work
) -> int:
    """Support that the motion asks for, or NEVER: of the amplitudes ``work.now``, tau after the phase's start."""
    n, powers = work.now.size, work.still.shape[1]
    if support == BRIDGE:
        return NEVER
    if support == LAND:
        return _leaves_land(t, tau, gap, last, tables, course, work)
    if support == FLOOR:
        place = course.width[last] - course.speed * (t - course.begin[last])
        moment = tables.at[1] * place
        for part in range(2):
            moment -= tables.at[2 + part] * horner(work.held[part], powers, tau)[0]
        for i in range(n):
            moment += tables.roll[i] * work.now[i]
        return NEAR if moment < 0 and tau >= course.wait else NEVER
    angle = horner(work.turned, powers, tau)[0]
    for i in range(n):
        angle += tables.turn[MODES[support], i] * work.now[i]
    if support == FAR:
        return _leaves_far(t, tau, angle, gap, tables, course, work)
    angle -= work.rest[0] * np.exp(-tau / tables.relaxation)
    if angle < 0 and tau >= course.wait:
        return LAND
    if support == TIP:
        return NEVER
    place = course.width[last] - course.speed * (t - course.begin[last])
    if place > 1.02 * course.least and angle * (course.free_end + place) >= course.depth:
        return FLOOR
    return NEVER


@njit(inline="always", error_model="numpy")
def _leaves_land(t: float, tau: float, gap: int, last: int, tables: Tables, course: Passage, work: Work) -> int:
    """The contact rolls to the next far edge, or to the tip or the near edge behind it."""
    if tau < course.wait and tau > 0:
        return NEVER
    rolled = 0.0
    for i in range(work.now.size):
        rolled += tables.roll[i] * work.now[i]
    rolled /= tables.at[1]
    if gap < course.begin.size and rolled > -course.speed * (t - course.begin[gap]):
        return FAR
    if last < 0:
        return NEVER
    end = -course.free_end
    if t >= course.begin[last] + course.free_end / course.speed:
        end = max(end, -course.speed * (t - course.end[last]))
    return NEVER if rolled >= end else TIP if end == -course.free_end else NEAR


@njit(inline="always", error_model="numpy")
def _leaves_far(t: float, tau: float, angle: float, gap: int, tables: Tables, course: Passage, work: Work) -> int:
    """The shaft lies down on the land again, or comes to the near edge."""
    if angle > 1e-12 and tau >= course.wait:
        return LAND
    d = course.speed * (t - course.begin[gap])
    x = course.width[gap] - d
    if x <= 0:
        return BRIDGE
    e = tables.at[0]
    s = e + x
    height = tables.at[1] * (x / (6 * e**2) + 1 / (2 * s) - e / (6 * s**2) - 1 / (3 * e)) + angle * d
    n, power = work.now.size, 1.0
    for k in range(tables.rise.shape[1]):
        power *= x
        rise = tables.rise[n, k] * d
        for i in range(n):
            rise += tables.rise[i, k] * work.now[i]
        height += rise * power
    return BRIDGE if height <= 0 else NEVER
