"""The verb `decompose`: modes and resonances of a tracked whisker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import NO_WHISKER, Friction, OfModes, WhiskerOptions
from vibrissa.cli.shared.words.units import Angle, OverLength, over_length
from vibrissa.errors import ConflictError, TooFewError, UnknownError

if TYPE_CHECKING:
    import xarray as xr


def decompose(
    profile: Path,
    *,
    contact: OverLength,
    of: WhiskerOptions = NO_WHISKER,
    which: int = 0,
    n_modes: int = 3,
    method: Literal["least-squares", "paper2014"] = "least-squares",
    modes: OfModes = "straight",
    base_angle: Angle | None = None,
    friction: Friction = 0.4,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Compute modal amplitudes, envelopes, resonances and damping of one tracked whisker.

    Resonances are fitted with white forcing assumed (Eq. 5); a study that knows its texture does better.

    Parameters
    ----------
    profile
        Dataset written by `vibrissa track`; arc length counts from the skin.
    contact
        Position of the contact over the length of the nontruncated cone: 0 at the cone's tip, 1 at the base;
        or its distance from the tip of the cone along the shaft (11.6mm).
    which
        Which of the tracked whiskers, from 0.
    n_modes
        Number of modes.
    method
        Least squares on the visible nodes, or the paper's projection of an extrapolated profile.
    base_angle
        For curved modes: angle of the shaft at the base to the substrate [rad].
    friction
        For curved modes: coefficient of friction of the substrate.
    """
    import xarray as xr

    from vibrissa.mechanics.modes.shift import resonance_shift, shift_remark
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.quantities import require
    from vibrissa.study.movie.backward import analyse

    if (base_angle is None) != (modes == "straight"):
        raise ConflictError("--base-angle", "must be given with curved --modes, and only then")
    cone = of.needed_cone()
    where = over_length(contact, "--contact", cone)
    posture = None if base_angle is None else Posture(contact=where, base_angle=base_angle, friction=friction)
    tracks = tracked_whisker(profile, which)
    require(tracks, "time", "x", "y", "arc_length")
    with stage("decomposing and fitting"):
        results = analyse(tracks, cone, where, n_modes=n_modes, method=method, modes=modes, posture=posture)
    data = xr.merge([*reversed(results.values())], combine_attrs="override").assign_attrs(results["modal"].attrs)
    for one in results.values():
        if "left_out" in one.attrs:
            tell(f"left out: {one.attrs['left_out']}")
    if posture is not None:
        tell(f"modes are about the profile ({modes}); {shift_remark(resonance_shift(posture, 1))}")
    if "resonance_white" in results:
        tell("the forcing is assumed to be white (Eq. 5); a study that knows its texture does better")
    fitted = [f"{name}{end}" for name in ("resonant_frequency", "damping") for end in ("", "_low", "_high")]
    drawing.draw("others.contents", data)
    output.show(data, [name for name in ("kappa", "variance_explained", *fitted) if name in data])


def tracked_whisker(path: Path, which: int) -> xr.Dataset:
    """The profiles of one whisker of a dataset that `track` or `import-tracks` wrote.

    Parameters
    ----------
    path : Path
        The file; it may hold a single whisker, without a dimension for it.
    which : int
        Number of the whisker, from 0.

    Returns
    -------
    Dataset
        Its profiles.

    Raises
    ------
    InputError
        If the file holds no profiles, or not this whisker.
    """
    from vibrissa.netcdf import load

    tracks = load(path)
    if "x" not in tracks:
        raise TooFewError(str(path), "must hold profiles", remedy="take what `vibrissa track` or `import-tracks` wrote")
    if "whisker" not in tracks.dims:
        return tracks
    if not 0 <= which < tracks.sizes["whisker"]:
        raise UnknownError("--which", f"must name one of the {tracks.sizes['whisker']} tracked whiskers", which)
    return tracks.isel(whisker=which)
