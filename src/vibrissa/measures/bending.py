"""Curvature of the free whisker as a function of its angle, and the change against it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Mask

BIN = np.radians(2.0)  # of angles: the free curvature changes little over it
LEAST_IN_BIN = 5  # frames of which a median is taken
BENT = 5.0  # robust standard deviations of the free whisker's curvature, above which it is bent
TRIED = 40  # frames through whose pairs lines are tried
COMPARED = 1000  # frames with which they are compared
ROUNDS = 3  # of fitting the line to the frames near it
MAD = 1.4826  # standard deviation of a normal variable over its median absolute deviation


class Bending(NamedTuple):
    """Bending in every frame; NaN where the whisker was not seen.

    Attributes
    ----------
    rest : (T,) array
        Curvature of the free whisker at the same angle [1/m].
    held : (T,) array
        1 where the angle lies beyond those of the free whisker, and the curvature at their end is taken; else 0.
    change : (T,) array
        Curvature less that at rest, Δκ [1/m].
    """

    rest: Array
    held: Array
    change: Array


def bending(angle: Array, curvature: Array, free: Mask) -> Bending:
    """Change of curvature against the free whisker, whose median curvature in bins of 2° of its angle is taken.

    The practice of [OConnor2010]_ and [Pammer2013]_: the curvature of a free whisker, as the camera sees it, changes
    with its angle, as the whisker rolls and leaves the plane; that is not bending. Between the bins the medians are
    joined by straight lines.

    Parameters
    ----------
    angle, curvature : (T,) arrays
        At the base [rad], [1/m]; NaN where not measured.
    free : (T,) array of bool
        Frames in which the whisker touches nothing.

    Returns
    -------
    Bending
        All NaN if no bin has five free frames.
    """
    known = np.isfinite(angle) & np.isfinite(curvature)
    places, medians = _medians(angle[known & free], curvature[known & free])
    if not places.size:
        return Bending(*(np.full(angle.size, np.nan) for _ in Bending._fields))
    rest = np.where(known, np.interp(angle, places, medians), np.nan)
    beyond = (angle < places[0] - BIN) | (angle > places[-1] + BIN)
    return Bending(rest, np.where(known, beyond * 1.0, np.nan), curvature - rest)


def bent_frames(angle: Array, curvature: Array) -> Mask:
    """Frames in which the whisker is bent, where it is free in more than half of the frames.

    The curvature of the free whisker is taken for a straight line in its angle, so that frames at angles at which it
    always touches are judged too. It is the line whose median distance to the frames is least, which up to half of the
    frames cannot move. Frames beyond five robust standard deviations from it are bent.

    Parameters
    ----------
    angle, curvature : (T,) arrays
        At the base [rad], [1/m]; NaN where not measured.

    Returns
    -------
    (T,) array of bool
        True where it is bent.
    """
    known = np.flatnonzero(np.isfinite(angle) & np.isfinite(curvature))
    if known.size < 2 * LEAST_IN_BIN:
        return np.zeros(angle.size, bool)
    slope, level = _free_line(angle[known], curvature[known])
    for _ in range(ROUNDS):
        off = np.abs(curvature[known] - level - slope * angle[known])
        near = off <= BENT / 2 * MAD * np.median(off)
        slope, level = _line(angle[known][near], curvature[known][near])
    off = np.abs(curvature - level - slope * angle)
    return np.asarray(off > BENT * MAD * np.nanmedian(off))


def _free_line(angle: Array, curvature: Array) -> tuple[float, float]:
    """Slope and level of the line through two frames that has the least median distance to all (least median)."""
    some, among = (slice(None, None, -(-angle.size // count)) for count in (TRIED, COMPARED))
    i, j = np.triu_indices(angle[some].size, 1)
    apart = np.abs(angle[some][j] - angle[some][i]) > np.ptp(angle) / 10
    i, j = i[apart], j[apart]
    if not i.size:
        return 0.0, float(np.median(curvature))
    slope = (curvature[some][j] - curvature[some][i]) / (angle[some][j] - angle[some][i])
    level = curvature[some][i] - slope * angle[some][i]
    off = np.abs(curvature[among] - level[:, None] - slope[:, None] * angle[among])
    best = int(np.median(off, axis=1).argmin())
    return float(slope[best]), float(level[best])


def _line(angle: Array, curvature: Array) -> tuple[float, float]:
    """Slope and level of the regression; of angles that are all the same the slope is 0."""
    centred = angle - angle.mean()
    square = float(centred @ centred)
    slope = float(centred @ curvature) / square if square > 0 else 0.0
    return slope, float(curvature.mean() - slope * angle.mean())


def _medians(angle: Array, curvature: Array) -> tuple[Array, Array]:
    """Median angle and curvature of each bin with enough frames, by growing angle."""
    number = np.floor((angle - angle.min(initial=np.inf)) / BIN).astype(int)
    bins = [number == one for one in np.unique(number)]
    full = [one for one in bins if one.sum() >= LEAST_IN_BIN]
    return np.array([np.median(angle[one]) for one in full]), np.array([np.median(curvature[one]) for one in full])
