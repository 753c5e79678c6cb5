"""Tracklets of all lines of a movie, with or without a name: what is plainly one line from frame to frame."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.common_swing import pairs_of
from vibrissa.video.link.exclusion import Solution
from vibrissa.video.link.tracklets import expected, tracklets
from vibrissa.video.link.whisker_linking import Linking


def line_tracklets(linking: Linking) -> Integers:
    """Tracklet of each segment.

    Parameters
    ----------
    linking : Linking
        A movie whose lines are linked: it gives the pad's swing from frame to frame.

    Returns
    -------
    (S,) array of int
        Numbered from 0; a line that is nowhere plainly linked is one by itself.
    """
    name = np.full(linking.pieces.frame.size, -1)
    for pad, solution in enumerate(linking.solutions):
        found = _of_pad(linking, pad, solution)
        name = np.where(found >= 0, found + name.max(initial=-1) + 1, name)
    alone = np.flatnonzero(name < 0)
    name[alone] = name.max(initial=-1) + 1 + np.arange(alone.size)
    return name


def _of_pad(linking: Linking, pad: int, solution: Solution) -> Integers:
    """Tracklets of the lines of one pad, −1 for all others."""
    frame, lines = linking.pieces.frame, linking.lines
    usable = np.isin(np.arange(frame.size), solution.who)
    across = np.where(usable, lines.place[:, 1], 0.0)
    pairs = pairs_of(
        linking.pieces.frames, frame, solution.who, lines.place, lines.covariance, lines.strength, linking.lever(pad)
    )
    swing = np.stack([np.diff(_phase(solution)), np.zeros(solution.frames - 1)], axis=1)
    off = (pairs.swing - expected(frame, pairs, swing, across)) / pairs.sd
    return tracklets(frame, pairs, 0.5 * (pairs.unlike + off**2), usable)


def _phase(solution: Solution) -> Array:
    """Phase of the pad in each frame [°]."""
    phase = np.full(solution.frames, np.nan)
    phase[solution.frame] = solution.phase
    known = np.flatnonzero(np.isfinite(phase))
    return np.interp(np.arange(solution.frames), known, phase[known])
