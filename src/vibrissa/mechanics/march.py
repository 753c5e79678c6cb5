"""Profiles on the flat and on an edge: the scaled Eq. (1) marched from the contact, in compiled loops.

With x = s/ε and ψ = θ − θ_ε, in ln x: ψ' = n/x², n' = Λ̂ cos(φ − ψ) − n, X' = x cos ψ, Y' = x sin ψ, where n = m/x. A
state holds (ψ, n, X, Y) and then their derivatives by Λ̂. The longest step in ln x of the method, of
order 6, is the caller's: 0.05 errs by 1e-9 of the displacements, 0.0125 by a few 1e-13.
"""

from __future__ import annotations

import numpy as np
from numba import njit

LONGEST = 0.0125  # step in ln x where profiles must be known to round-off
_STRIDE = 0.01  # [L] longest step of the excursion from one solution to the next
_BACK = 6  # solutions from which the next is foretold
_SHORTEST = 1e-8  # [L] step below which a profile is given up: the fold
_ARRIVED = 1e-9  # last step of Newton, of ε, θ_ε and ln x; of Λ̂ over its value: the next would be of its square
_ITERATIONS = 30

# Butcher's method of order 6 in seven stages, at 0, 1/3, 2/3, 1/3, 1/2, 1/2 and 1 of the step
_STAGES = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 3, 0, 0, 0, 0, 0],
        [0, 2 / 3, 0, 0, 0, 0],
        [1 / 12, 1 / 3, -1 / 12, 0, 0, 0],
        [-1 / 16, 9 / 8, -3 / 16, -3 / 8, 0, 0],
        [0, 9 / 8, -3 / 8, -3 / 4, 1 / 2, 0],
        [9 / 44, -9 / 11, 63 / 44, 18 / 11, 0, -16 / 11],
    ]
)
_WEIGHTS = np.array([11 / 120, 0, 27 / 40, 27 / 40, -4 / 15, -4 / 15, 11 / 120])


@njit(cache=True, nogil=True, error_model="numpy")
def _slope(x, state, load, cos_phi, sin_phi, out):  # type: ignore[no-untyped-def]
    sin, cos, square = np.sin(state[0]), np.cos(state[0]), 1 / x**2
    toward = cos_phi * cos + sin_phi * sin
    out[0], out[1], out[2], out[3] = state[1] * square, load * toward - state[1], x * cos, x * sin
    across = sin_phi * cos - cos_phi * sin
    out[4], out[5] = state[5] * square, toward + load * across * state[4] - state[5]
    out[6], out[7] = -x * sin * state[4], x * cos * state[4]


@njit(cache=True, nogil=True, error_model="numpy")
def onwards(state, at, to, load, phi, longest, trial, slopes):  # type: ignore[no-untyped-def]
    """Carry a state (8,) at one ln x on to another, in place; ``trial`` (8,) and ``slopes`` (7, 8) are room to work."""
    cos, sin = np.cos(phi), np.sin(phi)
    steps = int(np.ceil(abs(to - at) / longest))
    h, x = (to - at) / max(steps, 1), np.exp(at)
    third, half = np.exp(h / 3), np.exp(h / 2)
    for _ in range(steps):
        places = (x, x * third, x * third**2, x * third, x * half, x * half, x * half**2)
        for stage in range(7):
            trial[:] = state
            for k in range(stage):
                if _STAGES[stage, k] != 0:
                    for i in range(8):
                        trial[i] += h * _STAGES[stage, k] * slopes[k, i]
            _slope(places[stage], trial, load, cos, sin, slopes[stage])
        for k in range(7):
            for i in range(8):
                state[i] += h * _WEIGHTS[k] * slopes[k, i]
        x *= half**2


