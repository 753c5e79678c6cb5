"""The verbs of a whisker that is held still: `profile` and `gap`."""

from __future__ import annotations

from vibrissa.cli.shared.options import NO_WHISKER, PostureOptions, WhiskerOptions
from vibrissa.cli.shared.output import PRINTED, OutputOptions, names_without, tell
from vibrissa.cli.shared.progress import stage
from vibrissa.cli.shared.units import Length, OverLength, over_length


def profile(
    *,
    at: PostureOptions,
    contact_distance: OverLength | None = None,
    of: WhiskerOptions = NO_WHISKER,
    output: OutputOptions = PRINTED,
) -> None:
    """Stationary profile of a whisker held at its base, its contact on the flat or on an edge (Eq. 1).

    Lengths are over the length L of the nontruncated cone. With a whisker, forces also in newtons.

    Parameters
    ----------
    contact_distance
        Distance of an edge from the base along the substrate, over L, or, with a whisker, as a length (19mm): the
        whisker is held there, its base kept.
    """
    from vibrissa.mechanics.scan.gap_report import held_profile

    cone = of.cone()
    edge = None if contact_distance is None else over_length(contact_distance, "--contact-distance", cone)
    with stage("profile"):
        data = held_profile(at.posture(cone), contact_distance=edge, whisker=cone)
    if not float(data.fold_determinant) < 0:
        tell("beyond the fold: no quasi-static response to an edge exists here")
    output.show(data, names_without(data))


def gap(
    *,
    at: PostureOptions,
    gap_width: OverLength,
    gap_depth: Length = 35e-6,
    n_modes: int = 3,
    of: WhiskerOptions = NO_WHISKER,
    output: OutputOptions = PRINTED,
) -> None:
    """A gap crossed: when the contact jumps, and how far the linear response is from the exact one (Eq. 11).

    Lengths are over the length L of the nontruncated cone. With a whisker, the first line says whether the free end
    beyond the contact allows the jump.

    Parameters
    ----------
    gap_width
        Width of the gap, over L, or, with a whisker, as a length (0.6mm): 0.015 of a cone of 40 mm.
    gap_depth
        Depth of the gap [m]; it counts with a whisker only.
    n_modes
        Number of modes.
    """
    from vibrissa.mechanics.scan.free_end import free_end_lines, unknown_free_end
    from vibrissa.mechanics.scan.gap_report import crossing

    cone = of.cone()
    posture, width = at.posture(cone), over_length(gap_width, "--gap-width", cone)
    with stage("gap"):
        data = crossing(posture, width, n_modes=n_modes, whisker=cone, depth=gap_depth)
    tell(data.attrs["verdict"])
    tell(*(unknown_free_end(posture.contact, width) if cone is None else free_end_lines(data)))
    output.show(data, names_without(data, "s"))
