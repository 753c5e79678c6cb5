"""What each kind of edit decides: a new table of decisions, and a line that says so."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.errors import ConflictError, RangeError, TooFewError
from vibrissa.video.correct.decisions import GONE, NOBODY, Decisions, Lying, beside
from vibrissa.video.correct.edits import Edit, LinePoint


class Board(NamedTuple):
    """What an edit is made on.

    Attributes
    ----------
    whiskers : int
        Number of whiskers.
    whisker, piece : (S,) arrays of int
        Name, −1 for none, and piece of each segment.
    decisions : Decisions
        Made before.
    lying : Lying
        The segments.
    find : callable
        Segment at a point; it raises an InputError where there is none.
    labels : dict
        What whiskers are called, by their numbers.
    """

    whiskers: int
    whisker: Integers
    piece: Integers
    decisions: Decisions
    lying: Lying
    find: Callable[[LinePoint], int]
    labels: Mapping[int, str]


Moved = tuple[Decisions, str]


def moved(board: Board, edit: Edit) -> Moved:
    """Decisions after an edit, and what it did in one line.

    Parameters
    ----------
    board : Board
        What it is made on; it is not changed.
    edit : Edit
        The edit.

    Returns
    -------
    Decisions, str
        The new decisions.

    Raises
    ------
    InputError
        If no line is at a point of the edit, or it makes no sense on this board.
    """
    return _MOVES[edit.do](board, edit)


def _piece_at(board: Board, point: LinePoint | None, whole: bool = False, alone: bool = False) -> Integers:
    """Segments of the piece at a point, or of all pieces of its whisker, or the one at the point alone."""
    assert point is not None
    segment = board.find(point)
    if alone:
        return np.array([segment])
    if whole and board.whisker[segment] >= 0:
        return np.flatnonzero(board.whisker == board.whisker[segment])
    return np.flatnonzero(board.piece == board.piece[segment])


def _called(board: Board, segments: Integers, whole: bool = False) -> str:
    """How a piece, or a whole whisker, is called in a message."""
    frame, whisker = board.lying.frame[segments], board.whisker[segments[0]]
    of = f"of whisker {whisker}" if whisker >= 0 else "without a name"
    a, b = frame.min(), frame.max()
    what = "the whole" if whole and whisker >= 0 else "the piece"
    return f"{what} {of}, " + (f"frame {a}" if a == b else f"frames {a} to {b}")


def _whisker(board: Board, edit: Edit) -> int:
    """Number of the whisker of an edit, one that exists or the next one."""
    assert edit.whisker is not None
    if edit.whisker > board.whiskers:
        rule = f"must be one of 0 to {board.whiskers - 1}, or {board.whiskers} for a new one"
        raise RangeError("whisker", rule, edit.whisker)
    return edit.whisker


def _known_whisker(board: Board, edit: Edit) -> int:
    """Number of the whisker of an edit, one that exists."""
    whisker = _whisker(board, edit)
    if whisker == board.whiskers:
        rule, remedy = f"must be one of 0 to {board.whiskers - 1}", "name a piece to make a new one"
        raise RangeError("whisker", rule, whisker, remedy)
    return whisker


def _given(board: Board, segments: Integers, whisker: int) -> Decisions:
    """Segments held as a whisker's; others that were held as the same one beside them lose their name."""
    held, group = (one.copy() for one in board.decisions)
    rivals = np.setdiff1d(np.flatnonzero(held == whisker), segments)
    lost = rivals[beside(board.lying, rivals, segments)]
    held[lost], group[lost] = NOBODY, _next_group(board)
    held[segments], group[segments] = whisker, -1
    return Decisions(held, group)


def _next_group(board: Board) -> int:
    return int(board.decisions.group.max(initial=-1)) + 1


def _name(board: Board, edit: Edit) -> Moved:
    segments, whisker = _piece_at(board, edit.at, edit.whole), _whisker(board, edit)
    new = " (new)" if whisker == board.whiskers else ""
    return _given(board, segments, whisker), f"{_called(board, segments, edit.whole)}, is whisker {whisker}{new}"


