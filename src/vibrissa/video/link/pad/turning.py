"""How far whiskers of a pad move at the three radii when it swings, learnt from the lines themselves.

A whisker that turns about its base moves little near it. Where bases are hidden, or the pad carries them along,
it moves there nearly as far as in the middle, and a swing that does not know of it is taken for another one.
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.pad.pads import Lines

LAG = 2  # lines of a tracklet between which it is seen how far each radius has moved
FURTHEST = 12.0  # swing between these lines above which a tracklet is not trusted [°]
WHOLE = -0.7, 0.5  # a line that begins and ends here shows all three radii
DOUBT = 300.0  # sum of squared swings that the expected lever counts for [°²]
BOUNDS = 0.1, 1.6  # of what is learnt


def learnt_lever(frame: Integers, name: Integers, lines: Lines, expected: Array) -> Array:
    """Displacement at the three radii over that at the middle one.

    Parameters
    ----------
    frame, name : (S,) arrays
        Frame and tracklet of each segment; −1 where it has none.
    lines : Lines
        All lines.
    expected : (3,) array
        Of whiskers that turn about bases at a depth that is usual, :func:`vibrissa.video.link.pad.common_swing.lever`.

    Returns
    -------
    (3,) array
        Without unit; 1 in the middle.
    """
    order = np.lexsort((frame, name))
    whole = (lines.reach[:, 0] < WHOLE[0]) & (lines.reach[:, 1] > WHOLE[1])
    order = order[(name[order] >= 0) & whole[order]]
    i, j = order[:-LAG], order[LAG:]
    step = lines.place[j] - lines.place[i]
    kept = (name[i] == name[j]) & (np.abs(step[:, 1]) < FURTHEST)
    step, error = step[kept], (lines.covariance[i] + lines.covariance[j])[kept]
    # the error of the reading in the middle is on both sides of the regression
    top = step[:, 1] @ step - error[:, 1].sum(axis=0)
    found = (top + DOUBT * expected) / (max(top[1], 0.0) + DOUBT)
    return np.asarray(np.where([False, True, False], 1.0, np.clip(found, *BOUNDS)))
