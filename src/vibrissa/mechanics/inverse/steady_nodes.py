"""Nodes of a tracked whisker that are analysed: seen in most frames, and not drawn by the border of a shadow."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Mask

_STEADY = 0.99  # share of the frames, over that of the median node, in which a node before a shadow's border is seen
_BORDER = 8  # nodes, at most, over which the line ends at such a border
_DRAWN = 4  # nodes before these that it draws: the tracker compares five rows on either side of the line


def steady_nodes(known: Mask, arc: Array) -> Mask:
    """Select the nodes seen in half of the frames or more, without those at the border of a shadow.

    At such a border the line ends within a few nodes, to and fro as the whisker moves: a node is seen in the frames in
    which it lies to one side, and the slope of grey draws the line of the next ones too, by up to 0.4 pixel. A line
    that fades over more nodes than these is kept to its end.

    Parameters
    ----------
    known : (T, N) array of bool
        Whether a node is measured in a frame.
    arc : (N,) array
        Arc length from the skin [m]; nodes may come in any order.

    Returns
    -------
    (N,) array of bool
        The nodes to be analysed.
    """
    from_skin = np.argsort(arc, kind="stable")
    share = known.mean(axis=0)[from_skin]
    seen = share >= 0.5
    if not seen.any():
        return seen
    last = np.flatnonzero(seen)[-1]
    steady = np.flatnonzero(share >= _STEADY * np.median(share[seen]))[-1]
    if 0 < last - steady <= _BORDER:
        seen[steady + 1 - _DRAWN :] = False
    return np.asarray(seen[np.argsort(from_skin)])
