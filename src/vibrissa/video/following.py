"""Whiskers followed from frame to frame: raw centrelines, block by block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.video.centreline import SMOOTH, local_quadratic, read_line
from vibrissa.video.search import Search

Rows = NDArray[np.float64]
Image = NDArray[Any]

GROW = 10  # columns beyond either end of the followed line that are read in the next frame
GAP = 12  # longest run of lost columns within one whisker
FEWEST = 25  # columns below which a line is not called a whisker
SEED_REACH = 4  # rows around a seed in which its whisker is sought
GROW_REACH = 2  # rows about the straight continuation in which the first line is carried on
SLOPES = np.linspace(-2, 2, 41)  # of the whisker at its seed [rows per column]
REGAIN = 1.0  # root mean square distance [px] from where it was lost within which a whisker is taken up again
SAME = 0.3  # contrast of a background along the whisker, over the frame's, above which it holds the whisker
ALIKE = (0.5, 2.0)  # contrast of the line over this whisker's own, outside of which it is another or a crossing
ADAPT = 0.02  # share of a new frame in a whisker's own contrast
APART = 2.0  # distance [px] below which two lines are one
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


class _State(NamedTuple):
    """What is known of one whisker before a frame is read."""

    expected: Rows
    course: Rows
    typical: Rows
    missed: int


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
    states: list[_State] = []
    for block in blocks:
        background = background_of(search, block.shape[1:])
        if not states:
            states = [_start(np.ascontiguousarray(block[0]), background, search, seed) for seed in seeds]
        shape = (len(states), *block.shape[:1], block.shape[2])
        row, sd, contrast = np.empty(shape), np.empty(shape), np.empty(shape)
        reason = np.zeros(shape[:2], np.int8)
        for i, image in enumerate(np.ascontiguousarray(block)):
            lines = []
            for w, state in enumerate(states):
                line, reason[w, i] = _seek(image, background, search, state)
                lines.append(line)
            _part(lines, states, reason[:, i])
            for w, line in enumerate(lines):
                states[w] = _settle(states[w], line, reason[w, i], search)
                row[w, i], sd[w, i], contrast[w, i] = line if reason[w, i] == 0 else (np.nan, np.nan, np.nan)
        yield Centrelines(row, sd, contrast, reason)


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
    typical: Rows | None = None,
) -> tuple[Rows, Rows, Rows]:
    """Row, standard deviation and contrast of the line within ``reach`` rows of the expected rows."""
    ceiling = np.full(expected.size, np.inf)
    if typical is not None:
        # a line of 2 px full width at half maximum has a peak of half its sum
        ceiling = np.where(np.isnan(typical), np.inf, np.maximum(typical, 0) / 2)
    match = search.estimator == "matched"
    return read_line(image, background, sign_of(search), expected, ceiling, reach, search.threshold, GAP, match)


def _start(image: Image, background: NDArray[np.float32], search: Search, seed: tuple[float, float]) -> _State:
    """Find the whisker at a seed, along it to both ends."""
    height, width = image.shape
    if not (0 <= seed[0] <= width - 1 and 0 <= seed[1] <= height - 1):
        raise InputError("seed", f"must lie in the image of {width} × {height} pixels", _written(seed))
    if background.size:
        _refuse_whisker_in(background, image, search, seed)
    line, contrast = _find(image, background, search, seed)
    if np.count_nonzero(~np.isnan(line)) < FEWEST:
        remedy = "take a point on a clear stretch, or set polarity"
        raise InputError("seed", "must lie on a whisker", _written(seed), remedy)
    expected, course = _expect(line, np.full(width, np.nan), search)
    return _State(expected, course, _smooth_contrast(contrast), 0)


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
    for slope, off in product(SLOPES, range(-SEED_REACH, SEED_REACH + 1)):
        course = seed[1] + off + slope * (columns - seed[0])
        found, _, contrast = read(image, background, search, limited(np.where(near, course, np.nan), search), 1)
        if np.nansum(contrast) > best:
            best, line, strength = float(np.nansum(contrast)), found, contrast
    return grow(image, background, search, line, strength)


def grow(
    image: Image, background: NDArray[np.float32], search: Search, line: Rows, strength: Rows
) -> tuple[Rows, Rows]:
    """Carry a line and its contrast on to both ends."""
    unknown = np.full(line.size, np.nan)
    longest, stalled = 0, 0
    course = line
    # a faint stretch may cost columns once: give up when nothing was gained three times
    while stalled < 3 and np.count_nonzero(~np.isnan(course)) > SMOOTH // 2:
        course, _, contrast = read(image, background, search, _expect(course, unknown, search)[0], GROW_REACH)
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


def _smooth_contrast(contrast: Rows) -> Rows:
    """Contrast along a line, smooth; NaN where fewer than 5 columns were measured nearby."""
    return local_quadratic(contrast, SMOOTH)[0]


def limited(expected: Rows, search: Search) -> Rows:
    """Expected rows, NaN outside the columns that are read."""
    if search.columns is None:
        return expected
    columns = np.arange(expected.size)
    return np.where((columns >= search.columns[0]) & (columns <= search.columns[1]), expected, np.nan)


def _expect(row: Rows, course: Rows, search: Search) -> tuple[Rows, Rows]:
    """Where a line is expected next, and its course as far as it was ever followed.

    Beyond an end of the followed line its former course is carried along, as a hidden part comes back where
    it was; beyond that, ``GROW`` columns straight on.
    """
    measured = np.flatnonzero(~np.isnan(row))
    first, last = measured[0], measured[-1]
    value, slope = local_quadratic(row, SMOOTH)
    columns = np.arange(row.size)
    within = (columns >= first) & (columns <= last)
    known = measured[~np.isnan(value[measured])]
    now = np.where(within, np.interp(columns, known, value[known]), np.nan)
    now = np.where(columns < first, course + (now[first] - course[first]), now)
    now = np.where(columns > last, course + (now[last] - course[last]), now)
    seen = np.flatnonzero(~np.isnan(now))
    first, last = seen[0], seen[-1]
    # the slope at the very end of a local quadratic is noisy: take its mean over half the window
    ends = np.nanmean(slope[known[:SMOOTH]]), np.nanmean(slope[known[-SMOOTH:]])
    before, beyond = (columns < first) & (columns >= first - GROW), (columns > last) & (columns <= last + GROW)
    expected = np.where(before, now[first] + ends[0] * (columns - first), now)
    expected = np.where(beyond, now[last] + ends[1] * (columns - last), expected)
    return limited(expected, search), now


def _seek(
    image: Image, background: NDArray[np.float32], search: Search, state: _State
) -> tuple[tuple[Rows, Rows, Rows], int]:
    """Read one whisker in the next frame, and tell by a place in ``REASONS`` whether it is the one."""
    line = read(image, background, search, state.expected, search.search, state.typical)
    if np.count_nonzero(~np.isnan(line[0])) < FEWEST:
        return line, 1
    if state.missed and not _where_it_was(line[0], state):
        return line, 4
    common = ~np.isnan(line[2]) & ~np.isnan(state.typical)
    if common.any():
        ratio = np.median(line[2][common] / state.typical[common])
        if not ALIKE[0] < ratio < ALIKE[1]:
            return line, 2
    return line, 0


def _where_it_was(row: Rows, state: _State) -> bool:
    """Whether a lost whisker is back: at least half of its columns, where they were expected."""
    off = (row - state.expected)[~np.isnan(row)]
    half = np.count_nonzero(~np.isnan(state.course)) / 2
    return bool(off.size >= half and np.sqrt(np.mean(off**2)) < REGAIN)


def _part(lines: Sequence[tuple[Rows, Rows, Rows]], states: Sequence[_State], reason: NDArray[np.int8]) -> None:
    """Where two whiskers were read on one line, leave it to the one that was expected nearer to it."""
    for v in range(len(lines)):
        for w in range(v):
            common = ~np.isnan(lines[v][0]) & ~np.isnan(lines[w][0])
            if reason[v] or reason[w] or np.count_nonzero(common) < FEWEST:
                continue
            if np.median(np.abs(lines[v][0] - lines[w][0])[common]) < APART:
                off = [np.nanmedian(np.abs(lines[k][0] - states[k].expected)) for k in (v, w)]
                reason[v if off[0] > off[1] else w] = 3


def _settle(state: _State, line: tuple[Rows, Rows, Rows], reason: int, search: Search) -> _State:
    """State after a frame: as found if the whisker was followed, as carried along if it was lost."""
    if reason:
        return state._replace(missed=state.missed + 1)
    expected, course = _expect(line[0], state.course, search)
    found = _smooth_contrast(line[2])
    typical = np.where(np.isnan(state.typical), found, state.typical + ADAPT * (found - state.typical))
    return state._replace(expected=expected, course=course, typical=np.where(np.isnan(typical), state.typical, typical))
