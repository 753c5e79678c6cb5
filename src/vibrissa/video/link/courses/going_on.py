"""Whether one piece of a line goes on as another does."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array

SIDEWAYS, ASLANT = 3.0, 0.3  # leap across the line from one piece to the next at most: [px], and over the gap
ARM = 20  # points at the end of a piece that show where it goes on


def goes_on(former: Array, later: Array) -> bool:
    """Whether a piece lies where another one goes on, and that one where this one comes from.

    Parameters
    ----------
    former, later : (n, 2) and (m, 2) arrays
        Points of both [px, at the size of linking], the former up to the gap between them, the later from there on.

    Returns
    -------
    bool
        True where the later one has less than two points.
    """
    if len(later) < 2:
        return True
    leap = later[0] - former[-1]
    most = SIDEWAYS + ASLANT * float(np.hypot(*leap))
    off = sorted(_aside(leap, end[-1] - end[0]) for end in (former[-ARM:], later[:ARM]))
    return off[0] <= most and off[1] <= 2 * most


def _aside(leap: Array, along: Array) -> float:
    """Length of a leap across a direction."""
    return float(abs(along[0] * leap[1] - along[1] * leap[0]) / max(np.hypot(*along), 1e-9))
