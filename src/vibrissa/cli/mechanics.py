"""The verbs of one whisker's mechanics: `modes`, `profile`, `gap`."""

from __future__ import annotations

from typing import Literal

from vibrissa.cli.curved import NO_PROFILE, OfProfile
from vibrissa.cli.options import Atlas, AtPosture, Json, OfWhisker, Out, cone_of
from vibrissa.cli.output import show, tell
from vibrissa.errors import InputError


def modes(
    *,
    contact: float | None = None,
    count: int = 3,
    boundary: Literal["pinned", "free"] = "pinned",
    about: Literal["straight", "profile"] = "straight",
    pressed: OfProfile = NO_PROFILE,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Resonant modes of a whisker: pinned at a contact, or with a free tip; straight, or about its curved profile.

    Beside modes about the profile stand those of the straight shaft; the growth rate is 0 where a mode is stable.

    Parameters
    ----------
    contact
        Position of the contact (or of the free end) over the length of the nontruncated cone: 0 at the cone's tip,
        1 at the base.
        May be left out for a free tip: the whisker's own tip, or the whole cone.
    count
        Number of modes.
    boundary
        What holds at the contact.
    about
        Modes of a straight shaft (the paper's), or about the profile of a whisker pressed on flat ground, which needs
        --base-angle.
    """
    from vibrissa.mechanics.modes import eigenmodes, resonances

    cone = cone_of(whisker, atlas)
    names, hertz = ["contact", "kappa"], ["resonant_frequency"] if cone else []
    if contact is None and boundary == "pinned":
        raise InputError("--contact", "must be given for a pinned whisker", remedy="for example --contact 0.3")
    where = contact if contact is not None else cone.tip if cone else 0.0
    if about == "profile":
        if boundary == "free":
            raise InputError("--boundary", "must be 'pinned' about a profile", "'free'", "a free whisker is straight")
        data = pressed.modes(where, count, cone)
        names = ["contact", "base_angle", "kappa", "kappa_straight", "resonance_ratio", "growth_rate"]
    else:
        pressed.refuse()
        data = (
            resonances(cone, where, count, boundary=boundary) if cone else eigenmodes(where, count, boundary=boundary)
        )
    show(data, [*names, *hertz], json, out)


def profile(
    *,
    at: AtPosture,
    contact_distance: float | None = None,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Stationary profile of a whisker held at its base, its contact on the flat or on an edge (Eq. 1).

    Lengths are over the length L of the nontruncated cone. With a whisker, forces also in newtons.

    Parameters
    ----------
    contact_distance
        Distance of an edge from the base along the substrate, over L: the whisker is held there, its base kept.
    """
    from vibrissa.mechanics.crossing import held_profile

    cone = cone_of(whisker, atlas)
    data = held_profile(at.posture(), contact_distance=contact_distance, whisker=cone)
    if not float(data.fold_determinant) < 0:
        tell("beyond the fold: no quasi-static response to an edge exists here")
    show(data, [str(name) for name in data.data_vars if not data[name].dims], json, out)


def gap(
    *,
    at: AtPosture,
    gap_width: float,
    count: int = 3,
    out: Out = None,
    json: Json = False,
) -> None:
    """A gap crossed: when the contact jumps, and how far the linear response is from the exact one (Eq. 11).

    Lengths are over the length L of the nontruncated cone.

    Parameters
    ----------
    gap_width
        Width of the gap, over L: 0.015 is 0.6 mm for a cone of 40 mm.
    count
        Number of modes.
    """
    from vibrissa.mechanics.crossing import crossing

    data = crossing(at.posture(), gap_width, n_modes=count)
    show(data, [str(name) for name in data.data_vars if "s" not in data[name].dims], json, out)
