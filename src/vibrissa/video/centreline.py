"""The centreline of one whisker in one frame, read column by column in a band around where it is expected.

The band is straightened: row ``half`` of it is the expected row, rounded, of every column. All kernels are
serial, for one core, and take the whisker as dark (``sign`` = −1 turns a bright one over).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from vibrissa.video.band import SCALE, levels
from vibrissa.video.estimators import barycentres, matched
from vibrissa.video.path import best_path

FINE = 64  # of the path's score: whole numbers of 64ths of the noise's standard deviation
STIFFNESS = 2 * FINE  # cost of a step of one row against the expected course
TETHER = np.float32(0.2 * FINE)  # cost of a distance of one row from the expected course, squared
MOST = np.float32(4096 * FINE)  # contrast above which more attracts no more, so that 8000 columns' sum is held
OUTSIDE = -(10**7)  # score of rows outside the image
GAP = 12  # longest run of lost columns within one whisker
JUMP = 2.5  # rows against the expected course between two ends of a gap above which they are two whiskers
SMOOTH = 15  # columns on either side in the local quadratic that gives slope and prediction
SAMPLE = 40  # columns, or nearly so, that tell the noise


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _count_below(values, limit):  # type: ignore[no-untyped-def]
    """Number of values below a limit, each spread evenly over one grey level, as the camera rounded to these."""
    count, low = np.float32(0), limit + np.float32(SCALE / 2)
    for j in range(values.size):
        part = low - values[j]
        part = part if part > np.float32(0) else np.float32(0)
        count += part if part < np.float32(SCALE) else np.float32(SCALE)
    return count / np.float32(SCALE)


@njit(cache=True, nogil=True)
def quantile(values, share, low, high):  # type: ignore[no-untyped-def]
    """Value between two others below which a share of the values lies, by bisection, to 1/1024 of their distance."""
    number = np.float32(share * values.size)
    for _ in range(10):
        middle = np.float32(0.5) * (low + high)
        if _count_below(values, middle) > number:
            high = middle
        else:
            low = middle
    return np.float32(0.5) * (low + high)


@njit(cache=True, nogil=True)
def off_line(grey, level):  # type: ignore[no-untyped-def]
    """Offset and noise (standard deviation) of the contrast away from the middle row [grey levels].

    The closing of noise lies above the noise's mean; that offset would draw the barycentre to the middle
    of its window, so it is measured and taken away. Other whiskers are on the positive side only, so the
    noise is read from the negative side.
    """
    rows, n = grey.shape
    every = max(1, n // SAMPLE)
    sample = (n - 1) // every + 1
    values = np.empty((rows - 7) * sample, np.float32)
    low, high, at = np.float32(np.inf), np.float32(-np.inf), 0
    for i in range(rows - 7):
        k = i if i < rows // 2 - 3 else i + 7
        for j in range(0, n, every):
            value = np.float32(level[k, j] - grey[k, j])
            low, high = min(low, value), max(high, value)
            values[at] = value
            at += 1
    offset = quantile(values, 0.5, low, high)
    # 15.87 % of a normal distribution lie below −1 SD; whole grey levels alone have an SD of 0.29
    noise = (offset - quantile(values, 0.1587, low, offset)) * np.float32(1 / SCALE)
    return offset * np.float32(1 / SCALE), max(noise, np.float32(0.29))


@njit(cache=True, nogil=True)
def _sum_of_three(level, grey, out):  # type: ignore[no-untyped-def]
    """Contrast summed over each column and its two neighbours; the end columns stand for those beyond them."""
    n = out.size
    for j in range(1, n - 1):
        out[j] = level[j - 1] - grey[j - 1] + level[j] - grey[j] + level[j + 1] - grey[j + 1]
    out[0] = 2 * (level[0] - grey[0]) + level[1] - grey[1]
    out[n - 1] = 2 * (level[n - 1] - grey[n - 1]) + level[n - 2] - grey[n - 2]


@njit(cache=True, nogil=True)
def _guide(grey, level, reach):  # type: ignore[no-untyped-def]
    """Contrast averaged over three columns [192nds of a grey level], in ``reach`` rows about the middle one."""
    half = grey.shape[0] // 2
    out = np.empty((2 * reach + 1, grey.shape[1]), np.int32)
    for k in range(2 * reach + 1):
        _sum_of_three(level[half - reach + k], grey[half - reach + k], out[k])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _capped(contrast, ceiling, unit, cost, out):  # type: ignore[no-untyped-def]
    for j in range(out.size):
        value, most = np.float32(contrast[j]), ceiling[j]
        value = (most if value > most else value) * unit
        value = value if value < MOST else MOST
        out[j] = np.int32((value if value > -MOST else -MOST) - cost)


@njit(cache=True, nogil=True)
def _tops(guide, path, low):  # type: ignore[no-untyped-def]
    """Row of the highest of three pixels about the path in each column; ``low`` is the row of the band of guide's 0."""
    top = np.empty(path.size, np.int64)
    for j in range(path.size):
        k = path[j] - low
        above, here, below = guide[k - 1, j], guide[k, j], guide[k + 1, j]
        side = 1 if below > above else -1
        top[j] = path[j] + (side if max(above, below) > here else 0)
    return top


