"""The verb `track`: whiskers of a movie."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from vibrissa.cli.movies.points import Side, frame_of, line_of, marks_of, pixels_of, points_of
from vibrissa.cli.shared.display.output import Json, MaybeOut, refuse_out, show, tell
from vibrissa.cli.shared.display.pictures import write_picture
from vibrissa.cli.shared.display.progress import progress_bars, stage
from vibrissa.cli.shared.words.losses import lost_by_reason
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Length, Rate
from vibrissa.errors import ConflictError, FormatError
from vibrissa.quantities.identity import SURE
from vibrissa.quantities.kinds import Method
from vibrissa.signals.frame_numbers import frame_numbers
from vibrissa.video.kernel.estimator_table import Estimator, described

if TYPE_CHECKING:
    import xarray as xr

RUNS = 3  # runs of lost frames that are named


def track(
    movie: Path,
    *,
    frame_rate: Rate | None = None,
    pixel_size: Length,
    tracking: Method = "auto",
    seed_point: list[str] | None = None,
    mark: list[str] | None = None,
    mark_file: Path | None = None,
    skin: list[str] | None = None,
    base: Side | None = None,
    head: str | None = None,
    head_points: str | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    region: str | None = None,
    background: str = "space",
    estimator: Annotated[
        Estimator, Parameter(help=f"Method that places the line in a column. {described()}.")
    ] = "matched",
    search: int = 4,
    least_contrast: float = 3.0,
    least_probability: float = SURE,
    node_spacing: Length | None = None,
    substrate: list[str] | None = None,
    whisker_length: Annotated[Length | None, Parameter(name="--whisker.length")] = None,
    lamp: str | None = None,
    start: str | None = None,
    stop: str | None = None,
    drop_frames: Literal["nan"] | None = None,
    preview: MaybeOut = None,
    segments: MaybeOut = None,
    out: MaybeOut = None,
    json: Json = False,
) -> None:
    """Track whiskers in a movie: centrelines at nodes of fixed arc length.

    Whiskers that keep their place, as one that is dragged over a texture, are followed from the first frame on.
    Whiskers that whisk are found in every frame and linked. The first line of the output names the way.

    Parameters
    ----------
    movie
        Movie: AVI, MP4, MKV, TIFF, folder of images, Photron .cih(x) or .mraw, .npy; colour is read as grey.
    frame_rate
        Frames per second of the acquisition [Hz]; a movie file knows its playback rate only, a camera's header may have
        it.
    pixel_size
        Side of a pixel in the plane of the whiskers [m].
    tracking
        follow: from the first frame on; link: lines of every frame are found and linked; auto: link with marks, follow
        with seeds, skin, substrate or other settings of following, else follow if most whiskers keep their place.
    seed_point
        COLUMN,ROW of a point of a whisker in the first frame [pixels]; once for each whisker. Whiskers are found and
        counted if it is not given.
    mark
        FRAME,COLUMN,ROW,NAME of a point of a whisker in any frame [pixels]; names a linked whisker, and corrects it
        there. It is on the nearest line within 6 pixels.
    mark_file
        Table of such marks: CSV with the header frame,column,row,whisker.
    skin
        COLUMN,ROW of the point where a whisker leaves the skin [pixels]; once for each whisker, or not at all: then arc
        length counts from where each is first seen. Of linked whiskers the nearest one begins there.
    base
        Side of the image on which the whiskers leave the skin; left by default, or as found with the whiskers. Where
        lines are linked, the bases are found.
    head
        File with two tracked points of the head (DeepLabCut, SLEAP), or a table of frame, column, row and angle_deg; or
        `find`. Lines are linked in coordinates that move with the head.
    head_points
        Names of a caudal and of a rostral keypoint of the head in that file, separated by a comma; by default its two.
    polarity
        Whiskers darker or brighter than the background.
    region
        C0,R0,C1,R1: first column and row, last column and row that are searched [pixels].
    background
        Background of the whiskers: space (estimated in every frame), mean (of the movie itself, where whiskers sweep
        far; refused where one that is followed survives in it), median (the same, where lines are linked), or an image
        or movie without whiskers.
    search
        Largest distance of the line from where it is expected, in one column [pixels].
    least_contrast
        Signal to noise of the contrast below which a column is lost.
    least_probability
        Probability of a name from which on a linked line is called that whisker's; a higher one leaves fewer frames and
        fewer wrong names.
    node_spacing
        Arc length between nodes [m]; 5 pixels by default.
    substrate
        COLUMN,ROW of a point of the line along which the whiskers touch the substrate [pixels]; twice. Then skin and
        contact are extrapolated from the visible end, which must lie before the contact (--region), and a contact off
        the line is rejected.
    whisker_length
        Length L of the nontruncated cone of the whiskers [m], for the contact; without it, the paper's polynomial.
    lamp
        C0,R0,C1,R1 of the lamp that lights as the texture arrives [pixels], or `find`.
    start
        First frame that is tracked, from 0, or its time with a unit (0.1s); points are of this frame. Times count from
        the movie's first frame.
    stop
        First frame after it that is not tracked, or its time.
    drop_frames
        Frames that the time stamps of the movie, or the numbers of its images, show to be missing become missing frames
        (NaN), so that time is right; by default they are reported alone.
    preview
        Picture of the tracking: .mp4 or .mkv for a movie with the nodes over it, .png for a sheet of six frames.
    segments
        Dataset to write (NetCDF) with the lines of all frames, and which whisker each is linked to.
    out
        Dataset to write (NetCDF); MOVIE's name with .nc in the current folder by default.
    """
    from vibrissa.netcdf import save
    from vibrissa.study.movie.track_file import track_planned
    from vibrissa.study.movie.track_plan import plan_tracking
    from vibrissa.study.spec.settings import MovieFile

    out = out or Path(movie.name).with_suffix(".nc")
    _refuse_before(frame_rate, pixel_size, out, preview, segments)
    settings = MovieFile(
        path=str(movie),
        frame_rate=frame_rate,
        pixel_size=pixel_size,
        tracking=tracking,
        seeds=points_of(seed_point, "--seed-point"),
        marks=marks_of(mark, mark_file),
        skin=points_of(skin, "--skin") or None,
        base=base,
        **_head(head, head_points),
        polarity=polarity,
        background=background,
        region=pixels_of(region, "--region"),
        search=search,
        threshold=least_contrast,
        estimator=estimator,
        least_probability=least_probability,
        node_spacing=node_spacing,
        substrate=line_of(substrate, "--substrate"),
        whisker_length=whisker_length,
        lamp="find" if lamp == "find" else pixels_of(lamp, "--lamp"),
        drop_frames=drop_frames,
        **_part(movie, start, stop, frame_rate),
    )
    with stage("look at the movie"):
        plan = plan_tracking(settings, Path())
    tell(*plan.remarks)
    with progress_bars() as progress:
        profile = track_planned(plan, Path(), progress, segments)
    _preview(movie, profile, preview)
    save(profile, out)
    tell(f"the profiles are in {out}", *([] if segments is None else [f"the lines of all frames are in {segments}"]))
    remarks_on(profile)
    show(_table(profile), json=json)


def _part(movie: Path, start: str | None, stop: str | None, frame_rate: float | None) -> dict[str, Any]:
    """First frame that is tracked, and the first after it that is not, by their names in a study."""
    from vibrissa.video.io.movie import open_movie

    rate = open_movie(movie).frame_rate if frame_rate is None else frame_rate
    return {"start": frame_of(start, "--start", rate) or 0, "stop": frame_of(stop, "--stop", rate)}


def _table(profile: xr.Dataset) -> xr.Dataset:
    """How far each whisker was followed, and its contact where that was sought."""
    from vibrissa.study.movie.backward import followed

    ends = [name for name in ("contact_arc_length", "contact_arc_length_sd", "contact_accepted") if name in profile]
    return followed(profile).merge(profile[ends]) if ends else followed(profile)


def remarks_on(profile: xr.Dataset) -> None:
    """Report what was noticed of the movie, whiskers that were mostly lost, and trials that are rejected.

    Parameters
    ----------
    profile : Dataset
        What was tracked.
    """
    noted = {name: json_text.loads(profile.attrs.get(name, "[]")) for name in ("lost", "remarks", "rejected")}
    names = json_text.loads(profile.attrs.get("names", "[]"))
    for whisker, runs in enumerate(noted["lost"]):
        name = names[whisker] if whisker < len(names) else f"whisker {whisker}"
        tell(*(f"{name} was lost in {text}" for text in _losses(runs, profile)))
    if given := [f"{k} is {name}" for k, name in enumerate(names) if name != f"whisker {k}"]:
        tell(f"whisker {', '.join(given)}")
    tell(*map(in_options, noted["remarks"]))
    tell(*(f"whisker {k} is rejected: {reason}" for k, reason in enumerate(noted["rejected"]) if reason))
    if "led_frame" in profile.attrs:
        tell(f"the lamp lights in frame {profile.attrs['led_frame']}")


def _losses(runs: list[tuple[int, int, str]], profile: xr.Dataset) -> list[str]:
    """In how many frames a whisker was lost and mostly why; if it is followed in most, the longest runs."""
    lost = lost_by_reason(runs)
    count, start = profile.sizes["time"], int(frame_numbers(profile)[0])
    if 2 * lost.total() > count:
        return [f"{lost.total()} of {count} frames, mostly: {lost.most_common(1)[0][0]}"]
    whole: list[tuple[int, int]] = []  # whatever the reason
    for first, last, _ in runs:
        goes_on = bool(whole) and first == whole[-1][1] + 1
        whole.append((whole.pop()[0] if goes_on else first, last))
    longest = sorted(sorted(whole, key=lambda run: run[0] - run[1])[:RUNS])
    each = [f"{start + a}" if a == b else f"{start + a} to {start + b}" for a, b in longest]
    others = len(whole) - RUNS
    more = f" and in {others} shorter run{'s' if others > 1 else ''}" if others > 0 else ""
    one = len(whole) == 1 and whole[0][0] == whole[0][1]
    return [f"frame{'' if one else 's'} {', '.join(each)}{more}"] if runs else []


def _refuse_before(
    frame_rate: float | None, pixel_size: float, out: Path, preview: Path | None, segments: Path | None
) -> None:
    """Refuse, before any work, what would only fail after it."""
    from vibrissa.video.tracking import Calibration

    Calibration(frame_rate=1.0 if frame_rate is None else frame_rate, pixel_size=pixel_size)
    for file in filter(None, (out, segments)):
        refuse_out(file)
    if segments is not None and segments.resolve() == out.resolve():
        raise ConflictError("--segments", "must be another file than --out", str(segments), "choose another name")
    if preview is not None and preview.suffix not in (".mp4", ".mkv", ".png"):
        raise FormatError("--preview", "must end in .mp4, .mkv or .png", str(preview))


def _head(head: str | None, points: str | None) -> dict[str, Any]:
    """Where the head is, by the names of a study."""
    return {"head": head, "head_points": tuple(points.split(",")) if points else ()}


def _preview(movie: Path, profile: xr.Dataset, path: Path | None) -> None:
    if path is None:
        return
    from vibrissa.figures.others import preview
    from vibrissa.video.io.movie import read_blocks

    first, drop = int(frame_numbers(profile)[0]), profile.attrs.get("drop_frames")
    blocks = read_blocks(movie, start=first, drop_frames=drop)
    with stage("preview"):
        if path.suffix == ".png":
            write_picture(preview.draw(preview.compute(blocks, profile)), path)
        else:
            preview.write_preview(path, blocks, profile)
    tell(f"the preview is {path}")
