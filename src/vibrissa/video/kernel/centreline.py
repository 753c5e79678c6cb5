"""The centreline of one whisker in one frame, read column by column in a band around where it is expected.

The band is straightened: row ``half`` of it is the expected row, rounded, of every column. All kernels are
serial, for one core, and take the whisker as dark (``sign`` = −1 turns a bright one over).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit
from vibrissa.video.kernel.band import SCALE, Image, Places, Rows, Single, levels
from vibrissa.video.kernel.estimators import place
from vibrissa.video.kernel.path import best_path

FINE = 64  # of the path's score: whole numbers of 64ths of the noise's standard deviation
STIFFNESS = 2 * FINE  # cost of a step of one row against the expected course
TETHER = np.float32(0.2 * FINE)  # cost of a distance of one row from the expected course, squared
MOST = np.float32(4096 * FINE)  # contrast above which more attracts no more, so that 8000 columns' sum is held
OUTSIDE = -(10**7)  # score of rows outside the image
GAP = 12  # longest run of lost columns within one whisker
JUMP = 2.5  # rows against the expected course between two ends of a gap above which they are two whiskers
SAMPLE = 40  # columns, or nearly so, from which the noise is estimated


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _count_below(values: Single, limit: np.float32) -> np.float32:
    """Number of values below a limit, each spread evenly over one grey level, as the camera rounded to these."""
    count, low = np.float32(0), limit + np.float32(SCALE / 2)
    for j in range(values.size):
        part = low - values[j]
        part = part if part > np.float32(0) else np.float32(0)
        count += part if part < np.float32(SCALE) else np.float32(SCALE)
    return count / np.float32(SCALE)


@njit(cache=True, nogil=True)
def _quantile(values: Single, share: float, low: np.float32, high: np.float32) -> np.float32:
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
def _off_line(grey: Image, level: Image) -> tuple[np.float32, np.float32]:
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
    offset = _quantile(values, 0.5, low, high)
    # 15.87 % of a normal distribution lie below −1 SD; whole grey levels alone have an SD of 0.29
    noise = (offset - _quantile(values, 0.1587, low, offset)) * np.float32(1 / SCALE)
    return offset * np.float32(1 / SCALE), max(noise, np.float32(0.29))


@njit(cache=True, nogil=True)
def _sum_of_three(level: Image, grey: Image, out: Image) -> None:
    """Contrast summed over each column and its two neighbours; the end columns count for those beyond them."""
    n = out.size
    for j in range(1, n - 1):
        out[j] = level[j - 1] - grey[j - 1] + level[j] - grey[j] + level[j + 1] - grey[j + 1]
    out[0] = 2 * (level[0] - grey[0]) + level[1] - grey[1]
    out[n - 1] = 2 * (level[n - 1] - grey[n - 1]) + level[n - 2] - grey[n - 2]


@njit(cache=True, nogil=True)
def _guide(grey: Image, level: Image, reach: int) -> NDArray[np.int32]:
    """Contrast averaged over three columns [192nds of a grey level], in ``reach`` rows about the middle one."""
    half = grey.shape[0] // 2
    out = np.empty((2 * reach + 1, grey.shape[1]), np.int32)
    for k in range(2 * reach + 1):
        _sum_of_three(level[half - reach + k], grey[half - reach + k], out[k])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _capped(
    contrast: NDArray[np.int32], ceiling: Single, unit: np.float32, cost: np.float32, out: NDArray[np.int32]
) -> None:
    for j in range(out.size):
        value, most = np.float32(contrast[j]), ceiling[j]
        value = (most if value > most else value) * unit
        value = value if value < MOST else MOST
        out[j] = np.int32((value if value > -MOST else -MOST) - cost)


@njit(cache=True, nogil=True)
def _tops(guide: NDArray[np.int32], path: Places, low: int) -> Places:
    """Row of the highest of three pixels about the path in each column; ``low`` is the row of the band of guide's 0."""
    top = np.empty(path.size, np.int64)
    for j in range(path.size):
        k = path[j] - low
        above, here, below = guide[k - 1, j], guide[k, j], guide[k + 1, j]
        side = 1 if below > above else -1
        top[j] = path[j] + (side if max(above, below) > here else 0)
    return top


@njit(cache=True, nogil=True)
def _chain(offset: Rows) -> tuple[int, int]:
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
def _inside(expected: Rows, height: int) -> tuple[int, int]:
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
def read_line(
    image: Image,
    background: Single,
    sign: Image,
    expected: Rows,
    ceiling: Rows,
    how: tuple[int, float, int],
    lines: tuple[Rows, Rows, Rows],
) -> None:
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
    how : (search, threshold, estimator)
        Rows to search on either side; five-pixel contrast, averaged over 7 columns, over the noise of one column's sum,
        below which a column is lost; what places the line, by :func:`vibrissa.video.kernel.estimator_table.code_of`.
    lines : (row, sd, contrast), (width,) arrays
        Written: as in :class:`vibrissa.video.follow.following.Centrelines`, for one whisker in one frame.
    """
    height, (search, threshold, estimator) = image.shape[0], how
    for line in lines:
        line[:] = np.nan
    first, stop = _inside(expected, height)
    if stop - first < 7:
        return
    centre, cap = _centre(expected, ceiling, first, stop)
    half = search + 7
    grey, level = levels(image, background, sign, centre, first, half)
    offset, noise = _off_line(grey, level)
    path, top = _path_and_tops(grey, level, cap, centre, height, search, noise)
    if background.size:
        # nothing was closed, so there is no brim
        grey -= level
        level[:] = 0
    rows, sds, sums = place(estimator, grey, level, top, path, noise, offset)
    _keep(rows, sds, sums, threshold * noise * np.sqrt(5.0), expected, centre, first, stop, half, lines)


@njit(cache=True, nogil=True)
def _centre(expected: Rows, ceiling: Rows, first: int, stop: int) -> tuple[Places, Single]:
    """Rows expected, rounded, and ceiling of the columns that are read, and as at the last one up to whole fours."""
    n = (stop - first + 3) // 4 * 4
    centre, cap = np.empty(n, np.int64), np.empty(n, np.float32)
    for j in range(n):
        at = min(first + j, stop - 1)
        centre[j], cap[j] = np.int64(expected[at] + 0.5), ceiling[at] * (3 * SCALE)
    return centre, cap


@njit(cache=True, nogil=True, error_model="numpy")
def _keep(
    rows: Rows,
    sds: Rows,
    sums: Single,
    least: float,
    expected: Rows,
    centre: Places,
    first: int,
    stop: int,
    half: int,
    lines: tuple[Rows, Rows, Rows],
) -> None:
    """Write the visible columns, in one chain, to its columns of the image."""
    n, (row, sd, flux) = stop - first, lines
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
def _path_and_tops(
    grey: Image, level: Image, cap: Single, centre: Places, height: int, search: int, noise: np.float32
) -> tuple[Places, Places]:
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
