"""All lines in all frames of a movie: the dataset ``segments``, block by block in bounded memory."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import RangeError, ShapeError, TooFewError, UnknownError, require_positive
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.video.find.body_mask import cell_levels, mark_body
from vibrissa.video.find.frame_lines import LINES, FrameRoom, LineShape, find_moving, frame_room, line_shape
from vibrissa.video.find.line_placing import FULL_WIDTH
from vibrissa.video.find.line_scale import measured_shape
from vibrissa.video.find.still_scenery import SPAN, sceneries
from vibrissa.video.io.about import IN_COLOUR, refuse_region
from vibrissa.video.io.movie import DropFrames, frames_within, open_movie, read_blocks, with_missing_frames

if TYPE_CHECKING:
    import xarray as xr

Frames = NDArray[Any]
Single = NDArray[np.float32]
Background = Literal["none", "mean", "median"]

BLOCK = 32  # frames that are held at once
WATCHED, SAMPLED = 256, 5  # of the first frames, those on which the width of the lines is measured
SMALLEST = 32  # side of a frame at least [px]
CROWDED = f"some frames have more lines than are kept ({LINES:,}): the rest is left out; search for longer ones only"


@dataclass(frozen=True, kw_only=True)
class LineSearch:
    """What counts as a line, and where it is sought.

    Attributes
    ----------
    polarity : {"dark", "bright"}
        Whether whiskers are darker or brighter than the background.
    background : {"none", "mean", "median"} or (height, width) array
        What is subtracted from every frame: nothing; the mean or the median over time, in which whiskers that sweep
        vanish and scenery remains; or a given image. Mean and median are of 2,048 frames, one part of the movie after
        another, as light drifts.
    region : (first column, first row, last column, last row), optional
        Part of the image that is searched [px]; all by default.
    least_length : float, optional
        Length of a line at least [px]; ten times the width of the lines by default.
    line_width : float, optional
        Full width of the lines at half depth [px]; measured on the first frames by default.
    threads : int
        Frames that are searched at once.
    """

    polarity: Literal["dark", "bright"] = "dark"
    background: Background | Frames = "none"
    region: tuple[int, int, int, int] | None = None
    least_length: float | None = None
    line_width: float | None = None
    threads: int = 1

    def __post_init__(self) -> None:
        if self.polarity not in ("dark", "bright"):
            raise UnknownError("polarity", "must be 'dark' or 'bright'", repr(self.polarity))
        if isinstance(self.background, str) and self.background not in get_args(Background):
            rule = "must be 'none', 'mean', 'median' or an image"
            raise UnknownError("background", rule, repr(self.background))
        require_positive("least_length", self.least_length, "px")
        require_positive("line_width", self.line_width, "px")
        if self.threads < 1:
            raise RangeError("threads", "must be at least 1", self.threads)


class _Plan(NamedTuple):
    """What every frame is searched for: the part of the image, sign of the levels, shape of the lines."""

    part: tuple[slice, slice]
    sign: float
    shape: LineShape


class _Found(NamedTuple):
    """Points of all lines of a frame, the first of each line, and whether there were more than the room holds."""

    points: Single
    begin: NDArray[np.int64]
    crowded: bool


def find_segments(
    movie: str | Path | Frames,
    search: LineSearch | None = None,
    *,
    start: int = 0,
    stop: int | None = None,
    drop_frames: DropFrames = None,
    progress: Progress | None = None,
    watch: Callable[[Frames], None] | None = None,
) -> xr.Dataset:
    """Find all lines in all frames of a movie.

    Lines are read across their own direction, whichever it is. Each point is placed from the pixels within one pixel
    along the line, so errors of points two or more apart are independent.

    Parameters
    ----------
    movie : path or (T, height, width) array
        A file, or grey frames.
    search : LineSearch, optional
        What counts as a line; dark lines without subtraction by default.
    start, stop : int
        First frame that is searched, from 0, and the first after it that is not; all by default.
    drop_frames : {"nan"}, optional
        As of :func:`vibrissa.video.io.movie.read_blocks`.
    progress : callable, optional
        Called with a name of the work, the frames done, and their number.
    watch : callable, optional
        Called with every block of frames that is searched.

    Returns
    -------
    Dataset
        ``segments``: ``segment_frame``, ``segment_start`` (segment), ``column``, ``row``, ``line_width``,
        ``line_contrast``, ``position_sd`` (point) as in :mod:`vibrissa.quantities.segments`. Where a line is hidden, as
        at a crossing, its points are on its course and their ``position_sd`` is NaN. Attributes: ``frames``, ``width``,
        ``height``, ``source``, ``typical_width`` and ``least_length`` [px]; ``remarks`` (JSON, sentences), as of a
        movie in colour, or of frames with more than 2,000 lines, of which the rest is left out; of a part of a movie
        also ``first_frame``.

    Raises
    ------
    InputError
        If the movie cannot be read or the settings do not fit it.
    """
    if isinstance(movie, np.ndarray):
        total = (len(movie) if stop is None else stop) - start
    else:
        total = frames_within(with_missing_frames(open_movie(movie), drop_frames), start, stop)
    parts = []
    done = 0
    for part in segment_blocks(movie, search, start=start, stop=stop, drop_frames=drop_frames, watch=watch):
        parts.append(part)
        done += part.attrs["frames"]
        if progress is not None:
            progress("find whiskers", done, total)
    return joined(parts)


def segment_blocks(
    movie: str | Path | Frames,
    search: LineSearch | None = None,
    *,
    start: int = 0,
    stop: int | None = None,
    drop_frames: DropFrames = None,
    watch: Callable[[Frames], None] | None = None,
) -> Iterator[xr.Dataset]:
    """The same in blocks of frames, so that memory stays bounded however long the movie is.

    Parameters
    ----------
    movie, search, start, stop, drop_frames, watch
        As in :func:`find_segments`.

    Yields
    ------
    Dataset
        Segments of the next frames; ``segment_frame`` counts from the movie's first frame.

    Raises
    ------
    InputError
        As :func:`find_segments`.
    """
    search = search or LineSearch()
    blocks = _source(movie, start, stop, drop_frames)
    images = _sceneries(search.background, blocks)
    scenery = next(images, None)
    plan = _plan(blocks, search, scenery)
    about = _about(movie) | ({} if (start, stop) == (0, None) else {"first_frame": start})
    rooms: SimpleQueue[FrameRoom] = SimpleQueue()
    for _ in range(search.threads):
        height, width = (one.stop - one.start for one in plan.part)
        rooms.put(frame_room(height, width, plan.shape))
    done = 0
    with ThreadPoolExecutor(search.threads) as pool:
        for block in blocks():
            if watch is not None:
                watch(block)
            behind = []
            for k in range(done, done + len(block)):
                scenery = next(images, scenery) if k and k % SPAN == 0 else scenery
                behind.append(scenery)
            found = list(pool.map(lambda frame, image: _found(frame, image, plan, rooms), block, behind))
            attrs = {"height": block.shape[1], "width": block.shape[2], **about}
            yield _labelled(found, start + done, plan, attrs)
            done += len(block)


def joined(parts: Iterable[xr.Dataset]) -> xr.Dataset:
    """Segments of following parts of a movie in one dataset.

    Parameters
    ----------
    parts : iterable of Dataset
        As of :func:`segment_blocks`; at least one.

    Returns
    -------
    Dataset
        All of them.
    """
    parts = list(parts)
    names = ("segment_frame", "segment_start", "column", "row", "line_width", "line_contrast", "position_sd")
    arrays = {name: [part[name].values for part in parts] for name in names}
    before = np.cumsum([0] + [part.sizes["point"] for part in parts[:-1]])
    arrays["segment_start"] = [one + count for one, count in zip(arrays["segment_start"], before, strict=True)]
    attrs = parts[0].attrs | {"frames": sum(part.attrs["frames"] for part in parts)}
    remarks = dict.fromkeys(one for part in parts for one in json.loads(part.attrs["remarks"]))
    attrs["remarks"] = json.dumps(list(remarks))
    columns: dict[str, Any] = {name: np.concatenate(some) for name, some in arrays.items()}
    return dataset(attrs, **columns)


def _source(
    movie: str | Path | Frames, start: int, stop: int | None, drop_frames: DropFrames
) -> Callable[[], Iterator[Frames]]:
    """Function that gives the blocks of the frames wanted, from their first."""
    if not isinstance(movie, np.ndarray):
        return lambda: read_blocks(movie, BLOCK, start, stop, drop_frames=drop_frames)
    if movie.ndim != 3:
        raise ShapeError("movie", "must be (frames, height, width)", movie.shape)
    if not 0 <= start < (len(movie) if stop is None else stop) <= len(movie):
        raise RangeError("start, stop", f"must lie within the {len(movie)} frames of the movie", (start, stop))
    part = movie[start:stop]
    return lambda: (part[k : k + BLOCK] for k in range(0, len(part), BLOCK))


def _plan(blocks: Callable[[], Iterator[Frames]], search: LineSearch, scenery: Single | None) -> _Plan:
    """What is searched and how wide the lines are, from the movie itself."""
    watched = list(islice(chain.from_iterable(blocks()), WATCHED))
    if not watched:
        raise TooFewError("movie", "must hold at least one frame")
    shape = watched[0].shape
    if scenery is not None and scenery.shape != shape:
        raise ShapeError("background", f"must have the frames' shape {shape}", scenery.shape)
    part = _part(search.region, shape)
    sign, zero = (1.0, 0.0) if search.polarity == "dark" else (-1.0, -math.inf)
    if search.line_width is not None:
        return _Plan(part, sign, line_shape(search.line_width / FULL_WIDTH, search.least_length, zero))
    chosen = np.unique(np.linspace(0, len(watched) - 1, SAMPLED + 2).astype(int)[1:-1])
    images = [np.float32(sign) * _without(watched[k], scenery)[part] for k in chosen]
    # where scenery is subtracted no level is that of no light
    lines = measured_shape(images, search.least_length, zero if scenery is None else -math.inf)
    return _Plan(part, sign, lines._replace(zero=zero))


def _without(frame: Frames, scenery: Single | None) -> Single:
    """A frame less the scenery."""
    grey: Single = frame.astype(np.float32)
    return grey if scenery is None else grey - scenery


def _about(movie: str | Path | Frames) -> dict[str, str]:
    """Source of the frames, and what its reader should know."""
    if isinstance(movie, np.ndarray):
        return {"source": "array", "remarks": "[]"}
    remarks = [IN_COLOUR] if open_movie(movie).colour else []
    return {"source": str(movie), "remarks": json.dumps(remarks)}


def _part(region: tuple[int, int, int, int] | None, shape: tuple[int, ...]) -> tuple[slice, slice]:
    height, width = shape
    left, top, right, bottom = region or (0, 0, width - 1, height - 1)
    refuse_region((left, top, right, bottom), shape)
    if min(right - left, bottom - top) < SMALLEST - 1:
        size = (right - left + 1, bottom - top + 1)
        raise RangeError("region" if region else "movie", f"must be at least {SMALLEST} pixels each way", size)
    return slice(top, bottom + 1), slice(left, right + 1)


def _sceneries(background: Background | Frames, blocks: Callable[[], Iterator[Frames]]) -> Iterator[Single]:
    """Images that are subtracted from one part of the movie after another; none if nothing is."""
    if isinstance(background, np.ndarray):
        yield background.astype(np.float32)
    elif background != "none":
        yield from sceneries(blocks(), background)


def _found(frame: Frames, scenery: Single | None, plan: _Plan, rooms: SimpleQueue[FrameRoom]) -> _Found:
    """Lines of a frame."""
    room = rooms.get()
    try:
        grey = np.float32(plan.sign) * frame[plan.part].astype(np.float32)
        moving = grey if scenery is None else np.float32(plan.sign) * _without(frame, scenery)[plan.part]
        cell_levels(grey, plan.shape.cell, room.levels)
        mark_body(grey, room.levels, plan.shape.zero, plan.shape.cell, room.dark, room.body)
        lines = find_moving(grey, moving, plan.shape, room)
        begin = room.begin[: lines + 1].copy()
        points, crowded = room.found[: begin[-1]].astype(np.float32), bool(room.crowded[0])
    finally:
        rooms.put(room)
    points[:, 0] += plan.part[1].start
    points[:, 1] += plan.part[0].start
    return _Found(points, begin[:-1], crowded)


def _labelled(found: list[_Found], first: int, plan: _Plan, attrs: dict[str, Any]) -> xr.Dataset:
    """Dataset of the lines of some frames."""
    before = np.cumsum([0] + [len(one.points) for one in found[:-1]])
    points = np.concatenate([one.points for one in found])
    attrs |= {"frames": len(found), "typical_width": plan.shape.width, "least_length": plan.shape.least}
    if any(one.crowded for one in found):
        attrs["remarks"] = json.dumps([*json.loads(attrs["remarks"]), CROWDED])
    return dataset(
        attrs,
        segment_frame=np.repeat(np.arange(first, first + len(found)), [one.begin.size for one in found]),
        segment_start=np.concatenate([one.begin + count for one, count in zip(found, before, strict=True)]),
        column=points[:, 0],
        row=points[:, 1],
        line_width=points[:, 2],
        line_contrast=points[:, 3],
        position_sd=points[:, 4],
    )
