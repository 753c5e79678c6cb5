"""Which line of a movie a point is on."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError

REACH = 6.0  # distance of a point from the line that it is on at most [px]


def line_at(
    frame: Integers, start: Integers, column: Array, row: Array, point: tuple[int, float, float], thing: str, value: str
) -> int:
    """Line that a point is on: the nearest one of its frame.

    Parameters
    ----------
    frame, start : (S,) arrays of int
        Frame and first point of each line; at least one.
    column, row : (P,) arrays
        Points of all lines [px].
    point : (frame, column, row)
        The point.
    thing, value : str
        What the point is, and how it is written, for errors.

    Returns
    -------
    int
        The line.

    Raises
    ------
    InputError
        If no line is near; the error says where the nearest one is, in its frame, or in the nearest frame with lines.
    """
    nearest = frame[np.argmin(np.abs(frame - point[0]))]
    here = np.flatnonzero(frame == nearest)
    ends = np.append(start, column.size)
    first, stop = ends[here[0]], ends[here[-1] + 1]
    off = np.hypot(column[first:stop] - point[1], row[first:stop] - point[2])
    best = first + int(np.argmin(off))
    if nearest != point[0] or off.min() > REACH:
        place = f"column {column[best]:.1f}, row {row[best]:.1f}, {off.min():.1f} px away"
        rule, remedy = f"must lie within {REACH:g} px of a line of its frame", f"passes at {place}"
        raise RangeError(thing, rule, value, f"the nearest line of frame {nearest} {remedy}")
    return int(np.searchsorted(start, best, side="right") - 1)
