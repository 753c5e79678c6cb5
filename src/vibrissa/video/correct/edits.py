"""Edits of linked whiskers: what each kind needs, from and to plain values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from vibrissa.errors import FormatError, MissingError, RangeError, UnknownError

NEEDS: dict[str, tuple[str, ...]] = {
    "name": ("at", "whisker"),
    "mark": ("at", "whisker"),
    "join": ("at", "to"),
    "split": ("at",),
    "delete": ("at",),
    "swap": ("frame", "whiskers"),
}
WHOLE = ("name", "delete")  # kinds that may concern all pieces of the whisker


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
    do : {"name", "mark", "join", "split", "delete", "swap"}
        The piece at a point is a whisker; the line at a point is a whisker in this frame; the pieces at two points are
        one whisker; the name of the piece at a point ends before this frame; the piece is no whisker; two whiskers
        exchange names from a frame on.
    at, to : LinePoint, optional
        Points on lines.
    whisker : int, optional
        Number of the whisker, from 0; the number of whiskers makes a new one.
    frame : int, optional
        First frame of a swap.
    whiskers : (int, int), optional
        That are swapped.
    whole : bool
        The edit concerns all pieces of the whisker.
    """

    do: str
    at: LinePoint | None = None
    to: LinePoint | None = None
    whisker: int | None = None
    frame: int | None = None
    whiskers: tuple[int, int] | None = None
    whole: bool = False


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
    allowed = ("do", *NEEDS[kind], *(("whole",) if kind in WHOLE else ()))
    for name in values:
        if name not in allowed:
            rule = f"must not be given for {kind}"
            raise UnknownError(f"{thing}, {str(name)[:40]}", rule, remedy=f"it has {', '.join(allowed)}")
    read: dict[str, Any] = {"do": kind}
    for name in NEEDS[kind]:
        if name not in values:
            raise MissingError(f"{thing}, {name}", f"must be given for {kind}")
        read[name] = _READERS[name](values[name], f"{thing}, {name}")
    if not isinstance(values.get("whole", False), bool):
        raise FormatError(f"{thing}, whole", "must be true or false", repr(values["whole"])[:60])
    return Edit(**read, whole=values.get("whole", False))


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
    return values | ({"whole": True} if edit.whole else {})


def _count(value: object, thing: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise RangeError(thing, "must be a whole number from 0", repr(value)[:60])
    return value


def _point(value: Any, thing: str) -> LinePoint:
    whole = isinstance(value, list | tuple) and len(value) == 3
    if not whole or not all(isinstance(x, int | float) and math.isfinite(x) for x in value):
        raise FormatError(thing, "must be [frame, column, row]", repr(value)[:60])
    return LinePoint(_count(value[0], thing), float(value[1]), float(value[2]))


def _pair(value: object, thing: str) -> tuple[int, int]:
    if not isinstance(value, list | tuple) or len(value) != 2 or value[0] == value[1]:
        raise FormatError(thing, "must be two different whiskers", repr(value)[:60])
    return _count(value[0], thing), _count(value[1], thing)


_READERS = {"at": _point, "to": _point, "whisker": _count, "frame": _count, "whiskers": _pair}
