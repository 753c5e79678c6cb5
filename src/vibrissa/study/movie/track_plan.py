"""What tracking a movie file will do: which way is taken, and with which seeds."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Frames
from vibrissa.errors import MissingError, RangeError
from vibrissa.study.spec.settings import MovieFile
from vibrissa.video.io.about import Movie, refuse_region
from vibrissa.video.io.movie import frames_within, open_movie, read_blocks, with_missing_frames
from vibrissa.video.linked.tracking_way import choose_way

FOLLOWING = ("seeds", "whisking", "skin", "substrate", "names", "search", "threshold", "estimator")

STRIP = 3  # times its width, above which height and number of frames hint at an array with the frames last


class TrackPlan(NamedTuple):
    """How a movie file is tracked.

    Attributes
    ----------
    movie : MovieFile
        Its settings; ``tracking`` is "follow" or "link", and what is followed has seeds or marks of whisking.
    own_seeds : bool
        Whether the seeds were found here.
    remarks : tuple of str
        What the user should know before: first the way, and why, unless seeds say it.
    """

    movie: MovieFile
    own_seeds: bool
    remarks: tuple[str, ...]


def plan_tracking(movie: MovieFile, folder: Path) -> TrackPlan:
    """Choose the way of a movie, and find seeds where it needs some and none are given.

    Parameters
    ----------
    movie : MovieFile
        Its settings.
    folder : Path
        Where a relative path starts.

    Returns
    -------
    TrackPlan

    Raises
    ------
    InputError
        If the movie or the part of it cannot be read, or settings exclude each other.
    """
    path = folder / movie.path
    about = open_movie(path)
    acquisition_rate(movie, about)
    frames_within(with_missing_frames(about, movie.drop_frames), movie.start, movie.stop)
    if movie.region is not None:  # before the movie is looked at
        refuse_region(movie.region, (about.height, about.width))

    def blocks() -> Iterable[Frames]:
        return read_blocks(path, start=movie.start, stop=movie.stop, drop_frames=movie.drop_frames)

    plan = plan_of(movie, blocks)
    return plan._replace(remarks=(*plan.remarks, *_remark_on_axes(about)))


def _remark_on_axes(about: Movie) -> list[str]:
    """Say how an array is read whose last axis is much shorter than both others, as that of a few frames is."""
    if about.codec != "npy" or STRIP * about.width >= min(about.height, about.frame_count):
        return []
    read = f"{about.frame_count} frames of {about.width} columns and {about.height} rows"
    where = "if its last axis is that of the frames, save it with axes (frames, rows, columns)"
    return [f"{about.path.name} is read as {read}: {where}"]


def acquisition_rate(movie: MovieFile, about: Movie) -> float:
    """Frame rate of the camera.

    Parameters
    ----------
    movie : MovieFile
        Its settings.
    about : Movie
        What the file says.

    Returns
    -------
    float
        As given, else that of the camera's header [Hz].

    Raises
    ------
    InputError
        If there is neither.
    """
    if movie.frame_rate is None and not np.isfinite(about.frame_rate):
        remedy = "give the camera's rate, not the movie's playback rate"
        raise MissingError("frame_rate", f"must be given: {about.path} does not hold it", remedy=remedy)
    return about.frame_rate if movie.frame_rate is None else movie.frame_rate


def plan_of(movie: MovieFile, blocks: Callable[[], Iterable[Frames]]) -> TrackPlan:
    """The same of frames that are read elsewhere.

    Parameters
    ----------
    movie : MovieFile
        Its settings.
    blocks : callable
        Gives the blocks of the part that is tracked.

    Returns
    -------
    TrackPlan

    Raises
    ------
    InputError
        If a setting is out of range, settings exclude each other, or no whisker is found that could be followed.
    """
    if not 0 <= movie.least_probability <= 1:
        raise RangeError("least_probability", "must be from 0 to 1", movie.least_probability)
    way = choose_way(
        blocks,
        movie.tracking,
        following=_given(movie),
        linking=_linking(movie),
        polarity=movie.polarity,
        base=movie.base,
        region=movie.region,
        start=movie.start,
    )
    remarks = [f"tracking '{way.method}': {way.reason}"]
    if way.method == "link":
        if movie.base is not None:
            remarks.append(f"base {movie.base!r} is not used: bases are found where lines are linked")
        return TrackPlan(dataclasses.replace(movie, tracking="link"), False, tuple(remarks))
    if not way.seeds:
        return TrackPlan(dataclasses.replace(movie, tracking="follow"), False, ())
    places, count = "; ".join(f"{column:g},{row:g}" for column, row in way.seeds), len(way.seeds)
    remarks.append(f"{count} whisker{'s' * (count != 1)} found from the {way.base}, seeds {places}")
    if way.first > movie.start:
        remarks.append(f"frame {movie.start} is bad: tracking starts with frame {way.first}")
    found = dataclasses.replace(movie, tracking="follow", seeds=way.seeds, base=way.base, start=way.first)
    return TrackPlan(found, True, tuple(remarks))


def _given(movie: MovieFile) -> list[str]:
    """Settings of following that are not as they are by default; skin says nothing where lines are to be linked."""
    default = {field.name: field.default for field in dataclasses.fields(MovieFile)}
    linked = movie.tracking == "link" or bool(_linking(movie))
    return [name for name in FOLLOWING if getattr(movie, name) != default[name] and not (linked and name == "skin")]


def _linking(movie: MovieFile) -> list[str]:
    """Settings that only linking takes."""
    given = {"marks": bool(movie.marks), "head": movie.head is not None}
    given["background 'median'"] = movie.background == "median"
    given["least_probability"] = movie.least_probability != MovieFile.least_probability
    return [name for name, there in given.items() if there]
