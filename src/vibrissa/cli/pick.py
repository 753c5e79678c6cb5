"""The verb `pick`: a study file from a movie's first frame."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.output import tell
from vibrissa.cli.points import Side, points_of
from vibrissa.errors import InputError

OPTIONS = {
    "frame_rate": "--frame-rate",
    "pixel_size": "--pixel-size",
    "scale": "--scale",
    "scale_length": "--scale-length",
    "seeds": "--seed",
    "names": "--name",
    "skin": "--skin",
    "substrate": "--substrate",
}
Flag = Annotated[bool, Parameter(negative="")]


def pick(
    movie: Path,
    *,
    out: Path | None = None,
    frame_rate: float | None = None,
    pixel_size: float | None = None,
    scale: list[str] | None = None,
    scale_length: float | None = None,
    seed: list[str] | None = None,
    name: list[str] | None = None,
    skin: list[str] | None = None,
    substrate: list[str] | None = None,
    base: Side | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    page: bool = True,
    browser: bool = True,
    force: Flag = False,
) -> None:
    """Choose seeds, skin, substrate line and scale on the first frame of a movie, and write its study file.

    Parameters
    ----------
    movie
        Movie: AVI, MP4, MKV, TIFF, folder of images, Photron .cih(x) or .mraw, .npy.
    out
        Study file to write (TOML); MOVIE's name with .toml in the current folder by default.
    frame_rate
        Frames per second of the acquisition [Hz]; a camera's header may tell it.
    pixel_size
        Side of a pixel in the plane of the whiskers [m]; or --scale and --scale-length.
    scale
        COLUMN,ROW of one end of an object of known size [pixels]; twice.
    scale_length
        Distance between the two points of --scale [m].
    seed
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
        Whiskers darker or brighter than what is behind them.
    page
        Pick on a local page; with --no-page the study is written from what is given and found.
    browser
        Open the page in the browser.
    force
        Replace a study file that is there.
    """
    from vibrissa.study.pick import pick as pick_study
    from vibrissa.study.pick import pixel_size as size_from

    out = out or Path(movie.name).with_suffix(".toml")
    if not page and pixel_size is None and not scale:
        raise InputError("--pixel-size", "must be given, or --scale twice with --scale-length")
    if pixel_size is None and scale:
        with _by_option():
            pixel_size = size_from(points_of(scale, "--scale"), scale_length)
    with _by_option():
        written = pick_study(
            movie,
            out,
            frame_rate=frame_rate,
            pixel_size=pixel_size,
            seeds=points_of(seed, "--seed"),
            names=name or (),
            skin=points_of(skin, "--skin"),
            substrate=points_of(substrate, "--substrate"),
            base=base,
            polarity=polarity,
            force=force,
            page=page,
            browser=browser,
            tell=tell,
        )
    tell(f"the study is {out}: vibrissa run {out}" if written else "given up, nothing written")


@contextmanager
def _by_option() -> Iterator[None]:
    """Name a value that is missing or bad by its option."""
    try:
        yield
    except InputError as error:
        raise InputError(OPTIONS.get(error.thing, error.thing), error.said) from error
