"""What the rod carries from step to step, and how it is damped and held."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.mechanics.rod.kernels.band_kernels import HALF, WIDTH


class Damping(NamedTuple):
    """Viscous damping: C = a₀M + a₁K + Σ cᵢ (Mφᵢ)(Mφᵢ)ᵀ.

    Attributes
    ----------
    mass, stiffness : float
        a₀ and a₁, over 1/k and k.
    shape : (M, 2N + 3) array
        Mφᵢ.
    modal : (M,) array
        cᵢ.
    angle : float
        Angle of what holds the base, at which the shapes were taken [rad]; they turn with it.
    """

    mass: float
    stiffness: float
    shape: Array
    modal: Array
    angle: float = 0.0


class Follicle(NamedTuple):
    """How the base is held: by springs between it and what drives it, damped in proportion as the shaft is.

    Attributes
    ----------
    translation : float
        Stiffness against translation, over EI/L³ of the base; infinite where the base is clamped.
    rotation : float
        Stiffness against rotation, over EI/L of the base; infinite where the base is clamped.
    """

    translation: float = np.inf
    rotation: float = np.inf


CLAMPED = Follicle()


class Scheme(NamedTuple):
    """Backward differences of second order: the rate at the end of a step, and where the step is thought to lead.

    Attributes
    ----------
    step : float
        Time of the step, over k.
    now, before, earlier, scale : float
        Rate = (now · x₀ − before · x₁ + earlier · x₂) / scale; before = now + earlier.
    per_rate : float
        Derivative of the rate by the position.
    ahead, behind : float
        First guess: the last position and step · (ahead · its rate − behind · the rate before).
    """

    step: float
    now: float
    before: float
    earlier: float
    scale: float
    per_rate: float
    ahead: float
    behind: float


class RodState(NamedTuple):
    """Positions and rates of now and of the two steps before, (2N + 3,) each: x and y of the nodes, the base's angle.

    Attributes
    ----------
    at, before, earlier : (2N + 3,) arrays
        Positions.
    rate, rate_before, rate_earlier : (2N + 3,) arrays
        Rates.
    force : (2N + 8,) array
        Work space: see :func:`vibrissa.mechanics.rod.kernels.band_kernels.solve_band`.
    matrix : (2N + 8, 11) array
        Work space.
    totals : (3,) array
        Since the start: work of the ground on the shaft, work of what drives the base, energy that friction dissipated.
    counts : (4,) array
        Iterations, steps that did not converge even in parts, steps that were redone in parts, and steps in all.
    drift : (2N + 3,) array
        Rates against what holds the base, in axes that turn with it: what the damping by mass and by modes acts on.
    held : (2, 3) array
        x, y and angle of what holds the base, after the last step and the one before.
    load : (3,) array
        Force (x, y) and moment of what holds the base on the shaft, after the last step.
    kept : (4, 2N + 3) array
        Work space: positions and rates from before a step that is redone in parts.
    """

    at: Array
    before: Array
    earlier: Array
    rate: Array
    rate_before: Array
    rate_earlier: Array
    force: Array
    matrix: Array
    totals: Array
    counts: Integers
    drift: Array
    held: Array
    load: Array
    kept: Array


def at_rest(at: Array) -> RodState:
    """A rod that does not move.

    Parameters
    ----------
    at : (2N + 3,) array
        Positions.

    Returns
    -------
    RodState
        With no rates.
    """
    return RodState(
        at=at.copy(),
        before=at.copy(),
        earlier=at.copy(),
        rate=np.zeros_like(at),
        rate_before=np.zeros_like(at),
        rate_earlier=np.zeros_like(at),
        force=np.zeros(at.size + HALF),
        matrix=np.zeros((at.size + HALF, WIDTH)),
        totals=np.zeros(3),
        counts=np.zeros(4, np.int64),
        drift=np.zeros_like(at),
        held=np.zeros((2, 3)),
        load=np.zeros(3),
        kept=np.zeros((4, at.size)),
    )
