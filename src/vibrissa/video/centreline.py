"""The centreline of one whisker in one frame, read column by column in a band around where it is expected.

The band is straightened: row ``half`` of it is the expected row, rounded, of every column. All kernels are
serial, for one core, and take the whisker as dark (``sign`` = −1 turns a bright one over).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from vibrissa.video.band import SCALE, levels, smooth_along
from vibrissa.video.estimators import barycentres, matched
from vibrissa.video.path import best_path

STIFFNESS = np.float32(
    2.0
)  # cost of a step of one row against the expected course, in standard deviations of the noise
TETHER = np.float32(0.2)  # cost of a distance of one row from the expected course, squared, likewise
OUTSIDE = np.float32(-1e9)  # score of rows outside the image
JUMP = 2.5  # rows against the expected course between two ends of a gap above which they are two whiskers
SMOOTH = 15  # columns on either side in the local quadratic that gives slope and prediction
SAMPLE = 70  # columns, or nearly so, that tell the noise


@njit(cache=True, nogil=True, fastmath=True)
def _share_below(values, limit):  # type: ignore[no-untyped-def]
    count = np.float32(0)
    for j in range(values.size):
        count += np.float32(1) if values[j] < limit else np.float32(0)
    return count / values.size


@njit(cache=True, nogil=True)
def quantile(values, share):  # type: ignore[no-untyped-def]
    """Value below which a share of the values lies, by bisection, to 1/4096 of their range."""
    low, high = np.min(values), np.max(values)
    for _ in range(12):
        middle = np.float32(0.5) * (low + high)
        if _share_below(values, middle) > share:
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
    values = np.empty((rows - 7, sample), np.float32)
    for i in range(rows - 7):
        k = i if i < rows // 2 - 3 else i + 7
        for j in range(sample):
            values[i, j] = np.float32(level[k, every * j]) - np.float32(grey[k, every * j])
    values = values.reshape(-1)
    offset = quantile(values, 0.5)
    # 15.87 % of a normal distribution lie below −1 SD; whole grey levels alone have an SD of 0.29
    return offset / SCALE, max((offset - quantile(values, 0.1587)) / SCALE, np.float32(0.29))


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
    """Contrast averaged over three columns [27ths of a grey level], in ``reach`` rows about the middle one."""
    half = grey.shape[0] // 2
    out = np.empty((2 * reach + 1, grey.shape[1]), grey.dtype)
    for k in range(2 * reach + 1):
        _sum_of_three(level[half - reach + k], grey[half - reach + k], out[k])
    return out


@njit(cache=True, nogil=True)
def _capped(contrast, ceiling, cost, out):  # type: ignore[no-untyped-def]
    for j in range(out.size):
        value = np.float32(contrast[j])
        out[j] = (ceiling[j] if value > ceiling[j] else value) - cost


@njit(cache=True, nogil=True)
def _tops(guide, path, low):  # type: ignore[no-untyped-def]
    """Row of the highest of three pixels about the path in each column; ``low`` is the row of the band of guide's 0."""
    top = np.empty(path.size, np.int64)
    for j in range(path.size):
        k = path[j] - low
        best = k
        if guide[k - 1, j] > guide[best, j]:
            best = k - 1
        if guide[k + 1, j] > guide[best, j]:
            best = k + 1
        top[j] = best + low
    return top


@njit(cache=True, nogil=True, error_model="numpy")
def local_quadratic(row, reach):  # type: ignore[no-untyped-def]
    """Value and slope of a quadratic fitted to the measured rows within ``reach`` columns on either side.

    Where fewer than 5 rows are measured there, both are NaN.
    """
    n = row.size
    value, slope = np.full(n, np.nan), np.full(n, np.nan)
    # sums of u^k and of row u^k over the measured columns, u = 0 at the present one; they are carried along
    s0 = s1 = s2 = s3 = s4 = t0 = t1 = t2 = 0.0
    u, v = float(reach), -float(reach + 1)
    for j in range(-reach, n):
        s4 += s0 - 4 * s1 + 6 * s2 - 4 * s3
        s3 += 3 * s1 - 3 * s2 - s0
        s2 += s0 - 2 * s1
        s1 -= s0
        t2 += t0 - 2 * t1
        t1 -= t0
        for i, d, sense in ((j + reach, u, 1.0), (j - reach - 1, v, -1.0)):
            if 0 <= i < n and row[i] == row[i]:
                y = sense * row[i]
                s0 += sense
                s1 += sense * d
                s2 += sense * d * d
                s3 += sense * d * d * d
                s4 += sense * d * d * d * d
                t0 += y
                t1 += y * d
                t2 += y * d * d
        if j < 0 or s0 < 5:
            continue
        a, b, c = s2 * s4 - s3 * s3, s1 * s4 - s2 * s3, s1 * s3 - s2 * s2
        det = s0 * a - s1 * b + s2 * c
        # of measured columns that lie together, if the window is scaled to one
        if det > 1e-9 * s0**3 * u**6:
            value[j] = (t0 * a - t1 * b + t2 * c) / det
            slope[j] = (t1 * (s0 * s4 - s2 * s2) - t0 * b + t2 * (s1 * s2 - s0 * s3)) / det
    return value, slope


