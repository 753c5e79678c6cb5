"""Many equilibria marched from the contact to the base by DOP853, each in its own steps, in compiled loops."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.integrate import DOP853

_SIZE, _STAGES = 4, 12
_A, _B, _C = (np.ascontiguousarray(one, float) for one in (DOP853.A, DOP853.B, DOP853.C))
_E3, _E5 = (np.ascontiguousarray(one, float) for one in (DOP853.E3, DOP853.E5))
_FIRST = 0.02  # share of the way of the first step
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 10.0  # of one step over the last
_STEPS = 100_000


@njit(cache=True, nogil=True, error_model="numpy")
def ends(contact, load, friction, tolerance, out):  # type: ignore[no-untyped-def]
    """ψ/p, H/(p(1 − ε)) and D/(1 − ε) at the base, (3, N), of contacts and loads p (N,); NaN where it gives up.

    ``tolerance``: absolute, and relative, of each step; the equations are those of ``family``'s march.
    """
    slopes, state, ahead = np.empty((_STAGES + 1, _SIZE)), np.empty(_SIZE), np.empty(_SIZE)
    for c in range(contact.size):
        column = contact[c], -np.log(contact[c]), load[c], friction
        state[:] = 0.0
        at, h = 0.0, _FIRST
        _slope(at, state, column, slopes[0])
        for _ in range(_STEPS):
            h = min(h, 1 - at)
            miss = _step(at, h, state, column, tolerance, slopes, ahead)
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
def _slope(t, state, column, out):  # type: ignore[no-untyped-def]
    epsilon, span, p, friction = column
    free = 1 - epsilon
    bend = 6 / (free * (1 + 2 * epsilon))  # (1 − ε)/σ
    sin, cos = np.sin(p * state[0]), np.cos(p * state[0])
    out[0] = span * bend * state[1] * np.exp(-2 * t * span)
    out[1] = span * ((cos + friction * sin) / free - state[1])
    out[2], out[3] = span * (sin / (p * free) - state[2]), span * (cos / free - state[3])


@njit(cache=True, nogil=True, error_model="numpy")
def _step(t, h, state, column, tolerance, slopes, ahead):  # type: ignore[no-untyped-def]
    # the state after h, and its estimated error over what is tolerated, as scipy reckons it
    for stage in range(1, _STAGES):
        ahead[:] = state
        for k in range(stage):
            if _A[stage, k] != 0:
                for i in range(_SIZE):
                    ahead[i] += h * _A[stage, k] * slopes[k, i]
        _slope(t + _C[stage] * h, ahead, column, slopes[stage])
    ahead[:] = state
    for k in range(_STAGES):
        for i in range(_SIZE):
            ahead[i] += h * _B[k] * slopes[k, i]
    _slope(t + h, ahead, column, slopes[_STAGES])
    fifth = third = 0.0
    for i in range(_SIZE):
        scale, by_five, by_three = tolerance * (1 + max(abs(state[i]), abs(ahead[i]))), 0.0, 0.0
        for k in range(_STAGES + 1):
            by_five, by_three = by_five + _E5[k] * slopes[k, i], by_three + _E3[k] * slopes[k, i]
        fifth, third = fifth + (by_five / scale) ** 2, third + (by_three / scale) ** 2
    return h * fifth / np.sqrt((fifth + 0.01 * third) * _SIZE) if fifth > 0 else 0.0
