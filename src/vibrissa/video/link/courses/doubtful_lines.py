"""Lines cut, before whiskers are known, where they may go over from one whisker to another."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.courses.cut_lines import Cut
from vibrissa.video.link.courses.meetings import DRAWN, SHORTEST, meetings
from vibrissa.video.link.courses.smooth_curve import scatter
from vibrissa.video.link.pad.pieces import Pieces

DOUBT = 30.0  # fall of the misfit from which on a line is cut


def doubtful_lines(pieces: Pieces) -> Cut:
    """Cut the lines of all frames where another line's end, continued, fits better than what comes before.

    Most of these lines are one whisker's nevertheless; their pieces can be put together when whiskers are known. Lines
    of two whiskers mislead the linking.

    Parameters
    ----------
    pieces : Pieces
        Segments of the movie.

    Returns
    -------
    Cut
        All points of all lines.
    """
    width = float(np.median(pieces.width))
    sd = scatter(pieces)
    points = np.stack([pieces.column, pieces.row], axis=1)
    bounds = np.append(pieces.start, pieces.stop[-1])
    # first segment of each frame that has any
    frames = np.append(np.flatnonzero(np.diff(pieces.frame, prepend=-1)), pieces.frame.size)
    places = [pieces.start]
    for first, stop in pairwise(frames):
        part = slice(bounds[first], bounds[stop])
        places.append(
            bounds[first] + _doubtful(points[part], sd[part], bounds[first : stop + 1] - bounds[first], width)
        )
    start = np.sort(np.concatenate(places))
    return Cut(np.arange(points.shape[0]), start, pieces.owner[start])


def _doubtful(points: Array, sd: Array, ends: Integers, width: float) -> Integers:
    """Points of a frame at which a line is cut, the most doubtful first, and no two near each other."""
    apart, chosen = (DRAWN + SHORTEST) * width, np.zeros(0, np.int64)
    for _, place, gain in sorted(meetings(points, sd, ends, width), key=lambda one: -one[2]):
        if gain < DOUBT:
            break
        if np.all(np.abs(chosen - place) >= apart):
            chosen = np.append(chosen, place)
    return chosen
