"""The stationary profile on an edge: held by (D, H, θ_b), the contact free to slide along the shaft and to turn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.profile import Curve, Posture, curve, flat_curve

Array = NDArray[np.float64]

_TOLERANCE = 1e-12  # of ε, θ_ε, and Λ̂ over its value
_ITERATIONS = 30
_STRIDE = 0.01  # [L] longest step of the excursion from one solution to the next
_SHORTEST = 1e-5  # [L] step below which a held profile is given up


@dataclass(frozen=True)
class Held:
    """A stationary profile whose contact an edge has carried away from where it stood on the flat.

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
    def base(self) -> tuple[float, float]:
        """Distance D along the substrate and height H of the base from the edge, over L."""
        c, cos, sin = self.curve, np.cos(self.contact_angle), np.sin(self.contact_angle)
        x, y = self.contact * c.x[-1], self.contact * c.y[-1]
        return float(x * cos - y * sin), float(x * sin + y * cos)

    @cached_property
    def sensitivity(self) -> Array:
        """(3, 3) derivatives of (θ_b, D, H) by (ε, θ_ε, Λ̂)."""
        c, epsilon = self.curve, self.contact
        cos, sin = np.cos(self.contact_angle), np.sin(self.contact_angle)
        base, psi = 1 / epsilon, c.psi[-1]
        along = np.array([c.x[-1] - base * np.cos(psi), epsilon * c.x_load[-1]])  # by ε and Λ̂, before the turn
        up = np.array([c.y[-1] - base * np.sin(psi), epsilon * c.y_load[-1]])
        d_by, h_by = along * cos - up * sin, along * sin + up * cos
        distance, height = self.base
        return np.array(
            [
                [-c.slope[-1] * base, 1.0, c.psi_load[-1]],
                [d_by[0], -height, d_by[1]],
                [h_by[0], distance, h_by[1]],
            ]
        )

    @property
    def determinant(self) -> float:
        """Determinant of ∂(θ_b, D, H)/∂(ε, θ_ε, Λ): negative, 0 on the fold."""
        return float(np.linalg.det(self.sensitivity)) / self.contact**2

    def angle(self, s: Array) -> Array:
        """θ(s) [rad]; straight are the free end, below ε, and what is in the follicle, above 1."""
        return self.contact_angle + self.curve.at(self.curve.psi, self._log_x(s))

    def position(self, s: Array) -> tuple[Array, Array]:
        """Position from the base, along the substrate and up, over L; straight where :meth:`angle` says."""
        c, log_x, psi = self.curve, self._log_x(s), self.curve.psi[-1]
        free, inside = np.minimum(s / self.contact - 1, 0), np.maximum(s - 1, 0) / self.contact
        along = c.at(c.x, log_x) - c.x[-1] + free + inside * np.cos(psi)
        up = c.at(c.y, log_x) - c.y[-1] + inside * np.sin(psi)
        cos, sin = np.cos(self.contact_angle), np.sin(self.contact_angle)
        return self.contact * (along * cos - up * sin), self.contact * (along * sin + up * cos)

    def _log_x(self, s: Array) -> Array:
        return np.minimum(np.log(np.maximum(s / self.contact, 1.0)), self.curve.span)

    @property
    def base_curvature(self) -> float:
        """θ'(1), over 1/L: the bending moment at the base in units of πEα⁴L³/4."""
        return float(self.curve.slope[-1])

    @property
    def transverse_force(self) -> float:
        """Force on the follicle along n(1), in units of πEα⁴L²/4: Λ cos(θ_b − φ − θ_ε)."""
        return self.contact_force * float(np.cos(self._base_to_force))

    @property
    def axial_force(self) -> float:
        """Force along the shaft into the follicle, in units of πEα⁴L²/4: Λ sin(θ_b − φ − θ_ε)."""
        return self.contact_force * float(np.sin(self._base_to_force))

    @property
    def _base_to_force(self) -> float:
        return self.posture.base_angle - self.posture.friction_angle - self.contact_angle


def on_the_flat(posture: Posture) -> Held:
    """The profile on the flat, as one held at d = 0."""
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
        z over L: the edge then stands H − z below the base.

    Raises
    ------
    InputError
        If no profile is reached: on the way the determinant of the fold comes to 0, or the contact leaves the shaft.
    """
    held = start or flat
    step = _STRIDE
    while (held.excursion, held.height) != (excursion, height):
        way = np.array([excursion - held.excursion, height - held.height])
        ahead = float(np.hypot(*way))
        step = min(step, ahead, _STRIDE)
        there = np.array([held.excursion, held.height]) + step / ahead * way
        target = (excursion, height) if step == ahead else (float(there[0]), float(there[1]))
        try:
            held, step = _corrected(flat, held, *target), 2 * step
        except ConvergenceError:
            step /= 2
            if step < _SHORTEST:
                raise InputError(
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
    unknown = np.array([near.contact, near.contact_angle, near.curve.load])
    unknown += np.linalg.solve(near.sensitivity, [0.0, excursion - near.excursion, near.height - height])
    for _ in range(_ITERATIONS):
        contact, turn, load = unknown
        if not (0 < contact < 1 and load > 0 and abs(turn) < np.pi / 2):
            raise ConvergenceError("profile on an edge", float(contact), _ITERATIONS)
        member = curve(load, -np.log(contact), posture.friction_angle)
        held = Held(posture, excursion, float(contact), float(turn), member, height)
        if not held.determinant < 0:
            raise ConvergenceError("profile on an edge (beyond the fold)", held.determinant, _ITERATIONS)
        miss = np.array([turn + member.psi[-1], *held.base]) - target
        step = np.linalg.solve(held.sensitivity, miss)
        unknown = unknown - step
        if np.all(np.abs(step) < _TOLERANCE * np.array([1, 1, load])):
            return held
    raise ConvergenceError("profile on an edge", float(np.abs(miss).max()), _ITERATIONS)
