"""Resonant modes of the whisker about its curved profile, under what holds its contact.

The shaft does not stretch: a rotation ϑ(s) displaces it by δx' = −sin θ ϑ, δy' = cos θ ϑ from the base. Under the
contact force at rest, Λ at the angle φ to the normal, small motion obeys
δ∫[s⁴ϑ'² − Λ sin(θ − φ) ϑ² − s²(δẋ² + δẏ²)]/2 ds = δF·δr(ε) + Λ cos φ δε ϑ(ε), with δF what the contact force changes
by and δε how far it moves along the shaft. The free end beyond the contact has no mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eig, eigh, null_space

from vibrissa.arrays import Array, Complex
from vibrissa.errors import RangeError, UnknownError
from vibrissa.mechanics.modes.curved_operator import LinearRod, linearised
from vibrissa.mechanics.statics.contact_law import sliding_friction
from vibrissa.mechanics.statics.edge_contact import Held, on_the_flat
from vibrissa.mechanics.statics.profile import Posture

Condition = Literal["slide", "stick", "edge", "flat"]
Law = Literal["constant", "coulomb"]

_MORE_POLYNOMIALS = 24  # than the highest mode has radians in ln s, evenly spread as at the base
_REAL = 1e-9  # Im κ over |κ| below which it is rounding
_ROUNDING = 1e-10  # of the largest 1/κ², below which its sign may be


@dataclass(frozen=True)
class CurvedModes:
    """Modes about the profile on the flat, r_i(s) = (δx, δy) over L, in the frame of the substrate.

    Normalised by ∫_ε^1 s² |r_i|² ds = 1, with ϑ_i'(1) > 0. The ``dual`` modes l_i, ∫ s² l_i·r_j ds = δ_ij, are
    the modes themselves unless Coulomb's law makes the problem non-symmetric. Then two modes may merge into a pair that
    grows (flutter); it has no real shape, and all but its κ and growth is NaN. So it is with a mode that nothing brings
    back, on an edge beyond the fold: its κ is 0.

    Attributes
    ----------
    flat : Held
        Profile on the flat.
    condition : {"slide", "stick", "edge", "flat"}
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
        """ϑ_i(s) [rad], (M, S); the free end turns as the contact does.

        Parameters
        ----------
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        (M, S) array
            ϑ_i [rad] per unit of amplitude.
        """
        return _series(self.turn, self._place(s))

    def displacement(self, s: Array) -> Array:
        """(δx, δy) of the modes over L, (2, M, S); straight below the contact.

        Parameters
        ----------
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        (2, M, S) array
            Along the substrate and up, per unit of amplitude.
        """
        beyond = np.minimum(s - self.flat.contact, 0) * self.rotation(s)
        return _series(self.shift, self._place(s)) + np.stack([0 * beyond, beyond])

    def adjoint(self, s: Array) -> Array:
        """(δx, δy) of the dual modes in [ε, 1], (2, M, S).

        Parameters
        ----------
        s : (S,) array
            Points in [ε, 1].

        Returns
        -------
        (2, M, S) array
            l_i along the substrate and up.
        """
        return _series(self.dual, self._place(s))

    def _place(self, s: Array) -> Array:
        log_contact = np.log(self.flat.contact)
        return np.asarray(1 - 2 * np.clip(np.log(s) / log_contact, 0, 1))


def curved_modes(
    flat: Held | Posture, n_modes: int = 3, *, condition: Condition = "slide", law: Law | None = None
) -> CurvedModes:
    """Modes about the curved profile.

    Beyond [Boubenec2014]_, whose modes are those of a straight shaft. The contact is

    - ``slide``: one point of the shaft, as a tip is, that keeps its height and is free along the substrate;
    - ``stick``: one point of the shaft, held; both parts of the force are whatever holds it;
    - ``edge``: an edge at rest, over which the shaft slips, δε = −δx(ε): the load moves along the shaft
      and keeps the angle φ of Eq. 1 to the normal of the whisker, which turns. Beyond the fold nothing brings it back;
    - ``flat``: smooth ground on which the free end lies; the contact moves along both, so ϑ(ε) = 0.

    On the substrate, whose normal does not turn, friction keeps its value (``constant``: the contact force of Eq. 1
    stays as it is, but for its normal part) or follows the contact law (``coulomb``: δF_x = −(∂T/∂N) δF_y −
    (∂T/∂ε) δε, which is −μ δF_y by Coulomb's).

    Parameters
    ----------
    flat : Held or Posture
        Profile on the flat, or its posture.
    n_modes : int
        How many modes, from the lowest.
    condition : {"slide", "stick", "edge", "flat"}
        What holds the contact.
    law : {"constant", "coulomb"}, optional
        Friction of a contact that slides: ``coulomb`` on an edge, else ``constant`` by default.

    Returns
    -------
    CurvedModes
        From the lowest frequency.

    Raises
    ------
    InputError
        If an option is unknown, or the law not one of the condition.
    """
    held = on_the_flat(flat) if isinstance(flat, Posture) else flat
    law = _law(condition, law)
    waves = n_modes * np.log(1 / held.contact) / (1 - np.sqrt(held.contact))
    rod = linearised(held, _MORE_POLYNOMIALS + int(waves))
    contact = supported(rod, held, condition, law)
    kappa, right, left = _eigenmodes(rod, contact, n_modes, symmetric=law == "constant")
    omega2 = (kappa**2).real
    imbalance = contact.stiffness @ right.T - rod.mass @ right.T * omega2
    contact_force = contact.force.T @ np.linalg.pinv(contact.work.T) @ imbalance + contact.turning @ right.T
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


