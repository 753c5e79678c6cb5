"""Profiles held at a grid of excursions and heights of the contact, in compiled loops; names as in ``shooting``."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.loops import njit
from vibrissa.mechanics.statics.contact_law import ContactLaw, direction
from vibrissa.mechanics.statics.continuation import carry, chain
from vibrissa.mechanics.statics.shooting import Clamp, moved, onwards

_SETTLES = 20  # steps of Newton to a point of the substrate
_ROUNDING = 1e-15  # [L]


@njit(cache=True, nogil=True, error_model="numpy")
def settle(
    start: Array, clamp: Clamp, d: Array, z: Array, rows: Integers, middle: int, longest: float, unknowns: Array
) -> int:
    """Solutions (ε, θ_ε, Λ̂) at excursions d (J, K) and heights z (K,), from a start at d = z = 0.

    Row after row, as ``rows`` (K,) orders them; each from its ``middle`` node outwards to either side. Returns −1, or
    the node j · K + k that is not reached; ``unknowns`` is (J, K, 3).

    Parameters
    ----------
    start : (3,) array
        ε, θ_ε and Λ̂ at d = z = 0.
    clamp : Clamp
        At d = z = 0.
    d, z : (J, K) and (K,) arrays
        Excursions and heights, over L.
    rows : (K,) array
        Order of the heights.
    middle : int
        Node of the excursion to start from.
    longest : float
        Longest step in ln x.
    unknowns : (J, K, 3) array
        Written.

    Returns
    -------
    int
        −1, or the node that is not reached.
    """
    row, at, above = start.copy(), 0.0, 0.0
    for k in rows:
        first = d[middle, k]
        if not carry(row, moved(clamp, at, -above), first - at, above - z[k], longest):
            return middle * z.size + k
        at, above = first, z[k]
        unknowns[middle, k] = row
        for side in (1, -1):
            outwards = np.arange(middle + 1, len(d)) if side == 1 else np.arange(middle - 1, -1, -1)
            ahead, found = d[:, k][outwards] - first, np.empty((outwards.size, 3))
            reached = chain(row, moved(clamp, first, -z[k]), ahead, longest, found)
            if reached < outwards.size:
                return outwards[reached] * z.size + k
            for e in range(outwards.size):
                unknowns[outwards[e], k] = found[e]
    return -1


@njit(cache=True, nogil=True, error_model="numpy")
def rises(unknowns: Array, law: ContactLaw, u: Array, longest: float, out: Array) -> None:
    """Height of profiles (E, 3) above the contact over the distance from it, y/u (E, P), at ascending u (P,).

    Parameters
    ----------
    unknowns : (E, 3) array
        ε, θ_ε and Λ̂ of each.
    law : ContactLaw
        The contact law.
    u : (P,) array
        Distances over L.
    longest : float
        Longest step in ln x.
    out : (E, P) array
        Written.
    """
    trial, slopes = np.empty(8), np.empty((7, 8))
    for e in range(len(unknowns)):
        contact, turn, load = unknowns[e]
        cos, sin, base = np.cos(turn), np.sin(turn), -np.log(contact)
        state, at, towards = np.zeros(8), 0.0, direction(law, load)
        for j in range(u.size):
            for _ in range(_SETTLES):  # Newton's method for the ln x whose distance from the contact is u
                miss = u[j] - contact * (state[2] * cos - state[3] * sin)
                to = min(at + miss / (contact * np.exp(at) * np.cos(state[0] + turn)), base)
                if abs(miss) < _ROUNDING or to == at:
                    break
                onwards(state, at, to, load, towards, longest, trial, slopes)
                at = to
            x, y = state[2] * cos - state[3] * sin, state[2] * sin + state[3] * cos
            out[e, j] = y / x
