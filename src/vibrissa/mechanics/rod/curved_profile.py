"""Eq. (1) for a shaft that is curved in air: where its base must be so that it touches the flat in one given point."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, RangeError
from vibrissa.mechanics.statics.contact_law import inclination
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture

_CELLS = 400  # of the way from the contact to the base, in ln s
_STEPS, _GROWTH = 60, 1.25  # of the search for a load that turns the base far enough


class CurvedProfile(NamedTuple):
    """A curved shaft that is tangent to the flat at its contact.

    Attributes
    ----------
    load : float
        Λ over the force unit.
    base : (3,) array
        x and height of the base over L, from the contact, and its angle [rad].
    """

    load: float
    base: Array


def curved_profile(posture: Posture, curvature: Callable[[Array], Array]) -> CurvedProfile:
    """Load and base of a curved shaft that is tangent to the flat at ε.

    θ' = m/s⁴ + κ₀(s), m' = Λ cos(φ − θ), m(ε) = θ(ε) = 0, θ(1) = θ_b: Eq. (1) with a curvature κ₀ of the free shaft,
    integrated by Runge and Kutta's method of fourth order in ln s.

    Parameters
    ----------
    posture : Posture
        Contact, angle of the base and contact law.
    curvature : callable
        κ₀ over 1/L, of points s.

    Returns
    -------
    CurvedProfile
        Of the smallest load.

    Raises
    ------
    InputError
        If the free shaft turns by more than the base's angle between contact and base: only a pull would hold it there.
    ConvergenceError
        If no load turns the base that far.
    """
    from scipy.optimize import brentq

    logs = np.linspace(np.log(posture.contact), 0.0, 2 * _CELLS + 1)
    s = np.exp(logs)
    own = curvature(s)

    def turned(load: float) -> float:
        return float(_shot(posture, load, logs, own)[0] - posture.base_angle)

    if turned(0.0) >= 0:
        turn = float(_shot(posture, 0.0, logs, own)[0])
        rule = f"must turn the shaft by less than the base's angle, {posture.base_angle:.3g} rad, beyond the contact"
        raise RangeError("intrinsic curvature", rule, f"{turn:.3g} rad", "only a pull would hold that contact")
    below, above = 0.0, on_the_flat(posture).contact_force / 4
    for _ in range(_STEPS):
        if turned(above) > 0:
            break
        below, above = above, above * _GROWTH
    else:
        raise ConvergenceError("profile of the curved shaft", turned(above), _STEPS)
    load = float(brentq(turned, below, above, xtol=1e-14, rtol=1e-13))
    _, _, x, y = _shot(posture, load, logs, own)
    return CurvedProfile(load, np.array([x, y, posture.base_angle]))


def _shot(posture: Posture, load: float, logs: Array, own: Array) -> Array:
    """θ, m, x and y at the base, from the contact."""
    law, tiny = posture.law, load == 0
    phi = 0.0 if tiny else float(inclination(law, load / posture.contact**2)[0])
    state, h = np.zeros(4), logs[2] - logs[0]

    def slope(at: Array, k: int) -> Array:
        s = np.exp(logs[k])
        change = [at[1] / s**4 + own[k], load * np.cos(phi - at[0]), np.cos(at[0]), np.sin(at[0])]
        return s * np.array(change)

    for k in range(0, logs.size - 1, 2):
        one = slope(state, k)
        two = slope(state + h / 2 * one, k + 1)
        three = slope(state + h / 2 * two, k + 1)
        four = slope(state + h * three, k + 2)
        state = state + h / 6 * (one + 2 * two + 2 * three + four)
    return state
