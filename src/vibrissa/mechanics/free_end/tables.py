"""All that the march over a texture needs of one posture and one whisker."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from vibrissa.arrays import Array
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.free_end.bridge_statics import POWERS, Resistance
from vibrissa.mechanics.free_end.supports import (
    FreeEndShaft,
    Support,
    free_end_parts,
    lifted,
    on_the_tip,
    rolling,
    supports,
    whole_shaft,
)
from vibrissa.mechanics.modes.curved import CurvedModes
from vibrissa.mechanics.quasi_static.projection import Projection, profiles
from vibrissa.mechanics.quasi_static.response_rows import follicle_slope
from vibrissa.mechanics.statics.edge_contact import Held, on_the_flat
from vibrissa.mechanics.statics.gap import UnitResponse, unit_response
from vibrissa.mechanics.statics.profile import Posture

Field = Callable[[Array], Array]  # (δx, δy) of K motions at points (S,), (2, K, S)

MODES_HELD = 10  # on each support: two more change correlations with the rod by 0.001
NO_POINTS = np.empty(0)
_HIDDEN, _GRID = 0.02, 400  # as of the rod's observation: what a fit of the modes leaves out, and its points
_NODES = 16  # excursions at which the profile on an edge is found
_LOCAL, _FARTHEST = 5, 0.06  # powers of the distance from the contact, and how far they serve [L]


class Tables(NamedTuple):
    """Of M modes on land and on an edge; lengths over L, times over k.

    Attributes
    ----------
    kappa, zeta : (3, M) arrays
        On land, on an edge, on the tip.
    change : (3, 3, M, M) array
        Amplitudes on one support from those on another.
    held : (3, 2, M) array
        Amplitudes on each support of a unit of turn and of lift.
    excursion : (M + 1, POWERS) array
        Powers of d < 0: amplitudes on an edge, and the angle θ_ε.
    slope : (M + 1,) array
        The same for d ≥ 0, linear.
    stub : (M + 1,) array
        The same on the tip, of a unit of free end.
    turn : (3, M) array
        Angle at the contact.
    roll, slip : (M,) arrays
        Rolling of the contact, as a moment, and its shift towards the base on land.
    rise : (M + 1, 5) array
        Powers of the distance x from the contact: height of the modes on an edge, and of a unit of d.
    seen, held_seen : (3, R, M) and (R, 2) arrays
        Of each mode, and of a unit of turn and of lift: the pinned modes fitted to it, its motion along the normal at
        the points, and its curvature at the base over 1/L.
    at : (4,) array
        ε, normal force, K_θ and K_y.
    relaxation : float
        a₁ over k.
    """

    kappa: Array
    zeta: Array
    change: Array
    held: Array
    excursion: Array
    slope: Array
    stub: Array
    turn: Array
    roll: Array
    slip: Array
    rise: Array
    seen: Array
    held_seen: Array
    at: Array
    relaxation: float

    @property
    def resistance(self) -> Resistance:
        """What the shaft on the flat resists."""
        return Resistance(*self.at.tolist())


def tables(
    whisker_tip: float,
    posture: Posture,
    *,
    damping: float,
    farthest: float,
    n_modes: int = MODES_HELD,
    n_seen: int = 3,
    points: Array = NO_POINTS,
) -> Tables:
    """Tables of a posture.

    Parameters
    ----------
    whisker_tip : float
        Where the free end ends, over L.
    posture : Posture
        On the flat.
    damping : float
        ζ of the first three modes on land.
    farthest : float
        Largest excursion behind a near edge, over L; 0 where the contact never jumps.
    n_modes : int
        How many modes on each support.
    n_seen : int
        How many pinned modes are fitted.
    points : (P,) array
        Points whose motion is wanted, over L.

    Returns
    -------
    Tables
        For :mod:`vibrissa.mechanics.free_end.march_kernels`.

    Raises
    ------
    InputError
        If the posture has no response on an edge, or cannot follow as far.
    """
    unit, flat = unit_response(posture), on_the_flat(posture)
    shaft = whole_shaft(flat, whisker_tip, n_modes)
    every, relaxation = supports(shaft, n_modes, damping)
    land, edge, tip = every
    stub = on_the_tip(shaft)
    lift, resisted = lifted(shaft)
    n = len(shaft.rod.mass)
    modes = [_as_curved(shaft, one) for one in every]
    free = [one.dual @ free_end_parts(shaft) for one in every]  # (M, 2): by a turn and a shift of the contact
    turned = np.array([1.0, unit.shift(np.array([posture.contact]))[0][0] / unit.contact_angle])
    by_turn = [
        Projection(flat, m).of_displacement(*unit.shift_at_nodes) / unit.contact_angle + parts @ turned
        for m, parts in zip(modes, free, strict=True)
    ]
    by_lift = [one.dual @ shaft.mass @ lift for one in every]
    slope = np.append(by_turn[1], 1.0) * unit.contact_angle
    rod, kappa = shaft.rod, cone_kappa(posture.contact, n_seen)
    fields: list[Field] = [partial(_field, shaft, one.shape[:, :n]) for one in every]
    fields += [lambda s: _turned(unit, s), partial(_field, shaft, lift[None, :n])]
    seen = [np.vstack([_fitted(flat, kappa, field), _across(flat, points, field)]) for field in fields]
    bent = [one.shape[:, :n] @ rod.base for one in every]
    bent += [np.array([follicle_slope(unit, flat)[0] / unit.contact_angle]), lift[None, :n] @ rod.base]
    seen = [np.vstack([rows, row]) for rows, row in zip(seen, bent, strict=True)]
    return Tables(
        kappa=np.stack([one.kappa for one in every]),
        zeta=np.stack([one.zeta for one in every]),
        change=np.array([[to.dual @ shaft.mass @ one.shape.T for one in every] for to in every]),
        held=np.stack([np.stack(pair) for pair in zip(by_turn, by_lift, strict=True)]),
        excursion=_excursion(flat, modes[1], free[1] @ turned, slope, farthest),
        slope=slope,
        stub=np.append(tip.dual @ shaft.mass @ stub, stub[:n] @ rod.contact_turn),
        turn=np.stack([one.shape[:, :n] @ rod.contact_turn for one in every]),
        roll=rolling(shaft, land),
        slip=land.shape[:, :n] @ rod.contact[0],
        rise=_rise(shaft, edge, unit),
        seen=np.stack(seen[:3]),
        held_seen=np.concatenate(seen[3:], axis=1),
        at=np.array([posture.contact, flat.normal_force, _turning(flat, unit), resisted]),
        relaxation=relaxation,
    )


def rod_field(shaft: FreeEndShaft, rows: Array, s: Array) -> Array:
    """(δx, δy) of motions of the shaft above its contact, (2, K, S), of coordinates (K, N) at points (S,).

    Parameters
    ----------
    shaft : FreeEndShaft
        Its coordinates.
    rows : (K, N) array
        Motions.
    s : (S,) array
        Points in [ε, 1].

    Returns
    -------
    (2, K, S) array
        Over L.
    """
    place = 1 - 2 * np.clip(np.log(s) / np.log(shaft.held.contact), 0, 1)
    series = legendre.legvander(place, shaft.rod.turn.shape[0] - 1).T
    return np.asarray((rows @ shaft.rod.shift.transpose(0, 2, 1)) @ series)


def _as_curved(shaft: FreeEndShaft, support: Support) -> CurvedModes:
    """The part of the modes above the contact, as a projection takes them."""
    n, rod = len(shaft.rod.mass), shaft.rod
    shape, dual = support.shape[:, :n], support.dual[:, :n]
    still, none = np.zeros(len(shape)), np.zeros((2, len(shape)))
    parts = {"turn": shape @ rod.turn.T, "shift": shape @ rod.shift.transpose(0, 2, 1)}
    parts |= {"dual": dual @ rod.shift.transpose(0, 2, 1), "base_curvature": shape @ rod.base}
    return CurvedModes(
        shaft.held, "edge", "coulomb", support.kappa, still, contact_force=none, base_force=none, **parts
    )


def _excursion(flat: Held, modes: CurvedModes, by_turn: Array, slope: Array, farthest: float) -> Array:
    """Powers of d of the amplitudes on an edge and of θ_ε, from exact profiles between −farthest and 0."""
    out = np.zeros((len(slope), POWERS))
    out[:, 1] = slope
    if not farthest > 0:
        return out
    project = Projection(flat, modes)
    d = -farthest * np.sin(np.linspace(0, np.pi / 2, _NODES + 1)[1:]) ** 2
    held = profiles(flat, d, project.s)
    angle = held.unknowns[:, 1]
    rows = np.vstack([project.of_profiles(held) + np.outer(by_turn, angle), angle])
    share = (d / farthest)[:, None] ** np.arange(1, POWERS - 1)
    rest = (rows / d - slope[:, None]) / farthest  # the slope at 0 is known
    fitted, *_ = np.linalg.lstsq(share / share[:, :1] * (d / farthest)[:, None], rest.T * farthest, rcond=None)
    out[:, 2:] = fitted.T / farthest ** np.arange(1, POWERS - 1)
    return out


def _turning(flat: Held, unit: UnitResponse) -> float:
    """K_θ: on an edge the moment at ε is the load times what the contact has moved along the shaft."""
    return float(flat.normal_force * abs(unit.contact / unit.contact_angle))


def _rise(shaft: FreeEndShaft, edge: Support, unit: UnitResponse) -> Array:
    """Heights near the contact as powers of the distance from it."""
    contact, n = shaft.held.contact, len(shaft.rod.mass)
    x = np.linspace(0, min(_FARTHEST, 0.9 * (1 - contact)), 8 * _LOCAL)
    heights = np.vstack([rod_field(shaft, edge.shape[:, :n], contact + x)[1], unit.shift(contact + x)[1]])
    found, *_ = np.linalg.lstsq(x[:, None] ** np.arange(1, _LOCAL + 1), heights.T, rcond=None)
    return np.asarray(found.T)


def _field(shaft: FreeEndShaft, rows: Array, s: Array) -> Array:
    """Motions at points of the shaft; the free end continues straight."""
    contact = shaft.held.contact
    out = rod_field(shaft, rows, np.maximum(s, contact))
    out[1] += np.outer(rows @ shaft.rod.contact_turn, np.minimum(s - contact, 0))
    return out


def _turned(unit: UnitResponse, s: Array) -> Array:
    """The response to an excursion, per unit of turn at the contact, as :func:`_field`."""
    contact = unit.posture.contact
    x, y = (part / unit.contact_angle for part in unit.shift(np.maximum(s, contact)))
    return np.stack([x, y + np.minimum(s - contact, 0)])[:, None]


def _across(flat: Held, s: Array, field: Field) -> Array:
    """Motion along the normal of the profile at points, (S, K)."""
    angle, (along, up) = flat.angle(s), field(s)
    return np.asarray((up * np.cos(angle) - along * np.sin(angle)).T)


def _fitted(flat: Held, kappa: Array, field: Field) -> Array:
    """Amplitudes (K, M) of the pinned modes that fit motions best above ε + 0.02, as of a rod."""
    edges = np.linspace(flat.contact + _HIDDEN, 1, _GRID + 1)
    s = (edges[1:] + edges[:-1]) / 2
    shapes = cone_modes(kappa, flat.contact, s)
    weighted = shapes * s**2
    return np.asarray(np.linalg.solve(weighted @ shapes.T, weighted @ _across(flat, s, field)))
