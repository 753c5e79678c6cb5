"""The excursion at which the contact jumps over a gap, in compiled loops."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.statics.shooting import ARRIVED, ITERATIONS, Clamp, march, sensitivity


@njit(cache=True, nogil=True, error_model="numpy")
def excursion_at_jump(contact: float, load: float, clamp: Clamp, width: float, longest: float) -> float:
    """d₂ of a gap, over L, by Newton's method for (Λ̂, ln x of the near edge); NaN where none, ∞ beyond the fold.

    As :func:`vibrissa.mechanics.statics.gap.excursion_at_jump`.

    Parameters
    ----------
    contact, load : float
        ε and Λ̂ on the flat.
    clamp : Clamp
        Of the profile on the flat.
    width : float
        λ over L.
    longest : float
        Longest step in ln x.

    Returns
    -------
    float
        d₂ over L.
    """
    q, states, matrix = np.log1p(width / contact), np.empty((2, 8)), np.empty((3, 3))
    by = np.empty((3, 2))  # of (θ_b, H, D) by (Λ̂, q)
    for _ in range(ITERATIONS):
        march(load, clamp.law, np.array([q]), longest, states[:1])
        edge = states[0]
        reach = np.hypot(edge[2], edge[3])
        held, turn = width / reach, -np.arctan2(edge[3], edge[2])
        if not (0 < held < 1 and load > 0 and -np.log(held) > q > 0):
            return np.nan
        march(load, clamp.law, np.array([q, -np.log(held)]), longest, states)
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
        miss_angle, miss_height = turn + base[0] - clamp.angle, up - clamp.height
        area = by[0, 0] * by[1, 1] - by[0, 1] * by[1, 0]
        step_load = (miss_angle * by[1, 1] - miss_height * by[0, 1]) / area
        step_q = (miss_height * by[0, 0] - miss_angle * by[1, 0]) / area
        if abs(step_load) / load + abs(step_q) < ARRIVED:
            left = step_load * by[2, 0] + step_q * by[2, 1]
            return along - left - clamp.distance if determinant < 0 else np.inf
        share = min(1.0, 0.5 * load / abs(step_load), 0.3 * q / abs(step_q))
        load, q = load - share * step_load, q - share * step_q
    return np.nan


@njit(cache=True, nogil=True, error_model="numpy")
def jump_ratios(contact: float, load: float, clamp: Clamp, widths: Array, longest: float, out: Array) -> None:
    """d₂/λ² of gaps of widths λ (n,), over 1/L, which is smooth in λ: what a table of them holds.

    Parameters
    ----------
    contact, load : float
        ε and Λ̂ on the flat.
    clamp : Clamp
        Of the profile on the flat.
    widths : (n,) array
        λ over L.
    longest : float
        Longest step in ln x.
    out : (n,) array
        Written.
    """
    for k in range(widths.size):
        out[k] = excursion_at_jump(contact, load, clamp, widths[k], longest) / widths[k] ** 2
