"""The first line of each whisker: from its seed on to both ends, straight through whiskers that it crosses."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from vibrissa.errors import RangeError, TooFewError
from vibrissa.video.follow.reading import GROW_REACH, Reader
from vibrissa.video.kernel.band import Rows
from vibrissa.video.kernel.local_quadratic import SMOOTH
from vibrissa.video.kernel.tracking_kernel import FEWEST

SEED_REACH = 4  # rows around a seed in which its whisker is sought
FURTHER = 0.1  # share of the contrast that each row between seed and line takes: of two lines the nearer is meant
SLOPES = np.linspace(-2, 2, 41)  # of the whisker at its seed [rows per column]
SAME = 0.3  # contrast of a background along the whisker, over the frame's, above which it holds the whisker
COURSE = 100  # columns behind the end of a line whose quadratic is its course
BENT = 40  # columns below which the course is taken as straight
AHEAD = 10  # columns by which it is carried on at once
MERGED = 1.4  # contrast over the line's own above which two lines are seen as one
OFF = 1.5  # distance from its course [px] beyond which another line is seen
HIDDEN = 100  # columns in a row that a line may be merged with others, or not be seen


def whisker_at(reader: Reader, seed: tuple[float, float]) -> tuple[Rows, Rows]:
    """Line and contrast of the whisker at a seed.

    Parameters
    ----------
    reader : Reader
        Of the first frame.
    seed : (column, row)
        A point of the whisker [px].

    Returns
    -------
    line, contrast : (width,) arrays
        Rows [px], NaN where not seen, and contrast [grey levels × px].

    Raises
    ------
    InputError
        If the seed is outside the image or on no whisker, or the background holds the whisker.
    """
    height, width = reader.image.shape
    if not (0 <= seed[0] <= width - 1 and 0 <= seed[1] <= height - 1):
        raise RangeError("seed", f"must lie in the image of {width} × {height} pixels", _written(seed))
    if reader.background.size:
        _refuse_whisker_in_background(reader, seed)
    line, contrast = _carried_on(reader, *_find(reader, seed))
    if np.count_nonzero(~np.isnan(line)) < FEWEST:
        remedy = "take a point on a clear stretch, or set polarity"
        raise RangeError("seed", "must lie on a whisker", _written(seed), remedy)
    return line, contrast


def _written(seed: tuple[float, float]) -> str:
    return f"column {seed[0]:g}, row {seed[1]:g}"


def _find(reader: Reader, seed: tuple[float, float]) -> tuple[Rows, Rows]:
    """The line at a seed and its contrast, ``SMOOTH`` columns to either side: of the slope of highest contrast."""
    columns = np.arange(reader.image.shape[1])
    near = np.abs(columns - seed[0]) <= SMOOTH
    unknown = np.full(columns.size, np.nan)
    best, line, strength = 0.0, unknown, unknown
    for slope, off in product(SLOPES, range(-SEED_REACH, SEED_REACH + 1, 2)):
        course = seed[1] + off + slope * (columns - seed[0])
        found, _, contrast = reader.read(reader.limited(np.where(near, course, np.nan)), 1)
        total = _weight(found, contrast, seed)
        if total > best:
            best, line, strength = total, found, contrast
    return line, strength


def _weight(line: Rows, contrast: Rows, seed: tuple[float, float]) -> float:
    """Contrast of a short line as far as it is on one course, less the further that passes its seed."""
    seen = np.flatnonzero(~np.isnan(line))
    if seen.size <= SMOOTH // 2:
        return 0.0
    course = np.poly1d(np.polyfit(seen - seed[0], line[seen], 2))
    own = seen[np.abs(line[seen] - course(seen - seed[0])) < OFF / 2]
    return float(np.sum(contrast[own])) * (1 - FURTHER * min(abs(float(course(0)) - seed[1]), 2 * SEED_REACH))


def _carried_on(reader: Reader, line: Rows, strength: Rows) -> tuple[Rows, Rows]:
    """A short line and its contrast, continued to both ends."""
    if np.count_nonzero(~np.isnan(line)) <= SMOOTH // 2:
        return line, strength
    for way in (1, -1):
        _carry(reader, (line, strength), way)
    line, _, strength = reader.beyond(line)
    return line, strength


def _carry(reader: Reader, found: tuple[Rows, Rows], way: int) -> None:
    """Carry a line on to the right (way 1) or left (−1) by its own course; uncertain columns are left out."""
    line, strength = found
    end, hidden = (np.flatnonzero(~np.isnan(line))[-1 if way > 0 else 0]), 0
    while hidden < HIDDEN and 0 <= end < line.size:
        course, own = _course(line, strength, way)
        ahead = end + way * np.arange(1, AHEAD + 1)
        ahead = ahead[(ahead >= 0) & (ahead < line.size)]
        expected = reader.limited(np.where(np.abs(np.arange(line.size) - end) <= AHEAD, course, np.nan))
        row, _, contrast = reader.read(expected, GROW_REACH)
        mine = ahead[(np.abs(row - course) < OFF)[ahead] & (_smoothed(contrast) < MERGED * own)[ahead]]
        seen = 2 * mine.size >= ahead.size
        if seen:
            line[mine], strength[mine] = row[mine], contrast[mine]
        hidden, end = 0 if seen else hidden + AHEAD, end + way * AHEAD


def _course(line: Rows, strength: Rows, way: int) -> tuple[Rows, float]:
    """Where a line continues beyond its end, in all columns, and its contrast there."""
    known = np.flatnonzero(~np.isnan(line))[::-way]
    near = known[np.abs(known - known[0]) < COURSE]
    fit = np.polyfit(near - known[0], line[near], 2 if np.ptp(near) > BENT else 1)
    return np.polyval(fit, np.arange(line.size) - known[0]), float(np.median(strength[known[: 2 * SMOOTH]]))


def _smoothed(contrast: Rows) -> Rows:
    """Mean over seven columns, of those that are seen."""
    seen = ~np.isnan(contrast)
    count = np.convolve(seen, np.ones(7), "same")
    return np.convolve(np.where(seen, contrast, 0.0), np.ones(7), "same") / np.maximum(count, 1)


def _refuse_whisker_in_background(reader: Reader, seed: tuple[float, float]) -> None:
    """A whisker that is darker than its surroundings must not be in the background too."""
    without = replace(reader, background=np.zeros((0, 0), np.float32))
    line, contrast = _carried_on(without, *_find(without, seed))
    grey = np.clip(reader.background, 0, np.iinfo(reader.image.dtype).max)
    behind = replace(without, image=np.rint(grey).astype(reader.image.dtype))
    itself = behind.read(line, 1)[2]
    if np.nansum(itself) > SAME * np.nansum(contrast):
        raise TooFewError(
            "background",
            "must not hold the whisker, as a mean over time does",
            remedy="give an image without it, or 'space'",
        )
