"""Closed forms: modes of the pinned and of the free cone, the damped oscillator, the AM tone.

A cone's modes solve (s⁴V'')'' = κ² s² V. With z = 2√(κs) and F any of the Bessel functions J, Y, I, K,
V ∝ z⁻²F₂(z), V' ∝ z⁻³F₃(z), V'' ∝ z⁻⁴F₄(z), because (1/z d/dz)(z⁻ⁿFₙ) = ±z⁻ⁿ⁻¹Fₙ₊₁ (+ for I alone).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array

Boundary = Literal["pinned", "free"]

_FEW = 2000  # points whose mode shapes are kept
_AT_BASE = np.array([2, 3])  # orders of V and V' there; then those of V'' at ε, after V (pinned) or (s⁴V'')' (free)
_AND_AT_CONTACT = {"pinned": np.array([2, 3, 2, 4]), "free": np.array([2, 3, 3, 4])}


@lru_cache(maxsize=64)
def gauss(count: int) -> tuple[Array, Array]:
    """Gauss–Legendre nodes and weights on [−1, 1], (count,) each, ascending.

    Parameters
    ----------
    count : int
        Number of nodes.

    Returns
    -------
    node, weight : (count,) arrays
        Ascending.
    """
    return np.polynomial.legendre.leggauss(count)


def shaft_quadrature(contact: float, count: int) -> tuple[Array, Array]:
    """Gauss–Legendre nodes and weights on [ε, 1], even in √s, in which modes oscillate evenly.

    Parameters
    ----------
    contact : float
        Outer end ε of the interval, over L.
    count : int
        Number of nodes.

    Returns
    -------
    s, weights : (count,) arrays
        Σ weights·f(s) = ∫_ε^1 f ds, spectrally accurate for smooth f.
    """
    node, weight = gauss(count)
    r0 = np.sqrt(contact)
    r = r0 + (1 - r0) * (node + 1) / 2
    return r**2, weight * (1 - r0) * r


def _bessel(order: int | NDArray[np.int64], z: Array, z0: Array, z1: Array) -> Array:
    """J, Y, I, K of one order, or of one for each z, signed for the derivative; I scaled by exp(−z₁), K by exp(z₀).

    Shape (..., 4). The signs are those of (1/z d/dz) applied order − 2 times.
    """
    import scipy.special as of

    sign = (-1.0) ** order
    columns = np.empty((*z.shape, 4))
    columns[..., 0] = sign * of.jv(order, z)
    columns[..., 1] = sign * of.yv(order, z)
    columns[..., 2] = of.ive(order, z) * np.exp(z - z1)
    columns[..., 3] = sign * of.kve(order, z) * np.exp(z0 - z)
    return columns


def _boundary_matrix(kappa: Array, contact: float, boundary: Boundary) -> Array:
    """(..., 4, 4) matrix whose null vector holds the coefficients of J, Y, I, K; (..., 2, 2) at ε = 0."""
    z1 = (2 * np.sqrt(kappa))[..., None]
    z0 = z1 * np.sqrt(contact)
    if contact == 0:  # only J and I are finite at the tip of the whole cone
        return _bessel(_AT_BASE, np.concatenate([z1, z1], axis=-1), z0, z1)[..., [0, 2]]
    matrix = _bessel(_AND_AT_CONTACT[boundary], np.concatenate([z1, z1, z0, z0], axis=-1), z0, z1)
    if boundary == "free":  # s⁴V'' ∝ z⁴F₄, whose derivative ∝ z³F₃ has + for J, Y, I and − for K
        matrix[..., 2, :] *= [-1, -1, 1, 1]
    return matrix


def cone_kappa(contact: float, n_modes: int, boundary: Boundary = "pinned") -> Array:
    """Adimensional resonant frequencies κ of a cone clamped at s = 1.

    Boundary conditions V(1) = V'(1) = 0 at the base and, at s = ε, V = V'' = 0 (``pinned``; [Boubenec2014]_
    prints V' = 0 beside "null bending moment": a lost prime) or V'' = (s⁴V'')' = 0 (``free``). In
    ξ = 2√κ(1 − √ε) neighbouring roots are 2.4 to 3.3 apart for every ε, and the first beyond 1.8,
    so a scan with unit step from ξ = 1 can skip none.

    Parameters
    ----------
    contact : float
        Position ε of the contact, or of the free end, over L; 0 only if free.
    n_modes : int
        How many, from the lowest.
    boundary : {"pinned", "free"}
        What holds at s = ε.

    Returns
    -------
    (n_modes,) array
        κ in ascending order [1]; ω = κ/k.

    Examples
    --------
    >>> cone_kappa(0.0, 2, "free").round(8).tolist()  # the paper: 8.72 and 21.15
    [8.71925886, 21.14566239]
    """
    stretch = 2 * (1 - np.sqrt(contact))

    def determinant(xi: Array) -> Array:
        return np.linalg.det(_boundary_matrix((xi / stretch) ** 2, contact, boundary))

    xi = np.arange(1.0, np.pi * (n_modes + 1.5))
    value = determinant(xi)
    left = np.flatnonzero(np.sign(value[1:]) != np.sign(value[:-1]))[:n_modes]
    root = _ridders(determinant, xi[left], xi[left + 1], value[left], value[left + 1])
    return np.asarray((root / stretch) ** 2)


def _ridders(function: Callable[[Array], Array], a: Array, b: Array, fa: Array, fb: Array) -> Array:
    """Roots of a vectorised function, one in each bracket [a, b], to the last digits (Ridders' method)."""
    root = a
    for _ in range(60):
        middle = (a + b) / 2
        fm = function(middle)
        scale = np.sqrt(fm**2 - fa * fb)
        step = np.divide((middle - a) * np.sign(fa - fb) * fm, scale, out=np.zeros_like(fm), where=scale > 0)
        previous, root = root, middle + step
        if np.all(np.abs(root - previous) <= 1e-15 * root):
            break
        fr = function(root)
        low = np.sign(fm) != np.sign(fr)  # the root lies between the middle and the new point
        left = np.sign(fa) != np.sign(fr)
        a, fa, b, fb = (
            np.where(low, middle, np.where(left, a, root)),
            np.where(low, fm, np.where(left, fa, fr)),
            np.where(low | left, root, b),
            np.where(low | left, fr, fb),
        )
    return root


def cone_modes(kappa: Array, contact: float, s: Array, boundary: Boundary = "pinned", derivative: int = 0) -> Array:
    """Mode shapes of the cone, or one of their derivatives, at any s.

    Parameters
    ----------
    kappa : (M,) array
        Frequencies from :func:`cone_kappa`.
    contact : float
        Position ε of the contact or of the free end, over L.
    s : (S,) array
        Positions in [ε, 1]; above 0.
    boundary : {"pinned", "free"}
        What holds at s = ε.
    derivative : int
        Order of the derivative by s, from 0 to 3 and beyond.

    Returns
    -------
    (M, S) array
        V normalised by ∫_ε^1 s² V_i V_j ds = δ_ij, with V''(1) > 0.
    """
    place = tuple(np.asarray(kappa, float).tolist()), float(contact), boundary, derivative
    points = np.asarray(s, float)
    if points.ndim != 1 or points.size > _FEW:
        return _shapes(*place, points)
    return _kept_shapes(*place, points.tobytes()).copy()


@lru_cache(maxsize=64)
def _kept_shapes(
    kappas: tuple[float, ...], contact: float, boundary: Boundary, derivative: int, points: bytes
) -> Array:
    """Shapes at few points, which are asked for again and again: of a movie's shaft, of a quadrature."""
    return _shapes(kappas, contact, boundary, derivative, np.frombuffer(points))


def _shapes(kappas: tuple[float, ...], contact: float, boundary: Boundary, derivative: int, s: Array) -> Array:
    coefficient = _normalised(kappas, contact, boundary)
    return _shape(np.array(kappas), contact, s, coefficient, derivative)


@lru_cache(maxsize=64)
def _normalised(kappas: tuple[float, ...], contact: float, boundary: Boundary) -> Array:
    """(M, 4) coefficients that make the modes orthonormal, with V''(1) > 0."""
    kappa = np.array(kappas)
    coefficient = _coefficients(kappa, contact, boundary)
    nodes, weights = shaft_quadrature(contact, 80 + 8 * len(kappa))
    shape = _shape(kappa, contact, nodes, coefficient, 0)
    norm = np.sqrt(np.sum(weights * nodes**2 * shape**2, axis=1))
    bending = _shape(kappa, contact, np.ones(1), coefficient, 2)[:, 0]
    return np.asarray((np.sign(bending) / norm)[:, None] * coefficient)


def _coefficients(kappa: Array, contact: float, boundary: Boundary) -> Array:
    """(M, 4) coefficients of J, Y, I, K: the null vector of the boundary matrix, columns made equal first."""
    matrix = _boundary_matrix(np.asarray(kappa, float), contact, boundary)
    matrix = matrix / np.linalg.norm(matrix, axis=-1, keepdims=True)
    size = np.linalg.norm(matrix, axis=-2, keepdims=True)
    null = np.linalg.svd(matrix / size)[2][:, -1] / size[:, 0]
    if contact > 0:
        return np.asarray(null)
    coefficient = np.zeros((len(null), 4))
    coefficient[:, [0, 2]] = null
    return coefficient


def _shape(kappa: Array, contact: float, s: Array, coefficient: Array, derivative: int) -> Array:
    """(M, S) derivative of [aJ₂ + bY₂ + cI₂ + dK₂](z)/s up to a factor: (2κ)ⁿ z⁻²⁻ⁿ F₂₊ₙ."""
    z1 = 2 * np.sqrt(kappa)[:, None]
    z = z1 * np.sqrt(s)
    order = 2 + derivative
    used = coefficient.any(axis=0)  # Y and K stay out at ε = 0, where they would be infinite
    values = _bessel(order, z, z1 * np.sqrt(contact), z1)[..., used] @ coefficient[:, used, None]
    return np.asarray((2 * kappa[:, None]) ** derivative * values[..., 0] / z**order)


def free_decay(t: Array, q0: float, v0: float, omega: float, zeta: float) -> Array:
    """Displacement of a damped oscillator released at t = 0.

    Parameters
    ----------
    t : (T,) array
        Time since the release [s].
    q0, v0 : float
        Displacement and velocity at t = 0.
    omega, zeta : float
        Resonant angular frequency [rad/s] and damping ratio, below 1.

    Returns
    -------
    (T,) array
        e^{−ζωt}[q₀ cos Ωt + (v₀ + ζωq₀)/Ω sin Ωt], Ω = ω√(1 − ζ²), in the unit of q₀.
    """
    big_omega = omega * np.sqrt(1 - zeta**2)
    sine = (v0 + zeta * omega * q0) / big_omega
    return np.exp(-zeta * omega * t) * (q0 * np.cos(big_omega * t) + sine * np.sin(big_omega * t))


def am_tone(t: Array, carrier: float, modulation: float, depth: float) -> tuple[Array, Array]:
    """Tone whose amplitude is modulated by a slower sine, and its exact envelope.

    Parameters
    ----------
    t : (T,) array
        Time [s].
    carrier, modulation : float
        Frequencies [Hz], modulation < carrier (then the analytic signal's modulus is the envelope).
    depth : float
        Modulation depth, in [0, 1].

    Returns
    -------
    signal, envelope : (T,) arrays
        (1 + depth·sin 2π f_m t) cos 2π f_c t, and the factor before the cosine.
    """
    envelope = 1 + depth * np.sin(2 * np.pi * modulation * t)
    return envelope * np.cos(2 * np.pi * carrier * t), envelope
