"""Edits of linked whiskers: what each kind needs, from and to plain values."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError, UnknownError

NEEDS: dict[str, tuple[str, ...]] = {
    "name": ("at", "whisker"),
    "mark": ("at", "whisker"),
    "join": ("at", "to"),
    "split": ("at",),
    "delete": ("at",),
    "swap": ("frame", "whiskers"),
    "call": ("whisker", "label"),
}
MAY: dict[str, tuple[str, ...]] = {"name": ("whole",), "delete": ("whole", "alone")}  # what it concerns, if not a piece
LONGEST = 40  # characters of a label


class LinePoint(NamedTuple):
    """A point on a line: frame from 0, column and row [px]."""

    frame: int
    column: float
    row: float


@dataclass(frozen=True, kw_only=True)
class Edit:
    """One decision by hand.

    Attributes
    ----------
    do : {"name", "mark", "join", "split", "delete", "swap", "call"}
        The piece at a point is a whisker; the line at a point is a whisker in this frame; the pieces at two points are
        one whisker; the name of the piece at a point ends before this frame; the piece is no whisker; two whiskers
        exchange names from a frame on; a whisker has a label.
    at, to : LinePoint, optional
        Points on lines.
    whisker : int, optional
        Number of the whisker, from 0; the number of whiskers makes a new one.
    frame : int, optional
        First frame of a swap.
    whiskers : (int, int), optional
        That are swapped.
    label : str, optional
        What the whisker is called, such as C2; nothing takes its name away.
    whole : bool
        The edit concerns all pieces of the whisker.
    alone : bool
        It concerns the line at the point alone.
    """

    do: str
    at: LinePoint | None = None
    to: LinePoint | None = None
    whisker: int | None = None
    frame: int | None = None
    whiskers: tuple[int, int] | None = None
    label: str | None = None
    whole: bool = False
    alone: bool = False


def edit_of(values: object, thing: str) -> Edit:
    """An edit from plain values, checked.

    Parameters
    ----------
    values : object
        Mapping of the edit's fields, points as [frame, column, row].
    thing : str
        What it is, for errors.

    Returns
    -------
    Edit
        The edit.

    Raises
    ------
    InputError
        Names the first field that is missing, unknown or bad.
    """
    if not isinstance(values, Mapping):
        raise FormatError(thing, "must be an object with 'do' and its fields", repr(values)[:60])
    kind = values.get("do")
    if not isinstance(kind, str) or kind not in NEEDS:
        raise UnknownError(f"{thing}, do", f"must be one of {', '.join(NEEDS)}", repr(kind)[:60])
    may = MAY.get(kind, ())
    allowed = ("do", *NEEDS[kind], *may)
    for name in values:
        if name not in allowed:
            rule = f"must not be given for {kind}"
            raise UnknownError(f"{thing}, {str(name)[:40]}", rule, remedy=f"it has {', '.join(allowed)}")
    read: dict[str, Any] = {"do": kind}
    for name in NEEDS[kind]:
        if name not in values:
            raise MissingError(f"{thing}, {name}", f"must be given for {kind}")
        read[name] = _READERS[name](values[name], f"{thing}, {name}")
    for name in may:
        read[name] = values.get(name, False)
        if not isinstance(read[name], bool):
            raise FormatError(f"{thing}, {name}", "must be true or false", repr(read[name])[:60])
    if read.get("whole") and read.get("alone"):
        raise ConflictError(f"{thing}, alone", "must not be given with whole")
    return Edit(**read)


def plain_edit(edit: Edit) -> dict[str, Any]:
    """Plain values of an edit, which :func:`edit_of` reads.

    Parameters
    ----------
    edit : Edit
        The edit.

    Returns
    -------
    dict
        Fields that its kind needs; pixels to a hundredth.
    """
    values: dict[str, Any] = {"do": edit.do}
    for name in NEEDS[edit.do]:
        value = getattr(edit, name)
        if isinstance(value, LinePoint):
            value = [value.frame, round(value.column, 2), round(value.row, 2)]
        values[name] = list(value) if isinstance(value, tuple) else value
    return values | {name: True for name in MAY.get(edit.do, ()) if getattr(edit, name)}


def _count(value: object, thing: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise RangeError(thing, "must be a whole number from 0", repr(value)[:60])
    return value


def _point(value: Any, thing: str) -> LinePoint:
    whole = isinstance(value, list | tuple) and len(value) == 3
    if not whole or not all(isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) for x in value):
        raise FormatError(thing, "must be [frame, column, row]", repr(value)[:60])
    return LinePoint(_count(value[0], thing), float(value[1]), float(value[2]))


def _pair(value: object, thing: str) -> tuple[int, int]:
    if not isinstance(value, list | tuple) or len(value) != 2 or value[0] == value[1]:
        raise FormatError(thing, "must be two different whiskers", repr(value)[:60])
    return _count(value[0], thing), _count(value[1], thing)


def _label(value: object, thing: str) -> str:
    text = value.strip() if isinstance(value, str) else ""
    bad = not isinstance(value, str) or len(text) > LONGEST or not text.isprintable()
    bare = text.removeprefix("whisker ")
    if bad or re.fullmatch(r"[-+\d.]+", bare) or _is_number(bare):
        rule = f"must be a name of at most {LONGEST} characters that is no number, or nothing"
        raise FormatError(thing, rule, repr(value)[:60], "for example C2")
    return text


def _is_number(text: str) -> bool:
    """Whether a table of names would be read with a number here: also 1e0 and nan."""
    try:
        float(text)
    except ValueError:
        return False
    return True


_READERS = {
    "at": _point,
    "to": _point,
    "whisker": _count,
    "frame": _count,
    "whiskers": _pair,
    "label": _label,
}
