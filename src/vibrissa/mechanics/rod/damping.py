"""Damping of the rod: the given ratio, in each of the first three modes about the equilibrium.

Damping in proportion to mass and to stiffness gives two modes their ratio: the first and the third. The second, which
would have less, gets the rest by a third term: C = a₀M + a₁K + c₂ (Mφ₂)(Mφ₂)ᵀ with the elastic stiffness K.
Higher modes are damped more, in proportion to their frequency.

The modes are those of the shaft above the contact nearest to the base, which slides on the flat and rolls on it: those
that :mod:`vibrissa.mechanics.modes.curved` calls ``flat`` under ``coulomb`` friction. They are not orthogonal, since
friction follows the load; the ratio of a mode is that of its dual ψ, ψᵀCφ / 2κ ψᵀMφ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig

from vibrissa.arrays import Array, Mask
from vibrissa.errors import ConvergenceError
from vibrissa.mechanics.rod.kernels.band_kernels import HALF, WIDTH
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness, add_contacts, find_near, untouched
from vibrissa.mechanics.rod.kernels.elastic_kernels import add_elastic, bend, segments
from vibrissa.mechanics.rod.kernels.ground import ground_of
from vibrissa.mechanics.rod.kernels.shaft import RodShaft
from vibrissa.mechanics.rod.kernels.state import CLAMPED, Damping, Follicle

_MODES = 3
_TURNING = 1e-9  # inertia of the base's angle, which has none: its own mode is far above all others
_SLIDING = 1.0  # travel over L that makes every contact slide


class RodModes(NamedTuple):
    """First modes about an equilibrium.

    Attributes
    ----------
    kappa : (M,) array
        Adimensional frequencies, of three modes at least.
    shape, dual : (M, 2N + 3) arrays
        φ and ψ, zero below the contact; ψᵀMφ = 1, and φᵀMφ = 1.
    stiffness : (M,) array
        ψᵀKφ of the elastic stiffness alone.
    """

    kappa: Array
    shape: Array
    dual: Array
    stiffness: Array


def viscous(shaft: RodShaft, modes: RodModes, ratio: float) -> Damping:
    """Damping of the rod about an equilibrium.

    Parameters
    ----------
    shaft : RodShaft
        The rod.
    modes : RodModes
        About the equilibrium.
    ratio : float
        ζ of each.

    Returns
    -------
    Damping
        a₀, a₁ and the term of the second mode.
    """
    kappa, shape, dual, elastic = (part[:_MODES] for part in modes)
    weighted = shape * np.append(np.repeat(shaft.mass, 2), 0.0)
    own = (dual @ weighted[1]) * (shape @ weighted[1])
    terms = np.stack([np.ones(_MODES), elastic, own], axis=1)
    mass, stiffness, second = np.linalg.solve(terms, 2 * ratio * kappa)
    return Damping(float(mass), float(stiffness), weighted, np.array([0.0, second, 0.0]))


def rod_modes(
    shaft: RodShaft, at: Array, stiffness: Stiffness, level: float, follicle: Follicle = CLAMPED, count: int = _MODES
) -> RodModes:
    """First modes about an equilibrium on a flat, along which all contacts slide.

    Parameters
    ----------
    shaft : RodShaft
        The rod.
    at : (2N + 3,) array
        Its equilibrium.
    stiffness : Stiffness
        Of the ground, and friction.
    level : float
        Height of the flat.
    follicle : Follicle
        How the base is held; clamped by default.
    count : int
        How many; three, which the damping needs, if it is less.

    Returns
    -------
    RodModes
        Of lowest frequency.

    Raises
    ------
    ConvergenceError
        If friction makes a mode grow without ringing, so that it has no frequency.
    """
    first = _first_of_the_last_contact(at[1:-1:2] - shaft.radius < level)
    upper, places = _above(shaft, first), at[2 * first :]
    elastic, whole = _matrices(upper, places, stiffness, level)
    mass = np.append(np.repeat(upper.mass, 2), _TURNING)
    springs = np.array([follicle.translation, follicle.translation, follicle.rotation])
    held = np.concatenate([np.zeros(places.size - 3), springs])
    free = np.flatnonzero(np.isfinite(held))
    for matrix in (elastic, whole):
        matrix[free, free] += held[free]
    values, left, right = eig(whole[np.ix_(free, free)] / mass[free, None], left=True)
    chosen = np.argsort(values.real)[: max(count, _MODES)]
    if not (np.all(values.real[chosen] > 0) and np.all(values.imag[chosen] == 0)):
        raise ConvergenceError("modes of the rod about its equilibrium", float(values.real[chosen].min()), 1)
    shape, dual = np.zeros((2, chosen.size, at.size))
    shape[:, 2 * first + free], dual[:, 2 * first + free] = right.real[:, chosen].T, left.real[:, chosen].T / mass[free]
    weight = np.append(np.repeat(shaft.mass, 2), _TURNING)
    shape /= np.sqrt((shape**2 * weight).sum(axis=1))[:, None]
    dual /= (dual * weight * shape).sum(axis=1)[:, None]
    own = np.einsum("mi,ij,mj->m", dual[:, 2 * first :], elastic, shape[:, 2 * first :])
    return RodModes(np.sqrt(values.real[chosen]), shape, dual, own)


def _first_of_the_last_contact(touching: Mask) -> int:
    """Lowest node of the run of touching nodes that is nearest to the base; 0 where none touches."""
    if not touching.any():
        return 0
    last = int(np.flatnonzero(touching)[-1])
    apart = np.flatnonzero(~touching[:last])
    return int(apart[-1]) + 1 if apart.size else 0


def _above(shaft: RodShaft, first: int) -> RodShaft:
    """The shaft without its first nodes; nothing bends at its new tip."""
    bending = shaft.bending[first:].copy()
    bending[0] = 0.0
    return RodShaft(
        s=shaft.s[first:],
        rest=shaft.rest[first:],
        mass=shaft.mass[first:],
        axial=shaft.axial[first:],
        bending=bending,
        rest_angle=shaft.rest_angle[first:],
        radius=shaft.radius[first:],
    )


def _matrices(shaft: RodShaft, at: Array, stiffness: Stiffness, level: float) -> tuple[Array, Array]:
    """Minus the derivatives of the forces by the positions, (U, U): of the elastic ones, and of all with contacts."""
    work, size, still = segments(shaft.rest.size), at.size, np.zeros_like(at)
    band, force = np.zeros((size + HALF, WIDTH)), np.zeros(size + HALF)
    bend(shaft, 0.0, at, still, work)
    add_elastic(shaft, 0.0, 0.0, at, still, work, force, band)
    elastic, flat, touch = _whole(band, size), ground_of(None, 1.0), untouched(shaft.s.size, 0)
    find_near(shaft, flat, (0.0, level), at, touch)
    add_contacts(shaft, flat, stiffness, (0.0, level), (-_SLIDING, 0.0), at, at, touch, force, band)
    return elastic, _whole(band, size)


def _whole(band: Array, size: int) -> Array:
    """A band matrix written out."""
    out = np.zeros((size, size))
    for row in range(size):
        first, last = max(0, row - HALF), min(size, row + HALF + 1)
        out[row, first:last] = band[row, HALF + first - row : HALF + last - row]
    return out
