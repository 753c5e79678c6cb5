"""Rows of the quasi-static response: amplitudes of the modes, then what follicle and contact bear."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import gauss
from vibrissa.mechanics.modes.basis import Basis, amplitudes
from vibrissa.mechanics.quasi_static.projection import Profiles, Projection
from vibrissa.mechanics.statics.contact_law import follicle_forces, inclination, inclinations, lever
from vibrissa.mechanics.statics.edge_contact import Held
from vibrissa.mechanics.statics.gap import UnitResponse

_PANEL = 48  # Gauss nodes in each of the two panels of Q, and 4 more for each mode
FOLLICLE = ("base_curvature", "transverse_force", "axial_force", "contact_load", "contact_angle")


def table_rows(project: Projection, held: Profiles) -> Array:
    """The table at many profiles (E,) at once, (K, E).

    Parameters
    ----------
    project : Projection
        Of the posture and its modes.
    held : Profiles
        E profiles at its points.

    Returns
    -------
    (K, E) array
        Rows as of :class:`Response`.
    """
    contact, turn, load = held.unknowns.T
    posture = project.flat.posture
    phi = inclinations(posture.law, load)
    follicle = _follicle(posture.base_angle, phi, turn, load * contact**2, held.base_curvature)
    return np.concatenate([project.of_profiles(held), follicle])


def held_rows(flat: Held, shapes: Basis, held: Held) -> Array:
    """One column of the table: Q_i of the modes, then ``FOLLICLE``, of one held profile.

    Parameters
    ----------
    flat : Held
        Profile on the flat.
    shapes : Basis
        The modes.
    held : Held
        The profile.

    Returns
    -------
    (K,) array
        Rows as of :class:`Response`.
    """
    return np.concatenate([_amplitudes(flat, shapes, held), follicle_of(held)])


def follicle_of(held: Held) -> Array:
    """``FOLLICLE`` of one held profile.

    Parameters
    ----------
    held : Held
        The profile.

    Returns
    -------
    (5,) array
        By ``FOLLICLE``.
    """
    at = (held.posture.base_angle, held.force_angle, held.contact_angle, held.contact_force, held.base_curvature)
    return _follicle(at[0], *map(np.asarray, at[1:]))


def _follicle(base_angle: float, phi: Array, turn: Array, force: Array, curvature: Array) -> Array:
    """``FOLLICLE`` (5, …) by φ, θ_ε and Λ at the contact and the curvature at the base, (…)."""
    forces = *follicle_forces(force, base_angle - phi - turn), force * np.cos(phi + turn)
    return np.stack([curvature, *forces, turn])


def _amplitudes(flat: Held, shapes: Basis, held: Held) -> Array:
    """Q_i = ∫_ε^1 s² (r − r₁)·l_i ds, for straight modes l_i = V_i n₁, in two panels: the free end is straight."""
    contact = flat.posture.contact
    z, w = gauss(_PANEL + 4 * len(shapes.kappa))
    total = np.zeros(len(shapes.kappa))
    for low, high in ((contact, max(held.contact, contact)), (max(held.contact, contact), 1.0)):
        s = (low + high) / 2 + (high - low) / 2 * z
        (x, y), (x1, y1) = held.position(s), flat.position(s)
        total += amplitudes(shapes, s, (high - low) / 2 * w, x - x1, y - y1)
    return total


def follicle_slope(unit: UnitResponse, flat: Held) -> Array:
    """Derivatives of ``FOLLICLE`` by d, from the derivatives of ε, θ_ε and Λ̂ and the balance of moments.

    Parameters
    ----------
    unit : UnitResponse
        Linear response of the posture.
    flat : Held
        Profile on the flat.

    Returns
    -------
    (5,) array
        By ``FOLLICLE``, per unit of d.
    """
    (phi, rate), force = inclination(flat.posture.law, flat.curve.load), flat.contact_force
    gain = unit.load * flat.contact**2 + 2 * flat.curve.load * flat.contact * unit.contact
    turn = unit.contact_angle + rate * unit.load / flat.curve.load  # of the force: with the shaft and with its load
    distance, height = flat.base
    transverse, axial = follicle_forces(1.0, flat.posture.base_angle - phi)
    # the moment is Λ [(D + d) cos(φ + θ_ε) + H sin(φ + θ_ε)]
    swing = lever(phi, height, -distance)
    return np.array(
        [
            gain * lever(phi, distance, height) + force * (np.cos(phi) + turn * swing),
            gain * transverse + force * axial * turn,
            gain * axial - force * transverse * turn,
            gain * np.cos(phi) - force * np.sin(phi) * turn,
            unit.contact_angle,
        ]
    )