@njit(cache=True, nogil=True, error_model="numpy")
def march(load, phi, log_x, longest, states):  # type: ignore[no-untyped-def]
    """States (P, 8) at ln x (P,), ever farther from the contact at 0, to either side."""
    state, trial, slopes, at = np.zeros(8), np.empty(8), np.empty((7, 8)), 0.0
    for j in range(log_x.size):
        onwards(state, at, log_x[j], load, phi, longest, trial, slopes)
        at = log_x[j]
        states[j] = state


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivity(contact, turn, base, matrix):  # type: ignore[no-untyped-def]
    """Derivatives (3, 3) of (θ_b, D, H) by (ε, θ_ε, Λ̂) from the state at the base; returns D, H and the determinant.

    The determinant is negative before the fold and 0 on it.
    """
    cos, sin, x = np.cos(turn), np.sin(turn), 1 / contact
    along, up = contact * base[2], contact * base[3]
    distance, height = along * cos - up * sin, along * sin + up * cos
    a, b = base[2] - x * np.cos(base[0]), base[3] - x * np.sin(base[0])
    c, d = contact * base[6], contact * base[7]
    matrix[0] = (-base[1] * contact, 1.0, base[4])
    matrix[1] = (a * cos - b * sin, -height, c * cos - d * sin)
    matrix[2] = (a * sin + b * cos, distance, c * sin + d * cos)
    return distance, height, _determinant(matrix)


@njit(cache=True, nogil=True, error_model="numpy")
def _determinant(m):  # type: ignore[no-untyped-def]
    return (
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    )


@njit(cache=True, nogil=True, error_model="numpy")
def solve3(m, determinant, right, out):  # type: ignore[no-untyped-def]
    """Solution (3,) of three linear equations, by Cramer's rule."""
    swapped = np.empty((3, 3))
    for j in range(3):
        swapped[:] = m
        swapped[:, j] = right
        out[j] = _determinant(swapped) / determinant


@njit(cache=True, nogil=True, error_model="numpy")
def correct(unknown, angle, distance, height, phi, longest):  # type: ignore[no-untyped-def]
    """Newton's method for (ε, θ_ε, Λ̂) that stand at (θ_b, D, H), in place; whether it arrived."""
    matrix, right, step, state = np.empty((3, 3)), np.zeros(3), np.empty(3), np.empty((1, 8))
    for _ in range(_ITERATIONS):
        contact, turn, load = unknown
        if not (0 < contact < 1 and load > 0 and abs(turn) < np.pi / 2):
            return False
        march(load, phi, np.array([-np.log(contact)]), longest, state)
        along, up, determinant = sensitivity(contact, turn, state[0], matrix)
        if not determinant < 0:
            return False
        right[0], right[1], right[2] = turn + state[0, 0] - angle, along - distance, up - height
        solve3(matrix, determinant, right, step)
        unknown -= step
        if abs(step[0]) + abs(step[1]) + abs(step[2]) / load < _ARRIVED:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def hold(unknown, angle, distance, height, phi, ahead, longest):  # type: ignore[no-untyped-def]
    """Carry a solution (ε, θ_ε, Λ̂) that stands at (θ_b, D, H) on to D + ahead, in place; whether it got there."""
    return carry(unknown, angle, distance, height, phi, ahead, 0.0, longest)


@njit(cache=True, nogil=True, error_model="numpy")
def carry(unknown, angle, distance, height, phi, ahead, up, longest):  # type: ignore[no-untyped-def]
    """Carry a solution (ε, θ_ε, Λ̂) that stands at (θ_b, D, H) on to D + ahead, H + up, in place, as :func:`hold`."""
    done, stride, way = 0.0, 1.0, np.hypot(ahead, up)
    while done < 1:
        stride = min(stride, _STRIDE / way)
        to = 1.0 if stride >= 1 - done else done + stride
        trial = unknown.copy()
        if correct(trial, angle, distance + to * ahead, height + to * up, phi, longest):
            unknown[:] = trial
            done, stride = to, 2 * (to - done)
        else:
            stride = (to - done) / 2
            if stride * way < _SHORTEST:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def place(unknown, phi, s, longest, x, y, tilt):  # type: ignore[no-untyped-def]
    """Positions x, y (P,) from the base and angles θ of ascending points s (P,), s[-1] = 1; straight below ε."""
    contact, turn, load = unknown
    first = np.searchsorted(s, contact)
    states = np.zeros((s.size, 8))
    march(load, phi, np.log(s[first:] / contact), longest, states[first:])
    cos, sin = np.cos(turn), np.sin(turn)
    for j in range(s.size):
        along = (states[j, 2] if j >= first else s[j] / contact - 1) - states[-1, 2]
        up = states[j, 3] - states[-1, 3]
        x[j], y[j] = contact * (along * cos - up * sin), contact * (along * sin + up * cos)
        tilt[j] = turn + states[j, 0]


