"""The march from support to support: free modes and polynomials in each phase, exact between events.

Times are over k, lengths over L. In every phase Ä + 2ζωȦ + ω²(A − Q) = 0 of each mode's whole amplitude A = q + Q:
damping acts on the whole motion, as in the rod.
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.free_end.phases import BRIDGE, FAR, FLOOR, LAND, MODES, NEAR, TIP, Passage, Phases, Work
from vibrissa.mechanics.free_end.support_kernels import NEVER, next_support
from vibrissa.mechanics.free_end.tables import Tables
from vibrissa.mechanics.vibration.excitation import horner

_HALVINGS = 7  # of a step of the march: events are found to within 3 µs


@njit(inline="always", error_model="numpy")
def _expand(series: Array, place: float, rate: float, out: Array) -> None:
    """Powers of τ of Σ_k series[k] (place + rate τ)^k."""
    out[:] = series
    for i in range(series.size):
        for k in range(series.size - 2, i - 1, -1):
            out[k] += place * out[k + 1]
    factor = 1.0
    for k in range(series.size):
        out[k] *= factor
        factor *= rate


@njit(inline="always", error_model="numpy")
def _particular(still: Array, omega: float, zeta: float, out: Array) -> None:
    """Q that solves q̈ + 2ζωq̇ + ω²q = −Q̈ − 2ζωQ̇."""
    out[:] = 0.0
    n = still.size
    for k in range(n - 2, -1, -1):
        force = -2 * zeta * omega * (k + 1) * (still[k + 1] + out[k + 1])
        if k + 2 < n:
            force -= (k + 1) * (k + 2) * (still[k + 2] + out[k + 2])
        out[k] = force / omega**2


@njit(inline="always", error_model="numpy")
def _begin(support: int, t: float, gap: int, tables: Tables, course: Passage, work: Work) -> None:
    """Polynomials of a phase, and its free motion, from the whole amplitudes."""
    land = support % 2 == 0
    n, side = work.whole.size, MODES[support]
    work.held[:] = 0.0
    if land:
        if support != LAND:
            path = course.bridge if support == BRIDGE else course.floor
            slip = rate = 0.0
            for i in range(n):
                slip += tables.slip[i] * work.whole[i]
                rate += tables.slip[i] * work.rate[i]
            width = course.width[gap]
            place = ((t - course.begin[gap]) * course.speed + slip) / width
            for part in range(2):
                _expand(path[part, gap], place, (course.speed + rate) / width, work.held[part])
        for i in range(n):
            for k in range(work.still.shape[1]):
                work.still[i, k] = tables.held[0, 0, i] * work.held[0, k] + tables.held[0, 1, i] * work.held[1, k]
    else:
        _excursion(support, t, gap, tables, course, work)
    for i in range(n):
        omega, zeta = tables.kappa[side, i], tables.zeta[side, i]
        _particular(work.still[i], omega, zeta, work.forced[i])
        q, rate = work.whole[i] - work.still[i, 0], work.rate[i] - work.still[i, 1]
        work.free[0, i] = q - work.forced[i, 0]
        decay = zeta * omega
        work.free[1, i] = (rate - work.forced[i, 1] + decay * work.free[0, i]) / (omega * np.sqrt(1 - zeta**2))


@njit(inline="always", error_model="numpy")
def _excursion(support: int, t: float, gap: int, tables: Tables, course: Passage, work: Work) -> None:
    """Amplitudes and angle of the shaft at rest on an edge, and how much of the angle the modes leave out."""
    n, powers = work.whole.size, work.still.shape[1]
    speed = course.speed
    if support == FAR:
        d = (t - course.begin[gap]) * speed
    else:
        d = (t - course.end[gap]) * speed
        if d >= course.free_end * (1 - 1e-12):
            d, speed = course.free_end, 0.0
    work.still[:] = 0.0
    work.turned[:] = 0.0
    if support == TIP:
        for i in range(n):
            work.still[i, 0] = tables.stub[i] * course.free_end
        work.turned[0] = tables.stub[n] * course.free_end
    elif d < -1e-12 and support == NEAR:
        for i in range(n):
            _expand(tables.excursion[i], d, speed, work.still[i])
        _expand(tables.excursion[n], d, speed, work.turned)
    else:
        for i in range(n):
            work.still[i, 0], work.still[i, 1] = tables.slope[i] * d, tables.slope[i] * speed
        work.turned[0], work.turned[1] = tables.slope[n] * d, tables.slope[n] * speed
    for k in range(powers):
        work.rest[k] = work.turned[k]
        for i in range(n):
            work.rest[k] -= tables.turn[MODES[support], i] * work.still[i, k]


@njit(inline="always", error_model="numpy")
def _vibration(tau: float, support: int, tables: Tables, work: Work) -> None:
    """Amplitudes q at a time since the phase's start."""
    side = MODES[support]
    for i in range(work.now.size):
        omega, zeta = tables.kappa[side, i], tables.zeta[side, i]
        turn, size = omega * np.sqrt(1 - zeta**2) * tau, np.exp(-zeta * omega * tau)
        work.now[i] = size * (work.free[0, i] * np.cos(turn) + work.free[1, i] * np.sin(turn))
        work.now[i] += horner(work.forced[i], work.forced.shape[1], tau)[0]


