"""Points and rectangles of an image, as commands take them."""

from __future__ import annotations

from math import ceil, isfinite, isnan
from pathlib import Path
from typing import Literal

from vibrissa.cli.shared.words.units import in_si
from vibrissa.errors import FormatError, MissingError, RangeError, ShapeError, TooFewError
from vibrissa.tables.quantity import number

Side = Literal["left", "right", "top", "bottom"]
Point = tuple[float, float]
Mark = tuple[int, float, float, str]


def points_of(texts: list[str] | None, option: str) -> tuple[Point, ...]:
    """Points written COLUMN,ROW.

    Parameters
    ----------
    texts, option
        As typed, and the option for messages.

    Returns
    -------
    tuple of (float, float)
        Columns and rows [pixels].
    """
    return tuple(_point(text, option) for text in texts or ())


def marks_of(texts: list[str] | None, table: Path | None) -> tuple[Mark, ...]:
    """Marks written FRAME,COLUMN,ROW,NAME, and those of a table.

    Parameters
    ----------
    texts : list of str, optional
        As typed.
    table : Path, optional
        CSV with the header ``frame,column,row,whisker``.

    Returns
    -------
    tuple of (int, float, float, str)
        Frames, columns and rows [pixels], names.

    Raises
    ------
    InputError
        If a text or the table is another.
    """
    from vibrissa.tables.reader import read_table
    from vibrissa.tables.units import PURE, TEXT

    columns = {"frame": PURE, "column": PURE, "row": PURE, "whisker": TEXT}
    found = [_mark(text.split(",", 3), "--mark", repr(text)) for text in texts or ()]
    if table is not None:
        for here, row in read_table(table, columns).rows():
            words = [row[name] for name in columns]
            found.append(_mark(words, here, ",".join(words)))
        if len(found) == len(texts or ()):
            raise TooFewError("--mark-file", "must hold at least one mark", str(table))
    return tuple(found)


def line_of(texts: list[str] | None, option: str) -> tuple[Point, Point] | None:
    """Two points, or none.

    Parameters
    ----------
    texts, option
        As typed, and the option for messages.

    Returns
    -------
    tuple or None
        The two points [pixels].

    Raises
    ------
    InputError
        If there is another number of points.
    """
    points = points_of(texts, option)
    if len(points) not in (0, 2):
        raise MissingError(option, "must be given twice, a point of the line each", len(points))
    if points and points[0] == points[1]:
        raise RangeError(option, "must be two points apart from each other", " ".join(texts or ()))
    return (points[0], points[1]) if points else None


def pixels_of(text: str | None, option: str) -> tuple[int, int, int, int] | None:
    """A rectangle written C0,R0,C1,R1.

    Parameters
    ----------
    text, option
        As typed, and the option for messages.

    Returns
    -------
    tuple of int or None
        First column and row, last column and row.

    Raises
    ------
    InputError
        If the text is another.
    """
    if text is None:
        return None
    try:
        column, row, last_column, last_row = map(int, text.split(","))
    except ValueError:
        raise ShapeError(option, "must be C0,R0,C1,R1", repr(text), f"for example {option} 20,10,480,300") from None
    return column, row, last_column, last_row


def frame_of(text: str | None, option: str, frame_rate: float | None) -> int | None:
    """Number of a frame, or of the first one at or after a time.

    Parameters
    ----------
    text, option
        As typed, ``200`` or ``0.1s``, and the option for messages.
    frame_rate : float, optional
        Of the acquisition [Hz]; NaN where it is not known either.

    Returns
    -------
    int or None
        From 0.

    Raises
    ------
    InputError
        If the text is neither, or a time is given and the frame rate is not known.
    """
    if text is None:
        return None
    if text.isdecimal():
        return int(text)
    if number(text) is not None:
        raise FormatError(
            option, "must be the number of a frame, or a time with its unit", text, f"write {option} 0.1s"
        )
    time = in_si(text, option, "duration")
    if frame_rate is None or isnan(frame_rate):
        raise MissingError("--frame-rate", f"must be given where {option} is a time")
    return ceil(time * frame_rate - 1e-6)


def _point(text: str, option: str) -> Point:
    try:
        column, row = map(float, text.split(","))
    except ValueError:
        raise ShapeError(option, "must be COLUMN,ROW", repr(text), f"for example {option} 120,187") from None
    if not (isfinite(column) and isfinite(row)):
        raise RangeError(option, "must be two finite numbers, COLUMN,ROW", repr(text))
    return column, row


def _mark(words: list[str], option: str, shown: str) -> Mark:
    try:
        frame, column, row, name = words
        number, place = int(frame), (float(column), float(row))
    except ValueError:
        raise ShapeError(option, "must be FRAME,COLUMN,ROW,NAME", shown, "for example --mark 0,120,187,C2") from None
    if number < 0 or not all(map(isfinite, place)) or not name.strip():
        raise RangeError(option, "must have a frame from 0 on, a point and a name", shown)
    return number, *place, name.strip()
