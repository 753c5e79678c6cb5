"""Amplitudes of a motion in phases at ascending times; even steps are the fastest."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.free_end.phases import MODES, Phases
from vibrissa.mechanics.free_end.tables import Tables
from vibrissa.mechanics.vibration.excitation import horner

_ALIKE = 1e-9  # by how much steps of an even grid may differ, over the step


@njit(cache=True, nogil=True, error_model="numpy")
def _turn(tau: float, kappa: Array, zeta: Array, c: Array, s: Array) -> None:
    """Cosine and sine of the turn of each mode in a time, as small as its damping leaves them."""
    for i in range(kappa.size):
        fast, size = kappa[i] * np.sqrt(1 - zeta[i] ** 2), np.exp(-zeta[i] * kappa[i] * tau)
        c[i], s[i] = size * np.cos(fast * tau), size * np.sin(fast * tau)


@njit(cache=True, nogil=True, error_model="numpy")
def _follow(side: int, seen: Array, held_seen: Array, forced: Array, held: Array, path: Array) -> None:
    """Powers of the time of what is forced and held, in each row."""
    path[:] = 0.0
    for r in range(path.shape[0]):
        for k in range(path.shape[1]):
            for i in range(forced.shape[0]):
                path[r, k] += seen[r, i] * forced[i, k]
            if side == 0:
                path[r, k] += held_seen[r, 0] * held[0, k] + held_seen[r, 1] * held[1, k]


@njit(cache=True, nogil=True, error_model="numpy")
def sample(t: Array, phases: Phases, tables: Tables, seen: Array, held_seen: Array, out: Array) -> None:
    """Write what is seen of the motion: Σ over the modes of each support, and of what is held.

    Parameters
    ----------
    t : (T,) array
        Times over k, ascending.
    phases : Phases
        The motion.
    tables : Tables
        Gives κ and ζ.
    seen : (3, R, M) array
        What each mode on land, on an edge and on the tip gives to each row.
    held_seen : (R, 2) array
        What turn and lift give.
    out : (R, T) array
        Written.
    """
    rows, n = seen.shape[1], seen.shape[2]
    powers = phases.forced.shape[2]
    c, s, x, y = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    path = np.empty((rows, powers))
    first = 0
    out[:] = 0.0
    for e in range(phases.start.size):
        start = phases.start[e]
        end = phases.start[e + 1] if e + 1 < phases.start.size else np.inf
        while first < t.size and t[first] < start:
            first += 1
        stop = first
        while stop < t.size and t[stop] < end:
            stop += 1
        if stop == first:
            continue
        side = MODES[phases.support[e]]
        step = t[first + 1] - t[first] if stop > first + 1 else 1.0
        _turn(t[first] - start, tables.kappa[side], tables.zeta[side], c, s)
        for i in range(n):
            a, b = phases.free[e, 0, i], phases.free[e, 1, i]
            x[i], y[i] = a * c[i] + b * s[i], b * c[i] - a * s[i]
        _turn(step, tables.kappa[side], tables.zeta[side], c, s)
        _follow(side, seen[side], held_seen, phases.forced[e], phases.held[e], path)
        for j in range(first, stop):
            for r in range(rows):
                total = horner(path[r], powers, t[j] - start)[0]
                for i in range(n):
                    total += seen[side, r, i] * x[i]
                out[r, j] = total
            ahead = t[j + 1] - t[j] if j + 1 < stop else step
            if abs(ahead - step) > _ALIKE * step:
                step = ahead
                _turn(step, tables.kappa[side], tables.zeta[side], c, s)
            for i in range(n):
                x[i], y[i] = x[i] * c[i] + y[i] * s[i], y[i] * c[i] - x[i] * s[i]
        first = stop