@njit(cache=True, nogil=True, error_model="numpy")
def foretold(excursions, unknowns, start, d):  # type: ignore[no-untyped-def]
    """The polynomial through the start at d = 0 and the last solutions, at d."""
    first, out = max(excursions.size - _BACK, 0), np.zeros(3)
    for i in range(first - 1, excursions.size):
        here, share = (0.0 if i < first else excursions[i]), 1.0
        for j in range(first - 1, excursions.size):
            if j != i:
                there = 0.0 if j < first else excursions[j]
                share *= (d - there) / (here - there)
        out += share * (start if i < first else unknowns[i])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def follow(start, angle, distance, height, phi, excursions, s, longest, unknowns, x, y, curvature):  # type: ignore[no-untyped-def]
    """Profiles from a start (ε, θ_ε, Λ̂) at d = 0 through a chain of excursions (E,); how many of them are reached.

    ``unknowns`` (E, 3); ``x``, ``y`` (E, P) from the base at ascending points s (P,), s[-1] = 1, of the curve of Eq. 1,
    which goes on smoothly below its contact; ``curvature`` (E,) at the base, over 1/L.
    """
    unknown, before, states = start.copy(), 0.0, np.empty((s.size, 8))
    for e in range(excursions.size):
        guess = foretold(excursions[:e], unknowns, start, excursions[e])
        near = e > 1 and abs(excursions[e] - before) < _STRIDE
        if near and correct(guess, angle, distance + excursions[e], height, phi, longest):
            unknown[:] = guess
        elif not hold(unknown, angle, distance + before, height, phi, excursions[e] - before, longest):
            return e
        before = excursions[e]
        unknowns[e] = unknown
        curvature[e] = lay(unknown, phi, s, longest, states, x[e], y[e])
    return excursions.size


@njit(cache=True, nogil=True, error_model="numpy")
def lay(unknown, phi, s, longest, states, x, y):  # type: ignore[no-untyped-def]
    """Positions x, y (P,) from the base, over L, as :func:`follow` gives them; returns the curvature at the base.

    ``states`` (P, 8) is room to work.
    """
    contact, turn, load = unknown
    first = np.searchsorted(s, contact)
    march(load, phi, np.log(s[:first] / contact)[::-1], longest, states[:first][::-1])
    march(load, phi, np.log(s[first:] / contact), longest, states[first:])
    cos, sin = contact * np.cos(turn), contact * np.sin(turn)
    for j in range(s.size):
        along, up = states[j, 2] - states[-1, 2], states[j, 3] - states[-1, 3]
        x[j], y[j] = along * cos - up * sin, along * sin + up * cos
    return states[-1, 1] * contact**2


@njit(cache=True, nogil=True, error_model="numpy")
def straightened(unknowns, phi, s, longest, x, y):  # type: ignore[no-untyped-def]
    """Straight free end less Eq. 1's curve going on, (E, P) over L, at points s (E, P) that ascend to the contact."""
    states = np.empty((s.shape[1], 8))
    for e in range(len(unknowns)):
        contact, turn, load = unknowns[e]
        march(load, phi, np.log(s[e] / contact)[::-1], longest, states[::-1])
        cos, sin = contact * np.cos(turn), contact * np.sin(turn)
        for j in range(s.shape[1]):
            along, up = s[e, j] / contact - 1 - states[j, 2], -states[j, 3]
            x[e, j], y[e, j] = along * cos - up * sin, along * sin + up * cos


