"""How often names leave lines that go on plainly: a sign, without any truth, that names of a movie do not hold.

Where names are right, a line that goes on without an alternative keeps its name. Where the whole pad has been taken
for its neighbours, or whiskers stray as far as these are, names jump from one line to the next.
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers

RUN = 3  # lines of one name in a row that are not an accident


def torn_links(frame: Integers, tracklet: Integers, whisker: Integers, count: int) -> Array:
    """Changes of name within plain stretches, per frame of each whisker.

    Parameters
    ----------
    frame, tracklet, whisker : (S,) arrays of int
        Frame, plain stretch and whisker of each segment; −1 for none.
    count : int
        Number of whiskers.

    Returns
    -------
    (count,) array
        Changes from or to each whisker, over its named lines.
    """
    order = np.lexsort((frame, tracklet))
    order = order[(tracklet[order] >= 0) & (whisker[order] >= 0)]
    name, piece = whisker[order], tracklet[order]
    new = np.flatnonzero((np.diff(name, prepend=-1) != 0) | (np.diff(piece, prepend=-1) != 0))
    long = new[np.diff(new, append=name.size) >= RUN]
    first, second = long[:-1], long[1:]
    jump = (piece[first] == piece[second]) & (name[first] != name[second])
    both = np.concatenate([name[first[jump]], name[second[jump]]])
    lines = np.bincount(whisker[whisker >= 0], minlength=count)
    return np.asarray(np.bincount(both, minlength=count) / np.maximum(lines, 1))