class Contact(NamedTuple):
    """What holds the contact, in the basis of the rod.

    Attributes
    ----------
    stiffness : (N, N) array
        That of the rod and of the load at rest as it moves and turns; test motion by motion.
    held, work : (C, N) arrays
        What stays 0 of a motion, and the work of unit reactions on it.
    force : (C, 2) array
        Force on the whisker of unit reactions; 0 of a moment.
    turning : (2, N) array
        Change of the contact force as it turns with the whisker.
    """

    stiffness: Array
    held: Array
    work: Array
    force: Array
    turning: Array


def supported(rod: LinearRod, held: Held, condition: Condition, law: Law) -> Contact:
    """Stiffness, constraints and reactions of a contact.

    Parameters
    ----------
    rod : LinearRod
        The linearised shaft.
    held : Held
        Its profile on the flat.
    condition, law : str
        As of :func:`curved_modes`.

    Returns
    -------
    Contact
        In the basis of the rod; on the flat the second constraint is the turn, in units of |δy| over |ϑ|.
    """
    along, up = rod.contact
    friction = sliding_friction(held.posture.law, held.curve.load, held.contact)
    force = np.eye(2) if condition == "stick" else np.array([[-friction.by_normal * (law == "coulomb"), 1.0]])
    fixed, work = rod.contact if condition == "stick" else up[None], force @ rod.contact
    stiffness, turning = rod.stiffness, np.zeros_like(rod.contact)
    if condition == "edge":
        # the force turns with the shaft; as the edge comes to another place, δε = −δx(ε), friction and moment change
        load, phi = held.contact_force, held.force_angle
        turning = -load * np.outer([np.cos(phi), np.sin(phi)], rod.contact_turn)
        turning[0] += friction.by_place * along
        stiffness = stiffness - rod.contact.T @ turning + load * np.cos(phi) * np.outer(rod.contact_turn, along)
    if condition == "flat":
        # the reaction to the turn is a moment M = Λ cos φ δε: it says where the contact is, and so what friction is
        size = np.linalg.norm(up) / np.linalg.norm(rod.contact_turn)
        drag = np.array([-friction.by_place * (law == "coulomb") / held.normal_force * size, 0.0])
        fixed = np.vstack([fixed, size * rod.contact_turn])
        work = np.vstack([work, size * rod.contact_turn + drag @ rod.contact])
        force = np.vstack([force, drag])
    return Contact(stiffness, fixed, work, force, turning)


def _eigenmodes(rod: LinearRod, contact: Contact, n_modes: int, *, symmetric: bool) -> tuple[Complex, Array, Array]:
    """κ, modes and dual modes, normalised, (M,), (M, N), (M, N).

    Trial motion obeys the constraint; in test motion the contact force does no work.
    """
    trial, test = null_space(contact.held), null_space(contact.work)
    solve = _symmetric if symmetric else _general
    kappa, right, left = solve(test.T @ rod.mass @ trial, test.T @ contact.stiffness @ trial, n_modes)
    right, left = right @ trial.T, left @ test.T
    right = right * np.sign(right @ rod.base)[:, None]
    right = right / np.sqrt(np.einsum("ij,jk,ik->i", right, rod.mass, right))[:, None]
    return kappa, right, left / np.einsum("ij,jk,ik->i", left, rod.mass, right)[:, None]


def _symmetric(mass: Array, stiffness: Array, n_modes: int) -> tuple[Complex, Array, Array]:
    """κ, modes and dual modes, from 1/κ², so that rounding falls on the highest modes."""
    value, vectors = eigh(mass, stiffness)
    right = vectors[:, : -n_modes - 1 : -1].T
    return np.asarray(1 / np.sqrt(value[: -n_modes - 1 : -1]), complex), right, right


def _general(mass: Array, stiffness: Array, n_modes: int) -> tuple[Complex, Array, Array]:
    """The same where they may grow, from the lowest frequency: first those that nothing brings back."""
    value, left, right = eig(mass, stiffness, left=True, right=True)
    kappa = 1 / np.sqrt(value.astype(complex))
    size = np.abs(value)
    lowest = np.argsort(np.where(size > _ROUNDING * size.max(), kappa.real, np.abs(kappa)), kind="stable")[:n_modes]
    kappa = kappa[lowest]
    stable = np.where(np.abs(kappa.imag) < _REAL * np.abs(kappa), 1.0, np.nan)
    return kappa, right[:, lowest].real.T * stable[:, None], left[:, lowest].real.T * stable[:, None]


def _series(coefficients: Array, z: Array) -> Array:
    return np.asarray(coefficients @ legendre.legvander(z, coefficients.shape[-1] - 1).T)


def _law(condition: Condition, law: Law | None) -> Law:
    for name, value, rule in (("contact condition", condition, Condition), ("friction law", law or "constant", Law)):
        if value not in get_args(rule):
            raise UnknownError(name, f"must be one of {', '.join(get_args(rule))}", repr(value))
    if condition == "stick" and law == "coulomb":
        raise RangeError("friction law", "of a stuck contact must be 'constant'", repr(law), "it does not slide")
    if condition == "edge" and law == "constant":
        raise UnknownError("friction law", "on an edge must be 'coulomb'", repr(law), "leave it out")
    return law or ("coulomb" if condition == "edge" else "constant")
