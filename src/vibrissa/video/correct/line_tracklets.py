"""Tracklets of all lines of a movie, with or without a name: what is plainly one line from frame to frame."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.video.link.whisker_linking import Linking


def line_tracklets(linking: Linking) -> Integers:
    """Tracklet of each segment.

    Parameters
    ----------
    linking : Linking
        A movie whose lines are linked.

    Returns
    -------
    (S,) array of int
        Numbered from 0; a line that is nowhere plainly linked is one by itself.
    """
    name = np.full(linking.pieces.frame.size, -1)
    for solution in linking.solutions:
        found = solution.tracklet
        name = np.where(found >= 0, found + name.max(initial=-1) + 1, name)
    alone = np.flatnonzero(name < 0)
    name[alone] = name.max(initial=-1) + 1 + np.arange(alone.size)
    return name
