"""All lines in all frames of a movie: the dataset ``segments``, block by block in bounded memory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import RangeError, ShapeError, TooFewError, UnknownError, require_positive
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.video.find.body_mask import cell_levels, mark_body
from vibrissa.video.find.frame_lines import FrameRoom, LineShape, find_beside, frame_room, line_shape
from vibrissa.video.find.line_placing import FULL_WIDTH
from vibrissa.video.find.line_scale import measured_shape
from vibrissa.video.io.movie import read_blocks

if TYPE_CHECKING:
    import xarray as xr

Frames = NDArray[Any]
Single = NDArray[np.float32]
Background = Literal["none", "median"]

BLOCK = 32  # frames that are held at once
WATCHED, SAMPLED = 256, 5  # of the first frames, those on which the width of the lines is measured
MEDIAN_OF = 61  # frames, evenly over the movie, whose median is the scenery
SMALLEST = 32  # side of a frame at least [px]


@dataclass(frozen=True, kw_only=True)
class LineSearch:
    """What counts as a line, and where it is sought.

    Attributes
    ----------
    polarity : {"dark", "bright"}
        Whether whiskers are darker or brighter than the background.
    background : {"none", "median"} or (height, width) array
        What is subtracted from every frame: nothing; the median over time, in which whiskers that sweep vanish and
        scenery remains; or a given image.
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
        if isinstance(self.background, str) and self.background not in ("none", "median"):
            raise UnknownError("background", "must be 'none', 'median' or an image", repr(self.background))
        require_positive("least_length", self.least_length, "px")
        require_positive("line_width", self.line_width, "px")
        if self.threads < 1:
            raise RangeError("threads", "must be at least 1", self.threads)


class _Plan(NamedTuple):
    """What every frame is searched for: the part of the image, sign of the levels, scenery, shape of the lines."""

    part: tuple[slice, slice]
    sign: float
    scenery: Single | None
    shape: LineShape


