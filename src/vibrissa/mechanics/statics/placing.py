"""Positions of points of profiles that are known by (ε, θ_ε, Λ̂), in compiled loops; names as in ``shooting``."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.statics.contact_law import ContactLaw
from vibrissa.mechanics.statics.shooting import march, sensitivity, solve3


@njit(cache=True, nogil=True, error_model="numpy")
def place(
    unknown: Array, law: ContactLaw, s: Array, longest: float, straight: bool, states: Array, x: Array, y: Array
) -> float:
    """Positions x, y (P,) from the base, over L, of ascending points s (P,), s[-1] = 1, of one profile.

    Parameters
    ----------
    unknown : (3,) array
        ε, θ_ε and Λ̂.
    law : ContactLaw
        The contact law.
    s : (P,) array
        Points.
    longest : float
        Longest step in ln x.
    straight : bool
        Whether the free end below ε is straight, as a whisker's is; else it is the curve of Eq. 1 going on, smooth.
    states : (P, 8) array
        Written: states at the points.
    x, y : (P,) arrays
        Written.

    Returns
    -------
    float
        Curvature θ'(1) at the base, over 1/L.
    """
    contact, turn, load = unknown
    first = np.searchsorted(s, contact)
    march(load, law, np.log(s[first:] / contact), longest, states[first:])
    if straight:
        states[:first] = 0.0
        states[:first, 2] = s[:first] / contact - 1
    else:
        march(load, law, np.log(s[:first] / contact)[::-1], longest, states[:first][::-1])
    cos, sin = contact * np.cos(turn), contact * np.sin(turn)
    for j in range(s.size):
        along, up = states[j, 2] - states[-1, 2], states[j, 3] - states[-1, 3]
        x[j], y[j] = along * cos - up * sin, along * sin + up * cos
    return states[-1, 1] * contact**2


@njit(cache=True, nogil=True, error_model="numpy")
def place_all(
    unknowns: Array, law: ContactLaw, s: Array, longest: float, straight: bool, x: Array, y: Array, curvature: Array
) -> None:
    """Positions of many profiles (E, 3), see :func:`place`.

    Parameters
    ----------
    unknowns : (E, 3) array
        ε, θ_ε and Λ̂ of each.
    law, s, longest, straight
        As of :func:`place`.
    x, y, curvature : (E, P), (E, P) and (E,) arrays
        Written: positions from the base over L, curvature at the base over 1/L.
    """
    states = np.empty((s.size, 8))
    for e in range(len(unknowns)):
        curvature[e] = place(unknowns[e], law, s, longest, straight, states, x[e], y[e])


@njit(cache=True, nogil=True, error_model="numpy")
def straightened(unknowns: Array, law: ContactLaw, s: Array, longest: float, x: Array, y: Array) -> None:
    """Straight free end less Eq. 1's curve continued, (E, P) over L, at points s (E, P) that ascend to the contact.

    Parameters
    ----------
    unknowns : (E, 3) array
        ε, θ_ε and Λ̂ of each.
    law : ContactLaw
        The contact law.
    s : (E, P) array
        Points.
    longest : float
        Longest step in ln x.
    x, y : (E, P) arrays
        Written.
    """
    states = np.empty((s.shape[1], 8))
    for e in range(len(unknowns)):
        contact, turn, load = unknowns[e]
        march(load, law, np.log(s[e] / contact)[::-1], longest, states[::-1])
        cos, sin = contact * np.cos(turn), contact * np.sin(turn)
        for j in range(s.shape[1]):
            along, up = s[e, j] / contact - 1 - states[j, 2], -states[j, 3]
            x[e, j], y[e, j] = along * cos - up * sin, along * sin + up * cos


@njit(cache=True, nogil=True, error_model="numpy")
def unit_displacement(contact: float, load: float, law: ContactLaw, s: Array, longest: float, out: Array) -> float:
    """Ū = n·∂r/∂d at d = 0 of points s (P,) from ε to 1; returns the determinant, 0 or above where there is none.

    Parameters
    ----------
    contact, load : float
        ε and Λ̂ on the flat.
    law : ContactLaw
        The contact law.
    s : (P,) array
        Points, s[-1] = 1.
    longest : float
        Longest step in ln x.
    out : (P,) array
        Written: Ū [1].

    Returns
    -------
    float
        The determinant.
    """
    states, matrix, gain = np.empty((s.size, 8)), np.empty((3, 3)), np.empty(3)
    march(load, law, np.log(s / contact), longest, states)
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
