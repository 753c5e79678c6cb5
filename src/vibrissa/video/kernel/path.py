"""The path of highest contrast through a straightened band."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Integers
from vibrissa.loops import njit


@njit(cache=True, nogil=True)
def best_path(score: NDArray[np.int32], stiffness: int) -> Integers:
    """Rows of the path of highest score through a band, one row per column at most up or down (Viterbi).

    Parameters
    ----------
    score : (rows, n) array of int32
        Contrast, less what a distance of that row from the middle of the band costs.
    stiffness : int
        Score that a step of one row costs.

    Returns
    -------
    (n,) array of int
        Row of the path in each column.
    """
    rows, n = score.shape
    never = np.int32(-(2**30))
    total = np.empty((n, rows + 2), np.int32)  # a row beyond either edge that is never the best
    for j in range(n):
        total[j, 0], total[j, rows + 1] = never, never
    for k in range(rows):
        total[0, k + 1] = score[k, 0]
    # best score of a path that ends in row k of column j: on from the same row, or from a neighbour at a cost
    for j in range(1, n):
        above, here = never, total[j - 1, 1]
        for k in range(rows):
            below = total[j - 1, k + 2]
            total[j, k + 1] = max(max(above, below) - stiffness, here) + score[k, j]
            above, here = here, below
    path = np.empty(n, np.int64)
    k = 1
    for i in range(2, rows + 1):
        k = i if total[n - 1, i] > total[n - 1, k] else k
    path[n - 1] = k - 1
    # back from the best end, each time to where its score came from
    for j in range(n - 2, -1, -1):
        above, here, below = total[j, k - 1], total[j, k], total[j, k + 1]
        side = -1 if above > below else 1
        k += side if max(above, below) - stiffness > here else 0
        path[j] = k - 1
    return path