@njit(cache=True, nogil=True, error_model="numpy")
def unit_displacement(contact, load, phi, s, longest, out):  # type: ignore[no-untyped-def]
    """Ū = n·∂r/∂d at d = 0 of points s (P,) from ε to 1; returns the determinant, 0 or above where there is none."""
    states, matrix, gain = np.empty((s.size, 8)), np.empty((3, 3)), np.empty(3)
    march(load, phi, np.log(s / contact), longest, states)
    base = states[-1]
    _, _, determinant = sensitivity(contact, 0.0, base, matrix)
    if not determinant < 0:
        return determinant
    solve3(matrix, determinant, np.array([0.0, 1.0, 0.0]), gain)
    for j in range(s.size):
        cos, sin, x = np.cos(states[j, 0]), np.sin(states[j, 0]), s[j] / contact
        from_base = states[j] - base
        shift_x = from_base[2] - (x * cos - np.cos(base[0]) / contact)
        shift_y = from_base[3] - (x * sin - np.sin(base[0]) / contact)
        delta_x = gain[0] * shift_x + contact * (gain[2] * from_base[6] - gain[1] * from_base[3])
        delta_y = gain[0] * shift_y + contact * (gain[2] * from_base[7] + gain[1] * from_base[2])
        out[j] = -sin * delta_x + cos * delta_y
    return determinant


@njit(cache=True, nogil=True, error_model="numpy")
def excursion_at_jump(contact, load, angle, distance, height, phi, width, longest):  # type: ignore[no-untyped-def]
    """d₂ of a gap, over L, by Newton's method for (Λ̂, ln x of the near edge); NaN where none, ∞ beyond the fold.

    As :func:`vibrissa.mechanics.gap.excursion_at_jump`.
    """
    q, states, matrix = np.log1p(width / contact), np.empty((2, 8)), np.empty((3, 3))
    by = np.empty((3, 2))  # of (θ_b, H, D) by (Λ̂, q)
    for _ in range(_ITERATIONS):
        march(load, phi, np.array([q]), longest, states[:1])
        edge = states[0]
        reach = np.hypot(edge[2], edge[3])
        held, turn = width / reach, -np.arctan2(edge[3], edge[2])
        if not (0 < held < 1 and load > 0 and -np.log(held) > q > 0):
            return np.nan
        march(load, phi, np.array([q, -np.log(held)]), longest, states)
        base = states[1]
        along, up, determinant = sensitivity(held, turn, base, matrix)
        moved = ((edge[6], edge[7]), (np.exp(q) * np.cos(edge[0]), np.exp(q) * np.sin(edge[0])))
        for j in range(2):
            x, y = moved[j]
            reach_by = (edge[2] * x + edge[3] * y) / reach
            held_by, turn_by = -held * reach_by / reach, -(edge[2] * y - edge[3] * x) / reach**2
            own = 1.0 if j == 0 else 0.0
            by[0, j] = matrix[0, 0] * held_by + turn_by + own * matrix[0, 2]
            by[1, j] = matrix[2, 0] * held_by + along * turn_by + own * matrix[2, 2]
            by[2, j] = matrix[1, 0] * held_by - up * turn_by + own * matrix[1, 2]
        miss_angle, miss_height = turn + base[0] - angle, up - height
        area = by[0, 0] * by[1, 1] - by[0, 1] * by[1, 0]
        step_load = (miss_angle * by[1, 1] - miss_height * by[0, 1]) / area
        step_q = (miss_height * by[0, 0] - miss_angle * by[1, 0]) / area
        if abs(step_load) / load + abs(step_q) < _ARRIVED:
            left = step_load * by[2, 0] + step_q * by[2, 1]
            return along - left - distance if determinant < 0 else np.inf
        share = min(1.0, 0.5 * load / abs(step_load), 0.3 * q / abs(step_q))
        load, q = load - share * step_load, q - share * step_q
    return np.nan
