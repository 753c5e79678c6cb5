"""The verbs of movies: `track` and `decompose`."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from vibrissa.cli.options import Atlas, Json, OfModes, OfWhisker, Out, needed_cone
from vibrissa.cli.output import progress_bars, refuse_out, show, tell
from vibrissa.cli.points import Point, Side, line_of, pixels_of, points_of
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def track(
    movie: Path,
    *,
    frame_rate: float | None = None,
    pixel_size: float,
    seed: list[str] | None = None,
    skin: list[str] | None = None,
    base: Side | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    region: str | None = None,
    background: str = "space",
    estimator: Literal["matched", "barycentre"] = "matched",
    search: int = 4,
    threshold: float = 3.0,
    node_spacing: float | None = None,
    substrate: list[str] | None = None,
    whisker_length: float | None = None,
    lamp: str | None = None,
    preview: Path | None = None,
    out: Path | None = None,
    json: Json = False,
) -> None:
    """Track whiskers in a movie: centrelines at nodes of fixed arc length.

    Parameters
    ----------
    movie
        Movie: AVI, MP4, MKV, TIFF, folder of images, Photron .cih(x) or .mraw, .npy; grey.
    frame_rate
        Frames per second of the acquisition [Hz]; a movie file knows its playback rate only, a camera's header may tell
        it.
    pixel_size
        Side of a pixel in the plane of the whiskers [m].
    seed
        COLUMN,ROW of a point of a whisker in the first frame [pixels]; once for each whisker. Whiskers are found and
        counted if it is not given.
    skin
        COLUMN,ROW of the point where a whisker leaves the skin [pixels]; once for each whisker, or not at all: then arc
        length counts from where each is first seen.
    base
        Side of the image on which the whiskers leave the skin; left by default, or as found with the whiskers.
    polarity
        Whiskers darker or brighter than what is behind them.
    region
        C0,R0,C1,R1: first column and row, last column and row that are searched [pixels].
    background
        What is behind the whiskers: space (estimated in every frame), mean (of the movie itself, refused where a
        whisker survives in it), or an image or movie without whiskers.
    estimator
        What places the line in a column: the profile that fits best, or the paper's five-pixel barycentre.
    search
        Largest distance of the line from where it is expected, in one column [pixels].
    threshold
        Signal to noise of the contrast below which a column is lost.
    node_spacing
        Arc length between nodes [m]; 5 pixels by default.
    substrate
        COLUMN,ROW of a point of the line along which the whiskers touch the substrate [pixels]; twice. Then skin and
        contact are extrapolated from the visible end, which must lie before the contact (--region), and a contact off
        the line is rejected.
    whisker_length
        Length of the nontruncated cone of the whiskers [m], for the contact; without it, the paper's polynomial.
    lamp
        C0,R0,C1,R1 of the lamp that lights as the texture arrives [pixels], or `find`.
    preview
        Picture of the tracking: .mp4 or .mkv for a movie with the nodes over it, .png for a sheet of six frames.
    out
        Dataset to write (NetCDF); MOVIE's name with .nc in the current folder by default.
    """
    from vibrissa.files import save
    from vibrissa.study.backward import followed, track_file
    from vibrissa.study.settings import MovieFile

    out = out or Path(movie.name).with_suffix(".nc")
    _refuse_before(frame_rate, pixel_size, out, preview)
    seeds, area = points_of(seed, "--seed"), pixels_of(region, "--region")
    if not seeds:
        seeds, base = _found(movie, polarity, base, area)
    settings = MovieFile(
        path=str(movie),
        frame_rate=frame_rate,
        pixel_size=pixel_size,
        seeds=seeds,
        skin=points_of(skin, "--skin") or None,
        base=base or "left",
        polarity=polarity,
        background=background,
        region=area,
        search=search,
        threshold=threshold,
        estimator=estimator,
        node_spacing=node_spacing,
        substrate=line_of(substrate, "--substrate"),
        whisker_length=whisker_length,
        lamp="find" if lamp == "find" else pixels_of(lamp, "--lamp"),
    )
    with progress_bars() as progress:
        profile = track_file(settings, Path(), progress)
    if preview is not None:
        _preview(movie, profile, preview)
    save(profile, out)
    tell(f"the profiles are in {out}")
    remarks_on(profile)
    table = followed(profile)
    if "contact_accepted" in profile:
        table = table.merge(profile[["contact_arc_length", "contact_arc_length_sd", "contact_accepted"]])
    show(table, None, json, None)


def decompose(
    profile: Path,
    *,
    contact: float,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    which: int = 0,
    count: int = 3,
    method: Literal["least-squares", "paper2014"] = "least-squares",
    modes: OfModes = "straight",
    base_angle: float | None = None,
    friction: float = 0.4,
    out: Out = None,
    json: Json = False,
) -> None:
    """Modal amplitudes, envelopes, resonances and damping of one tracked whisker.

    Resonances are fitted with the forcing taken for white (Eq. 5); a study that knows its texture does better.

    Parameters
    ----------
    profile
        Dataset written by `vibrissa track`; arc length counts from the skin.
    contact
        Position of the contact over the length of the nontruncated cone: 0 at the cone's tip, 1 at the base.
    which
        Which of the tracked whiskers, from 0.
    count
        Number of modes.
    method
        Least squares on the visible nodes, or the paper's projection of an extrapolated profile.
    base_angle
        For curved modes: angle of the shaft at the base to the substrate [rad].
    friction
        For curved modes: coefficient of friction of the substrate.
    """
    import xarray as xr

    from vibrissa.mechanics.profile import Posture
    from vibrissa.mechanics.shift import resonance_shift, shift_remark
    from vibrissa.quantities import require
    from vibrissa.study.backward import analyse

    refuse_out(out)
    if (base_angle is None) != (modes == "straight"):
        raise InputError("--base-angle", "must be given with curved --modes, and only then")
    posture = None if base_angle is None else Posture(contact=contact, base_angle=base_angle, friction=friction)
    tracks = tracked_in(profile)
    require(tracks, "x", "y", "arc_length", "whisker")
    if not 0 <= which < tracks.sizes.get("whisker", 0):
        raise InputError("--which", f"must name one of the {tracks.sizes.get('whisker', 0)} tracked whiskers", which)
    cone = needed_cone(whisker, atlas)
    how: dict[str, Any] = {"n_modes": count, "method": method, "modes": modes, "posture": posture}
    results = analyse(tracks.isel(whisker=which), cone, contact, **how)
    data = xr.merge([*reversed(results.values())], combine_attrs="override").assign_attrs(results["modal"].attrs)
    for one in results.values():
        if "left_out" in one.attrs:
            tell(f"left out: {one.attrs['left_out']}")
    if posture is not None:
        tell(f"modes are about the profile ({modes}); {shift_remark(resonance_shift(posture, 1))}")
    if "resonance_white" in results:
        tell("the forcing is taken for white (Eq. 5); a study that knows its texture does better")
    names = ("kappa", "variance_explained", *_with_ends("resonant_frequency"), *_with_ends("damping"))
    show(data, [name for name in names if name in data], json, out)


def tracked_in(path: Path) -> xr.Dataset:
    """The profiles of a dataset that `track` or `tracks` wrote; another is refused."""
    from vibrissa.files import load

    tracks = load(path)
    if "x" not in tracks:
        raise InputError(str(path), "must hold profiles", remedy="take what `vibrissa track` or `tracks` wrote")
    return tracks


def remarks_on(profile: xr.Dataset) -> None:
    """What was noticed of the movie, whiskers that were mostly lost, and trials that are rejected."""
    frames = profile.sizes["time"]
    for whisker, runs in enumerate(json_text.loads(profile.attrs.get("lost", "[]"))):
        by_reason: dict[str, int] = {}
        for first, last, reason in runs:
            by_reason[reason] = by_reason.get(reason, 0) + last - first + 1
        if 2 * sum(by_reason.values()) > frames:
            most = max(by_reason, key=lambda reason: by_reason[reason])
            tell(f"whisker {whisker} was lost in {sum(by_reason.values())} of {frames} frames, mostly: {most}")
    for line in json_text.loads(profile.attrs.get("remarks", "[]")):
        tell(line)
    for whisker, reason in enumerate(json_text.loads(profile.attrs.get("rejected", "[]"))):
        if reason:
            tell(f"whisker {whisker} is rejected: {reason}")
    if "led_frame" in profile.attrs:
        tell(f"the lamp lights in frame {profile.attrs['led_frame']}")


def _refuse_before(frame_rate: float | None, pixel_size: float, out: Path, preview: Path | None) -> None:
    """Refuse, before any work, what would only fail after it."""
    from vibrissa.video.tracking import Calibration

    Calibration(frame_rate=1.0 if frame_rate is None else frame_rate, pixel_size=pixel_size)
    refuse_out(out)
    if preview is not None and preview.suffix not in (".mp4", ".mkv", ".png"):
        raise InputError("--preview", "must end in .mp4, .mkv or .png", str(preview))


def _found(
    movie: Path, polarity: Literal["dark", "bright"], base: Side | None, region: tuple[int, int, int, int] | None
) -> tuple[tuple[Point, ...], Side]:
    """A seed on each whisker of the first frame, and the side of the bases."""
    from vibrissa.video.finding import find_seeds
    from vibrissa.video.movie import read_blocks

    image = next(iter(read_blocks(movie, 1)))[0]
    side, found = find_seeds(image, polarity=polarity, base=base, region=region)
    seeds = tuple(one.seed for one in found)
    places = "; ".join(f"{column:g},{row:g}" for column, row in seeds)
    tell(f"{len(seeds)} whisker{'s' * (len(seeds) != 1)} found from the {side}, seeds {places}")
    return seeds, side


def _preview(movie: Path, profile: xr.Dataset, path: Path) -> None:
    from vibrissa.figures import preview
    from vibrissa.files import written_whole
    from vibrissa.video.movie import read_blocks

    if path.suffix == ".png":
        figure = preview.draw(preview.compute(read_blocks(movie), profile))
        with written_whole(path) as temporary:
            figure.savefig(temporary, format="png")
    else:
        preview.write_preview(path, read_blocks(movie), profile)
    tell(f"the preview is {path}")


def _with_ends(name: str) -> tuple[str, str, str]:
    return name, f"{name}_low", f"{name}_high"
