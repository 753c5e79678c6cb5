"""Whiskers followed from frame to frame: raw centrelines, block by block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.video.centreline import SMOOTH, local_quadratic, read_line
from vibrissa.video.kernel import APART as APART
from vibrissa.video.kernel import FEWEST as FEWEST
from vibrissa.video.kernel import expect, follow
from vibrissa.video.search import Search

Rows = NDArray[np.float64]
Image = NDArray[Any]
_State = tuple[Rows, Rows, Rows, NDArray[np.int64]]  # as vibrissa.video.kernel has it

SEED_REACH = 4  # rows around a seed in which its whisker is sought
GROW_REACH = 2  # rows about the straight continuation in which the first line is carried on
SLOPES = np.linspace(-2, 2, 41)  # of the whisker at its seed [rows per column]
SAME = 0.3  # contrast of a background along the whisker, over the frame's, above which it holds the whisker
REASONS = (
    "followed",
    "too faint or hidden",
    "contrast of another",
    "on another whisker's line",
    "not sure that it is back",
    "base end hidden",
    "not sure which one",
)
UNSURE = len(REASONS) - 1


class Centrelines(NamedTuple):
    """Raw centrelines of some frames, column by column; NaN where not measured.

    Attributes
    ----------
    row : (whisker, T, width) array
        Row of the line in each column [px]; the first pixel's centre is 0, down is positive.
    sd : (whisker, T, width) array
        Standard deviation of ``row`` that the pixel noise gives [px].
    contrast : (whisker, T, width) array
        Five-pixel sum of the difference to the background [grey levels × px].
    reason : (whisker, T) array of int
        Index into ``REASONS``: 0 if the whisker is followed in that frame, else why not.
    """

    row: Rows
    sd: Rows
    contrast: Rows
    reason: NDArray[np.int8]


def centrelines(
    blocks: Iterable[Image], *, seeds: Sequence[tuple[float, float]], search: Search | None = None
) -> Iterator[Centrelines]:
    """Follow whiskers through a movie, column by column.

    Parameters
    ----------
    blocks : iterable of (T, height, width) arrays of uint8 or uint16
        The movie.
    seeds : sequence of (column, row)
        A point within 4 rows of each whisker in the first frame [px].
    search : Search
        How they are sought.

    Yields
    ------
    Centrelines
        Those of one block.

    Raises
    ------
    InputError
        If a seed is outside the image or has no whisker, or the background is none.
    """
    search = search or Search()
    state: _State | None = None
    for block in blocks:
        background = background_of(search, block.shape[1:])
        if state is None:
            state = _start(np.ascontiguousarray(block[0]), background, search, seeds)
        shape = (len(seeds), len(block), block.shape[2])
        lines = np.empty(shape), np.empty(shape), np.empty(shape)
        reason = np.zeros(shape[:2], np.int8)
        how = search.search, search.threshold, search.estimator == "matched"
        sign = _sign_for(block, search)
        follow(np.ascontiguousarray(block), background, sign, how, _columns(search, shape[2]), state, lines, reason)
        yield Centrelines(*lines, reason)


def background_of(search: Search, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """The image without the whisker, or an array of size 0 if it is to be estimated."""
    if isinstance(search.background, str):
        return np.zeros((0, 0), np.float32)
    if search.background.shape != shape:
        raise InputError("background", f"must have the frames' shape {shape}", search.background.shape)
    return np.ascontiguousarray(search.background, np.float32)


def sign_of(search: Search) -> float:
    """1 for dark whiskers, −1 for bright ones."""
    return 1.0 if search.polarity == "dark" else -1.0


def read(
    image: Image,
    background: NDArray[np.float32],
    search: Search,
    expected: Rows,
    reach: int,
) -> tuple[Rows, Rows, Rows]:
    """Row, standard deviation and contrast of the line within ``reach`` rows of the expected rows."""
    ceiling = np.full(expected.size, np.nan)
    line = np.empty((3, expected.size))
    match = search.estimator == "matched"
    sign = _sign_for(image, search)
    read_line(image, background, sign, expected, ceiling, reach, search.threshold, match, line[0], line[1], line[2])
    return line[0], line[1], line[2]


def _sign_for(image: Image, search: Search) -> NDArray[np.signedinteger]:
    """The sign, in a type that holds sums of the image's grey levels."""
    return np.array([sign_of(search)], np.int16 if image.dtype == np.uint8 else np.int32)


