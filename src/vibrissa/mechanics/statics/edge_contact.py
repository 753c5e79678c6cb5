"""The stationary profile on an edge: held by (D, H, θ_b), the contact free to slide along the shaft and to turn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import ConvergenceError, RangeError
from vibrissa.mechanics.statics.contact_law import follicle_forces, inclination
from vibrissa.mechanics.statics.profile import Curve, Posture, curve, flat_curve
from vibrissa.mechanics.statics.shooting import STRIDE, Clamp, sensitivity

_TOLERANCE = 1e-12  # of ε, θ_ε, and Λ̂ over its value
_ITERATIONS = 30
_SHORTEST = 1e-5  # [L] step below which a held profile is given up


@dataclass(frozen=True)
class Held:
    """A stationary profile whose contact an edge has carried away from where it was on the flat.

    Attributes
    ----------
    posture : Posture
        The posture on the flat; its θ_b and H are kept.
    excursion : float
        Horizontal distance d by which the edge carried the contact, over L, positive away from the base.
    contact, contact_angle : float
        Where on the shaft the edge is, ε, and the angle θ_ε there [rad]; negative where the whisker sags.
    curve : Curve
        Member of the family.
    height : float
        Height z of the edge above the flat, over L.
    """

    posture: Posture
    excursion: float
    contact: float
    contact_angle: float
    curve: Curve
    height: float = 0.0

    @property
    def contact_force(self) -> float:
        """Λ, in units of πEα⁴L²/4."""
        return self.curve.load * self.contact**2

    @cached_property
    def _at_base(self) -> tuple[float, float, float, Array]:
        """D and H, the determinant of the sensitivity by Λ̂, and the sensitivity."""
        matrix = np.empty((3, 3))
        return *sensitivity(self.contact, self.contact_angle, self.curve.base_state, matrix), matrix

    @property
    def base(self) -> tuple[float, float]:
        """Distance D along the substrate and height H of the base from the edge, over L."""
        return self._at_base[:2]

    @property
    def clamp(self) -> Clamp:
        """How the base is held, as the kernels take it."""
        return Clamp(float(self.posture.base_angle), *self.base, self.posture.law)

    @property
    def start(self) -> Array:
        """ε, θ_ε and Λ̂, (3,)."""
        return np.array([self.contact, self.contact_angle, self.curve.load])

    @property
    def sensitivity(self) -> Array:
        """(3, 3) derivatives of (θ_b, D, H) by (ε, θ_ε, Λ̂)."""
        return self._at_base[3]

    @property
    def determinant(self) -> float:
        """Determinant of ∂(θ_b, D, H)/∂(ε, θ_ε, Λ): negative, 0 on the fold."""
        return self._at_base[2] / self.contact**2

    def angle(self, s: Array) -> Array:
        """θ(s) [rad]; straight are the free end, below ε, and what is in the follicle, above 1.

        Parameters
        ----------
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        (S,) array
            θ [rad].
        """
        return self.contact_angle + self.curve.at(self.curve.psi, self._log_x(s))

    def position(self, s: Array) -> tuple[Array, Array]:
        """Position from the base, along the substrate and up, over L; straight where :meth:`angle` says.

        Parameters
        ----------
        s : (S,) array
            Points of the shaft, over L.

        Returns
        -------
        x, y : (S,) arrays
            Along the substrate and up, over L.
        """
        c, log_x, psi = self.curve, self._log_x(s), self.curve.psi[-1]
        free, inside = np.minimum(s / self.contact - 1, 0), np.maximum(s - 1, 0) / self.contact
        along = c.at(c.x, log_x) - c.x[-1] + free + inside * np.cos(psi)
        up = c.at(c.y, log_x) - c.y[-1] + inside * np.sin(psi)
        cos, sin = np.cos(self.contact_angle), np.sin(self.contact_angle)
        return self.contact * (along * cos - up * sin), self.contact * (along * sin + up * cos)

    def displaced(self, x: Array, y: Array, s: Array) -> Array:
        """Transverse displacement n₁·(r − r₁) of points of the shaft about this profile.

        Parameters
        ----------
        x, y : (…, S) arrays
            Where the points are now, from the base, over L.
        s : (S,) array
            The points, over L.

        Returns
        -------
        (…, S) array
            Over L, positive away from the substrate.
        """
        angle, (x0, y0) = self.angle(s), self.position(s)
        return np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0)

    def _log_x(self, s: Array) -> Array:
        return np.minimum(np.log(np.maximum(s / self.contact, 1.0)), self.curve.span)

    @property
    def base_curvature(self) -> float:
        """θ'(1), over 1/L: the bending moment at the base in units of πEα⁴L³/4."""
        return float(self.curve.slope[-1])

    @property
    def transverse_force(self) -> float:
        """Force on the follicle along n(1), in units of πEα⁴L²/4: Λ cos(θ_b − φ − θ_ε)."""
        return float(self._follicle_forces[0])

    @property
    def axial_force(self) -> float:
        """Force along the shaft into the follicle, in units of πEα⁴L²/4: Λ sin(θ_b − φ − θ_ε)."""
        return float(self._follicle_forces[1])

    @cached_property
    def force_angle(self) -> float:
        """Angle φ of the contact force to the normal of the whisker at the contact [rad]."""
        return inclination(self.posture.law, self.curve.load)[0]

    @property
    def normal_force(self) -> float:
        """Λ cos φ along the normal of the whisker at the contact, in units of πEα⁴L²/4."""
        return self.contact_force * float(np.cos(self.force_angle))

    @property
    def _follicle_forces(self) -> tuple[Array, Array]:
        return follicle_forces(self.contact_force, self.posture.base_angle - self.force_angle - self.contact_angle)