@njit(cache=True, nogil=True)
def _chain(visible, offset, gap):  # type: ignore[no-untyped-def]
    """Keep the longest chain of visible columns with no gap longer than ``gap`` and no jump over ``JUMP`` rows."""
    best_count, best_first, best_last = 0, 0, -1
    count, first, last = 0, 0, -1
    for j in range(visible.size):
        if not visible[j]:
            continue
        if count == 0 or j - last - 1 > gap or (j - last > 1 and abs(offset[j] - offset[last]) > JUMP):
            count, first = 0, j
        count += 1
        last = j
        if count > best_count:
            best_count, best_first, best_last = count, first, last
    kept = np.zeros(visible.size, np.bool_)
    kept[best_first : best_last + 1] = visible[best_first : best_last + 1]
    return kept


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
def read_line(image, background, sign, expected, ceiling, search, threshold, gap, match, row, sd, flux):  # type: ignore[no-untyped-def]
    """Centreline in one frame within ``search`` rows of the expected rows.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    background : (height, width) array
        Grey levels without the whisker, or an array of size 0 to close across rows instead.
    sign : (1,) array of int
        1 for a dark whisker, −1 for a bright one; of a type that holds 27 times the grey levels.
    expected : (width,) array
        Where the whisker is expected [px]; NaN in columns not to be read.
    ceiling : (width,) array
        Contrast above which a line attracts no more [grey levels], so that a darker neighbour does not win;
        NaN for any.
    search : int
        Rows to search on either side.
    threshold : float
        Five-pixel contrast, averaged over 7 columns, over the noise of one column's sum: below, a column is lost.
    gap : int
        Longest run of lost columns within a line; what is beyond a longer one is not this whisker.
    match : bool
        Whether the row is that of the matched profile, or of the five-pixel barycentre.
    row, sd, flux : (width,) arrays
        Written: as in :class:`vibrissa.video.following.Centrelines`, for one whisker in one frame.
    """
    row[:], sd[:], flux[:] = np.nan, np.nan, np.nan
    height = image.shape[0]
    first, stop = _inside(expected, height)
    if stop - first < 7:
        return
    centre = np.floor(expected[first:stop] + 0.5).astype(np.int64)
    half = search + 7
    grey, level = levels(image, background, sign, centre, first, half)
    offset, noise = off_line(grey, level)
    path, top = _path_and_tops(grey, level, ceiling[first:stop], centre, height, search, noise)
    closed = background.size == 0
    if match:
        rows, sds, sums = matched(grey, level, top, path, noise, offset, closed)
    else:
        rows, sds, sums, _ = barycentres(grey, level, top, path, noise, offset, closed)
    mean = smooth_along(sums.reshape(1, -1), 3)[0]
    visible = (mean > threshold * noise * np.sqrt(5)) & ~np.isnan(rows)
    kept = _chain(visible, rows + centre - half - expected[first:stop], gap)
    for j in range(kept.size):
        if kept[j]:
            row[first + j] = rows[j] + centre[j] - half
            sd[first + j], flux[first + j] = sds[j], sums[j]


@njit(cache=True, nogil=True)
def _path_and_tops(grey, level, ceiling, centre, height, search, noise):  # type: ignore[no-untyped-def]
    """Row of the band in which the line runs, and of its extremum, for each column."""
    half, per_level = grey.shape[0] // 2, np.float32(3 * SCALE)
    guide = _guide(grey, level, search + 1)
    score = np.empty((2 * search + 1, centre.size), np.float32)
    cap = (ceiling * per_level).astype(np.float32)
    tether = TETHER * noise * per_level
    for k in range(2 * search + 1):
        _capped(guide[k + 1], cap, tether * np.float32((k - search) ** 2), score[k])
        if np.min(centre) + k - search < 2 or np.max(centre) + k - search > height - 3:
            row = centre + k - search
            score[k, (row < 2) | (row > height - 3)] = OUTSIDE
    path = best_path(score, STIFFNESS * noise * per_level)
    path += half - search
    return path, _tops(guide, path, half - search - 1)
