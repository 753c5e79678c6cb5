"""Lines that may go on from marked ones, however far the whisker has strayed there."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.whisker_models import Model
from vibrissa.video.link.pad.common_swing import REACH
from vibrissa.video.link.pad.pads import Lines

FARTHEST = 25  # frames from a mark
STEP = 6.0  # distance of two lines of it at most, from one frame to the next, in standard deviations


def going_on(
    model: Model, lines: Lines, frame: Integers, who: Integers, x: Array, marked: Integers, starts: Integers
) -> Integers:
    """In each frame before and after a marked line the one that is nearest to the last, until none is near.

    Parameters
    ----------
    model : Model
        The whisker.
    lines : Lines
        All lines.
    frame : (S,) array
        Frame of each segment.
    who : (n,) array of int
        Segments that can be a whisker's, by frames.
    x : (n, 3) array
        Their deviations from the whisker's place.
    marked : array of int
        All marked segments of the whisker.
    starts : array of int
        Those of them from which to go on, up to the next marked one.

    Returns
    -------
    array of int
        Those from which it started, and those that may go on from them.
    """
    bounds = np.searchsorted(frame[who], np.arange(frame.max() + 2))
    stops = set(frame[marked].tolist())
    found: set[int] = set(starts.tolist())
    for start, way in ((one, way) for one in np.flatnonzero(np.isin(who, starts)) for way in (1, -1)):
        last, missed = int(start), 0
        for t in _frames(frame[who[start]], way, bounds.size - 1):
            here = np.arange(bounds[t], bounds[t + 1])
            off = x[here] - x[last]
            spread = lines.covariance[who[here]] + lines.covariance[who[last]] + model.spread
            far = np.einsum("ni,nij,nj->n", off, np.linalg.inv(spread), off)
            near = here.size > 0 and far.min() < STEP**2
            last, missed = (int(here[far.argmin()]), 0) if near else (last, missed + 1)
            if t in stops or missed == REACH:
                break
            found |= {int(who[last])}
    return np.array(sorted(found), np.int64)


def _frames(start: int, way: int, count: int) -> range:
    """Frames on one side of a frame, as far as a mark reaches."""
    if way > 0:
        return range(start + 1, min(start + FARTHEST + 1, count))
    return range(start - 1, max(start - FARTHEST - 1, -1), -1)