def _mark(board: Board, edit: Edit) -> Moved:
    assert edit.at is not None
    whisker = _known_whisker(board, edit)
    segments = np.array([board.find(edit.at)])
    return _given(board, segments, whisker), f"the line in frame {edit.at.frame} is whisker {whisker}"


def _join(board: Board, edit: Edit) -> Moved:
    one, other = _piece_at(board, edit.at), _piece_at(board, edit.to)
    if board.piece[one[0]] == board.piece[other[0]]:
        raise ConflictError("join", "must be of two pieces", "the same piece twice")
    both = one[beside(board.lying, one, other)]
    if both.size:
        frames = np.unique(board.lying.frame[both])
        rule = "must be of pieces that do not lie beside one another in a frame"
        such = f"{frames.size} such frame{'s' * (frames.size > 1)}, the first {frames[0]}"
        raise ConflictError("join", rule, such, "split one before")
    together = np.concatenate([one, other])
    names = [board.whisker[part[0]] for part in (other, one) if board.whisker[part[0]] >= 0]
    said = f"{_called(board, one)}, and {_called(board, other)}, are one"
    if names:
        return _given(board, together, int(names[0])), f"{said}: whisker {names[0]}"
    held, group = (one.copy() for one in board.decisions)
    group[together] = _next_group(board)
    return Decisions(held, group), said


def _split(board: Board, edit: Edit) -> Moved:
    assert edit.at is not None
    segments = _piece_at(board, edit.at)
    rest = segments[board.lying.frame[segments] >= edit.at.frame]
    if rest.size == segments.size:
        first = int(board.lying.frame[segments].min())
        rule, remedy = "must be after the first frame of the piece", "go to the frame in which the name is wrong"
        raise RangeError("split", rule, first, remedy)
    held, group = (one.copy() for one in board.decisions)
    if board.whisker[rest[0]] >= 0:
        held[rest] = NOBODY
    group[rest] = _next_group(board)
    return Decisions(held, group), f"{_called(board, segments)}, ends before frame {edit.at.frame}"


def _delete(board: Board, edit: Edit) -> Moved:
    segments = _piece_at(board, edit.at, edit.whole, edit.alone)
    held, group = (one.copy() for one in board.decisions)
    held[segments], group[segments] = GONE, _next_group(board)
    what = _called(board, segments, edit.whole)
    return Decisions(held, group), f"{what.replace('piece', 'line') if edit.alone else what}, is no whisker"


def _swap(board: Board, edit: Edit) -> Moved:
    assert edit.whiskers is not None
    assert edit.frame is not None
    a, b = edit.whiskers
    if max(a, b) >= board.whiskers:
        raise RangeError("whiskers", f"must be two of 0 to {board.whiskers - 1}", f"{a} and {b}")
    later = board.lying.frame >= edit.frame
    first, second = later & (board.whisker == a), later & (board.whisker == b)
    if not (first | second).any():
        raise TooFewError("swap", "must be where one of the whiskers has a line later on", f"frame {edit.frame}")
    held, group = (one.copy() for one in board.decisions)
    held[later & (held == a)], held[later & (board.decisions.held == b)] = b, a
    return Decisions(held, group), f"whiskers {a} and {b} exchange names from frame {edit.frame} on"


def _call(board: Board, edit: Edit) -> Moved:
    assert edit.label is not None
    whisker = _known_whisker(board, edit)
    for other, label in board.labels.items():
        if other != whisker and label.lower() == edit.label.lower():
            rule, remedy = f"must not be that of whisker {other}", "upper and lower case are alike"
            raise ConflictError("name", rule, edit.label, remedy)
    return board.decisions, f"whisker {whisker} is called {edit.label or whisker}"


_MOVES: dict[str, Callable[[Board, Edit], Moved]] = {
    "name": _name,
    "mark": _mark,
    "join": _join,
    "split": _split,
    "delete": _delete,
    "swap": _swap,
    "call": _call,
}
