"""A quadratic fitted about each column of a line: its smooth course and its slope."""

from __future__ import annotations

import numpy as np

from vibrissa.loops import njit
from vibrissa.video.kernel.band import Rows

SMOOTH = 15  # columns on either side in the local quadratic that gives slope and prediction


@njit(cache=True, nogil=True, error_model="numpy")
def local_quadratic(row: Rows, reach: int | np.int64) -> tuple[Rows, Rows]:
    """Value and slope of a quadratic fitted to the measured rows about each column.

    Parameters
    ----------
    row : (width,) array
        Rows [px]; NaN where not measured.
    reach : int
        Columns on either side that are fitted.

    Returns
    -------
    value, slope : (width,) arrays
        [px] and [px per column]; NaN where fewer than 5 rows are measured within reach.
    """
    n = row.size
    value, slope = np.full(n, np.nan), np.full(n, np.nan)
    first = 0  # measured column
    while first < n and row[first] != row[first]:
        first += 1
    # sums of u^k and of row u^k over the measured columns, u = 0 at the present one; they are carried along
    s0 = s1 = s2 = s3 = s4 = t0 = t1 = t2 = 0.0
    u, v, full = float(reach), -float(reach + 1), 2 * reach + 1
    all2 = reach * (reach + 1) * full / 3
    all4 = all2 * (3 * reach * (reach + 1) - 1) / 5
    for j in range(first - reach, n):
        ahead, behind = j + reach, j - reach - 1
        comes, goes = ahead < n and row[ahead] == row[ahead], behind >= first and row[behind] == row[behind]
        y, z = row[ahead] if comes else 0.0, row[behind] if goes else 0.0
        # a change in one bracket each, as the next column waits for nothing else
        t2 += (t0 - 2 * t1) + (y * (u * u) - z * (v * v))
        t1 += (y * u - z * v) - t0
        t0 += y - z
        if not (comes and goes and s0 == full):
            s4 += s0 - 4 * s1 + 6 * s2 - 4 * s3
            s3 += 3 * s1 - 3 * s2 - s0
            s2 += s0 - 2 * s1
            s1 -= s0
            a, b = (1.0 if comes else 0.0), (1.0 if goes else 0.0)
            s0, s1, s2 = s0 + a - b, s1 + a * u - b * v, s2 + a * u * u - b * v * v
            s3, s4 = s3 + a * u**3 - b * v**3, s4 + a * u**4 - b * v**4
        if j < 0 or s0 < 5:
            continue
        if s0 == full:
            value[j] = (t0 * all4 - t2 * all2) * (1 / (full * all4 - all2 * all2))
            slope[j] = t1 * (1 / all2)
            continue
        a, b, c = s2 * s4 - s3 * s3, s1 * s4 - s2 * s3, s1 * s3 - s2 * s2
        det = s0 * a - s1 * b + s2 * c
        # of measured columns that lie together, if the window is scaled to one
        if det > 1e-9 * s0**3 * u**6:
            value[j] = (t0 * a - t1 * b + t2 * c) / det
            slope[j] = (t1 * (s0 * s4 - s2 * s2) - t0 * b + t2 * (s1 * s2 - s0 * s3)) / det
    return value, slope
