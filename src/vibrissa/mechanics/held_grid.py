"""Profiles held at a grid of excursions and heights of the contact, in compiled loops; names as in ``march``."""

from __future__ import annotations

import numpy as np
from numba import njit

from vibrissa.mechanics.march import carry, correct, foretold, lay, onwards, place

_STRIDE = 0.01  # [L] farthest excursion to the last solution from which the next one is foretold
_SETTLES = 20  # steps of Newton to a point of the substrate
_ROUNDING = 1e-15  # [L]
_TOGETHER = 512  # places whose polynomials are summed together


@njit(cache=True, nogil=True, error_model="numpy")
def settle(start, angle, distance, height, phi, d, z, rows, middle, longest, unknowns):  # type: ignore[no-untyped-def]
    """Solutions (ε, θ_ε, Λ̂) at excursions d (J, K) and heights z (K,), from a start at d = z = 0.

    Row after row, as ``rows`` (K,) orders them; each from its ``middle`` node outwards to either side. Returns −1, or
    the node j · K + k that is not reached; ``unknowns`` is (J, K, 3).
    """
    row, at, above = start.copy(), 0.0, 0.0
    for k in rows:
        first = d[middle, k]
        if not carry(row, angle, distance + at, height - above, phi, first - at, above - z[k], longest):
            return middle * z.size + k
        at, above = first, z[k]
        unknowns[middle, k] = row
        for side in (1, -1):
            chain = np.arange(middle + 1, len(d)) if side == 1 else np.arange(middle - 1, -1, -1)
            ahead, found = d[:, k][chain] - first, np.empty((chain.size, 3))
            reached = _along(row, angle, distance + first, height - z[k], phi, ahead, longest, found)
            if reached < chain.size:
                return chain[reached] * z.size + k
            for e in range(chain.size):
                unknowns[chain[e], k] = found[e]
    return -1


@njit(cache=True, nogil=True, error_model="numpy")
def _along(start, angle, distance, height, phi, ahead, longest, found):  # type: ignore[no-untyped-def]
    # a chain of excursions from the start, each foretold from the last ones; how many are reached
    unknown, before = start.copy(), 0.0
    for e in range(ahead.size):
        guess = foretold(ahead[:e], found, start, ahead[e])
        near = e > 1 and abs(ahead[e] - before) < _STRIDE
        if near and correct(guess, angle, distance + ahead[e], height, phi, longest):
            unknown[:] = guess
        elif not carry(unknown, angle, distance + before, height, phi, ahead[e] - before, 0.0, longest):
            return e
        before = ahead[e]
        found[e] = unknown
    return ahead.size


@njit(cache=True, nogil=True, error_model="numpy")
def rises(unknowns, phi, u, longest, out):  # type: ignore[no-untyped-def]
    """Height of profiles (E, 3) above the contact over the distance from it, y/u (E, P), at ascending u (P,)."""
    trial, slopes = np.empty(8), np.empty((7, 8))
    for e in range(len(unknowns)):
        contact, turn, load = unknowns[e]
        cos, sin, base = np.cos(turn), np.sin(turn), -np.log(contact)
        state, at = np.zeros(8), 0.0
        for j in range(u.size):
            for _ in range(_SETTLES):
                miss = u[j] - contact * (state[2] * cos - state[3] * sin)
                to = min(at + miss / (contact * np.exp(at) * np.cos(state[0] + turn)), base)
                if abs(miss) < _ROUNDING or to == at:
                    break
                onwards(state, at, to, load, phi, longest, trial, slopes)
                at = to
            x, y = state[2] * cos - state[3] * sin, state[2] * sin + state[3] * cos
            out[e, j] = y / x


@njit(cache=True, nogil=True, error_model="numpy")
def laid(unknowns, phi, s, longest, x, y, curvature):  # type: ignore[no-untyped-def]
    """Profiles (E, 3) at ascending points s (P,), s[-1] = 1, as ``march.follow`` gives them."""
    states = np.empty((s.size, 8))
    for e in range(len(unknowns)):
        curvature[e] = lay(unknowns[e], phi, s, longest, states, x[e], y[e])


@njit(cache=True, nogil=True, error_model="numpy")
def placed(unknowns, phi, s, longest, x, y):  # type: ignore[no-untyped-def]
    """Positions x, y (E, P) of profiles (E, 3) at ascending points s (P,), s[-1] = 1, the free end straight."""
    tilt = np.empty(s.size)
    for e in range(len(unknowns)):
        place(unknowns[e], phi, s, longest, x[e], y[e], tilt)


@njit(cache=True, nogil=True, error_model="numpy")
def summed(coefficients, first, second, out):  # type: ignore[no-untyped-def]
    """Chebyshev series (M, J, K) in two coordinates at places (T,), (M, T); in blocks that stay in the cache."""
    rows, j, k = coefficients.shape
    by_first, by_second, inner = np.empty((j, _TOGETHER)), np.empty((k, _TOGETHER)), np.empty(_TOGETHER)
    for start in range(0, first.size, _TOGETHER):
        n = min(_TOGETHER, first.size - start)
        _polynomials(first[start : start + n], by_first)
        _polynomials(second[start : start + n], by_second)
        for m in range(rows):
            total = out[m, start : start + n]
            total[:] = 0.0
            for a in range(j):
                inner[:n] = 0.0
                for b in range(k):
                    c = coefficients[m, a, b]
                    for t in range(n):
                        inner[t] += c * by_second[b, t]
                for t in range(n):
                    total[t] += inner[t] * by_first[a, t]


@njit(cache=True, nogil=True, error_model="numpy")
def _polynomials(x, out):  # type: ignore[no-untyped-def]
    # Chebyshev polynomials at x, one a row
    n = x.size
    out[0, :n] = 1.0
    if len(out) > 1:
        out[1, :n] = x
    for k in range(2, len(out)):
        out[k, :n] = 2 * x * out[k - 1, :n] - out[k - 2, :n]
