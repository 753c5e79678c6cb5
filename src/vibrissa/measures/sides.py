"""Pads of both sides of the head in one movie, by where whiskers grow from and where they point."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers

LEAST = 2  # whiskers of a side at least
ACROSS = 0.7  # median component of their directions across the head, at least
APART = 2.0  # distance of the sides' median bases over the spread (middle half) of either, at least


def sides_of(bases: Array, ways: Array, towards: Array) -> Integers:
    """Side of each whisker, where pads of both sides are seen.

    The whiskers of each side point away from the head, and their bases are apart: those of one pad, which may lie on an
    arc and point any way, are of one side.

    Parameters
    ----------
    bases, ways : (W, 2) arrays
        Mean base [m] and mean direction of each whisker, NaN where it was never seen.
    towards : (2,) array
        Unit vector to the nose.

    Returns
    -------
    (W,) array of int
        1 on the side to which a whisker turns from the nose as from the x to the y axis, −1 on the other; 0 for all if
        they are of one side, and for those without a direction.
    """
    normal = np.array([-towards[1], towards[0]])
    place, out = bases @ normal, np.nan_to_num(ways @ normal)
    side = np.sign(out).astype(np.int64)
    each = [np.flatnonzero(side == one) for one in (1, -1)]
    if min(map(len, each)) < LEAST or min(np.median(np.abs(out[one])) for one in each) < ACROSS:
        return np.zeros_like(side)
    low, middle, high = np.array([np.quantile(place[one], (0.25, 0.5, 0.75)) for one in each]).T
    return side if middle[0] - middle[1] > APART * (high - low).max() else np.zeros_like(side)


def sides_along(bases: Array, middle: Array, towards: Array) -> Integers:
    """Side of each whisker where it is known that pads of both sides are seen, and how the head lies.

    Parameters
    ----------
    bases : (W, 2) array
        Mean base of each whisker [m], NaN where it was never seen.
    middle : (2,) array
        A point of the axis of the head [m].
    towards : (2,) array
        Unit vector to the nose.

    Returns
    -------
    (W,) array of int
        As of :func:`sides_of`.
    """
    return np.sign(np.nan_to_num((bases - middle) @ np.array([-towards[1], towards[0]]))).astype(np.int64)


def axis_between(bases: Array, side: Integers, towards: Array) -> Array:
    """Axis of the head that has pads on both sides: across the line from one's median base to the other's.

    Parameters
    ----------
    bases : (W, 2) array
        Mean base of each whisker [m].
    side : (W,) array of int
        From :func:`sides_of`.
    towards : (2,) array
        Unit vector roughly to the nose.

    Returns
    -------
    (2,) array
        Unit vector to the nose.
    """
    one, other = (np.median(bases[side == s], axis=0) for s in (1, -1))
    across = (one - other) / np.hypot(*(one - other))
    axis = np.array([across[1], -across[0]])
    return np.asarray(axis * np.sign(axis @ towards))
