"""The verb `pick`: a study file from a movie's first frame."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from vibrissa.cli.movies.points import Side, points_of
from vibrissa.cli.shared.display.output import MaybeOut, tell
from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.words.units import Length, Rate
from vibrissa.errors import MissingError


def pick(
    movie: Path,
    *,
    out: MaybeOut = None,
    frame_rate: Rate | None = None,
    pixel_size: Length | None = None,
    scale_point: list[str] | None = None,
    scale_length: Length | None = None,
    seed_point: list[str] | None = None,
    name: list[str] | None = None,
    skin: list[str] | None = None,
    substrate: list[str] | None = None,
    base: Side | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    page: bool = True,
    browser: bool = True,
    overwrite: Flag = False,
) -> None:
    """Choose seeds, skin, substrate line and scale on the first frame of a movie, and write its study file.

    Parameters
    ----------
    movie
        Movie: AVI, MP4, MKV, TIFF, folder of images, Photron .cih(x) or .mraw, .npy.
    out
        Study file to write (TOML); MOVIE's name with .toml in the current folder by default.
    frame_rate
        Frames per second of the acquisition [Hz]; a camera's header may state it.
    pixel_size
        Side of a pixel in the plane of the whiskers [m]; or --scale-point and --scale-length.
    scale_point
        COLUMN,ROW of one end of an object of known size [pixels]; twice.
    scale_length
        Distance between the two points of --scale-point [m].
    seed_point
        COLUMN,ROW of a point of a whisker [pixels]; once for each whisker. Whiskers are found if it is not given.
    name
        Name of a whisker; once for each, in the order of the seeds.
    skin
        COLUMN,ROW of the point where a whisker leaves the skin [pixels]; once for each whisker.
    substrate
        COLUMN,ROW of a point of the line along which the whiskers touch the substrate [pixels]; twice.
    base
        Side of the image on which the whiskers leave the skin.
    polarity
        Whiskers darker or brighter than the background.
    page
        Pick on a local page; with --no-page the study is written from the values given and the whiskers found.
    browser
        Open the page in the browser.
    overwrite
        Replace a study file that is there.
    """
    from vibrissa.study.pick.pick import pick as pick_study
    from vibrissa.study.pick.pick import pixel_size as size_from

    out = out or Path(movie.name).with_suffix(".toml")
    if not page and pixel_size is None and not scale_point:
        raise MissingError("--pixel-size", "must be given, or --scale-point twice with --scale-length")
    if pixel_size is None and scale_point:
        pixel_size = size_from(points_of(scale_point, "--scale-point"), scale_length)
    written = pick_study(
        movie,
        out,
        frame_rate=frame_rate,
        pixel_size=pixel_size,
        seeds=points_of(seed_point, "--seed-point"),
        names=name or (),
        skin=points_of(skin, "--skin"),
        substrate=points_of(substrate, "--substrate"),
        base=base,
        polarity=polarity,
        force=overwrite,
        page=page,
        browser=browser,
        tell=tell,
    )
    tell(f"the study is {out}: vibrissa run {out}" if written else "given up, nothing written")
