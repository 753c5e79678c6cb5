"""The centreline of one whisker in one frame, read column by column in a band around where it is expected.

The band is straightened: row ``half`` of it is the expected row, rounded, of every column. All kernels are
serial, for one core, and take the whisker as dark (``sign`` = −1 turns a bright one over).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from vibrissa.video.band import contrast_band, smooth_along

STIFFNESS = 2.0  # cost of a step of one row against the expected course, in standard deviations of the noise
TETHER = 0.2  # cost of a distance of one row from the expected course, squared, likewise
JUMP = 2.5  # rows against the expected course between two ends of a gap above which they are two whiskers
PROFILE = 1.1  # SD of the profile that is matched [px]; a sharper one is drawn to the pixels' middles by 0.01 px
REACH = 4  # rows on either side that are matched
STEPS = 12  # of Newton's method at most
SMOOTH = 15  # columns on either side in the local quadratic that gives slope and prediction


@njit(cache=True)
def best_path(score, low, high, stiffness, tether):  # type: ignore[no-untyped-def]
    """Rows of the path of highest score through a band, one row per column at most up or down (Viterbi).

    Parameters
    ----------
    score : (rows, n) array
        Contrast [grey levels].
    low, high : (n,) arrays of int
        First and last row allowed in each column.
    stiffness : float
        Score that a step of one row costs.
    tether : float
        Score that a distance of one row from the middle of the band costs, times that distance squared.
    """
    rows, n = score.shape
    cost = tether * (np.arange(rows) - rows // 2) ** 2
    total = np.full((rows, n), -np.inf, np.float32)
    step = np.zeros((rows, n), np.int8)
    for k in range(low[0], high[0] + 1):
        total[k, 0] = score[k, 0] - cost[k]
    for j in range(1, n):
        for k in range(low[j], high[j] + 1):
            best, move = total[k, j - 1], 0
            if k > 0 and total[k - 1, j - 1] - stiffness > best:
                best, move = total[k - 1, j - 1] - stiffness, -1
            if k + 1 < rows and total[k + 1, j - 1] - stiffness > best:
                best, move = total[k + 1, j - 1] - stiffness, 1
            total[k, j] = best + score[k, j] - cost[k]
            step[k, j] = move
    path = np.empty(n, np.int64)
    path[n - 1] = np.argmax(total[:, n - 1])
    for j in range(n - 1, 0, -1):
        path[j - 1] = path[j] + step[path[j], j]
    return path


@njit(cache=True)
def off_line(contrast):  # type: ignore[no-untyped-def]
    """Offset and noise (standard deviation) of the contrast away from the middle row.

    The closing of noise lies above the noise's mean; that offset would draw the barycentre to the middle
    of its window, so it is measured and taken away. Other whiskers are on the positive side only, so the
    noise is read from the negative side.
    """
    rows, n = contrast.shape
    values = np.empty(rows * (n // 6 + 1), np.float32)
    count = 0
    for j in range(0, n, 6):
        for k in range(rows):
            if abs(k - rows // 2) > 3:
                values[count] = contrast[k, j]
                count += 1
    values = np.sort(values[:count])
    offset = values[count // 2]
    # 15.87 % of a normal distribution lie below −1 SD; whole grey levels alone have an SD of 0.29
    return offset, max(offset - values[int(0.1587 * count)], np.float32(0.29))


@njit(cache=True)
def extremum(guide, row, j):  # type: ignore[no-untyped-def]
    """The highest of three pixels about a row of column j, far enough from the ends for a window of five."""
    top = row
    for k in range(max(row - 1, 2), min(row + 2, guide.shape[0] - 2)):
        if guide[k, j] > guide[top, j]:
            top = k
    return top


@njit(cache=True)
def five_pixel_sum(contrast, top, j):  # type: ignore[no-untyped-def]
    """Sum of the contrast over five pixels, and its barycentre about the middle one."""
    total, moment = 0.0, 0.0
    for d in range(-2, 3):
        total += contrast[top + d, j]
        moment += d * contrast[top + d, j]
    return total, moment / total if total > 0 else np.nan


@njit(cache=True)
def barycentres(contrast, guide, path, noise):  # type: ignore[no-untyped-def]
    """Five-pixel barycentre about the extremum in each column: row, its standard deviation, and the sum.

    The window is moved once to the pixel nearest to the barycentre, else noise at a faint tip cuts off
    one flank of the line. Where two windows would do, the one on the side of ``path`` is taken.
    """
    rows, n = contrast.shape
    row, sd, flux = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n)
    for j in range(n):
        top = extremum(guide, path[j], j)
        total, shift = five_pixel_sum(contrast, top, j)
        if 0.5 < abs(shift) < 2.5 and 2 <= top + round(shift) < rows - 2:
            top += round(shift)
            total, shift = five_pixel_sum(contrast, top, j)
        flux[j] = total
        if total > 0 and abs(shift) < 2:
            square = 0.0
            for d in range(-2, 3):
                square += (d - shift) ** 2
            row[j], sd[j] = top + shift, noise * np.sqrt(square) / total
    return row, sd, flux


@njit(cache=True)
def matched(contrast, guide, path, noise):  # type: ignore[no-untyped-def]
    """Row in each column where a Gaussian profile of ``PROFILE`` px fits best, its standard deviation, five-pixel sum.

    The maximum of Σ C(k) g(k − c): maximum likelihood in white noise for a line of that width; for one r times as
    wide the SD is ((r + 1/r)/2)^1.5 of the least possible, 1.1 at r = 0.7 or 1.45. Neither a constant left in the
    background moves it, nor the place from which it is sought.
    """
    rows, n = contrast.shape
    row, sd, flux = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n)
    for j in range(n):
        top = extremum(guide, path[j], j)
        flux[j], shift = five_pixel_sum(contrast, top, j)
        shift = min(max(shift, -1.0), 1.0)
        for _ in range(STEPS):
            whole = int(np.floor(top + shift + 0.5))
            if not (shift == shift and REACH <= whole < rows - REACH):
                shift = np.nan
                break
            shift, top = top + shift - whole, whole
            slope, bend, square = 0.0, 0.0, 0.0
            for d in range(-REACH, REACH + 1):
                u = d - shift
                weight = np.exp(-0.5 * (u / PROFILE) ** 2)
                slope += contrast[top + d, j] * u * weight
                bend += contrast[top + d, j] * ((u / PROFILE) ** 2 - 1) * weight
                square += (u * weight) ** 2
            if bend >= 0:
                shift = np.nan
                break
            step = min(max(-slope / bend, -0.5), 0.5)
            shift += step
            if abs(step) < 1e-4:
                break
        if abs(top + shift - path[j]) < 2.5:
            row[j], sd[j] = top + shift, noise * np.sqrt(square) / -bend
    return row, sd, flux


@njit(cache=True)
def local_quadratic(row, reach):  # type: ignore[no-untyped-def]
    """Value and slope of a quadratic fitted to the measured rows within ``reach`` columns on either side.

    Where fewer than 5 rows are measured there, both are NaN.
    """
    n = row.size
    value, slope = np.full(n, np.nan), np.full(n, np.nan)
    for j in range(n):
        s0 = s1 = s2 = s3 = s4 = t0 = t1 = t2 = 0.0
        for i in range(max(0, j - reach), min(n, j + reach + 1)):
            if row[i] == row[i]:
                u = (i - j) / reach
                s0 += 1
                s1 += u
                s2 += u * u
                s3 += u * u * u
                s4 += u * u * u * u
                t0 += row[i]
                t1 += row[i] * u
                t2 += row[i] * u * u
        det = s0 * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
        if s0 < 5 or det < 1e-9 * s0**3:
            continue
        value[j] = (t0 * (s2 * s4 - s3 * s3) - s1 * (t1 * s4 - s3 * t2) + s2 * (t1 * s3 - s2 * t2)) / det
        slope[j] = (s0 * (t1 * s4 - s3 * t2) - t0 * (s1 * s4 - s2 * s3) + s2 * (s1 * t2 - t1 * s2)) / det / reach
    return value, slope


@njit(cache=True)
def _level(background, path):  # type: ignore[no-untyped-def]
    """Draw the background under the line straight from 5 rows above the path to 5 rows below.

    The closing fills the line up to its lower brim, which under a slope of grey levels is a tilted error.
    """
    out = background.copy()
    for j in range(path.size):
        above, below = background[path[j] - 5, j], background[path[j] + 5, j]
        for k in range(path[j] - 4, path[j] + 5):
            out[k, j] = above + (below - above) * np.float32((k - path[j] + 5) / 10)
    return out


@njit(cache=True)
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


@njit(cache=True)
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


@njit(cache=True)
def read_line(image, background, sign, expected, ceiling, search, threshold, gap, match):  # type: ignore[no-untyped-def]
    """Centreline in one frame within ``search`` rows of the expected rows.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    background : (height, width) array
        Grey levels without the whisker, or an array of size 0 to close across rows instead.
    sign : float
        1 for a dark whisker, −1 for a bright one.
    expected : (width,) array
        Where the whisker is expected [px]; NaN in columns not to be read.
    ceiling : (width,) array
        Contrast above which a line attracts no more [grey levels], so that a darker neighbour does not win.
    search : int
        Rows to search on either side.
    threshold : float
        Five-pixel contrast, averaged over 7 columns, over the noise of one column's sum: below, a column is lost.
    gap : int
        Longest run of lost columns within a line; what is beyond a longer one is not this whisker.
    match : bool
        Whether the row is that of the matched profile, or of the five-pixel barycentre.

    Returns
    -------
    row, sd, flux : (width,) arrays
        As in :class:`vibrissa.video.following.Centrelines`, for one whisker in one frame.
    """
    height, width = image.shape
    row, sd, flux = np.full(width, np.nan), np.full(width, np.nan), np.full(width, np.nan)
    first, stop = _inside(expected, height)
    if stop - first < 7:
        return row, sd, flux
    centre = np.floor(expected[first:stop] + 0.5).astype(np.int64)
    half = search + 7
    level, contrast = contrast_band(image, background, sign, centre, first, half)
    offset, noise = off_line(contrast)
    guide = smooth_along(contrast, 1)
    low = np.maximum(half - search, 2 - centre + half)
    high = np.minimum(half + search, height - 3 - centre + half)
    path = best_path(
        np.minimum(guide, ceiling[first:stop].astype(np.float32)), low, high, STIFFNESS * noise, TETHER * noise
    )
    if not background.size:
        contrast += _level(level, path) - level
    if match:
        rows, sds, sums = matched(contrast - offset, guide, path, noise)
    else:
        rows, sds, sums = barycentres(contrast - offset, guide, path, noise)
    mean = smooth_along(sums.reshape(1, -1).astype(np.float32), 3)[0]
    visible = (mean > threshold * noise * np.sqrt(5)) & ~np.isnan(rows)
    kept = _chain(visible, rows + centre - half - expected[first:stop], gap)
    for j in range(kept.size):
        if kept[j]:
            row[first + j] = rows[j] + centre[j] - half
            sd[first + j], flux[first + j] = sds[j], sums[j]
    return row, sd, flux
