"""A whisker that is held still: its resonant modes, its profile, and one gap."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vibrissa.api.shared.arguments import names_arguments
from vibrissa.api.shared.rods import Model, rod_of
from vibrissa.errors import ConflictError, RangeError, give_in
from vibrissa.mechanics.free_end.free_end_gap import free_end_gap
from vibrissa.mechanics.modes.shift import curved_eigenmodes
from vibrissa.mechanics.modes.straight import resonances
from vibrissa.mechanics.rod.rod_gap import gap_prediction, rod_gap
from vibrissa.mechanics.scan.gap_report import crossing, held_profile
from vibrissa.mechanics.statics.profile import Posture, check_tip
from vibrissa.texture.surface import DEPTH
from vibrissa.whisker import DAMPING, Whisker

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.arrays import Array


@names_arguments
def modes(
    whisker: Whisker,
    posture: Posture | None = None,
    *,
    n_modes: int = 3,
    about: Literal["straight", "profile"] = "straight",
) -> xr.Dataset:
    """Resonant modes of a whisker: pinned at the contact of a posture, or with a free tip in air.

    Parameters
    ----------
    whisker : Whisker
        The cone.
    posture : Posture, optional
        How it is held; a free tip in air without one.
    n_modes : int
        Number of modes.
    about : {"straight", "profile"}
        Modes of a straight shaft (the paper's), or about the profile of the pressed whisker, whose contact slides.

    Returns
    -------
    Dataset
        On (mode): ``kappa``, the adimensional frequency [1], and ``resonant_frequency`` [Hz]; about the profile also
        ``resonance_ratio`` to the straight shaft's and ``growth_rate``.

    Raises
    ------
    InputError
        If the contact lies beyond the whisker's tip, or modes about the profile of a free whisker are asked for.

    Examples
    --------
    >>> import vibrissa as vb
    >>> whisker = vb.Whisker(length=0.04, cone_angle=1.5e-3)
    >>> vb.modes(whisker, vb.Posture(contact=0.29, base_angle=1.2)).resonant_frequency.values.round(1)
    array([123.1, 347.9, 695.4])
    """
    if posture is None:
        if about == "profile":
            raise ConflictError(
                "posture", "must be given for modes about a profile", remedy="a free whisker is straight"
            )
        return resonances(whisker, whisker.tip, n_modes, boundary="free")
    check_tip(posture, whisker)
    if about == "profile":
        return curved_eigenmodes(posture, n_modes, whisker=whisker)
    return resonances(whisker, posture.contact, n_modes)


@names_arguments
def profile(whisker: Whisker, posture: Posture, *, distance: float | None = None, s: Array | None = None) -> xr.Dataset:
    """Stationary profile of a pressed whisker (Eq. 1), and the forces on contact and follicle.

    Parameters
    ----------
    whisker : Whisker
        The cone.
    posture : Posture
        How it is held.
    distance : float, optional
        Distance along the substrate from the base to an edge that holds the whisker [m]; its base is kept. On the flat
        without one.
    s : (S,) array, optional
        Points of the shaft, over L from the tip of the cone; 201 even ones by default.

    Returns
    -------
    Dataset
        As :func:`vibrissa.mechanics.scan.gap_report.held_profile` gives it: shape on (s), adimensional, and forces [N].

    Raises
    ------
    InputError
        If the edge is out of reach, or the contact lies beyond the whisker's tip.

    Examples
    --------
    >>> import vibrissa as vb
    >>> pressed = vb.profile(vb.atlas("C2"), vb.Posture(contact=0.29, base_angle=1.2))
    >>> print(f"{1e6 * float(pressed.static_contact_force):.0f} µN")
    56 µN
    """
    refuse_beyond("distance", distance, whisker)
    place = None if distance is None else distance / whisker.length
    points = None if s is None else np.atleast_1d(np.asarray(s, float))
    if points is not None and not ((whisker.tip <= points) & (points <= 1)).all():
        rule = f"must lie on the whisker, from its tip, {whisker.tip:.4g}, to its base, 1 (over L)"
        raise RangeError("s", rule, f"{points[(points < whisker.tip) | ~(points <= 1)][0]:g}")
    return held_profile(posture, contact_distance=place, whisker=whisker, s=points)


@names_arguments
def gap(
    whisker: Whisker,
    posture: Posture,
    *,
    width: float,
    depth: float = DEPTH,
    n_modes: int = 3,
    model: Model = "modes",
    speed: float = 0.1,
    damping: float = DAMPING,
) -> xr.Dataset:
    """One gap crossed: when the contact jumps, how far each mode jumps, and whether the free end allows it.

    Parameters
    ----------
    whisker : Whisker
        The cone.
    posture : Posture
        How it is held on the flat.
    width, depth : float
        Of the gap [m].
    n_modes : int
        Number of modes.
    model : {"modes", "free-end", "rod", "auto"} or Rod
        The paper's modes of a shaft with a single contact, held at the moment of the jump; or the gap drawn past a
        whisker with its free end, by the fast model (``"free-end"``, ``"auto"``) or as a rod: see ``scan``.
    speed, damping : float
        Of the gap past the base [m/s], and damping ratio of the first three modes; they do not count for the modes.

    Returns
    -------
    Dataset
        As :func:`vibrissa.mechanics.scan.gap_report.crossing` gives it; ``linearity`` (mode) is the exact jump over the
        linear one (Eq. 11). Of a gap that is drawn past the whisker as ``scan`` gives it, with
        ``largest_mode_displacement`` (mode).

    Raises
    ------
    InputError
        If the posture cannot follow across the gap.

    Examples
    --------
    >>> import vibrissa as vb
    >>> crossed = vb.gap(vb.atlas("C2"), vb.Posture(contact=0.29, base_angle=1.2), width=0.5e-3)
    >>> bool(crossed.linearity[0] < 1)
    True
    """
    refuse_beyond("width", width, whisker)
    refuse_beyond("depth", depth, whisker, "µm", 1e-6)
    rod = rod_of(model)
    if model == "modes":
        return crossing(posture, width / whisker.length, n_modes=n_modes, whisker=whisker, depth=depth)
    drawn: dict[str, Any] = {"width": width, "depth": depth, "speed": speed, "damping": damping, "n_modes": n_modes}
    if rod is not None:
        return rod_gap(gap_prediction(whisker, posture, **drawn, settings=rod))
    return free_end_gap(whisker, posture, **drawn)


def refuse_beyond(name: str, value: float | None, whisker: Whisker, likely: str = "mm", factor: float = 1e-3) -> None:
    """Refuse a length that is longer than the whisker, which is likely in another unit.

    Parameters
    ----------
    name : str
        The argument.
    value : float, optional
        As given [m].
    whisker : Whisker
        Gives L.
    likely, factor : str and float
        The unit that is likely meant, and its size [m].

    Raises
    ------
    InputError
        If it is longer than L.
    """
    if value is not None and whisker.length < value < np.inf:
        rule = f"must be at most the whisker's length, {whisker.length:.4g} m"
        raise RangeError(name, rule, value, give_in("m", value, likely, factor))
