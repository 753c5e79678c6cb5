"""Profiles carried from one clamp of the base to the next, in compiled loops; names as in ``shooting``."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.statics.shooting import STRIDE, Clamp, correct, moved

_BACK = 6  # solutions from which the next is predicted
_SHORTEST = 1e-8  # [L] step below which a profile is given up: the fold


@njit(cache=True, nogil=True, error_model="numpy")
def carry(unknown: Array, clamp: Clamp, ahead: float, up: float, longest: float) -> bool:
    """Carry the solution (ε, θ_ε, Λ̂) of a clamp on to D + ahead, H + up, in place; whether it got there.

    Parameters
    ----------
    unknown : (3,) array
        In and out.
    clamp : Clamp
        Where it starts.
    ahead, up : float
        How far D and H change, over L.
    longest : float
        Longest step in ln x.

    Returns
    -------
    bool
        Whether it got there.
    """
    done, stride, way = 0.0, 1.0, np.hypot(ahead, up)
    while done < 1:
        stride = min(stride, STRIDE / way)
        to = 1.0 if stride >= 1 - done else done + stride
        trial = unknown.copy()
        if correct(trial, moved(clamp, to * ahead, to * up), longest):
            unknown[:] = trial
            done, stride = to, 2 * (to - done)
        else:
            stride = (to - done) / 2
            if stride * way < _SHORTEST:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def predicted(excursions: Array, unknowns: Array, start: Array, d: float) -> Array:
    """The polynomial through the start at d = 0 and the last solutions, at d.

    Parameters
    ----------
    excursions : (E,) array
        Of the solutions so far.
    unknowns : (E or more, 3) array
        The solutions.
    start : (3,) array
        That at d = 0.
    d : float
        Over L.

    Returns
    -------
    (3,) array
        ε, θ_ε and Λ̂ to start from.
    """
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
def chain(start: Array, clamp: Clamp, excursions: Array, longest: float, unknowns: Array) -> int:
    """Solutions from a start (ε, θ_ε, Λ̂) through excursions (E,) into ``unknowns`` (E, 3); how many it reaches.

    Each is predicted from the last ones where they are near, else carried there step by step.

    Parameters
    ----------
    start : (3,) array
        ε, θ_ε and Λ̂ at d = 0.
    clamp : Clamp
        At d = 0.
    excursions : (E,) array
        d over L, each near the one before.
    longest : float
        Longest step in ln x.
    unknowns : (E, 3) array
        Written.

    Returns
    -------
    int
        How many are reached.
    """
    unknown, before = start.copy(), 0.0
    for e in range(excursions.size):
        guess = predicted(excursions[:e], unknowns, start, excursions[e])
        near = e > 1 and abs(excursions[e] - before) < STRIDE
        if near and correct(guess, moved(clamp, excursions[e], 0.0), longest):
            unknown[:] = guess
        elif not carry(unknown, moved(clamp, before, 0.0), excursions[e] - before, 0.0, longest):
            return e
        before = excursions[e]
        unknowns[e] = unknown
    return excursions.size