def _columns(search: Search, width: int) -> tuple[int, int]:
    """First and last column that are read."""
    low, high = search.columns or (0, width - 1)
    return max(low, 0), min(high, width - 1)


def _start(
    image: Image, background: NDArray[np.float32], search: Search, seeds: Sequence[tuple[float, float]]
) -> _State:
    """Find the whiskers at the seeds, along them to both ends."""
    width = image.shape[1]
    columns = _columns(search, width)
    expected, course, typical = np.empty((3, len(seeds), width))
    for w, seed in enumerate(seeds):
        line, contrast = _whisker_at(image, background, search, seed)
        course[w] = np.nan
        expect(line, course[w], *columns, expected[w])
        typical[w] = local_quadratic(contrast, SMOOTH)[0]
    return expected, course, typical, np.zeros(len(seeds), np.int64)


def _whisker_at(
    image: Image, background: NDArray[np.float32], search: Search, seed: tuple[float, float]
) -> tuple[Rows, Rows]:
    """Line and contrast of the whisker at a seed."""
    height, width = image.shape
    if not (0 <= seed[0] <= width - 1 and 0 <= seed[1] <= height - 1):
        raise InputError("seed", f"must lie in the image of {width} × {height} pixels", _written(seed))
    if background.size:
        _refuse_whisker_in(background, image, search, seed)
    line, contrast = _find(image, background, search, seed)
    if np.count_nonzero(~np.isnan(line)) < FEWEST:
        remedy = "take a point on a clear stretch, or set polarity"
        raise InputError("seed", "must lie on a whisker", _written(seed), remedy)
    return line, contrast


def _written(seed: tuple[float, float]) -> str:
    return f"column {seed[0]:g}, row {seed[1]:g}"


def _find(
    image: Image, background: NDArray[np.float32], search: Search, seed: tuple[float, float]
) -> tuple[Rows, Rows]:
    """The line through a seed and its contrast: from the slope of highest contrast, on to both ends."""
    columns = np.arange(image.shape[1])
    near = np.abs(columns - seed[0]) <= SMOOTH
    unknown = np.full(columns.size, np.nan)
    best, line, strength = 0.0, unknown, unknown
    for slope, off in product(SLOPES, range(-SEED_REACH, SEED_REACH + 1, 2)):
        course = seed[1] + off + slope * (columns - seed[0])
        found, _, contrast = read(image, background, search, limited(np.where(near, course, np.nan), search), 1)
        total = float(np.add.reduce(contrast, where=contrast == contrast))
        if total > best:
            best, line, strength = total, found, contrast
    return grow(image, background, search, line, strength)


def grow(
    image: Image, background: NDArray[np.float32], search: Search, line: Rows, strength: Rows
) -> tuple[Rows, Rows]:
    """Carry a line and its contrast on to both ends."""
    longest, stalled = 0, 0
    course = line
    # a faint stretch may cost columns once: give up when nothing was gained three times
    while stalled < 3 and np.count_nonzero(~np.isnan(course)) > SMOOTH // 2:
        expected = np.empty(line.size)
        expect(course, np.full(line.size, np.nan), *_columns(search, line.size), expected)
        course, _, contrast = read(image, background, search, expected, GROW_REACH)
        count = int(np.count_nonzero(~np.isnan(course)))
        stalled = 0 if count > longest else stalled + 1
        if count > longest:
            longest, line, strength = count, course, contrast
    return line, strength


def _refuse_whisker_in(
    background: NDArray[np.float32], image: Image, search: Search, seed: tuple[float, float]
) -> None:
    """A whisker that stands out against what is above and below it must not stand in the background too."""
    space = np.zeros((0, 0), np.float32)
    line, contrast = _find(image, space, search, seed)
    grey = np.rint(np.clip(background, 0, np.iinfo(image.dtype).max)).astype(image.dtype)
    itself = read(grey, space, search, line, 1)[2]
    if np.nansum(itself) > SAME * np.nansum(contrast):
        raise InputError(
            "background",
            "must not hold the whisker, as a mean over time does",
            remedy="give an image without it, or 'space'",
        )


def limited(expected: Rows, search: Search) -> Rows:
    """Expected rows, NaN outside the columns that are read."""
    if search.columns is None:
        return expected
    columns = np.arange(expected.size)
    return np.where((columns >= search.columns[0]) & (columns <= search.columns[1]), expected, np.nan)