def find_segments(
    movie: str | Path | Frames,
    search: LineSearch | None = None,
    *,
    start: int = 0,
    stop: int | None = None,
    progress: Progress | None = None,
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
    progress : callable, optional
        Called with a name of the work, the frames done, and their number (0 if it is not known).

    Returns
    -------
    Dataset
        ``segments``: ``segment_frame``, ``segment_start`` (segment), ``column``, ``row``, ``line_width``,
        ``line_contrast``, ``position_sd`` (point) as in :mod:`vibrissa.quantities.segments`. Where a line is hidden, as
        at a crossing, its points are on its course and their ``position_sd`` is NaN. Attributes: ``frames``, ``width``,
        ``height``, ``source``, ``typical_width`` and ``least_length`` [px].

    Raises
    ------
    InputError
        If the movie cannot be read or the settings do not fit it.
    """
    total = (len(movie) if stop is None else stop) - start if isinstance(movie, np.ndarray) else (stop or 0)
    parts = []
    done = 0
    for part in segment_blocks(movie, search, start=start, stop=stop):
        parts.append(part)
        done += part.attrs["frames"]
        if progress is not None:
            progress("find whiskers", done, total)
    return joined(parts)


def segment_blocks(
    movie: str | Path | Frames, search: LineSearch | None = None, *, start: int = 0, stop: int | None = None
) -> Iterator[xr.Dataset]:
    """The same in blocks of frames, so that memory stays bounded however long the movie is.

    Parameters
    ----------
    movie, search, start, stop
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
    blocks = _source(movie, start, stop)
    plan = _plan(blocks, search)
    source = str(movie) if isinstance(movie, str | Path) else "array"
    rooms: SimpleQueue[FrameRoom] = SimpleQueue()
    first = start
    with ThreadPoolExecutor(search.threads) as pool:
        for block in blocks():
            if first == start:
                shape = block[0][plan.part].shape
                for _ in range(search.threads):
                    rooms.put(frame_room(*shape, plan.shape))
            found = list(pool.map(lambda frame: _found(frame, plan, rooms), block))
            attrs = {"height": block.shape[1], "width": block.shape[2], "source": source}
            yield _labelled(found, first, plan, attrs)
            first += len(block)


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
    return dataset(attrs, **{name: np.concatenate(some) for name, some in arrays.items()})


def _source(movie: str | Path | Frames, start: int, stop: int | None) -> Callable[[], Iterator[Frames]]:
    """Function that gives the blocks of the frames wanted, from their first."""
    if not isinstance(movie, np.ndarray):
        return lambda: read_blocks(movie, BLOCK, start, stop)
    if movie.ndim != 3:
        raise ShapeError("movie", "must be (frames, height, width)", movie.shape)
    if not 0 <= start < (len(movie) if stop is None else stop) <= len(movie):
        raise RangeError("start, stop", f"must lie within the {len(movie)} frames of the movie", (start, stop))
    part = movie[start:stop]
    return lambda: (part[k : k + BLOCK] for k in range(0, len(part), BLOCK))


def _plan(blocks: Callable[[], Iterator[Frames]], search: LineSearch) -> _Plan:
    """What is subtracted and how wide the lines are, from the movie itself."""
    watched = list(islice(chain.from_iterable(blocks()), WATCHED))
    if not watched:
        raise TooFewError("movie", "must hold at least one frame")
    part = _part(search.region, watched[0].shape)
    sign, zero = (1.0, 0.0) if search.polarity == "dark" else (-1.0, -math.inf)
    scenery = _scenery(search.background, blocks, watched[0].shape)
    if scenery is not None:
        scenery = np.float32(sign) * scenery[part]
    if search.line_width is not None:
        return _Plan(part, sign, scenery, line_shape(search.line_width / FULL_WIDTH, search.least_length, zero))
    chosen = np.unique(np.linspace(0, len(watched) - 1, SAMPLED + 2).astype(int)[1:-1])
    images = [np.float32(sign) * watched[k][part].astype(np.float32) for k in chosen]
    if scenery is not None:
        images = [image - scenery for image in images]
    # where scenery is subtracted no level is that of no light
    shape = measured_shape(images, search.least_length, zero if scenery is None else -math.inf)
    return _Plan(part, sign, scenery, shape._replace(zero=zero))


def _part(region: tuple[int, int, int, int] | None, shape: tuple[int, ...]) -> tuple[slice, slice]:
    height, width = shape
    left, top, right, bottom = region or (0, 0, width - 1, height - 1)
    if not (0 <= left < right < width and 0 <= top < bottom < height):
        raise RangeError("region", f"must lie within the image of {width} × {height} pixels", region)
    if min(right - left, bottom - top) < SMALLEST - 1:
        raise RangeError(
            "region" if region else "movie", f"must be at least {SMALLEST} pixels each way", (width, height)
        )
    return slice(top, bottom + 1), slice(left, right + 1)


def _scenery(
    background: Background | Frames, blocks: Callable[[], Iterator[Frames]], shape: tuple[int, ...]
) -> Single | None:
    """Image that is subtracted, or none."""
    if isinstance(background, np.ndarray):
        if background.shape != shape:
            raise ShapeError("background", f"must have the frames' shape {shape}", background.shape)
        return background.astype(np.float32)
    if background == "none":
        return None
    # an even sample of frames whose number is not known before: each time it is full, every other one is left out
    sample: list[Frames] = []
    every = 1
    for k, frame in enumerate(chain.from_iterable(blocks())):
        if k % every == 0:
            sample.append(frame.copy())
        if len(sample) == 2 * MEDIAN_OF:
            sample, every = sample[::2], 2 * every
    return np.median(np.stack(sample), axis=0).astype(np.float32)


def _found(frame: Frames, plan: _Plan, rooms: SimpleQueue[FrameRoom]) -> tuple[Single, NDArray[np.int64]]:
    """Points of all lines of a frame, and the first of each line."""
    room = rooms.get()
    try:
        grey = np.float32(plan.sign) * frame[plan.part].astype(np.float32)
        cell_levels(grey, plan.shape.cell, room.levels)
        mark_body(grey, room.levels, plan.shape.zero, plan.shape.cell, room.dark, room.body)
        lines = find_beside(grey if plan.scenery is None else grey - plan.scenery, plan.shape, room)
        begin = room.begin[: lines + 1].copy()
        points = room.found[: begin[-1]].astype(np.float32)
    finally:
        rooms.put(room)
    points[:, 0] += plan.part[1].start
    points[:, 1] += plan.part[0].start
    return points, begin[:-1]


def _labelled(
    found: list[tuple[Single, NDArray[np.int64]]], first: int, plan: _Plan, attrs: dict[str, Any]
) -> xr.Dataset:
    """Dataset of the lines of some frames."""
    before = np.cumsum([0] + [len(points) for points, _ in found[:-1]])
    points = np.concatenate([points for points, _ in found])
    attrs |= {"frames": len(found), "typical_width": plan.shape.width, "least_length": plan.shape.least}
    return dataset(
        attrs,
        segment_frame=np.repeat(np.arange(first, first + len(found)), [begin.size for _, begin in found]),
        segment_start=np.concatenate([begin + count for (_, begin), count in zip(found, before, strict=True)]),
        column=points[:, 0],
        row=points[:, 1],
        line_width=points[:, 2],
        line_contrast=points[:, 3],
        position_sd=points[:, 4],
    )
