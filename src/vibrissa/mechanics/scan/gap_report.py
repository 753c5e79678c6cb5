"""One posture and one gap, as datasets: the stationary profile, and the sequence U₁ → U₂ → U₃."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.mechanics.quasi_static.response import quasi_static
from vibrissa.mechanics.scan.diagnostics import own_weight
from vibrissa.mechanics.scan.follicle import force_unit
from vibrissa.mechanics.scan.free_end import free_end_facts, gaps_allowed
from vibrissa.mechanics.scan.verdict import unknown_verdict, verdict
from vibrissa.mechanics.statics.edge_contact import Held, hold, on_the_flat
from vibrissa.mechanics.statics.gap import excursion_at_jump
from vibrissa.mechanics.statics.profile import Posture, check_tip
from vibrissa.quantities import dataset
from vibrissa.texture.surface import DEPTH
from vibrissa.whisker import Whisker

_POINTS = 201  # of a profile


def held_profile(
    posture: Posture, *, contact_distance: float | None = None, whisker: Whisker | None = None, s: Array | None = None
) -> xr.Dataset:
    """Stationary profile on the flat, or on an edge elsewhere, with what contact and follicle bear.

    Parameters
    ----------
    posture : Posture
        On the flat; its θ_b and H are kept.
    contact_distance : float, optional
        Distance D of an edge from the base along the substrate, over L; where the flat contact is, by default.
    whisker : Whisker, optional
        Gives forces in newtons, and its own weight against the contact force.
    s : (S,) array, optional
        Where to give the profile, in [ε, 1]; 201 even steps by default.

    Returns
    -------
    Dataset
        ``angle``, ``profile_x``, ``profile_y`` (s) from the contact; ``contact``, ``contact_angle``, ``excursion``,
        ``contact_force`` Λ, ``base_distance`` H, ``contact_distance`` D; on the follicle ``moment_scaled``,
        ``transverse_force_scaled``, ``axial_force_scaled``; ``fold_determinant``; with a whisker the same in SI units,
        and ``weight_ratio``.

    Raises
    ------
    InputError
        If the edge is out of reach, on or beyond the fold.
    """
    if whisker is not None:
        check_tip(posture, whisker)
    held = on_the_flat(posture)
    if contact_distance is not None:
        held = hold(held, contact_distance - held.base[0])
    points = np.linspace(held.contact, 1, _POINTS) if s is None else s
    x, y = held.position(points)
    more: dict[str, Any] = {} if whisker is None else _in_newtons(held, whisker)
    return dataset(
        posture.friction_attributes,
        s=points,
        angle=held.angle(points),
        profile_x=x + held.base[0],
        profile_y=y + held.base[1],
        base_angle=posture.base_angle,
        held_excursion=held.excursion,
        **_scalars(held),
        **more,
    )


def _scalars(held: Held) -> dict[str, Any]:
    return {
        "contact": held.contact,
        "contact_angle": held.contact_angle,
        "contact_force": held.contact_force,
        "contact_distance": held.base[0],
        "base_distance": held.base[1],
        "moment_scaled": held.base_curvature,
        "transverse_force_scaled": held.transverse_force,
        "axial_force_scaled": held.axial_force,
        "fold_determinant": held.determinant,
    }


def _in_newtons(held: Held, whisker: Whisker) -> dict[str, float]:
    unit = force_unit(whisker)
    return {
        "static_contact_force": unit * held.contact_force,
        "static_moment": unit * whisker.length * held.base_curvature,
        "static_transverse_force": unit * held.transverse_force,
        "static_axial_force": unit * held.axial_force,
        "weight_ratio": own_weight(whisker) / held.contact_force,
    }


def crossing(
    posture: Posture, gap_width: float, *, n_modes: int = 3, whisker: Whisker | None = None, depth: float = DEPTH
) -> xr.Dataset:
    """A gap crossed: U₁ on the flat, U₂ held by the far edge when it meets the near one, U₃ on the near one.

    Parameters
    ----------
    posture : Posture
        On the flat.
    gap_width : float
        Width λ, over L.
    n_modes : int
        Number of modes.
    whisker : Whisker, optional
        Its free end may not allow the jump.
    depth : float
        Depth of the gap [m], which counts with a whisker only.

    Returns
    -------
    Dataset
        ``excursion_at_jump`` d₂; of the three profiles (stage) ``held_excursion`` 0, d₂, d₂ − λ, ``travel`` of the
        texture since the far edge took the contact along (0, d₂, d₂; back on the flat at λ), ``contact``,
        ``contact_angle``, forces as in :func:`held_profile`, ``profile_x``, ``profile_y`` (stage, s) from the base;
        ``coupling`` c_i, ``jump_exact`` −[Q_i(d₂ − λ) − Q_i(d₂)], ``jump_linear`` c_i λ and their ratio ``linearity``;
        with a whisker ``free_end_length``, and ``jumps_allowed`` of this one jump; the attribute ``verdict``.

    Raises
    ------
    InputError, ConvergenceError
        If the posture is beyond the fold or cannot follow across the gap.
    """
    if whisker is not None:
        check_tip(posture, whisker)
    jump = excursion_at_jump(posture, gap_width)
    response = quasi_static(posture, (jump - gap_width, jump), n_modes=n_modes)
    flat = response.flat
    stages = [flat, hold(flat, jump), hold(flat, jump - gap_width)]
    s = np.linspace(posture.contact, 1, _POINTS)
    positions = [held.position(s) for held in stages]
    table = [_scalars(held) for held in stages]
    before, after = response(np.array([jump, jump - gap_width]))[:n_modes].T
    free_end = {} if whisker is None else _free_end(stages[2], gap_width, whisker, depth)
    judged = verdict(free_end) if free_end else unknown_verdict(posture.contact, gap_width)
    attrs = {"base_angle": posture.base_angle, "flat_contact": posture.contact, "verdict": judged}
    return dataset(
        posture.friction_attributes | attrs,
        lead=("stage",),
        stage=np.arange(1, 4),
        s=s,
        mode=np.arange(1, n_modes + 1),
        gap_width=gap_width,
        excursion_at_jump=jump,
        held_excursion=np.array([0.0, jump, jump - gap_width]),
        travel=np.array([0.0, jump, jump]),
        profile_x=np.array([x for x, _ in positions]),
        profile_y=np.array([y for _, y in positions]),
        **{name: np.array([row[name] for row in table]) for name in table[0]},
        kappa=response.kappa,
        coupling=response.c,
        jump_exact=before - after,
        jump_linear=response.c * gap_width,
        linearity=(before - after) / (response.c * gap_width),
        **free_end,
    )


def _free_end(after: Held, gap_width: float, whisker: Whisker, depth: float) -> dict[str, Any]:
    """Whether the free end allows the one jump, to this profile."""
    free_end = (after.posture.contact - whisker.tip) * whisker.length
    width, angle = np.array([gap_width * whisker.length]), np.array([after.contact_angle])
    return free_end_facts(free_end, gaps_allowed(free_end, width, angle, depth))
