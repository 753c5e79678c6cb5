"""Where a line lies across its own direction, how wide and how deep it is, and how sure that is."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.loops import njit
from vibrissa.video.find.profile_fit import Single, fit_profile

WINDOW = 1.5  # of the pixels across the line, over its width, to either side
FULL_WIDTH = 2.3548  # full width at half maximum of a Gaussian over its standard deviation
FURTHEST = 0.75  # distance from the course, over the width, beyond which another line is read
TILTED = 1.0  # background's change across one width over the depth of the line, above which it is an edge
DEPTH_NOISE = 1.0, 1.5  # depth of a line over its standard deviation, below which a point is left out of either fit
SHALLOW = 0.5  # depth of a line over that about it, below which it has ended
OUTLYING = 4.0  # distance from a smooth course over the standard deviation, from which on another line is read
SHARPEST = 1.5  # width of the sharpest line, as pixels show it [px]
NARROWEST, WIDEST = 0.5, 3.0  # of a line, over the width of all


@njit(cache=True, nogil=True, error_model="numpy")
def smoothed(values: Array, good: Mask, reach: int, order: int, out: Array, leverage: Array) -> None:
    """Polynomial of order 0 or 2 fitted to the good values within reach of each point, and the share that its own has.

    Parameters
    ----------
    values : (n,) array
        One for each point.
    good : (n,) array of bool
        Which are fitted.
    reach : int
        Points to either side.
    order : int
        0 or 2; 0 where fewer than five values are good.
    out, leverage : (n,) arrays
        Written; NaN and 1 where none is good.
    """
    n = values.size
    for k in range(n):
        s0 = s1 = s2 = s3 = s4 = t0 = t1 = t2 = 0.0
        for j in range(max(k - reach, 0), min(k + reach + 1, n)):
            if good[j]:
                u = (j - k) / reach
                v = values[j]
                s0 += 1
                s1 += u
                s2 += u * u
                s3 += u * u * u
                s4 += u * u * u * u
                t0 += v
                t1 += u * v
                t2 += u * u * v
        out[k], leverage[k] = np.nan, 1.0
        if s0 == 0:
            continue
        out[k], leverage[k] = t0 / s0, 1 / s0
        if order == 2 and s0 >= 5:
            # first row of the inverse of the normal matrix
            a, b, c = s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2
            det = s0 * a + s1 * b + s2 * c
            if det > 1e-9 * s0 * s0 * s0:
                out[k], leverage[k] = (a * t0 + b * t1 + c * t2) / det, a / det


@njit(cache=True, nogil=True)
def resampled(points: Array, out: Array) -> int:
    """Points one pixel apart along a line through given points.

    Parameters
    ----------
    points : (n, 2 or more) array
        Column and row of the given points.
    out : (room, 2) array
        Written.

    Returns
    -------
    int
        How many; at most the room there is.
    """
    count, left = 0, 0.0
    for k in range(len(points) - 1):
        du, dv = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
        length = np.hypot(du, dv)
        while left <= length and length > 0 and count < len(out):
            out[count, 0] = points[k, 0] + du * left / length
            out[count, 1] = points[k, 1] + dv * left / length
            count += 1
            left += 1.0
        left -= length
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _directions(course: Array, out: Array) -> None:
    """Unit vectors along a course."""
    n = len(course)
    for k in range(n):
        i, j = max(k - 2, 0), min(k + 2, n - 1)
        du, dv = course[j, 0] - course[i, 0], course[j, 1] - course[i, 1]
        length = max(np.hypot(du, dv), 1e-9)
        out[k, 0], out[k, 1] = du / length, dv / length


@njit(cache=True, nogil=True, error_model="numpy")
def _fit_all(
    grey: Single,
    course: Array,
    way: Array,
    sigma: Array,
    typical: float,
    n: int,
    least: float,
    room: Array,
    cells: Array,
    fits: Array,
    good: Mask,
) -> None:
    """Fit a profile about every point of a course; ``good`` where a line is there, and no edge."""
    height, width = grey.shape
    for k in range(len(course)):
        x, y = course[k, 0], course[k, 1]
        full = FULL_WIDTH * sigma[k]
        good[k] = False
        fits[k, 0] = np.nan
        if not (0 <= x <= width - 1 and 0 <= y <= height - 1):
            continue
        fit_profile(grey, x, y, way[k, 0], way[k, 1], sigma[k], WINDOW * full, n, room, cells, fits[k])
        depth = fits[k, 0]
        noise = np.sqrt(fits[k, 5] * fits[k, 6] / fits[k, 7])
        near = (
            abs(fits[k, 1]) < FURTHEST * max(FULL_WIDTH * typical, SHARPEST) and abs(fits[k, 3]) * full < TILTED * depth
        )
        good[k] = depth > least * noise and near


@njit(cache=True, nogil=True, error_model="numpy")
def _move(course: Array, way: Array, shift: Array) -> None:
    for k in range(len(course)):
        if shift[k] == shift[k]:
            course[k, 0] -= shift[k] * way[k, 1]
            course[k, 1] += shift[k] * way[k, 0]


@njit(cache=True, nogil=True, error_model="numpy")
def place_line(
    grey: Single, course: Array, typical: float, room: Array, cells: Array, work: Array, good: Mask, out: Array
) -> int:
    """Place a line at points one pixel apart.

    Parameters
    ----------
    grey : (height, width) array
        Grey levels, lines darker than their sides.
    course : (n, 2) array
        Columns and rows of the line, about right; moved onto it.
    typical : float
        Standard deviation of the profiles of lines in this movie [px].
    room : (16, 5) array
        Room for work.
    cells : (13, most) array
        Room for the pixels about a point.
    work : (n, 16) array
        Room for work.
    good : (n,) array of bool
        Written: where the line was measured.
    out : (n, 5) array
        Written: column, row, full width at half depth, depth [grey levels], and standard deviation of the position
        across the line [px], NaN where it was not measured.

    Returns
    -------
    int
        Points that were measured.
    """
    n = len(course)
    way, fits = work[:, 0:2], work[:, 2:10]
    sigma, shift, smooth, leverage, value = work[:, 10], work[:, 11], work[:, 12], work[:, 13], work[:, 14]
    near = max(int(2.5 * typical * FULL_WIDTH), 3)
    sigma[:] = typical
    good[:] = True
    for axis in range(2):
        value[:] = course[:, axis]
        smoothed(value, good, near, 2, smooth, leverage)
        course[:, axis] = smooth
    _directions(course, way)
    _fit_all(grey, course, way, sigma, typical, 5, DEPTH_NOISE[0], room, cells, fits, good)
    if 3 * good.sum() < n or n < 5:
        return 0
    shift[:] = fits[:, 1]
    smoothed(shift, good, 2 * near, 2, smooth, leverage)
    _move(course, way, smooth)
    # the width of the line, smooth along it
    for k in range(n):
        value[k] = min(max(sigma[k] + fits[k, 2], NARROWEST * typical), WIDEST * typical)
    smoothed(value, good, 3 * near, 0, smooth, leverage)
    for k in range(n):
        sigma[k] = smooth[k] if smooth[k] == smooth[k] else typical
    _directions(course, way)
    _fit_all(grey, course, way, sigma, typical, 4, DEPTH_NOISE[1], room, cells, fits, good)
    return _write(course, way, fits, sigma, near, work, good, out)


@njit(cache=True, nogil=True, error_model="numpy")
def _write(course: Array, way: Array, fits: Array, sigma: Array, near: int, work: Array, good: Mask, out: Array) -> int:
    """Places, widths, depths and standard deviations from the last fit."""
    n = len(course)
    shift, smooth, leverage, value, noise = work[:, 11], work[:, 12], work[:, 13], work[:, 14], work[:, 15]
    # beyond its ends a line has no depth
    smoothed(fits[:, 0], good, 2 * near, 0, smooth, leverage)
    for k in range(n):
        good[k] = good[k] and fits[k, 0] > SHALLOW * smooth[k]
    # noise of the pixels, from what the profiles leave, over a stretch of the line
    value[:] = fits[:, 6] / fits[:, 7]
    smoothed(value, good, 3 * near, 0, noise, leverage)
    shift[:] = fits[:, 1]
    smoothed(shift, good, 2 * near, 2, smooth, leverage)
    # scatter about a smooth course over what the pixels' noise explains: neighbours of compressed pixels err alike
    excess, count = 0.0, 0
    for k in range(n):
        if good[k] and leverage[k] < 0.5:
            excess += (shift[k] - smooth[k]) ** 2 / (fits[k, 4] * noise[k] * (1 - leverage[k]))
            count += 1
    factor = max(excess / count, 1.0) if count > 10 else 1.0
    measured = 0
    for k in range(n):
        sd = np.sqrt(fits[k, 4] * noise[k] * factor)
        good[k] = good[k] and abs(shift[k] - smooth[k]) < OUTLYING * sd
        moved = shift[k] if good[k] else 0.0
        out[k, 0] = course[k, 0] - moved * way[k, 1]
        out[k, 1] = course[k, 1] + moved * way[k, 0]
        out[k, 2] = FULL_WIDTH * sigma[k]
        out[k, 3] = fits[k, 0]
        out[k, 4] = sd if good[k] else np.nan
        measured += good[k]
    return measured
