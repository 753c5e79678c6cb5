"""Resonant modes of the whisker about its curved profile, its contact sliding or stuck.

The shaft does not stretch: a rotation ϑ(s) displaces it by δx' = −sin θ ϑ, δy' = cos θ ϑ from the base. Under the
contact force at rest, Λ at the angle φ to the normal, small motion obeys
δ∫[s⁴ϑ'² − Λ sin(θ − φ) ϑ² − s²(δẋ² + δẏ²)]/2 ds = δF·δr(ε), with δF what the contact force changes by. The free end
beyond the contact has no mass.

The bending moment is expanded in Legendre polynomials of ln s that are orthonormal in bending energy, so bending is the
unit matrix for every ε, and κ comes to 1e-10, for 24 modes and ε = 0.001 too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eig, eigh, null_space

from vibrissa.errors import InputError
from vibrissa.mechanics.edge import Held, on_the_flat
from vibrissa.mechanics.profile import Posture

Array = NDArray[np.float64]
Condition = Literal["slide", "stick"]
Law = Literal["constant", "coulomb"]

_MORE_POLYNOMIALS = 24  # than the highest mode has radians in ln s, evenly spread as at the base
_MORE_NODES = 24  # of quadrature than polynomials, for sin θ and powers of s
_REAL = 1e-9  # Im κ over |κ| below which it is rounding


@dataclass(frozen=True)
class CurvedModes:
    """Modes about the profile on the flat, r_i(s) = (δx, δy) over L, in the frame of the substrate.

    Normalised by ∫_ε^1 s² |r_i|² ds = 1, with ϑ_i'(1) > 0. The ``dual`` modes l_i, ∫ s² l_i·r_j ds = δ_ij, are
    the modes themselves unless Coulomb's law makes the problem non-symmetric. Then two modes may merge into a pair that
    grows (flutter); it has no real shape, and all but its κ and growth is NaN.

    Attributes
    ----------
    flat : Held
        Profile on the flat.
    condition : {"slide", "stick"}
        What holds the contact.
    law : {"constant", "coulomb"}
        What friction does while it slides.
    kappa, growth : (M,) arrays
        κ of the oscillation, and rate at which it grows, over 1/k: 0 of a stable mode.
    turn : (M, Q) array
        Legendre coefficients, in 1 − 2 ln s/ln ε, of the rotation ϑ.
    shift, dual : (2, M, Q) arrays
        Those of (δx, δy), and of the dual modes.
    base_curvature : (M,) array
        ϑ'(1), per unit of amplitude.
    contact_force, base_force : (2, M) arrays
        Force on the whisker at the contact and on the follicle, x and y over πEα⁴L²/4, per unit of amplitude.
    """

    flat: Held
    condition: Condition
    law: Law
    kappa: Array
    growth: Array
    turn: Array
    shift: Array
    dual: Array
    base_curvature: Array
    contact_force: Array
    base_force: Array

    @property
    def transverse_force(self) -> Array:
        """Force on the follicle along n(1) over πEα⁴L²/4, per unit of amplitude, (M,)."""
        angle = self.flat.posture.base_angle
        return np.asarray([-np.sin(angle), np.cos(angle)] @ self.base_force)

    @property
    def axial_force(self) -> Array:
        """Force along the shaft into the follicle over πEα⁴L²/4, per unit of amplitude, (M,)."""
        angle = self.flat.posture.base_angle
        return np.asarray([np.cos(angle), np.sin(angle)] @ self.base_force)

    @property
    def contact_load(self) -> Array:
        """Load on the contact over πEα⁴L²/4, per unit of amplitude, (M,)."""
        return self.contact_force[1]

    def rotation(self, s: Array) -> Array:
        """ϑ_i(s) [rad], (M, S); the free end turns as the contact does."""
        return _series(self.turn, self._place(s))

    def displacement(self, s: Array) -> Array:
        """(δx, δy) of the modes over L, (2, M, S); straight below the contact."""
        beyond = np.minimum(s - self.flat.contact, 0) * self.rotation(s)
        return _series(self.shift, self._place(s)) + np.stack([0 * beyond, beyond])

    def adjoint(self, s: Array) -> Array:
        """(δx, δy) of the dual modes in [ε, 1], (2, M, S)."""
        return _series(self.dual, self._place(s))

    def _place(self, s: Array) -> Array:
        log_contact = np.log(self.flat.contact)
        return np.asarray(1 - 2 * np.clip(np.log(s) / log_contact, 0, 1))


def curved_modes(
    flat: Held | Posture, n_modes: int = 3, *, condition: Condition = "slide", law: Law = "constant"
) -> CurvedModes:
    """Modes about the curved profile.

    Beyond [Boubenec2014]_, whose modes are those of a straight shaft. The point of the shaft that touches the substrate
    stays at its height. Where it slides, friction keeps its value (``constant``: the contact force of Eq. 1 stays as it
    is, but for its normal part) or follows the load (``coulomb``: δF_x = −μ δF_y, as on the flat, whose normal does not
    turn with the whisker). Where it is stuck, both parts of the force are whatever holds it.

    Parameters
    ----------
    flat : Held or Posture
        Profile on the flat, or its posture.
    n_modes : int
        How many modes, from the lowest.
    condition : {"slide", "stick"}
        Whether the contact is free along the substrate.
    law : {"constant", "coulomb"}
        Friction of a contact that slides.

    Raises
    ------
    InputError
        If an option is unknown.
    """
    held = on_the_flat(flat) if isinstance(flat, Posture) else flat
    _check(condition, law)
    waves = n_modes * np.log(1 / held.contact) / (1 - np.sqrt(held.contact))
    rod = _linearised(held, _MORE_POLYNOMIALS + int(waves))
    forces = np.eye(2) if condition == "stick" else np.array([[0.0, 1.0]])
    if law == "coulomb":
        forces = np.array([[-held.posture.friction, 1.0]])
    held_at = rod.contact if condition == "stick" else rod.contact[1:]
    work = forces @ rod.contact
    kappa, right, left = _eigenmodes(rod, null_space(held_at), null_space(work), n_modes)
    omega2 = (kappa**2).real
    imbalance = right @ rod.stiffness - omega2[:, None] * (right @ rod.mass)
    contact_force = forces.T @ np.linalg.pinv(work.T) @ imbalance.T
    return CurvedModes(
        held,
        condition,
        law,
        kappa=kappa.real,
        growth=np.where(np.abs(kappa.imag) < _REAL * np.abs(kappa), 0.0, np.abs(kappa.imag)),
        turn=right @ rod.turn.T,
        shift=right @ rod.shift.transpose(0, 2, 1),
        dual=left @ rod.shift.transpose(0, 2, 1),
        base_curvature=right @ rod.base,
        contact_force=contact_force,
        base_force=contact_force + omega2 * (rod.momentum @ right.T),
    )


class _Rod(NamedTuple):
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
    """

    stiffness: Array
    mass: Array
    turn: Array
    shift: Array
    base: Array
    contact: Array
    momentum: Array


