"""The modes that a prediction is made of: those of the straight shaft (the paper's), or about its curved profile."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, UnknownError
from vibrissa.exact import cone_kappa, cone_modes, shaft_quadrature
from vibrissa.mechanics.modes.curved import Condition, CurvedModes, Law, curved_modes
from vibrissa.mechanics.modes.straight import MOST_MODES, contact_shear, shear
from vibrissa.mechanics.statics.edge_contact import Held
from vibrissa.mechanics.statics.gap import UnitResponse

Modes = Literal["straight", "curved", "curved-coulomb", "curved-edge"]

CURVED: dict[str, tuple[Condition, Law]] = {
    "curved": ("slide", "constant"),
    "curved-coulomb": ("slide", "coulomb"),
    "curved-edge": ("edge", "coulomb"),
}


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
        """(δx, δy) over L: V_i along the normal of the profile, and along the shaft as far as it must not stretch.

        Parameters
        ----------
        s : (S,) array
            Points of the shaft, over L; below ε the free end goes on straight.

        Returns
        -------
        (2, M, S) array
            Along the substrate and up, per unit of amplitude.
        """
        contact, angle = self.flat.contact, self.flat.angle(s)
        slope = cone_modes(self.kappa, contact, np.array([contact]), derivative=1)
        across = cone_modes(self.kappa, contact, np.clip(s, contact, 1)) + slope * np.minimum(s - contact, 0)
        along = slip(across, angle, s)
        return np.stack(
            [along * np.cos(angle) - across * np.sin(angle), along * np.sin(angle) + across * np.cos(angle)]
        )

    def adjoint(self, s: Array) -> Array:
        """V_i along the normal: transverse displacement is projected; ∫_ε^1 s² δr·l_i ds is the amplitude.

        Parameters
        ----------
        s : (S,) array
            Points in [ε, 1].

        Returns
        -------
        (2, M, S) array
            l_i along the substrate and up.
        """
        angle = self.flat.angle(s)
        return np.stack([-np.sin(angle), np.cos(angle)])[:, None] * cone_modes(self.kappa, self.flat.contact, s)


Basis = StraightModes | CurvedModes  # M modes about a profile on the flat, and what each gives per unit of amplitude
_SHAFT = 400  # points from which the slip along the shaft is integrated


def contact_motion(modes: Basis) -> Array:
    """Displacement of the contact along the substrate, per unit of amplitude.

    Parameters
    ----------
    modes : Basis
        Of a profile on the flat.

    Returns
    -------
    (M,) array
        δx(ε), over L.
    """
    return np.asarray(modes.displacement(np.linspace(modes.flat.contact, 1, _SHAFT))[0, :, 0])


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

    Returns
    -------
    Basis
        The modes.

    Raises
    ------
    InputError
        If there are no such modes, or one of them is unstable.
    """
    if modes not in get_args(Modes):
        raise UnknownError("modes", f"must be one of {', '.join(get_args(Modes))}", repr(modes))
    if not 1 <= n_modes <= MOST_MODES:
        raise RangeError("number of modes", f"must be between 1 and {MOST_MODES}", n_modes)
    if modes == "straight":
        return StraightModes(flat, cone_kappa(flat.contact, n_modes))
    condition, law = CURVED[modes]
    found = curved_modes(flat, n_modes, condition=condition, law=law)
    if np.any(found.growth > 0):
        kappa, rule = found.kappa[found.growth.argmax()], "must be stable for a prediction"
        if kappa == 0:
            remedy = "lower the base angle or raise the contact"
            raise RangeError("modes", rule, "no way back to the edge, beyond the fold", remedy)
        raise RangeError("modes", rule, f"flutter at κ = {kappa:.4g}", "lower the friction")
    return found


def amplitudes(modes: Basis, s: Array, weights: Array, x: Array, y: Array) -> Array:
    """Q_i = ∫_ε^1 s² (δx, δy)·l_i ds of a displacement at nodes of a quadrature, (M,).

    Parameters
    ----------
    modes : Basis
        The modes.
    s, weights : (S,) arrays
        Nodes and weights of a quadrature on [ε, 1].
    x, y : (S,) arrays
        Displacement along the substrate and up, over L.

    Returns
    -------
    (M,) array
        Q_i over L.
    """
    along, up = modes.adjoint(s)
    return np.asarray(along @ (weights * s**2 * x) + up @ (weights * s**2 * y))


def couplings(modes: Basis, unit: UnitResponse) -> Array:
    """c_i, amplitudes of the response to a unit of excursion, (M,).

    Parameters
    ----------
    modes : Basis
        The modes.
    unit : UnitResponse
        Of their posture.

    Returns
    -------
    (M,) array
        c_i [1].
    """
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

    Returns
    -------
    (…, S) array
        Towards the base, in the unit of u.
    """
    steps = (u[..., 1:] + u[..., :-1]) / 2 * np.diff(angle)
    along = np.concatenate([np.zeros((*u.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)
    return along - along[..., [int(np.argmin(np.abs(s - 1)))]]
