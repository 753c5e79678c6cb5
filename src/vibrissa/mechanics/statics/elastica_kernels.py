"""Many equilibria integrated from the contact to the base by DOP853, each in its own steps, in compiled loops."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.statics.contact_law import across
from vibrissa.mechanics.statics.runge_kutta import DORMAND_PRINCE_853, stepper

_SIZE = 4
_NODES, _ERRORS = DORMAND_PRINCE_853.nodes, DORMAND_PRINCE_853.errors
_STAGES = _NODES.size
_FIRST = 0.02  # share of the way of the first step
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 10.0  # of one step over the last
_STEPS = 100_000


@njit(nogil=True, error_model="numpy")
def _slope(t: float, state: Array, column: tuple[float, ...], out: Array) -> None:
    epsilon, span, p, friction = column
    free = 1 - epsilon
    bend = 6 / (free * (1 + 2 * epsilon))  # (1 − ε)/σ
    sin, cos = np.sin(p * state[0]), np.cos(p * state[0])
    out[0] = span * bend * state[1] * np.exp(-2 * t * span)
    out[1] = span * (across(1.0, friction, cos, sin) / free - state[1])
    out[2], out[3] = span * (sin / (p * free) - state[2]), span * (cos / free - state[3])


_step = stepper(DORMAND_PRINCE_853, _slope, _SIZE)


@njit(cache=True, nogil=True, error_model="numpy")
def ends(contact: Array, load: Array, friction: float, tolerance: float, out: Array) -> None:
    """ψ/p, H/(p(1 − ε)) and D/(1 − ε) at the base, (3, N), of contacts and loads p (N,); NaN where it gives up.

    ``tolerance``: absolute, and relative, of each step; the equations are those of ``elastica_table``, per unit of the
    normal load, of which ``friction`` is the share along the shaft.

    Parameters
    ----------
    contact, load : (N,) arrays
        ε, and p.
    friction : float
        T/N.
    tolerance : float
        Absolute, and relative, of each step.
    out : (3, N) array
        Written.
    """
    slopes, places = np.empty((_STAGES + 1, _SIZE)), np.empty(_STAGES)
    state, ahead = np.empty(_SIZE), np.empty(_SIZE)
    for c in range(contact.size):
        column = contact[c], -np.log(contact[c]), load[c], friction
        state[:] = 0.0
        at, h = 0.0, _FIRST
        _slope(at, state, column, slopes[0])
        for _ in range(_STEPS):
            h = min(h, 1 - at)
            places[:] = at + _NODES * h
            _step(places, h, state, column, slopes, ahead)
            _slope(at + h, ahead, column, slopes[_STAGES])
            miss = _error(h, state, ahead, slopes, tolerance)
            if miss < 1:
                at = 1.0 if h == 1 - at else at + h
                state[:], slopes[0] = ahead, slopes[_STAGES]
            if at == 1:
                break
            h *= min(_MOST if miss < 1 else 1.0, max(_LEAST, _SAFETY * miss**-0.125)) if miss > 0 else _MOST
        out[0, c], out[1, c], out[2, c] = state[0], state[2], state[3]
        if at < 1:
            out[:, c] = np.nan


@njit(cache=True, nogil=True, error_model="numpy")
def _error(h: float, state: Array, ahead: Array, slopes: Array, tolerance: float) -> float:
    # the estimated error of a step over what is tolerated, as scipy computes it
    fifth = third = 0.0
    for i in range(_SIZE):
        scale, by_five, by_three = tolerance * (1 + max(abs(state[i]), abs(ahead[i]))), 0.0, 0.0
        for k in range(_STAGES + 1):
            by_five, by_three = by_five + _ERRORS[0, k] * slopes[k, i], by_three + _ERRORS[1, k] * slopes[k, i]
        fifth, third = fifth + (by_five / scale) ** 2, third + (by_three / scale) ** 2
    return h * fifth / np.sqrt((fifth + 0.01 * third) * _SIZE) if fifth > 0 else 0.0