@njit(cache=True, nogil=True, error_model="numpy")
def local_quadratic(row, reach):  # type: ignore[no-untyped-def]
    """Value and slope of a quadratic fitted to the measured rows within ``reach`` columns on either side.

    Where fewer than 5 rows are measured there, both are NaN.
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


@njit(cache=True, nogil=True)
def _chain(offset):  # type: ignore[no-untyped-def]
    """Longest chain of columns with no gap over ``GAP`` and no jump over ``JUMP`` rows: first, and one on."""
    best_count, best_first, best_last = 0, 0, -1
    count, first, last = 0, 0, -1
    for j in range(offset.size):
        if offset[j] != offset[j]:
            continue
        if count == 0 or j - last - 1 > GAP or (j - last > 1 and abs(offset[j] - offset[last]) > JUMP):
            count, first = 0, j
        count += 1
        last = j
        if count > best_count:
            best_count, best_first, best_last = count, first, last
    return best_first, best_last + 1


@njit(cache=True, nogil=True)
def _inside(expected, height):  # type: ignore[no-untyped-def]
    """First column and the one after the last of the longest run where the expected row is in the image."""
    best_first, best_stop, first = 0, 0, -1
    for j in range(expected.size + 1):
        inside = j < expected.size and 2 <= expected[j] <= height - 3
        if inside and first < 0:
            first = j
        elif not inside and first >= 0:
            if j - first > best_stop - best_first:
                best_first, best_stop = first, j
            first = -1
    return best_first, best_stop


@njit(cache=True, nogil=True)
def read_line(image, background, sign, expected, ceiling, search, threshold, match, row, sd, flux):  # type: ignore[no-untyped-def]
    """Centreline in one frame within ``search`` rows of the expected rows.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    background : (height, width) array
        Grey levels without the whisker, or an array of size 0 to close across rows instead.
    sign : (1,) array of int
        1 for a dark whisker, −1 for a bright one; of a type that holds 64 times the grey levels.
    expected : (width,) array
        Where the whisker is expected [px]; NaN in columns not to be read.
    ceiling : (width,) array
        Contrast above which a line attracts no more [grey levels], so that a darker neighbour does not win;
        NaN for any.
    search : int
        Rows to search on either side.
    threshold : float
        Five-pixel contrast, averaged over 7 columns, over the noise of one column's sum: below, a column is lost.
    match : bool
        Whether the row is that of the matched profile, or of the five-pixel barycentre.
    row, sd, flux : (width,) arrays
        Written: as in :class:`vibrissa.video.following.Centrelines`, for one whisker in one frame.
    """
    height = image.shape[0]
    for j in range(row.size):
        row[j], sd[j], flux[j] = np.nan, np.nan, np.nan
    first, stop = _inside(expected, height)
    if stop - first < 7:
        return
    centre, cap = _centre(expected, ceiling, first, stop)
    half = search + 7
    grey, level = levels(image, background, sign, centre, first, half)
    offset, noise = off_line(grey, level)
    path, top = _path_and_tops(grey, level, cap, centre, height, search, noise)
    if background.size:
        # nothing was closed, so there is no brim
        grey -= level
        level[:] = 0
    rows, sds, sums, window = barycentres(grey, level, top, path, noise, offset)
    if match:
        matched(grey, level, top, noise, offset, window, rows, sds)
    _keep(rows, sds, sums, threshold * noise * np.sqrt(5.0), expected, centre, first, stop, half, row, sd, flux)


@njit(cache=True, nogil=True)
def _centre(expected, ceiling, first, stop):  # type: ignore[no-untyped-def]
    """Rows expected, rounded, and ceiling of the columns that are read, and as at the last one up to whole fours."""
    n = (stop - first + 3) // 4 * 4
    centre, cap = np.empty(n, np.int64), np.empty(n, np.float32)
    for j in range(n):
        at = min(first + j, stop - 1)
        centre[j], cap[j] = np.int64(expected[at] + 0.5), ceiling[at] * (3 * SCALE)
    return centre, cap


@njit(cache=True, nogil=True, error_model="numpy")
def _keep(rows, sds, sums, least, expected, centre, first, stop, half, row, sd, flux):  # type: ignore[no-untyped-def]
    """Write what is visible, in one chain, to its columns of the image."""
    n = stop - first
    off = np.empty(n)
    total, count = 0.0, 0
    for j in range(min(3, n)):
        total += sums[j]
        count += 1
    for j in range(n):
        if j + 3 < n:
            total += sums[j + 3]
            count += 1
        if j >= 4:
            total -= sums[j - 4]
            count -= 1
        rows[j] += centre[j] - half
        off[j] = rows[j] - expected[first + j] if total > least * count else np.nan
    begin, end = _chain(off)
    for j in range(begin, end):
        if off[j] == off[j]:
            row[first + j], sd[first + j], flux[first + j] = rows[j], sds[j], sums[j]


@njit(cache=True, nogil=True)
def _path_and_tops(grey, level, cap, centre, height, search, noise):  # type: ignore[no-untyped-def]
    """Row of the band in which the line runs, and of its extremum, for each column."""
    half = grey.shape[0] // 2
    guide = _guide(grey, level, search + 1)
    score = np.empty((2 * search + 1, centre.size), np.int32)
    unit = np.float32(FINE) / (noise * np.float32(3 * SCALE))
    highest, lowest = height, 0
    for j in range(centre.size):
        highest, lowest = min(highest, centre[j]), max(lowest, centre[j])
    for k in range(2 * search + 1):
        _capped(guide[k + 1], cap, unit, TETHER * np.float32((k - search) ** 2), score[k])
        if highest + k - search < 2 or lowest + k - search > height - 3:
            for j in range(centre.size):
                if not 2 <= centre[j] + k - search <= height - 3:
                    score[k, j] = OUTSIDE
    path = best_path(score, STIFFNESS)
    for j in range(path.size):
        path[j] += half - search
    return path, _tops(guide, path, half - search - 1)
