"""The shaft with its free end, linearised about the profile on the flat, under each support that it may have.

On *land* the free end lies flat and the contact rolls, so that the shaft does not turn at ε. On an *edge* it turns, and
the free end swings with it; so it does on its own *tip*, but there the force keeps its direction. All are small motions
of one set of coordinates: bending moments of the shaft above ε, as of :mod:`vibrissa.mechanics.modes.curved_operator`,
and the bending of the free end below it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eig, null_space

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.exact import gauss
from vibrissa.mechanics.modes.curved import Condition, supported
from vibrissa.mechanics.modes.curved_operator import LinearRod, linearised
from vibrissa.mechanics.statics.edge_contact import Held

_MORE_POLYNOMIALS = 24  # than the highest mode has radians in ln s, as the modes about the profile
_BENDING = 8  # polynomials of the free end's bending
_OVERDAMPED = 0.97  # a ratio above is taken for this: such a mode does not ring in either case
_FIRST = 3  # modes that get the ratio
_REAL = 1e-9  # Im κ² over |κ²| below which it is rounding
_SHORTEST = 1e-6  # [L] of a free end that has a mass


class FreeEndShaft(NamedTuple):
    """Coordinates of the shaft and its free end, N + B of them.

    Attributes
    ----------
    held : Held
        Profile on the flat.
    rod : LinearRod
        The shaft above the contact, N coordinates.
    tip : float
        Where the free end ends, over L.
    mass, bending : (N + B, N + B) arrays
        Of both parts; bending without the load at rest.
    """

    held: Held
    rod: LinearRod
    tip: float
    mass: Array
    bending: Array

    def extended(self, rows: Array) -> Array:
        """Rows of the shaft above the contact, (…, N), with nothing of the free end, (…, N + B).

        Parameters
        ----------
        rows : (…, N) array
            Rows.

        Returns
        -------
        (…, N + B) array
            With zeros.
        """
        return np.concatenate([rows, np.zeros((*rows.shape[:-1], _BENDING))], axis=-1)


class Support(NamedTuple):
    """Modes of the shaft on one support.

    Attributes
    ----------
    kappa, zeta : (M,) arrays
        Adimensional frequencies and damping ratios.
    shape, dual : (M, N + B) arrays
        Modes and their duals: dual · mass · shape = 1.
    reaction : (C, M) array
        Force that holds the contact up and, on land, the moment that keeps it from turning, per unit of amplitude.
    """

    kappa: Array
    zeta: Array
    shape: Array
    dual: Array
    reaction: Array


def whole_shaft(held: Held, tip: float, n_modes: int) -> FreeEndShaft:
    """Coordinates of a shaft that ends at a tip.

    Parameters
    ----------
    held : Held
        Profile on the flat.
    tip : float
        Of the whisker, over L.
    n_modes : int
        How many modes they will serve.

    Returns
    -------
    FreeEndShaft
        Its mass and stiffness.
    """
    waves = n_modes * np.log(1 / held.contact) / (1 - np.sqrt(held.contact))
    rod = linearised(held, _MORE_POLYNOMIALS + int(waves))
    n = len(rod.mass)
    end = min(tip, held.contact - _SHORTEST)
    s, weight, across, curvature = _free_end(end, held.contact)
    # the free end follows the contact along the flat, turns with it, and bends
    up = np.zeros((n + _BENDING, len(s)))
    up[:n] = rod.contact_turn[:, None] * (s - held.contact)
    up[n:] = across
    along = np.concatenate([rod.contact[0], np.zeros(_BENDING)])
    mass, bending = np.zeros((2, n + _BENDING, n + _BENDING))
    mass[:n, :n], bending[:n, :n] = rod.mass, np.eye(n)
    mass += (up * (weight * s**2)) @ up.T + np.outer(along, along) * np.sum(weight * s**2)
    bending[n:, n:] = (curvature * (weight * s**4)) @ curvature.T
    return FreeEndShaft(held, rod, tip, mass, bending)


def _free_end(tip: float, contact: float) -> tuple[Array, Array, Array, Array]:
    """Nodes and weights between tip and contact, and there the bending of a free end that is clamped at the contact."""
    z, w = gauss(2 * _BENDING + 8)
    half = (contact - tip) / 2
    s, weight = tip + half * (1 + z), half * w
    series = np.eye(_BENDING)
    slope = legendre.legint(series, lbnd=1, axis=1)
    shift = legendre.legint(slope, lbnd=1, axis=1)
    across, curvature = half**2 * legendre.legval(z, shift.T), legendre.legval(z, series.T)
    return s, weight, np.asarray(across, float), np.asarray(curvature, float)


def supports(shaft: FreeEndShaft, n_modes: int, damping: float) -> tuple[tuple[Support, ...], float]:
    """Modes on land, on an edge and on the tip, damped as the rod is.

    C = a₀M + a₁K + c₂(Mφ₂)(Mφ₂)ᵀ gives the first three modes on land the ratio asked for; see
    :mod:`vibrissa.mechanics.rod.damping`.

    Parameters
    ----------
    shaft : FreeEndShaft
        With its free end.
    n_modes : int
        How many modes.
    damping : float
        ζ of the first three modes on land.

    Returns
    -------
    land, edge, tip : Support
        The modes.
    relaxation : float
        a₁, the time in which overdamped bending comes to rest, over k.

    Raises
    ------
    InputError
        If a mode grows or has no frequency.
    """
    bare = np.zeros_like(shaft.mass)
    n = len(shaft.rod.mass)
    bare[:n, :n] = shaft.rod.mass  # the rod's ratios are those of the shaft above its contact
    damped, relaxation = _damping(shaft, _modes(shaft._replace(mass=bare), "flat", _FIRST), damping)
    conditions: tuple[Condition, ...] = ("flat", "edge", "slide")
    return tuple(_with_ratios(_modes(shaft, one, n_modes), damped) for one in conditions), relaxation


def _modes(shaft: FreeEndShaft, condition: Condition, n_modes: int) -> Support:
    """Modes on one support, normalised by ∫ s² |r|² ds = 1, of a base curvature above 0; ratios not yet known."""
    rod, b = shaft.rod, _BENDING if condition == "flat" else 0
    contact = supported(rod, shaft.held, condition, "coulomb")
    stiffness = shaft.bending.copy()
    n = len(rod.mass)
    stiffness[:n, :n] = contact.stiffness
    lying = np.eye(n + _BENDING)[n : n + b]  # on land the free end does not bend
    held, work = (np.vstack([shaft.extended(rows), lying]) for rows in (contact.held, contact.work))
    trial, test = null_space(held), null_space(work)
    value, left, right = eig(test.T @ shaft.mass @ trial, test.T @ stiffness @ trial, left=True, right=True)
    chosen = np.argsort(-value.real)[:n_modes]
    if np.any(np.abs(value.imag[chosen]) > _REAL * np.abs(value[chosen])) or np.any(value.real[chosen] <= 0):
        remedy = "lower the base angle, raise the contact or lower the friction"
        raise RangeError("modes of the free end", "must be stable", f"κ² = {1 / value[chosen[0]]:.4g}", remedy)
    shape, dual = right.real[:, chosen].T @ trial.T, left.real[:, chosen].T @ test.T
    shape *= (np.sign(shape[:, :n] @ rod.base) / np.sqrt(np.einsum("mi,ij,mj->m", shape, shaft.mass, shape)))[:, None]
    dual /= np.einsum("mi,ij,mj->m", dual, shaft.mass, shape)[:, None]
    omega2 = 1 / value.real[chosen]
    imbalance = (stiffness @ shape.T - shaft.mass @ shape.T * omega2)[:n]
    return Support(np.sqrt(omega2), np.zeros(n_modes), shape, dual, np.linalg.pinv(contact.work.T) @ imbalance)


def _damping(shaft: FreeEndShaft, land: Support, ratio: float) -> tuple[Array, float]:
    """C and a₁, from the first three modes of the shaft above its contact."""
    n = len(shaft.rod.mass)
    shape, dual, mass = land.shape[:, :n], land.dual[:, :n], shaft.rod.mass
    weighted = mass @ shape[1]
    own = np.einsum("mi,mi->m", dual, shape)  # bending is the unit matrix
    terms = np.stack([np.ones(_FIRST), own, (dual @ weighted) * (shape @ weighted)], axis=1)
    a, b, c = np.linalg.solve(terms, 2 * ratio * land.kappa)
    out = a * shaft.mass + b * shaft.bending
    out[:n, :n] += c * np.outer(weighted, weighted)
    return out, float(b)


def _with_ratios(support: Support, damping: Array) -> Support:
    zeta = np.einsum("mi,ij,mj->m", support.dual, damping, support.shape) / (2 * support.kappa)
    return support._replace(zeta=np.minimum(zeta, _OVERDAMPED))


def free_end_parts(shaft: FreeEndShaft) -> Array:
    """Momentum of the free end as its contact turns and shifts: columns that a dual takes, (N + B, 2).

    Parameters
    ----------
    shaft : FreeEndShaft
        With its free end.

    Returns
    -------
    (N + B, 2) array
        By a unit of turn, the free end straight, and of shift along the flat.
    """
    s, weight, across, _ = _free_end(min(shaft.tip, shaft.held.contact - _SHORTEST), shaft.held.contact)
    n, inertia = len(shaft.rod.mass), weight * s**2
    out = np.zeros((n + _BENDING, 2))
    lever = s - shaft.held.contact
    out[:n, 0], out[n:, 0] = shaft.rod.contact_turn * (inertia @ lever**2), across @ (inertia * lever)
    out[:n, 1] = shaft.rod.contact[0] * inertia.sum()
    return out


def lifted(shaft: FreeEndShaft) -> tuple[Array, float]:
    """The shaft at rest on land that is lifted by 1 at the contact without turning there.

    Parameters
    ----------
    shaft : FreeEndShaft
        With its free end.

    Returns
    -------
    shape : (N + B,) array
        Coordinates.
    moment : float
        By how much the bending moment at the contact falls, over force unit and L.
    """
    rod = shaft.rod
    contact = supported(rod, shaft.held, "flat", "coulomb")
    n, size = len(rod.mass), _turn_unit(rod)
    equations = np.block([[contact.stiffness, -contact.work.T], [contact.held, np.zeros((2, 2))]])
    found = np.linalg.solve(equations, np.eye(n + 2)[n])
    return np.append(found[:n], np.zeros(_BENDING)), float(found[n + 1] * size)


def on_the_tip(shaft: FreeEndShaft) -> Array:
    """The shaft at rest that touches the flat 1 closer to the tip of the cone than ε, and turns there.

    Parameters
    ----------
    shaft : FreeEndShaft
        With its free end.

    Returns
    -------
    (N + B,) array
        Coordinates.
    """
    rod = shaft.rod
    contact, n = supported(rod, shaft.held, "slide", "coulomb"), len(rod.mass)
    equations = np.block([[contact.stiffness, -contact.work.T], [contact.held, np.zeros((1, 1))]])
    moment = np.append(-shaft.held.normal_force * rod.contact_turn, 0.0)
    return np.append(np.linalg.solve(equations, moment)[:n], np.zeros(_BENDING))


def rolling(shaft: FreeEndShaft, land: Support) -> Array:
    """Bending moment at the contact on land, per unit of each mode's amplitude, (M,), over force unit and L.

    Parameters
    ----------
    shaft : FreeEndShaft
        With its free end.
    land : Support
        Its modes on land.

    Returns
    -------
    (M,) array
        Over the contact force it is how far the contact rolls towards the tip of the cone, over L.
    """
    return land.reaction[1] * _turn_unit(shaft.rod)


def _turn_unit(rod: LinearRod) -> float:
    """What the moment of a turn is counted in, see :func:`vibrissa.mechanics.modes.curved.supported`."""
    return float(np.linalg.norm(rod.contact[1]) / np.linalg.norm(rod.contact_turn))
