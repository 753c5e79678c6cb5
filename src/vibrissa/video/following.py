"""Whiskers followed from frame to frame: raw centrelines, block by block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.video.centreline import SMOOTH, local_quadratic
from vibrissa.video.crossing import alone, part
from vibrissa.video.kernel import APART as APART
from vibrissa.video.kernel import FEWEST as FEWEST
from vibrissa.video.kernel import expect, follow
from vibrissa.video.reading import Image as Image
from vibrissa.video.reading import Rows as Rows
from vibrissa.video.reading import background_of as background_of
from vibrissa.video.reading import columns_of, sign_for
from vibrissa.video.reading import grow as grow
from vibrissa.video.reading import limited as limited
from vibrissa.video.reading import read as read
from vibrissa.video.reading import sign_of as sign_of
from vibrissa.video.search import Search
from vibrissa.video.starting import whisker_at

_State = tuple[Rows, Rows, Rows, NDArray[np.int64]]  # as vibrissa.video.kernel has it

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
        settings = background, sign_for(block, search), how, columns_of(search, shape[2])
        if len(seeds) > 1:
            _follow_apart(np.ascontiguousarray(block), settings, state, lines, reason)
        else:
            follow(np.ascontiguousarray(block), *settings, state, lines, reason)
        yield Centrelines(*lines, reason)


def _follow_apart(
    block: Image,
    settings: tuple[NDArray[np.float32], NDArray[np.signedinteger], tuple[int, float, bool], tuple[int, int]],
    state: _State,
    lines: tuple[Rows, Rows, Rows],
    reason: NDArray[np.int8],
) -> None:
    """Follow whiskers that may meet: frame by frame, as each frame's lines say where they are alone."""
    expected, course = state[:2]
    now, why = tuple(np.empty_like(one[:, :1]) for one in lines), reason[:, :1].copy()
    for t in range(len(block)):
        before = course.copy()
        why[:] = 0
        follow(block[t : t + 1], *settings, state, now, why)
        part(now[0][:, 0], before, settings[-1], course, expected)
        for all_, one in zip(lines, now, strict=True):
            all_[:, t] = one[:, 0]
        reason[:, t] = why[:, 0]


def _start(
    image: Image, background: NDArray[np.float32], search: Search, seeds: Sequence[tuple[float, float]]
) -> _State:
    """Find the whiskers at the seeds, along them to both ends."""
    found = [whisker_at(image, background, search, seed) for seed in seeds]
    row, contrast = (np.stack(one) for one in zip(*found, strict=True))
    course, expected, typical = np.full_like(row, np.nan), np.empty_like(row), np.empty_like(row)
    before, columns = course.copy(), columns_of(search, image.shape[1])
    for w in range(len(seeds)):
        expect(row[w], course[w], *columns, expected[w])
        own = np.where(np.isnan(alone(row, w)), np.nan, contrast[w])
        typical[w] = local_quadratic(own, SMOOTH)[0]
    part(row, before, columns, course, expected)
    return expected, course, typical, np.zeros(len(seeds), np.int64)