def _linearised(held: Held, count: int) -> _Rod:
    """With ln s = −(1 − z) σ, σ = ln(1/ε)/2: s⁴ϑ' = s^{3/2} g(z), and ∫ s⁴ϑ'² ds = ∫ g² d ln s."""
    z, weights, polynomials, from_base, analysis = _nodes(count)
    half = -np.log(held.contact) / 2
    s, weights = np.exp(-(1 - z) * half), weights * half
    scale = np.sqrt((np.arange(count) + 0.5) / half)
    turn = half * from_base @ (s[:, None] ** -1.5 * polynomials * scale)
    angle, push = held.angle(s), held.contact_force
    tangent = np.stack([np.cos(angle), np.sin(angle)])
    shift = np.stack([half * from_base @ (lever[:, None] * turn) for lever in (-s * tangent[1], s * tangent[0])])
    stiffening = weights * s * push * np.sin(held.posture.friction_angle - angle)
    inertia = weights * s**3
    coefficients = analysis @ shift
    return _Rod(
        stiffness=np.eye(count) + (turn * stiffening[:, None]).T @ turn,
        mass=sum((part * inertia[:, None]).T @ part for part in shift),
        turn=analysis @ turn,
        shift=coefficients,
        base=scale,
        contact=(-1.0) ** np.arange(len(z)) @ coefficients,
        momentum=inertia @ shift,
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


def _eigenmodes(rod: _Rod, trial: Array, test: Array, n_modes: int) -> tuple[NDArray[np.complex128], Array, Array]:
    """κ, modes and dual modes, normalised, (M,), (M, N), (M, N)."""
    kappa, right, left = _eigenvectors(rod, trial, test, n_modes)
    right = right * np.sign(right @ rod.base)[:, None]
    right = right / np.sqrt(np.einsum("ij,jk,ik->i", right, rod.mass, right))[:, None]
    return kappa, right, left / np.einsum("ij,jk,ik->i", left, rod.mass, right)[:, None]


def _eigenvectors(rod: _Rod, trial: Array, test: Array, n_modes: int) -> tuple[NDArray[np.complex128], Array, Array]:
    """κ, modes and dual modes, from 1/κ², so that rounding falls on the highest modes.

    Trial motion obeys the constraint; in test motion the contact force does no work.
    """
    if trial.shape == test.shape and np.allclose(test @ (test.T @ trial), trial, rtol=0, atol=1e-12):
        value, vectors = eigh(trial.T @ rod.mass @ trial, trial.T @ rod.stiffness @ trial)
        right = vectors[:, : -n_modes - 1 : -1].T @ trial.T
        return np.asarray(1 / np.sqrt(value[: -n_modes - 1 : -1]), complex), right, right
    value, left, right = eig(test.T @ rod.mass @ trial, test.T @ rod.stiffness @ trial, left=True, right=True)
    kappa = 1 / np.sqrt(value.astype(complex))
    lowest = np.argsort(np.abs(kappa), kind="stable")[:n_modes]
    kappa = kappa[lowest]
    stable = np.where(np.abs(kappa.imag) < _REAL * np.abs(kappa), 1.0, np.nan)
    return kappa, (trial @ right[:, lowest]).real.T * stable[:, None], (test @ left[:, lowest]).real.T * stable[:, None]


def _series(coefficients: Array, z: Array) -> Array:
    return np.asarray(coefficients @ legendre.legvander(z, coefficients.shape[-1] - 1).T)


def _check(condition: Condition, law: Law) -> None:
    for name, value, rule in (("contact condition", condition, Condition), ("friction law", law, Law)):
        if value not in get_args(rule):
            raise InputError(name, f"must be one of {', '.join(get_args(rule))}", repr(value))
    if condition == "stick" and law == "coulomb":
        raise InputError("friction law", "of a stuck contact must be 'constant'", repr(law), "it does not slide")
