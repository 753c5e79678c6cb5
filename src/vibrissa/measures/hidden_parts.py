"""Parts of a line that an object hides: a dark pole darkens the pixels around it, and there the line is not seen."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from vibrissa.arrays import Array
from vibrissa.measures.touched_object import Pole, nearest_point

USUAL = 0.9  # quantile of the lengths up to which a whisker is seen, that is no more than its own
ENDING = 3  # nodes at the end of what is seen, whose direction goes on beyond


def distance_with_hidden_parts(pole: Pole, x: Array, y: Array, hidden: float) -> Array:
    """Distance of a line to the surface of a pole, where the pole may hide a part of the line.

    Nodes that are not seen between others are put on a smooth line through these. Where a line ends before the length
    up to which the whisker is usually seen, it goes on straight. A part that was not seen is never inside the pole.

    Parameters
    ----------
    pole : Pole
        The pole.
    x, y : (T, N) arrays
        Nodes of one whisker [m], NaN where not measured.
    hidden : float
        Length by which a line goes on beyond its last seen node, at most [m].

    Returns
    -------
    (T,) array
        [m], negative where the seen line lies within; NaN where no two neighbouring nodes were seen.
    """
    seen = pole.distance(x, y)
    whole = nearest_point(*_whole(x, y, hidden), pole.centre)[0] - pole.radius
    return np.where(np.isfinite(seen), np.fmin(seen, np.maximum(whole, 0.0)), np.nan)


def _whole(x: Array, y: Array, hidden: float) -> tuple[Array, Array]:
    """Nodes with those between that were not seen, and one more beyond the last."""
    known = np.isfinite(x) & np.isfinite(y)
    count, nodes = known.sum(axis=1), np.arange(x.shape[1])
    last = np.where(known, nodes, -1).max(axis=1)
    usual = np.quantile(last[count > 0], USUAL) if count.any() else 0
    out = np.full((2, len(x), nodes.size + 1), np.nan)
    for frame in np.flatnonzero(count > ENDING):
        at, end = np.flatnonzero(known[frame]), last[frame]
        points = np.stack([x[frame], y[frame]])
        if at.size <= end - at[0]:
            between = slice(at[0], end + 1)
            points[:, between] = Akima1DInterpolator(at, points[:, at], axis=1)(nodes[between])
        out[:, frame, :-1] = points
        if end < usual:
            way = points[:, end] - points[:, end - ENDING]
            step = np.hypot(*way) / ENDING
            reach = min(hidden, step * (usual - end))
            out[:, frame, end + 1] = points[:, end] + reach * way / (ENDING * step)
    return out[0], out[1]
