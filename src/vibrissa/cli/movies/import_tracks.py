"""The verb `import-tracks`: track files of other programs in, WHISK's out."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from vibrissa.cli.movies.points import Side, points_of
from vibrissa.cli.movies.track import remarks_on
from vibrissa.cli.shared.display.output import Json, Out, refuse_out, show, tell
from vibrissa.cli.shared.words.units import Length, Rate
from vibrissa.errors import ConflictError, FormatError


def import_tracks(
    file: Path,
    *,
    out: Out,
    frame_rate: Rate | None = None,
    pixel_size: Length | None = None,
    measurements: Path | None = None,
    identity: Literal["measured", "number", "longest", "link"] | None = None,
    only_identity: list[int] | None = None,
    skin: list[str] | None = None,
    base: Side | None = None,
    keypoints: list[str] | None = None,
    least_likelihood: float | None = None,
    node_spacing: Length | None = None,
    json: Json = False,
) -> None:
    """Convert tracks of other programs to profiles (.nc), or profiles to WHISK's .whiskers.

    Parameters
    ----------
    file
        WHISK .whiskers, WhiskiWrap HDF5, DeepLabCut .csv or .h5, SLEAP .slp or .h5, WhiskerTracker .mat; or a profile
        (.nc) to write as .whiskers with its .measurements.
    out
        Profile to write (.nc), or .whiskers.
    frame_rate
        Frames per second of the acquisition [Hz].
    pixel_size
        Side of a pixel in the plane of the whiskers [m].
    measurements
        WHISK's .measurements; by default the one in the same folder.
    identity
        Source of a segment's whisker: as WHISK measured it, its number in the frame, the longest line, or linked here
        over all frames (link).
    only_identity
        Identity of a whisker to take; once for each, all by default.
    skin
        COLUMN,ROW of the point where a whisker leaves the skin [pixels]; once for each whisker.
    base
        Side of the image on which the whiskers leave the skin, if no measurement has it.
    keypoints
        Names of the keypoints of a whisker, base first, separated by commas; once for each whisker.
    least_likelihood
        Likelihood below which keypoints are left out; 0.6 of DeepLabCut.
    node_spacing
        Arc length between nodes [m].
    """
    from vibrissa.netcdf import load, save
    from vibrissa.study.movie.backward import followed
    from vibrissa.video.foreign.tracks import read_tracks
    from vibrissa.video.foreign.whisk_profile import write_whiskers
    from vibrissa.video.tracking import Calibration

    if file.suffix == ".nc":
        if out.suffix != ".whiskers":
            raise FormatError("--out", "must end in .whiskers for a profile", str(out))
        beside = write_whiskers(load(file), out)
        tell(f"the tracks are in {out} and {beside}; score, angle and curvature are not filled in (NaN)")
        return
    refuse_out(out)
    if (frame_rate is None) != (pixel_size is None):
        raise ConflictError("--frame-rate, --pixel-size", "must be given both, or neither")
    calibration = None if frame_rate is None else Calibration(frame_rate=frame_rate, pixel_size=pixel_size or 0.0)
    profile = read_tracks(
        file,
        calibration,
        measurements=measurements,
        identity=identity,
        whiskers=only_identity,
        skin=points_of(skin, "--skin") or None,
        base=base,
        keypoints=[names.split(",") for names in keypoints] if keypoints else None,
        least_likelihood=least_likelihood,
        node_spacing=node_spacing,
    )
    save(profile, out)
    remarks_on(profile)
    tell(
        f"the profiles are in {out}, from {profile.attrs['format']}; arc length from {profile.attrs['arc_length_from']}"
    )
    show(followed(profile), json=json)
