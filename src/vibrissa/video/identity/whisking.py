"""Whiskers followed while the animal whisks: linked as lines of the fan over the whole movie, then read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.errors import RangeError, TooFewError
from vibrissa.video.follow.following import UNSURE, Centrelines
from vibrissa.video.follow.reading import Reader, background_of
from vibrissa.video.follow.search import Search
from vibrissa.video.identity.identity_linking import Chain, chain, link
from vibrissa.video.identity.whisker_fan import Fan, angle_at, course, fan_lines
from vibrissa.video.kernel.band import Image, Rows
from vibrissa.video.kernel.tracking_kernel import APART, FEWEST

HIDDEN, SHARED = 1, 3  # places in REASONS
MARK_REACH = 3.0  # distance of a line from the point that marks it [px]
SURE = 4.0  # margin above which a line is called this whisker's; exp(−4) is 2 %


@dataclass(frozen=True, kw_only=True)
class Whisking:
    """How whiskers that swing through one another are identified.

    Attributes
    ----------
    fan : Fan
        Where the lines of the pad are sought.
    marks : (((frame, column, row), ...), ...)
        For each whisker, points of it in one frame or more [px], between the radii of the fan; frame 0 is the
        first one. Where an overlap cannot be decided the whisker is lost until its next mark.
    """

    fan: Fan
    marks: tuple[tuple[tuple[int, float, float], ...], ...]

    def __post_init__(self) -> None:
        if not self.marks or not all(self.marks):
            raise TooFewError("Whisking.marks", "must have at least one mark for each whisker", self.marks)
        for one in self.marks:
            frames = [mark[0] for mark in one]
            if sorted(set(frames)) != frames:
                raise RangeError("Whisking.marks", "must be in the order of frames, one in a frame", frames)


def whisking_centrelines(
    movie: Callable[[], Iterable[Image]], *, whisking: Whisking, search: Search
) -> Iterator[Centrelines]:
    """Follow whiskers that swing through one another.

    Parameters
    ----------
    movie : callable
        Gives the movie's blocks, (T, height, width) arrays of uint8 or uint16, from the start; called twice.
    whisking : Whisking
        Fan and marks.
    search : Search
        How the lines are read, once linked.

    Yields
    ------
    Centrelines
        Those of one block. A whisker is lost where its line is not seen or may be another one's.

    Raises
    ------
    InputError
        If there are no frames, or a mark is on no line.
    """
    fan, found = whisking.fan, []
    for block in movie():
        background, sign = background_of(search, block.shape[1:]), float(search.sign)
        found += [fan_lines(image, background, sign, fan) for image in np.ascontiguousarray(block)]
    if not found:
        raise TooFewError("blocks", "must hold at least one frame")
    chains = whiskers(np.stack(found), whisking)
    done = 0
    for block in movie():
        yield _read_block(block, chains, done, fan, search)
        done += len(block)


def whiskers(lines: Rows, whisking: Whisking) -> list[Chain]:
    """Marked whiskers, linked over all frames, from :func:`vibrissa.video.identity.whisker_fan.fan_lines`.

    Parameters
    ----------
    lines : (T, n, 3) array
        Lines of the fan in every frame.
    whisking : Whisking
        Fan and marks.

    Returns
    -------
    list of Chain
        One for each marked whisker.
    """
    links = link(lines, sum(whisking.fan.angles) / 2)
    return [chain(lines, links, _places(lines, whisking.fan, one)) for one in whisking.marks]


def _places(lines: Rows, fan: Fan, marks: Sequence[tuple[int, float, float]]) -> Integers:
    """Frame and place of the lines nearest to the marks."""
    places = []
    for frame, column, row in marks:
        if not 0 <= frame < len(lines):
            raise RangeError("mark", f"must be in the movie of {len(lines)} frames", frame)
        angle, offset, _ = lines[frame].T
        off = np.abs(angle - angle_at(fan, (column, row), offset)) * np.deg2rad(fan.middle)
        off = np.where(np.isnan(off), np.inf, off)
        if not off.min() < MARK_REACH:
            raise RangeError("mark", "must lie on a line of the fan", (frame, column, row))
        places.append((frame, int(np.argmin(off))))
    return np.array(places)


def _read_block(block: Image, chains: Sequence[Chain], done: int, fan: Fan, search: Search) -> Centrelines:
    """Centrelines along the linked lines."""
    background = background_of(search, block.shape[1:])
    row, sd, contrast = np.full((3, len(chains), block.shape[0], block.shape[2]), np.nan)
    reason = np.zeros((len(chains), len(block)), np.int8)
    for i, image in enumerate(np.ascontiguousarray(block)):
        reader = Reader(image, background, search)
        for w, one in enumerate(chains):
            t = done + i
            if not one.seen[t] or not one.margin[t] > SURE:
                reason[w, i] = UNSURE if one.margin[t] <= SURE else HIDDEN
                continue
            straight = reader.limited(course(fan, one.angle[t], one.offset[t], image.shape[1]))
            line = reader.grown(reader.read(straight, search.search)[0])
            row[w, i], sd[w, i], contrast[w, i] = reader.read(line, search.search)
            if np.count_nonzero(~np.isnan(row[w, i])) < FEWEST:
                reason[w, i] = HIDDEN
        for v, w in combinations(range(len(chains)), 2):
            if _one_line(row[v, i], row[w, i]):
                reason[v, i] = reason[w, i] = SHARED
    for values in (row, sd, contrast):
        values[reason > 0] = np.nan
    return Centrelines(row, sd, contrast, reason)


def within_rows(lines: Iterable[Centrelines], rows: tuple[int, int] | None) -> Iterator[Centrelines]:
    """Centrelines between two rows, both included; None for all.

    Parameters
    ----------
    lines : iterable of Centrelines
        Blocks, written over.
    rows : (int, int) or None
        First and last row that count.

    Returns
    -------
    iterator of Centrelines
        The blocks; NaN outside.
    """
    for block in lines:
        if rows is not None:
            outside = ~((block.row >= rows[0]) & (block.row <= rows[1]))
            few = np.count_nonzero(~outside, axis=2) < FEWEST
            block.reason[few & (block.reason == 0)] = HIDDEN
            for values in (block.row, block.sd, block.contrast):
                values[outside | few[..., None]] = np.nan
        yield block


def _one_line(one: Rows, other: Rows) -> bool:
    """Whether two whiskers were read on one line: which of them it is cannot be decided."""
    common = ~np.isnan(one) & ~np.isnan(other)
    return bool(np.count_nonzero(common) >= FEWEST and np.median(np.abs(one - other)[common]) < APART)
