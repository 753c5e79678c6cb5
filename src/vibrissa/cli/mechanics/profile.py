"""The verb `profile`: a whisker that is held still."""

from __future__ import annotations

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, names_without, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import NO_WHISKER, PostureOptions, WhiskerOptions
from vibrissa.cli.shared.words.units import OverLength, over_length


def profile(
    *,
    at: PostureOptions,
    contact_distance: OverLength | None = None,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Compute the stationary profile of a whisker whose contact is on the flat or on an edge (Eq. 1).

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
    drawing.draw("others.contents", data)
    output.show(data, names_without(data))
