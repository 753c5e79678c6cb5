"""Curvature of the free whisker as a function of its angle, and the change against it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Mask

BIN = np.radians(2.0)  # of angles: the free curvature changes little over it
LEAST_IN_BIN = 5  # frames of which a median is taken
BENT = 5.0  # robust standard deviations of the free whisker's curvature, above which it is bent
ROUNDS = 10  # of finding free frames; they settle in two or three
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
    """Frames in which the whisker is bent, where it is free most of the time at most of its angles.

    Frames beyond five robust standard deviations of the free frames' Δκ are bent; the free whisker is what is left.

    Parameters
    ----------
    angle, curvature : (T,) arrays
        At the base [rad], [1/m]; NaN where not measured.

    Returns
    -------
    (T,) array of bool
        True where it is bent.
    """
    known = np.isfinite(angle) & np.isfinite(curvature)
    bent = np.zeros(angle.size, bool)
    for _ in range(ROUNDS):
        change = bending(angle, curvature, known & ~bent).change
        kept = np.abs(change[known & ~bent])
        if not np.isfinite(kept).any():
            break
        found = np.abs(np.nan_to_num(change)) > BENT * MAD * np.nanmedian(kept)
        if (found == bent).all():
            break
        bent = found
    return bent


def _medians(angle: Array, curvature: Array) -> tuple[Array, Array]:
    """Median angle and curvature of each bin with enough frames, by growing angle."""
    number = np.floor(angle / BIN).astype(int)
    bins = [number == one for one in np.unique(number)]
    full = [one for one in bins if one.sum() >= LEAST_IN_BIN]
    return np.array([np.median(angle[one]) for one in full]), np.array([np.median(curvature[one]) for one in full])
