"""Modes of a pinned cone whose base is held by springs: the follicle turns and yields."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

from vibrissa.arrays import Array
from vibrissa.errors import RangeError

_DEGREE = 20  # of the polynomials: κ₁ to κ₃ to 1e-8 beside springs, to 1e-5 beside those as stiff as a clamp
_LEAST = 0.1  # ε below which they are not exact enough


def sprung_modes(contact: float, rotation: float, translation: float, n_modes: int = 3) -> tuple[Array, Array]:
    """First modes of the cone pinned at ε, its base held by springs.

    (s⁴V'')'' = κ² s² V on [ε, 1], V(ε) = V''(ε) = 0, V''(1) = −k_r V'(1), (s⁴V'')'(1) = k_t V(1), by Rayleigh and
    Ritz's method in Legendre polynomials.

    Parameters
    ----------
    contact : float
        ε over L, in [0.1, 0.9].
    rotation, translation : float
        k_r over EI/L and k_t over EI/L³ of the base; positive and finite, 1e5 is as good as a clamp.
    n_modes : int
        How many, at most 6.

    Returns
    -------
    kappa : (M,) array
        Adimensional frequencies.
    shape : (M, 21) array
        Coefficients of V in Legendre polynomials of 2(s − ε)/(1 − ε) − 1; ∫ s² V² ds = 1.

    Raises
    ------
    InputError
        If one of them is out of range.
    """
    for name, value in (("rotation", rotation), ("translation", translation)):
        if not 0 < value < np.inf:
            raise RangeError(f"stiffness against {name}", "must be positive and finite", value)
    bend, mass, turn, place, basis = _matrices(float(contact))
    values, vectors = eigh(bend + rotation * np.outer(turn, turn) + translation * np.outer(place, place), mass)
    return np.sqrt(values[:n_modes]), (basis @ vectors[:, :n_modes]).T


def sprung_shapes(contact: float, shape: Array, s: Array) -> Array:
    """Shapes of sprung modes at points of the shaft.

    Parameters
    ----------
    contact : float
        ε.
    shape : (M, 21) array
        Of :func:`sprung_modes`.
    s : (S,) array
        Points, over L, in [ε, 1].

    Returns
    -------
    (M, S) array
        V.
    """
    return np.asarray(legendre.legval(2 * (np.asarray(s) - contact) / (1 - contact) - 1, shape.T))


@lru_cache(maxsize=64)
def _matrices(contact: float) -> tuple[Array, Array, Array, Array, Array]:
    """∫s⁴φ''φ'', ∫s²φφ, φ'(1) and φ(1) of polynomials φ that vanish at ε, and their Legendre coefficients."""
    if not _LEAST <= contact <= 0.9:
        raise RangeError("contact", f"must lie in [{_LEAST}, 0.9] (over L)", contact)
    half = (1 - contact) / 2
    z, weight = legendre.leggauss(_DEGREE + 5)
    s = contact + half * (z + 1)
    basis = np.eye(_DEGREE + 1)[:, 1:]
    basis[0] = -((-1.0) ** np.arange(1, _DEGREE + 1))  # P_n − (−1)ⁿ
    basis = basis / np.arange(1, _DEGREE + 1) ** 2.0
    value = legendre.legval(z, basis)
    second = legendre.legval(z, legendre.legder(basis, 2)) / half**2
    ends = [legendre.legval(1.0, part) for part in (legendre.legder(basis) / half, basis)]
    bend = half * (second * (weight * s**4)) @ second.T
    mass = half * (value * (weight * s**2)) @ value.T
    return bend, mass, np.asarray(ends[0]), np.asarray(ends[1]), basis
