"""Damping of the rod: the ratio that is asked for, in each of the first modes about the equilibrium.

Damping in proportion to mass and to stiffness gives two modes their ratio: the first and the third. The second, which
would have less, gets the rest by a term of its own, so that C = a₀M + a₁K + c₂ (Mφ₂)(Mφ₂)ᵀ. Higher modes are damped
more, in proportion to their frequency. The modes are those of the shaft above the contact, which slides on the ground.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from vibrissa.arrays import Array
from vibrissa.mechanics.rod.band_kernels import HALF, WIDTH
from vibrissa.mechanics.rod.elastic_kernels import add_elastic, bend, segments
from vibrissa.mechanics.rod.shaft import Shaft
from vibrissa.mechanics.rod.step_kernels import Damping

_MODES = 3


def viscous(shaft: Shaft, at: Array, contact: float, ratio: float) -> Damping:
    """Damping of the rod about an equilibrium.

    Parameters
    ----------
    shaft : Shaft
        The rod; a node lies on the contact.
    at : (2N + 3,) array
        Its equilibrium.
    contact : float
        ε.
    ratio : float
        ζ of the first three modes.

    Returns
    -------
    Damping
        a₀, a₁ and the term of the second mode.
    """
    kappa, shapes = sliding_modes(shaft, at, contact)
    first, second, third = kappa[:_MODES]
    mass = 2 * ratio * first * third / (first + third)
    stiffness = 2 * ratio / (first + third)
    missing = np.zeros(_MODES)
    missing[1] = 2 * ratio * second - mass - stiffness * second**2
    weighted = np.zeros((_MODES, at.size))
    weighted[:, : 2 * shaft.s.size] = shapes[:, : 2 * shaft.s.size] * np.repeat(shaft.mass, 2)
    return Damping(mass, stiffness, weighted, missing)


def sliding_modes(shaft: Shaft, at: Array, contact: float) -> tuple[Array, Array]:
    """First modes of the shaft above the contact, which slides along x and is held in y; the base is clamped.

    Parameters
    ----------
    shaft : Shaft
        The rod; a node lies on the contact.
    at : (2N + 3,) array
        Its equilibrium.
    contact : float
        ε.

    Returns
    -------
    (3,) and (3, 2N + 3) arrays
        Adimensional frequencies κ; shapes, normalised by the mass, zero below the contact.
    """
    below = int(np.argmin(np.abs(shaft.s - contact)))
    matrix = _stiffness(_above(shaft, below), at[2 * below :])
    free = np.delete(np.arange(matrix.shape[0] - 3), 1)
    mass = np.repeat(shaft.mass[below:], 2)[free]
    values, vectors = eigh(matrix[np.ix_(free, free)], np.diag(mass), subset_by_index=(0, _MODES - 1))
    shapes = np.zeros((_MODES, at.size))
    shapes[:, 2 * below + free] = vectors.T
    return np.sqrt(values), shapes


def _above(shaft: Shaft, below: int) -> Shaft:
    """The shaft without its first nodes; nothing bends at its new tip."""
    bending = shaft.bending[below:].copy()
    bending[0] = 0.0
    return Shaft(
        s=shaft.s[below:],
        rest=shaft.rest[below:],
        mass=shaft.mass[below:],
        axial=shaft.axial[below:],
        bending=bending,
        rest_angle=shaft.rest_angle[below:],
        radius=shaft.radius[below:],
    )


def _stiffness(shaft: Shaft, at: Array) -> Array:
    """Derivative of minus the elastic forces by the positions, (U, U)."""
    work, size = segments(shaft.rest.size), at.size
    band, force, still = np.zeros((size, WIDTH)), np.zeros(size), np.zeros(size)
    bend(shaft, 0.0, at, still, work)
    add_elastic(shaft, 0.0, 0.0, at, still, work, force, band)
    whole = np.zeros((size, size))
    for row in range(size):
        first, last = max(0, row - HALF), min(size, row + HALF + 1)
        whole[row, first:last] = band[row, HALF + first - row : HALF + last - row]
    return whole
