"""The verb `posture`: Eq. 1 fitted to a tracked whisker."""

from __future__ import annotations

from math import inf, isfinite
from pathlib import Path

from vibrissa.cli.movies.decompose import tracked_whisker
from vibrissa.cli.movies.points import line_of
from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, names_without, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import NO_WHISKER, Flag, Friction, WhiskerOptions
from vibrissa.cli.shared.words.units import Length
from vibrissa.errors import ConflictError, RangeError


def posture(
    profile: Path,
    *,
    which: int = 0,
    fit_friction: Flag = False,
    friction: Friction = 0.4,
    substrate: list[str] | None = None,
    excursion: Length = 0.0,
    excursion_sd: Length = 0.0,
    length_sd: Length = 0.0,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Estimate contact, base angle and height of a tracked whisker from its mean profile (Eq. 1), with intervals.

    Parameters
    ----------
    profile
        Profile (.nc) from `track` or `import-tracks`.
    which
        Number of the whisker in the file, from 0.
    fit_friction
        Fit the coefficient of friction too; the profile may not determine it.
    friction
        Coefficient of friction, if it is not fitted.
    substrate
        COLUMN,ROW of a point of the substrate's line [pixels]; twice.
    excursion
        Mean excursion of the contact by a texture, along the scan [m]; negative where gaps let the contact hang back,
        by some 1e-4 on the paper's gratings.
    excursion_sd
        Standard deviation of that mean [m]; it widens the intervals.
    length_sd
        Standard deviation of the whisker's length [m].
    """
    from vibrissa.mechanics.inverse.stationary_posture import fit_profile

    cone, tracked, line = of.needed_cone(), tracked_whisker(profile, which), line_of(substrate, "--substrate")
    if line is not None:
        if "pixel_size" not in tracked.attrs:
            raise ConflictError("--substrate", f"must be left out: {profile} does not state its pixel size")
        size = float(tracked.attrs["pixel_size"])
        (a, b), (c, d) = line
        line = (a * size, b * size), (c * size, d * size)
    mu = None if fit_friction else friction
    imposed = excursion, excursion_sd
    if not (isfinite(excursion) and 0 <= excursion_sd < inf):
        raise RangeError("--excursion-sd", "must not be negative, and --excursion finite [m]", imposed)
    with stage("posture"):
        found = fit_profile(tracked, cone, substrate=line, friction=mu, excursion=imposed, length_sd=length_sd)
    drawing.draw("paper.fig1", tracked, found, cone)
    if not any(imposed):
        tell(
            "intervals are of a whisker at rest or on smooth ground; over a texture the",
            "contact hangs back (the paper's gratings: ε 0.003 too large, θ_b 0.02 rad",
            "too small): --excursion-sd 1e-4 widens the intervals by as much",
        )
    kept = "" if fit_friction else f", {friction:g}; --fit-friction fits it"
    tell(f"friction: {found.attrs['friction_told']}{kept}")
    output.show(found, names_without(found))
