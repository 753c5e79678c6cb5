"""A study file from what is picked in a movie's first frame: seeds, skin, substrate line and scale."""

from __future__ import annotations

import json
import math
import os
import sys
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeGuard

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConflictError, InputError, MissingError, RangeError, ShapeError, UnknownError
from vibrissa.files import written_whole
from vibrissa.study.pick.pick_page import serve
from vibrissa.study.spec.settings import MovieFile, validated_study
from vibrissa.video.find.finding import Side, find_seeds
from vibrissa.video.io.movie import open_movie, read_blocks
from vibrissa.video.tracking import Calibration, track

Point = tuple[float, float]
Image = NDArray[Any]
KEYS = ("frame_rate", "pixel_size", "seeds", "names", "skin", "base", "polarity", "substrate")
NUMBERS = ("frame_rate", "pixel_size")
EMPTY: tuple[object, ...] = (None, "", [], ())


def pick(
    movie: Path,
    study: Path,
    *,
    frame_rate: float | None = None,
    pixel_size: float | None = None,
    seeds: Sequence[Point] = (),
    names: Sequence[str] = (),
    skin: Sequence[Point] = (),
    substrate: Sequence[Point] = (),
    base: Side | None = None,
    polarity: Literal["dark", "bright"] = "dark",
    force: bool = False,
    page: bool = True,
    browser: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> bool:
    """Write a study file of a movie: from a page on which points are picked, or from what is given and found.

    Parameters
    ----------
    movie : Path
        The movie.
    study : Path
        Study file to write (TOML).
    frame_rate, pixel_size, seeds, names, skin, substrate, base, polarity
        As in :class:`vibrissa.study.spec.settings.MovieFile`; on the page they can still be changed. Seeds not given
        are found, and so is the side of the bases; a frame rate not given is that of the camera's header.
    force : bool
        Replace a file that is there.
    page : bool
        Serve the page, on this machine alone, and wait for it to be saved; else write what is given at once.
    browser : bool
        Open the page in the default browser.
    tell : callable
        Called with a line to show: the page's address, how many whiskers were found.

    Returns
    -------
    bool
        Whether the study was written; on the page one may give up.

    Raises
    ------
    InputError
        If the movie cannot be read, the study is there already, or, without a page, a value is missing or bad.
    """
    _refuse_to_replace(study, force)
    image, known = next(iter(read_blocks(movie, 1)))[0], open_movie(movie).frame_rate
    rate = known if frame_rate is None and np.isfinite(known) else frame_rate
    points = {"seeds": list(seeds), "names": list(names), "skin": list(skin), "substrate": list(substrate)}
    given = {"frame_rate": rate, "pixel_size": pixel_size, "base": base, "polarity": polarity, **points}
    proposal = _with_found(given, image, tell, needed=not page)

    def save(picked: Mapping[str, Any]) -> None:
        write_study(picked, image, movie, study, force=force)

    if not page:
        save(proposal)
        return True
    opened = webbrowser.open if browser else None
    return serve(image, {**proposal, "movie": movie.name, "study": str(study)}, save, tell=tell, opened=opened)


def write_study(
    picked: Mapping[str, Any], image: Image, movie: Path, study: Path, *, force: bool = False
) -> dict[str, Any]:
    """Check what was picked, by tracking the first frame with it, and write the study file whole or not at all.

    Parameters
    ----------
    picked : mapping
        Some of the keys of :class:`vibrissa.study.spec.settings.MovieFile`; empty ones are left out. In place of
        ``pixel_size``: ``scale``, two points, and ``scale_length``, their distance [m].
    image : (height, width) array
        First frame.
    movie, study : Path
        The movie, and the file to write.
    force : bool
        Replace a file that is there.

    Returns
    -------
    dict
        What was written, as TOML gives it.

    Raises
    ------
    InputError
        Names the first value that is missing, unknown or bad.
    """
    _refuse_to_replace(study, force)
    settings = checked(picked, image)
    path = os.path.relpath(movie.absolute(), study.absolute().parent)
    table = {"name": movie.stem, "movie": {"path": Path(path).as_posix(), **settings}}
    validated_study(table, "study", study.parent)
    with written_whole(study) as temporary:
        temporary.write_text(as_toml(table), encoding="utf-8")
    return table


def checked(picked: Mapping[str, Any], image: Image) -> dict[str, Any]:
    """Settings of a movie's study from what was picked, once the first frame could be tracked with them.

    Parameters
    ----------
    picked : mapping
        As :func:`write_study` takes it.
    image : (height, width) array
        Grey levels.

    Returns
    -------
    dict
        Values of ``KEYS``.

    Raises
    ------
    InputError
        Names the first value that is missing, unknown or bad.
    """
    unknown = set(picked) - {*KEYS, "scale", "scale_length"}
    if unknown:
        raise UnknownError(sorted(unknown)[0], "is unknown", remedy=f"it knows {', '.join(KEYS)}, scale, scale_length")
    settings = {key: value for key, value in picked.items() if key in KEYS and value not in EMPTY}
    if "pixel_size" not in settings:
        settings["pixel_size"] = pixel_size(picked.get("scale") or (), picked.get("scale_length"))
    for key in NUMBERS:
        settings[key] = _number(key, settings.get(key))
    if "seeds" not in settings:
        raise RangeError("seeds", "must be at least one", remedy="click on each whisker")
    movie = validated_study({"name": "study", "movie": {"path": "movie", **settings}}, "study", Path()).movie
    if movie is None:
        raise MissingError("study", "must have a [movie]")
    _check_points(movie, image)
    calibration = Calibration(frame_rate=settings["frame_rate"], pixel_size=movie.pixel_size)
    same = {name: getattr(movie, name) for name in ("seeds", "skin", "polarity")}
    track([image[None]], calibration=calibration, base=movie.base or "left", **same)
    return {key: settings[key] for key in KEYS if key in settings}


def pixel_size(scale: Sequence[Point], length: object) -> float:
    """Side of a pixel [m] from two points of an object [pixels] and their distance [m].

    Parameters
    ----------
    scale : sequence of (column, row)
        Two points [pixels].
    length : float
        Their distance [m].

    Returns
    -------
    float
        [m], six digits.

    Raises
    ------
    InputError
        If there are not two points, or they or their distance are nothing.
    """
    two = isinstance(scale, (list, tuple)) and len(scale) == 2 and all(_is_point(one) for one in scale)
    apart = math.dist(*scale) if two else 0.0
    if not 0 < apart < math.inf:
        remedy = "mark both ends of an object of known length, or give the pixel size"
        raise ShapeError("scale", "must be two points, apart", remedy=remedy)
    # a length in mm over pixels is known to four digits at best
    return float(f"{_number('scale_length', length) / apart:.6g}")


def as_toml(table: Mapping[str, Any]) -> str:
    """Text of a study's table: plain values first, then a section for each table in it.

    Parameters
    ----------
    table : mapping
        Values, and tables of values.

    Returns
    -------
    str
        TOML.
    """
    plain = [f"{key} = {_value(value)}" for key, value in table.items() if not isinstance(value, Mapping)]
    parts = [
        "\n".join([f"[{key}]", *(f"{name} = {_value(one)}" for name, one in value.items())])
        for key, value in table.items()
        if isinstance(value, Mapping)
    ]
    return "\n\n".join(["\n".join(plain), *parts]) + "\n"


def _value(value: Any) -> str:
    # JSON's strings and lists are TOML's too; DEL alone is not allowed bare
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _number(key: str, value: object) -> float:
    if not _is_number(value) or not value > 0:
        raise MissingError(key, "must be given, a positive number", None if value is None else repr(value)[:40])
    return float(value)


def _is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a number, finite as a float too."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _is_point(value: object) -> bool:
    return isinstance(value, (list, tuple)) and len(value) == 2 and all(_is_number(one) for one in value)


def _refuse_to_replace(study: Path, force: bool) -> None:
    if study.exists() and not force:
        raise ConflictError(str(study), "is there already", remedy="choose another `out`, or `force` to replace it")


def _with_found(given: dict[str, Any], image: Image, tell: Callable[[str], None], *, needed: bool) -> dict[str, Any]:
    """What was given, with seeds and the side of the bases found where they were not."""
    if given["seeds"] and given["base"]:
        return given
    try:
        side, found = find_seeds(image, polarity=given["polarity"], base=given["base"])
    except InputError:
        if needed and not given["seeds"]:
            raise
        side, found = given["base"] or "left", []
    if not given["seeds"]:
        s = "" if len(found) == 1 else "s"
        tell(f"{len(found)} whisker{s} found, the base{s} on the {side}")
    return {**given, "base": side, "seeds": given["seeds"] or [list(one.seed) for one in found]}


def _check_points(movie: MovieFile, image: Image) -> None:
    height, width = image.shape
    points = {"seeds": movie.seeds, "skin": movie.skin or (), "substrate": movie.substrate or ()}
    for key, places in points.items():
        for column, row in places:
            if not (0 <= column <= width - 1 and 0 <= row <= height - 1):
                raise RangeError(key, f"must lie in the image of {width} × {height} pixels", (column, row))
    if movie.names and len(movie.names) != len(movie.seeds):
        raise ShapeError("names", f"must be one for each of the {len(movie.seeds)} whiskers", list(movie.names))
    if movie.substrate and movie.substrate[0] == movie.substrate[1]:
        raise ShapeError("substrate", "must be two points, apart", movie.substrate)