def on_the_flat(posture: Posture) -> Held:
    """The profile on the flat, as one held at d = 0.

    Parameters
    ----------
    posture : Posture
        On the flat.

    Returns
    -------
    Held
        The profile, ε and θ_ε = 0.
    """
    return Held(posture, 0.0, posture.contact, 0.0, flat_curve(posture))


def hold(flat: Held, excursion: float, start: Held | None = None, *, height: float = 0.0) -> Held:
    """Carry the contact of a profile to an excursion and a height; the base stays where it is, and θ_b.

    Parameters
    ----------
    flat : Held
        From :func:`on_the_flat`.
    excursion : float
        d over L.
    start : Held, optional
        A solution nearby to start from; the flat one by default.
    height : float
        z over L: the edge is then H − z below the base.

    Returns
    -------
    Held
        The profile held there.

    Raises
    ------
    InputError
        If no profile is reached: on the way the determinant of the fold comes to 0, or the contact leaves the shaft.
    """
    held = start or flat
    step = STRIDE
    while (held.excursion, held.height) != (excursion, height):
        way = np.array([excursion - held.excursion, height - held.height])
        ahead = float(np.hypot(*way))
        step = min(step, ahead, STRIDE)
        there = np.array([held.excursion, held.height]) + step / ahead * way
        target = (excursion, height) if step == ahead else (float(there[0]), float(there[1]))
        try:
            held, step = _corrected(flat, held, *target), 2 * step
        except ConvergenceError:
            step /= 2
            if step < _SHORTEST:
                raise RangeError(
                    f"excursion {excursion:.4g} L" + (f" at height {height:.4g} L" if height else ""),
                    "must be within what the posture can follow",
                    f"no profile beyond {held.excursion:.4g} L, where the fold's determinant is {held.determinant:.3g}",
                    "lower the base angle, raise the contact, or narrow the gap",
                ) from None
    return held


def _corrected(flat: Held, near: Held, excursion: float, height: float) -> Held:
    """Newton's method for (ε, θ_ε, Λ̂) from a solution nearby."""
    posture, (distance, above) = flat.posture, flat.base
    target = np.array([posture.base_angle, distance + excursion, above - height])
    unknown = near.start + np.linalg.solve(near.sensitivity, [0.0, excursion - near.excursion, near.height - height])
    for _ in range(_ITERATIONS):
        contact, turn, load = unknown
        if not (0 < contact < 1 and load > 0 and abs(turn) < np.pi / 2):
            raise ConvergenceError("profile on an edge", float(contact), _ITERATIONS)
        member = curve(load, -np.log(contact), posture.law)
        held = Held(posture, excursion, float(contact), float(turn), member, height)
        if not held.determinant < 0:
            raise ConvergenceError("profile on an edge (beyond the fold)", held.determinant, _ITERATIONS)
        miss = np.array([turn + member.psi[-1], *held.base]) - target
        step = np.linalg.solve(held.sensitivity, miss)
        unknown = unknown - step
        if np.all(np.abs(step) < _TOLERANCE * np.array([1, 1, load])):
            return held
    raise ConvergenceError("profile on an edge", float(np.abs(miss).max()), _ITERATIONS)
