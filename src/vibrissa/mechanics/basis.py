"""The modes that a prediction is made of: those of the straight shaft (the paper's), or about its curved profile."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.exact import cone_kappa, cone_modes, shaft_quadrature
from vibrissa.mechanics.curved import Condition, Law, curved_modes
from vibrissa.mechanics.edge import Held
from vibrissa.mechanics.follicle import contact_shear, shear
from vibrissa.mechanics.gap import UnitResponse

Array = NDArray[np.float64]
Modes = Literal["straight", "curved", "curved-coulomb", "curved-edge"]

CURVED: dict[str, tuple[Condition, Law]] = {
    "curved": ("slide", "constant"),
    "curved-coulomb": ("slide", "coulomb"),
    "curved-edge": ("edge", "coulomb"),
}


class Basis(Protocol):
    """M modes of a whisker in its posture on the flat, and what each gives per unit of amplitude, (M,) arrays."""

    @property
    def kappa(self) -> Array:
        """Adimensional frequencies."""
        ...

    @property
    def base_curvature(self) -> Array:
        """Curvature at the base over 1/L."""
        ...

    @property
    def transverse_force(self) -> Array:
        """Force on the follicle along n(1), over πEα⁴L²/4."""
        ...

    @property
    def axial_force(self) -> Array:
        """Force along the shaft into the follicle, over πEα⁴L²/4."""
        ...

    @property
    def contact_load(self) -> Array:
        """Load on the contact, over πEα⁴L²/4."""
        ...

    def displacement(self, s: Array) -> Array:
        """(δx, δy) over L of the modes at points s, (2, M, S), along the substrate and up; straight beyond ε."""
        ...

    def adjoint(self, s: Array) -> Array:
        """l_i in [ε, 1], (2, M, S): the amplitude of a displacement δr is ∫_ε^1 s² δr·l_i ds."""
        ...


@dataclass(frozen=True)
class StraightModes:
    """Pinned modes V_i of the straight shaft, laid across the profile; they carry no axial vibration (NaN).

    Attributes
    ----------
    flat : Held
        Profile on the flat.
    kappa : (M,) array
        Adimensional frequencies.
    """

    flat: Held
    kappa: Array

    @cached_property
    def base_curvature(self) -> Array:
        """V_i''(1), (M,)."""
        return cone_modes(self.kappa, self.flat.contact, np.ones(1), derivative=2)[:, 0]

    @cached_property
    def transverse_force(self) -> Array:
        """(V_i''' + 4V_i'')(1), (M,)."""
        return shear(self.kappa, self.flat.contact, np.eye(len(self.kappa)))

    @cached_property
    def axial_force(self) -> Array:
        """Not modelled: NaN, (M,)."""
        return np.full(len(self.kappa), np.nan)

    @cached_property
    def contact_load(self) -> Array:
        """ε⁴ V_i'''(ε), (M,)."""
        return contact_shear(self.kappa, self.flat.contact, np.eye(len(self.kappa)))

    def displacement(self, s: Array) -> Array:
        """V_i along the normal of the profile, and along the shaft as far as it must not stretch, (2, M, S)."""
        contact, angle = self.flat.contact, self.flat.angle(s)
        slope = cone_modes(self.kappa, contact, np.array([contact]), derivative=1)
        across = cone_modes(self.kappa, contact, np.clip(s, contact, 1)) + slope * np.minimum(s - contact, 0)
        along = slip(across, angle, s)
        return np.stack(
            [along * np.cos(angle) - across * np.sin(angle), along * np.sin(angle) + across * np.cos(angle)]
        )

    def adjoint(self, s: Array) -> Array:
        """V_i along the normal, (2, M, S): what is projected is transverse displacement."""
        angle = self.flat.angle(s)
        return np.stack([-np.sin(angle), np.cos(angle)])[:, None] * cone_modes(self.kappa, self.flat.contact, s)


def basis(modes: Modes, flat: Held, n_modes: int) -> Basis:
    """Modes by name, of a profile on the flat.

    Parameters
    ----------
    modes : {"straight", "curved", "curved-coulomb", "curved-edge"}
        The paper's; those about the curved profile of a shaft of which one point slides, friction constant; the same,
        friction following the load (Coulomb); those of a shaft that slips over an edge, by Coulomb's friction.
    flat : Held
        Profile on the flat.
    n_modes : int
        How many, from the lowest.

    Raises
    ------
    InputError
        If there are no such modes, or one of them is unstable.
    """
    if modes not in get_args(Modes):
        raise InputError("modes", f"must be one of {', '.join(get_args(Modes))}", repr(modes))
    if modes == "straight":
        return StraightModes(flat, cone_kappa(flat.contact, n_modes))
    condition, law = CURVED[modes]
    found = curved_modes(flat, n_modes, condition=condition, law=law)
    if np.any(found.growth > 0):
        kappa, rule = found.kappa[found.growth.argmax()], "must be stable for a prediction"
        if kappa == 0:
            remedy = "lower the base angle or raise the contact"
            raise InputError("modes", rule, "no way back to the edge, beyond the fold", remedy)
        raise InputError("modes", rule, f"flutter at κ = {kappa:.4g}", "lower the friction")
    return found


def amplitudes(modes: Basis, s: Array, weights: Array, x: Array, y: Array) -> Array:
    """Q_i = ∫_ε^1 s² (δx, δy)·l_i ds of a displacement at nodes of a quadrature, (M,)."""
    along, up = modes.adjoint(s)
    return np.asarray(along @ (weights * s**2 * x) + up @ (weights * s**2 * y))


def couplings(modes: Basis, unit: UnitResponse) -> Array:
    """c_i, amplitudes of the response to a unit of excursion, (M,)."""
    s, weights = shaft_quadrature(unit.posture.contact, 80 + 8 * len(modes.kappa))
    return amplitudes(modes, s, weights, *unit.shift(s))


def slip(u: Array, angle: Array, s: Array) -> Array:
    """Slip along the tangent, dw/ds = u dθ/ds with w = 0 at the base, that keeps the shaft's length, (…, S).

    Parameters
    ----------
    u : (…, S) array
        Transverse displacement at points s.
    angle, s : (S,) arrays
        Angle θ, and the points, in any one order.
    """
    steps = (u[..., 1:] + u[..., :-1]) / 2 * np.diff(angle)
    along = np.concatenate([np.zeros((*u.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)
    return along - along[..., [int(np.argmin(np.abs(s - 1)))]]