@njit(inline="always", error_model="numpy")
def _due(support: int, t: float, gap: int, last: int, course: Passage, stop: float) -> tuple[float, int]:
    """When the phase ends at the latest, and the support then."""
    if support in (FAR, BRIDGE):
        off, following = course.begin[gap] + course.free_end / course.speed, NEAR
        if support == BRIDGE:
            if course.end[gap] <= off:
                off, following = course.end[gap], LAND
            if t + course.look < off:
                off, following = t + course.look, BRIDGE
    elif support == FLOOR:
        off, following = course.begin[last] + (course.width[last] - course.least) / course.speed, NEAR
        if t + course.look < off:
            off, following = t + course.look, FLOOR
    elif support == NEAR and t < course.end[last] - 1e-12:
        off, following = course.end[last], NEAR
    elif support == NEAR and t < course.end[last] + course.free_end / course.speed - 1e-12:
        off, following = course.end[last] + course.free_end / course.speed, TIP
    elif support == NEAR:
        off, following = t, TIP
    elif support == TIP and gap < course.begin.size:
        off, following = course.begin[gap] + course.free_end / course.speed, NEAR
    else:
        return stop, NEVER
    return (max(off, t), following) if off < stop else (stop, NEVER)


@njit(inline="always", error_model="numpy")
def _until(
    support: int, t: float, due: float, gap: int, last: int, tables: Tables, course: Passage, work: Work
) -> tuple[float, int]:
    """First time at which the motion asks for another support, and which; or the time it is due."""
    span, before = due - t, 0.0
    if support == BRIDGE:
        return due, NEVER
    work.moved[:] = work.free
    while True:
        tau = before + course.step
        if tau < span:
            _step(support, tau, work)
        else:
            tau = span
            _vibration(tau, support, tables, work)
        found = next_support(support, t + tau, tau, gap, last, tables, course, work)
        if found != NEVER:
            low, high = before, tau
            for _ in range(_HALVINGS):
                middle = (low + high) / 2
                _vibration(middle, support, tables, work)
                earlier = next_support(support, t + middle, middle, gap, last, tables, course, work)
                if earlier != NEVER:
                    high, found = middle, earlier
                else:
                    low = middle
            return t + high, found
        if tau >= span:
            return due, NEVER
        before = tau


@njit(inline="always", error_model="numpy")
def _step(support: int, tau: float, work: Work) -> None:
    """Amplitudes q a step later."""
    moved, powers = work.moved, work.forced.shape[1]
    c, s = work.ahead[MODES[support]]
    for i in range(work.now.size):
        x, y = moved[0, i], moved[1, i]
        moved[0, i], moved[1, i] = x * c[i] + y * s[i], y * c[i] - x * s[i]
        work.now[i] = moved[0, i]
    if support != LAND:
        for i in range(work.now.size):
            work.now[i] += horner(work.forced[i], powers, tau)[0]


