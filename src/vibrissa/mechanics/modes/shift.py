"""How far the modes about the curved profile are from those of a straight shaft."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.exact import cone_kappa
from vibrissa.mechanics.modes.curved import Condition, CurvedModes, Law, curved_modes
from vibrissa.mechanics.modes.straight import checked_nodes
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr


CONTACTS: dict[str, tuple[Condition, Law]] = {
    "constant": ("slide", "constant"),
    "coulomb": ("slide", "coulomb"),
    "stuck": ("stick", "constant"),
    "edge": ("edge", "coulomb"),
    "flat": ("flat", "coulomb"),
}

_CONTACT_WORDS = {
    "edge": "on an edge",
    "constant": "one point sliding, friction constant",
    "coulomb": "one point sliding, friction following the load",
    "flat": "lying on smooth ground",
    "stuck": "stuck",
}


def curved_eigenmodes(
    posture: Posture,
    n_modes: int = 3,
    *,
    condition: Condition = "slide",
    law: Law | None = None,
    whisker: Whisker | None = None,
    s: ArrayLike | None = None,
) -> xr.Dataset:
    """Resonant frequencies and mode shapes about the curved profile, beside those of a straight shaft.

    Parameters
    ----------
    posture : Posture
        On the flat.
    n_modes : int
        How many modes, from the lowest; at most 40.
    condition, law
        What holds the contact; see :func:`vibrissa.mechanics.modes.curved.curved_modes`.
    whisker : Whisker, optional
        Its timescale turns κ into hertz; the contact must lie on it.
    s : (S,) array, optional
        Where to give the shapes, in [ε, 1]; 201 even steps by default.

    Returns
    -------
    Dataset
        ``kappa`` and ``growth_rate`` (mode), the latter 0 of a stable mode; ``kappa_straight`` of the pinned straight
        shaft and ``resonance_ratio``, κ over it; ``mode_across`` and ``mode_along`` (mode, s), displacement along the
        normal n = (−sin θ, cos θ) and the tangent towards the base, together of norm 1 under s², and ``mode_rotation``;
        ``resonant_frequency`` [Hz] with a whisker.

    Raises
    ------
    InputError
        If a value is out of range, or the contact lies beyond the whisker's tip.
    """
    contact = posture.contact
    nodes = checked_nodes(contact, n_modes, s)
    modes = curved_modes(posture, n_modes, condition=condition, law=law)
    straight, angle = cone_kappa(contact, n_modes), modes.flat.angle(nodes)
    x, y = modes.displacement(nodes)
    return dataset(
        {"condition": condition, "friction_law": modes.law} | posture.friction_attributes,
        mode=np.arange(1, n_modes + 1),
        s=nodes,
        contact=contact,
        base_angle=posture.base_angle,
        kappa=modes.kappa,
        growth_rate=modes.growth,
        kappa_straight=straight,
        resonance_ratio=modes.kappa / straight,
        mode_across=y * np.cos(angle) - x * np.sin(angle),
        mode_along=x * np.cos(angle) + y * np.sin(angle),
        mode_rotation=modes.rotation(nodes),
        **_in_hertz(modes.kappa, posture, whisker),
    )


def resonance_shift(posture: Posture, n_modes: int = 3, *, whisker: Whisker | None = None) -> xr.Dataset:
    """What the curvature of the profile does to each resonance, under each law of the contact.

    Parameters
    ----------
    posture : Posture
        On the flat.
    n_modes : int
        How many modes, from the lowest.
    whisker : Whisker, optional
        Its timescale turns κ into hertz.

    Returns
    -------
    Dataset
        ``contact_law``: ``constant`` and ``coulomb`` (one point sliding, by the law of friction), ``stuck``, ``edge``
        (the shaft slips over it, as while it rings after a jump in a gap) and ``flat`` (its free end lies on smooth
        ground), both by Coulomb's friction; see :func:`vibrissa.mechanics.modes.curved.curved_modes`.
        ``kappa_straight`` (mode); ``kappa``, ``resonance_ratio`` (κ over the straight one) and ``growth_rate``
        (contact_law, mode); ``resonant_frequency`` [Hz] with a whisker.
    """
    flat = on_the_flat(posture)
    found: list[CurvedModes] = [curved_modes(flat, n_modes, condition=how, law=law) for how, law in CONTACTS.values()]
    kappa, straight = np.array([modes.kappa for modes in found]), cone_kappa(posture.contact, n_modes)
    return dataset(
        posture.friction_attributes,
        lead=("contact_law",),
        contact_law=np.array(list(CONTACTS)),
        mode=np.arange(1, n_modes + 1),
        contact=posture.contact,
        base_angle=posture.base_angle,
        kappa_straight=straight,
        kappa=kappa,
        resonance_ratio=kappa / straight,
        growth_rate=np.array([modes.growth for modes in found]),
        **_in_hertz(kappa, posture, whisker),
    )


def shift_remark(shift: xr.Dataset) -> str:
    """One line for a report: how far the first resonance is from that of the straight shaft, under each law.

    Parameters
    ----------
    shift : Dataset
        ``resonance_ratio`` and ``growth_rate`` (contact_law, mode) of :func:`resonance_shift` or a scan's diagnostics.

    Returns
    -------
    str
        The line.
    """
    parts = []
    for law, how in _CONTACT_WORDS.items():
        one = shift.sel(contact_law=law)
        off = f"{100 * (float(one.resonance_ratio[0]) - 1):+.1f} %".replace("-", "−")
        parts.append(f"{'unstable' if one.growth_rate[0] > 0 else off} ({how})")
    return f"about the curved profile the first resonance is off the straight shaft's by {', '.join(parts)}"


def _in_hertz(kappa: Array, posture: Posture, whisker: Whisker | None) -> dict[str, Any]:
    if whisker is None:
        return {}
    if posture.contact < whisker.tip:
        rule = f"must not lie beyond the whisker's tip at {whisker.tip:.4g} (over L)"
        raise RangeError("contact", rule, posture.contact)
    return {"resonant_frequency": kappa / (2 * np.pi * whisker.timescale)}
