"""Marks of a user on lines: which line is meant, and which of the whiskers that were linked has the mark's name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, MissingError, RangeError
from vibrissa.quantities.identity import SURE
from vibrissa.video.link.known.known_lines import LineNames
from vibrissa.video.link.known.known_names import chains_of, gone_on, names_with
from vibrissa.video.link.known.renamed_linking import RenamedLinking, line_names, with_names
from vibrissa.video.link.line_at import line_at
from vibrissa.video.link.whisker_linking import Linking

if TYPE_CHECKING:
    import xarray as xr


LEAST = 0.05  # weight of a mark on a line whose name is unsure


class LineMark(NamedTuple):
    """A point of a whisker in any frame.

    Attributes
    ----------
    frame : int
        Frame of the movie, from 0.
    column, row : float
        The point, in the image as the user sees it [px].
    whisker : str
        Name of the whisker; marks of one name are of one whisker.
    """

    frame: int
    column: float
    row: float
    whisker: str


def snapped(segments: xr.Dataset, mark: LineMark) -> int:
    """Segment that a mark lies on.

    Parameters
    ----------
    segments : Dataset
        ``segments``, from :func:`vibrissa.video.find.movie_segments.find_segments`.
    mark : LineMark
        The mark; the nearest line within 6 px is meant.

    Returns
    -------
    int
        The segment.

    Raises
    ------
    InputError
        If the frame is not searched, the mark lies outside the image, or no line is near; the error says where the
        nearest one is, in its frame, or in the nearest frame with lines.
    """
    first, count = int(segments.attrs.get("first_frame", 0)), int(segments.attrs["frames"])
    require_in_movie(mark, (first, first + count), (segments.attrs["width"], segments.attrs["height"]))
    frames, start = segments.segment_frame.values, segments.segment_start.values
    if not frames.size:
        raise MissingError("mark", "must be in a movie with lines", _written(mark))
    column, row = segments.column.values, segments.row.values
    return line_at(frames, start, column, row, mark[:3], "mark", _written(mark))


def require_in_movie(mark: LineMark, frames: tuple[int, int], size: tuple[int, int]) -> None:
    """Refuse a mark that lies in no frame.

    Parameters
    ----------
    mark : LineMark
        The mark.
    frames : (first, stop)
        First frame that is searched, and the first after it that is not.
    size : (width, height)
        Of the image [px].

    Raises
    ------
    InputError
        If the frame is not searched, or the mark lies outside the image.
    """
    (first, stop), (width, height) = frames, size
    if not first <= mark.frame < stop:
        remedy = "frames count from 0, the movie's first" if mark.frame == stop else ""
        raise RangeError("mark", f"must be in a frame from {first} to {stop - 1}", _written(mark), remedy)
    if not (0 <= mark.column <= width - 1 and 0 <= mark.row <= height - 1):
        raise RangeError("mark", f"must lie in the image of {width} × {height} pixels", _written(mark))


def _written(mark: LineMark) -> str:
    return f"frame {mark.frame}, column {mark.column:g}, row {mark.row:g} ({mark.whisker})"


def marked_lines(segments: xr.Dataset, marks: Sequence[LineMark]) -> list[int]:
    """Segments that marks lie on.

    Parameters
    ----------
    segments : Dataset
        As :func:`snapped` takes them.
    marks : sequence of LineMark
        The marks.

    Returns
    -------
    list of int
        The segment of each.

    Raises
    ------
    InputError
        If a mark is on no line, or two names mark one line.
    """
    lines = [snapped(segments, mark) for mark in marks]
    named: dict[int, LineMark] = {}
    for line, mark in zip(lines, marks, strict=True):
        other = named.setdefault(line, mark)
        if other.whisker != mark.whisker:
            rule = f"must not give a line a second name; {_written(other)} is on the same line"
            raise ConflictError("mark", rule, _written(mark), "leave one of the two out")
    return lines


def apply_marks(
    linking: Linking, segments: xr.Dataset, marks: Sequence[LineMark]
) -> tuple[RenamedLinking, dict[str, int], list[str]]:
    """Give names to the whiskers of a linking, and correct it where the marks say otherwise.

    Each name goes to the whisker that has most of its marks, or whose lines go on as the marked ones; a line counts by
    how sure its name is. The lines of all its marks are then that whisker's, and the names about them are put right.

    Parameters
    ----------
    linking : Linking
        Of the segments.
    segments : Dataset
        As :func:`snapped` takes them, in the order of the linking.
    marks : sequence of LineMark
        The marks.

    Returns
    -------
    RenamedLinking
        The linking with the names after all marks.
    dict
        Number of the whisker in the linking by its name, in the order of the marks.
    list of str
        Remarks on names whose marks are on lines of several whiskers.

    Raises
    ------
    InputError
        If a mark is on no line, two names mark one line, or a name is on no whisker that was linked.
    """
    lines = marked_lines(segments, marks)
    chains, linked = chains_of(linking), line_names(linking)
    known: dict[int, int] = {}
    owner, said = _owners_of_names(linking, linked, lines, marks)
    for line, mark in zip(lines, marks, strict=True):
        whisker = owner[mark.whisker]
        if line not in linking.solutions[chains.roster[whisker][0]].who:
            raise RangeError("mark", "must be on a line of the pad of its whisker", _written(mark))
        chains, linked = names_with(chains, linked, np.array([line]), whisker, known)
        known[line] = whisker
    return with_names(linking, linked, linking.whiskers), owner, said


def _owners_of_names(
    linking: Linking, linked: LineNames, lines: Sequence[int], marks: Sequence[LineMark]
) -> tuple[dict[str, int], list[str]]:
    """Whisker of each name, and remarks on names whose marks are on lines of several."""
    names = list(dict.fromkeys(mark.whisker for mark in marks))
    votes = np.zeros((len(names), max(linking.whiskers, len(names))))
    for line, mark in zip(lines, marks, strict=True):
        named = int(linked.whisker[line])
        who = named if named >= 0 else gone_on(linking, linked, line)
        if who >= 0:
            sure = linked.sure[line] if named >= 0 else SURE
            votes[names.index(mark.whisker), who] += max(2 * float(sure) - 1, LEAST)
    owner = dict(zip(names, _owners(votes), strict=True))
    said = [
        f"marks of {name} are on lines of {(own > 0).sum()} whiskers; it is the one whose names are surest there"
        for name, own in zip(names, votes, strict=True)
        if (own > 0).sum() > 1
    ]
    for mark in marks:
        if owner[mark.whisker] < 0:
            rule = "must be on a line of a whisker, or on one that goes on from its lines, and that no other name has"
            remedy = f"mark {mark.whisker} also in a frame in which its line has a name"
            raise ConflictError("mark", rule, _written(mark), remedy)
    return owner, said


def _owners(votes: Array) -> list[int]:
    """Whisker of each name (names, whiskers), so that most marks agree; −1 for a name without one."""
    row, column = linear_sum_assignment(-votes)
    return [int(who) if votes[name, who] else -1 for name, who in zip(row, column, strict=True)]
