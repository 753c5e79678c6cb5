"""Profiles on the flat and on an edge: the scaled Eq. (1) integrated from the contact, in compiled loops.

With x = s/ε and ψ = θ − θ_ε, in ln x: ψ' = n/x², n' = Λ̂ cos(φ − ψ) − n, X' = x cos ψ, Y' = x sin ψ, where n = m/x. A
state holds (ψ, n, X, Y) and then their derivatives by Λ̂, which the direction φ of the contact force may depend on. The
longest step in ln x of the method, of order 6, is the caller's: 0.05 errs by 1e-9 of the displacements, 0.0125 by a few
1e-13.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.statics.contact_law import ContactLaw, Direction, across, direction
from vibrissa.mechanics.statics.runge_kutta import BUTCHER_6, stepper

LONGEST = 0.0125  # step in ln x where profiles must be known to round-off
STRIDE = 0.01  # [L] longest step of the excursion from one solution to the next
ARRIVED = 1e-9  # last step of Newton, of ε, θ_ε and ln x; of Λ̂ over its value: the next would be of its square
ITERATIONS = 30


class Clamp(NamedTuple):
    """How the base is held, and the law of the contact.

    Attributes
    ----------
    angle : float
        θ_b [rad].
    distance, height : float
        D and H of the base from the contact, over L.
    law : ContactLaw
        The contact law.
    """

    angle: float
    distance: float
    height: float
    law: ContactLaw


@njit(cache=True, nogil=True, error_model="numpy")
def moved(clamp: Clamp, ahead: float, up: float) -> Clamp:
    """The clamp with the contact farther away by ``ahead`` along the substrate, and lower by ``up``, over L.

    Parameters
    ----------
    clamp : Clamp
        As it is.
    ahead, up : float
        Over L.

    Returns
    -------
    Clamp
        As it is then.
    """
    return Clamp(clamp.angle, clamp.distance + ahead, clamp.height + up, clamp.law)


@njit(nogil=True, error_model="numpy")
def _slope(x: float, state: Array, constants: tuple[float, ...], out: Array) -> None:
    load, cos_phi, sin_phi, cos_gain, sin_gain = constants
    sin, cos, square = np.sin(state[0]), np.cos(state[0]), 1 / x**2
    toward = across(cos_phi, sin_phi, cos, sin)
    out[0], out[1], out[2], out[3] = state[1] * square, load * toward - state[1], x * cos, x * sin
    gain, turned = across(cos_gain, sin_gain, cos, sin), across(sin_phi, -cos_phi, cos, sin)
    out[4], out[5] = state[5] * square, gain + load * turned * state[4] - state[5]
    out[6], out[7] = -x * sin * state[4], x * cos * state[4]


_step = stepper(BUTCHER_6, _slope, 8)


@njit(cache=True, nogil=True, error_model="numpy")
def onwards(
    state: Array, at: float, to: float, load: float, towards: Direction, longest: float, trial: Array, slopes: Array
) -> None:
    """Carry a state (8,) at one ln x on to another, in place; ``trial`` (8,) and ``slopes`` (7, 8) are room to work.

    Parameters
    ----------
    state : (8,) array
        In and out.
    at, to : float
        ln x.
    load : float
        Λ̂.
    towards : tuple
        Of :func:`vibrissa.mechanics.statics.contact_law.direction`.
    longest : float
        Longest step in ln x.
    trial, slopes : (8,) and (7, 8) arrays
        Room to work.
    """
    steps = int(np.ceil(abs(to - at) / longest))
    h, x = (to - at) / max(steps, 1), np.exp(at)
    third, half = np.exp(h / 3), np.exp(h / 2)
    constants = (load, towards[0], towards[1], towards[2], towards[3])
    for _ in range(steps):
        places = (x, x * third, x * third**2, x * third, x * half, x * half, x * half**2)
        _slope(x, state, constants, slopes[0])
        _step(places, h, state, constants, slopes, trial)
        state[:] = trial
        x *= half**2


@njit(cache=True, nogil=True, error_model="numpy")
def march(load: float, law: ContactLaw, log_x: Array, longest: float, states: Array) -> None:
    """States (P, 8) at ln x (P,), ever farther from the contact at 0, to either side.

    Parameters
    ----------
    load : float
        Λ̂.
    law : ContactLaw
        The contact law.
    log_x : (P,) array
        ln x, ever farther from 0.
    longest : float
        Longest step in ln x.
    states : (P, 8) array
        Written.
    """
    state, trial, slopes, at = np.zeros(8), np.empty(8), np.empty((7, 8)), 0.0
    towards = direction(law, load)
    for j in range(log_x.size):
        onwards(state, at, log_x[j], load, towards, longest, trial, slopes)
        at = log_x[j]
        states[j] = state


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivity(contact: float, turn: float, base: Array, matrix: Array) -> tuple[float, float, float]:
    """Derivatives (3, 3) of (θ_b, D, H) by (ε, θ_ε, Λ̂) from the state at the base; returns D, H and the determinant.

    The determinant is negative before the fold and 0 on it.

    Parameters
    ----------
    contact, turn : float
        ε, and θ_ε [rad].
    base : (8,) array
        State at the base.
    matrix : (3, 3) array
        Written.

    Returns
    -------
    tuple of 3 floats
        D and H over L, and the determinant.
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
def _determinant(m: Array) -> float:
    return (
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    )


@njit(cache=True, nogil=True, error_model="numpy")
def solve3(m: Array, size: float, right: Array, out: Array) -> None:
    """Solution (3,) of three linear equations, by Cramer's rule.

    Parameters
    ----------
    m : (3, 3) array
        The matrix.
    size : float
        Its determinant.
    right : (3,) array
        The right side.
    out : (3,) array
        Written.
    """
    swapped = np.empty((3, 3))
    for j in range(3):
        swapped[:] = m
        swapped[:, j] = right
        out[j] = _determinant(swapped) / size


@njit(cache=True, nogil=True, error_model="numpy")
def correct(unknown: Array, clamp: Clamp, longest: float) -> bool:
    """Newton's method for the (ε, θ_ε, Λ̂) of a whisker that a clamp holds, in place; whether it arrived.

    Parameters
    ----------
    unknown : (3,) array
        In and out.
    clamp : Clamp
        What holds the base.
    longest : float
        Longest step in ln x.

    Returns
    -------
    bool
        Whether it arrived.
    """
    matrix, right, step, state = np.empty((3, 3)), np.zeros(3), np.empty(3), np.empty((1, 8))
    for _ in range(ITERATIONS):
        contact, turn, load = unknown
        if not (0 < contact < 1 and load > 0 and abs(turn) < np.pi / 2):
            return False
        march(load, clamp.law, np.array([-np.log(contact)]), longest, state)
        along, up, determinant = sensitivity(contact, turn, state[0], matrix)
        if not determinant < 0:
            return False
        right[0], right[1], right[2] = turn + state[0, 0] - clamp.angle, along - clamp.distance, up - clamp.height
        solve3(matrix, determinant, right, step)
        unknown -= step
        if abs(step[0]) + abs(step[1]) + abs(step[2]) / load < ARRIVED:
            return True
    return False
