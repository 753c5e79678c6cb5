"""Whiskers followed from frame to frame: raw centrelines, block by block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Integers
from vibrissa.video.follow.reading import Reader, background_of
from vibrissa.video.follow.search import Search
from vibrissa.video.follow.starting import whisker_at
from vibrissa.video.kernel.band import Image, Rows
from vibrissa.video.kernel.crossing import alone, part
from vibrissa.video.kernel.local_quadratic import SMOOTH, local_quadratic
from vibrissa.video.kernel.tracking_kernel import expect, follow

_State = tuple[Rows, Rows, Rows, Integers]  # as vibrissa.video.kernel.tracking_kernel has it
_Lines = tuple[Rows, Rows, Rows]  # row, standard deviation, contrast

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
    for block in map(np.ascontiguousarray, blocks):
        if not len(block):
            continue
        reader = Reader(block[0], background_of(search, block.shape[1:]), search)
        if state is None:
            state = _start(reader, seeds)
        shape = (len(seeds), len(block), block.shape[2])
        lines = np.empty(shape), np.empty(shape), np.empty(shape)
        reason = np.zeros(shape[:2], np.int8)
        # whiskers that may meet are followed frame by frame
        (_follow_apart if len(seeds) > 1 else _follow)(block, reader, state, lines, reason)
        yield Centrelines(*lines, reason)


def _follow(block: Image, reader: Reader, state: _State, lines: _Lines, reason: NDArray[np.int8]) -> None:
    """Follow whiskers by the settings of a reader."""
    follow(block, reader.background, reader.sign, reader.how, reader.columns, state, lines, reason)


def _follow_apart(block: Image, reader: Reader, state: _State, lines: _Lines, reason: NDArray[np.int8]) -> None:
    """Follow whiskers that may meet: frame by frame, as each frame's lines say where they are alone."""
    expected, course = state[:2]
    shape = lines[0][:, :1].shape
    now, why = (np.empty(shape), np.empty(shape), np.empty(shape)), reason[:, :1].copy()
    for t in range(len(block)):
        before = course.copy()
        why[:] = 0
        _follow(block[t : t + 1], reader, state, now, why)
        part(now[0][:, 0], before, reader.columns, course, expected)
        for all_, one in zip(lines, now, strict=True):
            all_[:, t] = one[:, 0]
        reason[:, t] = why[:, 0]


def _start(reader: Reader, seeds: Sequence[tuple[float, float]]) -> _State:
    """Find the whiskers at the seeds, along them to both ends."""
    found = [whisker_at(reader, seed) for seed in seeds]
    row, contrast = (np.stack(one) for one in zip(*found, strict=True))
    course, expected, typical = np.full_like(row, np.nan), np.empty_like(row), np.empty_like(row)
    before, columns = course.copy(), reader.columns
    for w in range(len(seeds)):
        expect(row[w], course[w], *columns, expected[w])
        own = np.where(np.isnan(alone(row, w)), np.nan, contrast[w])
        typical[w] = local_quadratic(own, SMOOTH)[0]
    part(row, before, columns, course, expected)
    return expected, course, typical, np.zeros(len(seeds), np.int64)
