"""The path of highest contrast through a straightened band."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def best_path(score, stiffness):  # type: ignore[no-untyped-def]
    """Rows of the path of highest score through a band, one row per column at most up or down (Viterbi).

    Parameters
    ----------
    score : (rows, n) array of float32
        Contrast, less what a distance of that row from the middle of the band costs.
    stiffness : float
        Score that a step of one row costs.
    """
    rows, n = score.shape
    stiff, never = np.float32(stiffness), np.float32(-1e30)
    total = np.full(rows + 2, never)  # a row beyond either edge that is never the best
    total[1 : rows + 1] = score[:, 0]
    step = np.zeros((n, rows), np.int8)
    for j in range(1, n):
        moves = step[j]
        above, here = never, total[1]
        for k in range(rows):
            below = total[k + 2]
            up, down = above - stiff, below - stiff
            side = up if up > down else down
            move = np.int8(-1) if up > down else np.int8(1)
            moves[k] = move if side > here else np.int8(0)
            total[k + 1] = (side if side > here else here) + score[k, j]
            above, here = here, below
    path = np.empty(n, np.int64)
    path[n - 1] = np.argmax(total) - 1
    for j in range(n - 1, 0, -1):
        path[j - 1] = path[j] + step[j, path[j]]
    return path