@njit(inline="always", error_model="numpy")
def _prepare(step: float, tables: Tables, work: Work) -> None:
    """Rest, and what a step does to each mode."""
    work.whole[:] = 0.0
    work.rate[:] = 0.0
    for side in range(3):
        for i in range(work.now.size):
            omega, zeta = tables.kappa[side, i], tables.zeta[side, i]
            turn, size = omega * np.sqrt(1 - zeta**2) * step, np.exp(-zeta * omega * step)
            work.ahead[side, 0, i], work.ahead[side, 1, i] = size * np.cos(turn), size * np.sin(turn)


@njit(inline="always", error_model="numpy")
def _hand_over(tau: float, support: int, following: int, tables: Tables, work: Work) -> None:
    """Whole amplitudes and rates at the end of a phase, as the next support has them."""
    land, side, to = support % 2 == 0, MODES[support], MODES[following]
    n = work.whole.size
    powers = work.still.shape[1]
    for i in range(n):
        omega, zeta = tables.kappa[side, i], tables.zeta[side, i]
        decay, fast = zeta * omega, omega * np.sqrt(1 - zeta**2)
        size, c, s = np.exp(-decay * tau), np.cos(fast * tau), np.sin(fast * tau)
        x = size * (work.free[0, i] * c + work.free[1, i] * s)
        y = size * (work.free[1, i] * c - work.free[0, i] * s)
        value, rate = horner(work.forced[i], powers, tau)
        work.now[i], work.rate[i] = x + value, fast * y - decay * x + rate
        if not land:
            value, rate = horner(work.still[i], powers, tau)
            work.now[i] += value
            work.rate[i] += rate
    turn, turning = horner(work.held[0], powers, tau)
    lift, lifting = horner(work.held[1], powers, tau)
    if side == to:
        for i in range(n):
            work.whole[i] = work.now[i]
    else:
        matrix = tables.change[to, side]
        work.whole[:] = matrix @ work.now
        work.rate[:] = matrix @ work.rate
    if land:
        for i in range(n):
            work.whole[i] += turn * tables.held[to, 0, i] + lift * tables.held[to, 1, i]
            work.rate[i] += turning * tables.held[to, 0, i] + lifting * tables.held[to, 1, i]


@njit(cache=True, nogil=True, error_model="numpy")
def march(tables: Tables, course: Passage, stop: float, work: Work, phases: Phases) -> int:
    """Carry the shaft over all gaps.

    Parameters
    ----------
    tables : Tables
        Of the shaft.
    course : Passage
        Of the gaps.
    stop : float
        When it ends, over k.
    work : Work
        Room.
    phases : Phases
        Written.

    Returns
    -------
    int
        How many phases; −1 where there is no room for them.
    """
    gap, last, support = 0, -1, LAND
    t = min(course.begin[0], 0.0) - 1.0
    count = 0
    _prepare(course.step, tables, work)
    while t < stop:
        if count == phases.start.size:
            return -1
        borne = gap if support in (FAR, BRIDGE) else last
        _begin(support, t, borne, tables, course, work)
        _write(count, t, support, borne, work, phases)
        count += 1
        due, planned = _due(support, t, gap, last, course, stop)
        end, asked = _until(support, t, due, gap, last, tables, course, work)
        following = asked if asked != NEVER else planned
        if following == NEVER:
            break
        _hand_over(end - t, support, following, tables, work)
        if (support in (FAR, BRIDGE, TIP) and following == NEAR) or (support == BRIDGE and following == LAND):
            last, gap = gap, gap + 1
        t, support = end, following
    return count


@njit(inline="always", error_model="numpy")
def _write(e: int, t: float, support: int, gap: int, work: Work, phases: Phases) -> None:
    phases.start[e], phases.support[e], phases.gap[e] = t, support, gap
    phases.free[e], phases.held[e] = work.free, work.held
    phases.forced[e] = work.forced
    if support % 2:
        phases.forced[e] += work.still
