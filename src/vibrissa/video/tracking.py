"""From movie to profile: whiskers followed, and read at nodes of fixed arc length from the skin."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, MissingError, RangeError, ShapeError, TooFewError, give_in
from vibrissa.quantities import dataset
from vibrissa.video.follow.background import levelled, reference, refuse_still
from vibrissa.video.follow.following import REASONS, Centrelines, centrelines
from vibrissa.video.follow.own_seeds import unusable
from vibrissa.video.follow.search import Search
from vibrissa.video.identity.whisking import Whisking, whisking_centrelines, within_rows
from vibrissa.video.kernel.band import Image
from vibrissa.video.kernel.estimator_table import Estimator
from vibrissa.video.profile.nodes import profile
from vibrissa.video.profile.turning import Point, Region, Side, View

if TYPE_CHECKING:
    import xarray as xr

Blocks = Iterable[Image] | Callable[[], Iterable[Image]]

SPACING = 5  # default distance of the nodes [px]
LARGEST_PIXEL = 1e-3  # [m] a whisker seen in coarser pixels is no centreline; millimetres given for metres are


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """What turns frames and pixels into seconds and metres; a movie file knows neither.

    Attributes
    ----------
    frame_rate : float
        Frames per second of the acquisition [Hz], not of playback.
    pixel_size : float
        Side of a pixel in the plane of the whisker [m].
    """

    frame_rate: float
    pixel_size: float

    def __post_init__(self) -> None:
        for name, remedy in (
            ("frame_rate", "give the camera's rate, not the movie's playback rate"),
            ("pixel_size", "measure an object of known size in the image"),
        ):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise RangeError(f"Calibration.{name}", "must be positive and finite", value, remedy)
        if self.pixel_size > LARGEST_PIXEL:
            remedy, millimetres = give_in("m", self.pixel_size, "µm", 1e-6), 1e-3 * self.pixel_size
            if millimetres <= LARGEST_PIXEL:
                remedy = f"{remedy}, {millimetres:.5g} for {self.pixel_size:g} mm"
            raise RangeError("Calibration.pixel_size", f"must be at most {LARGEST_PIXEL} m", self.pixel_size, remedy)


def track(
    blocks: Blocks,
    *,
    seeds: Sequence[Point] = (),
    calibration: Calibration,
    polarity: Literal["dark", "bright"] = "dark",
    background: str | Path | NDArray[Any] = "space",
    node_spacing: float | None = None,
    skin: Sequence[Point] | None = None,
    base: Side = "left",
    region: Region | None = None,
    search: int = 4,
    threshold: float = 3.0,
    estimator: Estimator = "matched",
    whisking: Whisking | None = None,
    own_seeds: bool = False,
) -> xr.Dataset:
    """Track whiskers that run across the image, from the side of their base to the other.

    In every column the centreline is placed by ``estimator``. Nodes are at fixed arc length, measured along a local
    quadratic over 31 columns (a sum over the raw steps is too long), and take the raw rows of the two columns about
    them. Between the skin and the visible base end, the whisker is taken as straight: nodes there have a
    position but no standard
    deviation. With the base at the top or bottom, rows are read for columns and columns for rows.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays of uint8 or uint16, or callable
        The movie, from :func:`vibrissa.video.io.movie.read_blocks` or from memory; or a function that gives it
        from the start. Movies of whisking, or with a background that is not "space", are read again: an iterator does
        not do.
    seeds : sequence of (column, row)
        A point within 4 pixels of each whisker in the first frame [px]; the first pixel's centre is (0, 0).
        Small vibrations need no more; whiskers that whisk are marked in ``whisking`` instead.
    calibration : Calibration
        Frame rate and pixel size.
    polarity, search, threshold, estimator
        See :class:`vibrissa.video.follow.search.Search`.
    background : "space", "mean", path, or (height, width) array
        What is behind the whiskers; see :func:`vibrissa.video.follow.background.reference`. Frames are brought to
        the brightness of an image. An attribute names the background.
    node_spacing : float, optional
        Arc length between nodes [m]; 5 pixels if not given. Nodes reach as far as the line in the first frame,
        of whiskers that whisk as far as in any frame.
    skin : sequence of (column, row), optional
        Where each whisker leaves the skin [px]. If not given, arc length starts at the base end of the line in the
        first frame in which it is followed, and the attribute ``arc_length_from`` says so.
    base : {"left", "right", "top", "bottom"}
        Side of the image on which the base is.
    region : (first column, first row, last column, last row), optional
        Pixels in which whiskers are read, both ends included; all by default. The fan of ``whisking`` may leave it.
    whisking : Whisking, optional
        The fan of the pad and marks of the whiskers, if they swing through one another.
    own_seeds : bool
        Whether the program found the seeds itself: those that cannot be followed are left out then, and the attribute
        ``remarks`` (JSON) names them.

    Returns
    -------
    Dataset
        ``x``, ``y``, ``y_sd`` (whisker, time, node) and ``arc_length`` (whisker, node) [m]: x = column × pixel
        size, y = row × pixel size, down, of the image as it was given; time 0 is the first frame. ``x_sd`` in place of
        ``y_sd`` where the base is at the top or bottom: columns are measured then, at given rows. NaN where the
        whisker was not seen, or where ``node`` passes a whisker's end. The attribute ``lost`` is JSON: for each
        whisker a list of [first frame, last frame, reason] of the frames without any node.

    Raises
    ------
    InputError
        If there are no frames, or as :class:`Search`, :class:`View`,
        :func:`vibrissa.video.follow.background.reference`, :func:`vibrissa.video.follow.following.centrelines` and
        :func:`vibrissa.video.identity.whisking.whisking_centrelines`.

    Examples
    --------
    >>> frames = np.full((50, 60, 80), 200, np.uint8)
    >>> frames[:, 29:32] = [[120], [40], [120]]  # a dark line along row 30
    >>> profile = track([frames], seeds=[(40, 30)], calibration=Calibration(frame_rate=2000, pixel_size=1e-4))
    >>> bool(np.nanmax(np.abs(profile.y / 1e-4 - 30)) < 0.1)  # to a tenth of a pixel
    True
    """
    view = View(base=base, region=region, cut=whisking is None)
    spacing = SPACING if node_spacing is None else node_spacing / calibration.pixel_size
    if not spacing > 0:
        raise RangeError("node_spacing", "must be positive", node_spacing)
    count = _count(seeds, whisking, skin)
    again = whisking is not None or not isinstance(background, str) or background != "space"
    movie = _opener(blocks, again)
    image, name = reference(background, movie)
    how = Search(polarity=polarity, search=search, threshold=threshold, estimator=estimator)
    origins = None if skin is None else [view.point(one) for one in skin]
    remarks: list[str] = []
    with view.located():
        movie, how = _in_light(movie, view, image, how, whisking is None)
        if own_seeds:
            seeds, remarks = _usable(view.of(next(iter(movie()))[0]), view, how, seeds)
            count = len(seeds)
        lines = _lines(movie, view, how, seeds, whisking)
        along, across, sd, arc, reason = profile(lines, count, spacing, origins, view.side, whisking is not None)
    if name == "mean":
        refuse_still(along, across, arc)
    attrs = {
        **_attributes(how, view, name, seeds, whisking),
        "arc_length_from": "skin" if skin is not None else "base end of the line in the first frame",
        "lost": json.dumps(lost_frames(reason, REASONS)),
        **({"remarks": json.dumps(remarks)} if remarks else {}),
    }
    x, y = view.back(along, across)
    del along, across  # of a long movie, each is large
    return labelled(attrs, calibration, x=x, y=y, arc_length=arc, **{"x_sd" if view.turned else "y_sd": sd})


def _count(seeds: Sequence[Point], whisking: Whisking | None, skin: Sequence[Point] | None) -> int:
    """Number of whiskers."""
    if bool(seeds) == (whisking is not None):
        raise MissingError("seeds", "must be given, or marks in whisking instead")
    count = len(seeds) if whisking is None else len(whisking.marks)
    if skin is not None and len(skin) != count:
        raise ShapeError("skin", f"must have one point for each of the {count} whiskers", len(skin))
    return count


def _opener(blocks: Blocks, again: bool) -> Callable[[], Iterable[Image]]:
    """Function that gives the blocks from the start, at every call if they are read ``again``."""
    if callable(blocks):
        return blocks
    if again and iter(blocks) is blocks:
        raise FormatError("blocks", "must be readable twice", remedy="give a function that opens the movie")
    return lambda: blocks


def _in_light(
    movie: Callable[[], Iterable[Image]], view: View, image: Image | None, how: Search, finer: bool
) -> tuple[Callable[[], Iterable[Image]], Search]:
    """The movie in the light of the background, and how whiskers are sought before it."""
    if image is None:
        return movie, how
    movie, image = levelled(movie, image, finer=finer)
    return movie, replace(how, background=view.of(image))


def _usable(first: Image, view: View, how: Search, seeds: Sequence[Point]) -> tuple[list[Point], list[str]]:
    """Seeds that can be followed from the first frame on, and a remark on each other one."""
    why = unusable(first, [view.point(seed) for seed in seeds], how)
    if len(why) == len(seeds):
        raise TooFewError("whiskers", "must be seen in the first frame to be followed", remedy="give their seeds")
    remarks = [f"the seed at {seeds[k][0]:g},{seeds[k][1]:g} is left out: {reason}" for k, reason in why.items()]
    return [seed for k, seed in enumerate(seeds) if k not in why], remarks


def _lines(
    movie: Callable[[], Iterable[Image]], view: View, how: Search, seeds: Sequence[Point], whisking: Whisking | None
) -> Iterator[Centrelines]:
    """Centrelines in the view."""
    if whisking is None:
        return centrelines(map(view.of, movie()), seeds=[view.point(seed) for seed in seeds], search=how)
    marked, limits = view.whisking(whisking), view.limits
    how = replace(how, columns=limits[0])
    return within_rows(whisking_centrelines(lambda: map(view.of, movie()), whisking=marked, search=how), limits[1])


def _attributes(
    how: Search, view: View, background: str, seeds: Sequence[Point], whisking: Whisking | None
) -> dict[str, Any]:
    """What was asked for: settings, region, and seeds or fan and marks."""
    asked = {name: getattr(how, name) for name in ("polarity", "search", "threshold", "estimator")}
    region = {} if view.region is None else {"region": json.dumps(view.region)}
    if whisking is None:
        marked = {"seeds": json.dumps([[float(c), float(r)] for c, r in seeds])}
    else:
        marked = {"fan": json.dumps(asdict(whisking.fan)), "marks": json.dumps(whisking.marks)}
    return {"background": background, **asked, "base": view.base, **region, **marked}


def labelled(attrs: Mapping[str, Any], calibration: Calibration, **pixels: Array) -> xr.Dataset:
    """Profile of places in pixels, which are turned into metres in place.

    Parameters
    ----------
    attrs : mapping
        Attributes beside the frame ``image``, the frame rate and the pixel size.
    calibration : Calibration
        Frame rate and pixel size.
    **pixels : (whisker, time, node) arrays
        ``x``, ``y`` and others by their names; ``arc_length`` (whisker, node) [px].

    Returns
    -------
    Dataset
        ``profile`` [m].
    """
    count, frames, nodes = pixels["x"].shape
    for values in pixels.values():
        values *= calibration.pixel_size
    return dataset(
        {"frame": "image", **asdict(calibration), **attrs},
        lead=("whisker",),
        whisker=np.arange(count),
        time=np.arange(frames) / calibration.frame_rate,
        node=np.arange(nodes),
        **pixels,
    )


def numbered_from(profile: xr.Dataset, first: int) -> xr.Dataset:
    """A profile of a part of a movie, whose time counts from the movie's first frame.

    Parameters
    ----------
    profile : Dataset
        From :func:`track`, of these frames alone.
    first : int
        Number of its first frame in the movie, from 0.

    Returns
    -------
    Dataset
        With the attributes ``first_frame`` and ``last_frame``; the runs of ``lost`` still count from the first of them.
    """
    count = profile.sizes["time"]
    time = (first + np.arange(count)) / profile.attrs["frame_rate"]
    later = profile.assign_coords(time=("time", time, profile.time.attrs))
    return later.assign_attrs(first_frame=first, last_frame=first + count - 1)


def lost_frames(reason: NDArray[np.int8], reasons: Sequence[str]) -> list[list[list[Any]]]:
    """Runs of frames in which a whisker is lost.

    Parameters
    ----------
    reason : (whisker, T) array
        Index into ``reasons``; 0 where the whisker is followed.
    reasons : sequence of str
        Why it is not.

    Returns
    -------
    list
        For each whisker, first frame, last frame and reason of its runs.
    """
    runs = []
    for codes in reason:
        starts = np.flatnonzero(np.diff(codes, prepend=-1))
        ends = np.append(starts[1:], codes.size) - 1
        runs.append([[int(a), int(b), reasons[codes[a]]] for a, b in zip(starts, ends, strict=True) if codes[a]])
    return runs
