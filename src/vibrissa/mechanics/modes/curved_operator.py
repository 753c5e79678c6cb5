"""The shaft linearised about its curved profile, on a basis of bending moments.

The bending moment is expanded in Legendre polynomials of ln s that are orthonormal in bending energy, so bending is the
unit matrix for every ε, and κ comes to 1e-10, for 24 modes and ε = 0.001 too.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from vibrissa.arrays import Array
from vibrissa.mechanics.statics.edge_contact import Held

_MORE_NODES = 24  # of quadrature than polynomials, for sin θ and powers of s


class LinearRod(NamedTuple):
    """The linearised shaft in the basis of bending moments, N polynomials and Q nodes.

    Attributes
    ----------
    stiffness, mass : (N, N) arrays
        Bending and the force at rest; ∫ s² (δx δx + δy δy) ds.
    turn, shift : (Q, N) and (2, Q, N) arrays
        Legendre coefficients of ϑ and of (δx, δy).
    base : (N,) array
        ϑ'(1).
    contact, momentum : (2, N) arrays
        (δx, δy) at the contact, and ∫ s² (δx, δy) ds.
    contact_turn : (N,) array
        ϑ(ε).
    """

    stiffness: Array
    mass: Array
    turn: Array
    shift: Array
    base: Array
    contact: Array
    momentum: Array
    contact_turn: Array


def linearised(held: Held, count: int) -> LinearRod:
    """With ln s = −(1 − z) σ, σ = ln(1/ε)/2: s⁴ϑ' = s^{3/2} g(z), and ∫ s⁴ϑ'² ds = ∫ g² d ln s.

    Parameters
    ----------
    held : Held
        Profile on the flat.
    count : int
        How many polynomials.

    Returns
    -------
    LinearRod
        In the basis of bending moments.
    """
    z, weights, polynomials, from_base, analysis = _nodes(count)
    half = -np.log(held.contact) / 2
    s, weights = np.exp(-(1 - z) * half), weights * half
    scale = np.sqrt((np.arange(count) + 0.5) / half)
    turn = half * from_base @ (s[:, None] ** -1.5 * polynomials * scale)
    angle, push = held.angle(s), held.contact_force
    tangent = np.stack([np.cos(angle), np.sin(angle)])
    shift = np.stack([half * from_base @ (lever[:, None] * turn) for lever in (-s * tangent[1], s * tangent[0])])
    stiffening = weights * s * push * np.sin(held.force_angle - angle)
    inertia = weights * s**3
    ends, coefficients = (-1.0) ** np.arange(len(z)), analysis @ shift
    return LinearRod(
        stiffness=np.eye(count) + (turn * stiffening[:, None]).T @ turn,
        mass=sum((part * inertia[:, None]).T @ part for part in shift),
        turn=analysis @ turn,
        shift=coefficients,
        base=scale,
        contact=ends @ coefficients,
        momentum=inertia @ shift,
        contact_turn=ends @ analysis @ turn,
    )


@lru_cache(maxsize=32)
def _nodes(count: int) -> tuple[Array, Array, Array, Array, Array]:
    """Gauss nodes and weights on [−1, 1]; matrices of polynomials there, of integration from 1, and to coefficients."""
    n = count + _MORE_NODES
    z, weights = legendre.leggauss(n)
    vandermonde = legendre.legvander(z, n - 1)
    analysis: Array = (vandermonde * weights[:, None]).T * (np.arange(n) + 0.5)[:, None]
    integrals = np.stack([legendre.legval(z, legendre.legint(one, lbnd=1)) for one in np.eye(n)], axis=1)
    return z, weights, np.asarray(vandermonde[:, :count]), integrals @ analysis, analysis
