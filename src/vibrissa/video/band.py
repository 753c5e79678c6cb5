"""A straightened band of the image around where a whisker is expected, and its contrast to the background.

Row ``half`` of a band is the expected row, rounded, of every column. A whisker is dark in it (``sign`` = −1
turns a bright one over). All kernels are serial, for one core.
"""

from __future__ import annotations

import numpy as np
from numba import njit

BACKGROUND_ROWS = 15  # height of the closing: three times the width of a whisker with its blur
ALONG = 4  # columns on either side over which the closing's input is averaged


@njit(cache=True)
def straighten(image, sign, centre, first, half):  # type: ignore[no-untyped-def]
    """Band (2 half + 1, n) of an image around the rows ``centre`` of the columns from ``first``."""
    height = image.shape[0]
    n = centre.size
    band = np.empty((2 * half + 1, n), np.float32)
    for k in range(2 * half + 1):
        for j in range(n):
            row = min(max(centre[j] + k - half, 0), height - 1)
            band[k, j] = sign * np.float32(image[row, first + j])
    return band


@njit(cache=True)
def smooth_along(band, reach):  # type: ignore[no-untyped-def]
    """Running mean over ``reach`` columns on either side, over fewer at the ends."""
    rows, n = band.shape
    out = np.empty_like(band)
    for k in range(rows):
        total, count = np.float32(0), 0
        for j in range(min(reach, n)):
            total += band[k, j]
            count += 1
        for j in range(n):
            if j + reach < n:
                total += band[k, j + reach]
                count += 1
            if j - reach - 1 >= 0:
                total -= band[k, j - reach - 1]
                count -= 1
            out[k, j] = total / count
    return out


@njit(cache=True)
def _extremum_rows(band, size, sign):  # type: ignore[no-untyped-def]
    """Maximum (sign 1) or minimum (−1) over ``size`` rows, by doubling; row k covers k … k + size − 1."""
    out = band.copy()
    reach = 1
    while reach < size:
        step = min(reach, size - reach)
        rows = out.shape[0] - step
        for k in range(rows):
            for j in range(out.shape[1]):
                here, there = out[k, j], out[k + step, j]
                out[k, j] = max(here, there) if sign > 0 else min(here, there)
        out = out[:rows]
        reach += step
    return out


@njit(cache=True)
def closing(band, size):  # type: ignore[no-untyped-def]
    """Closing across ``size`` rows: dark lines narrower than that are filled; loses size − 1 rows at each end."""
    return _extremum_rows(_extremum_rows(band, size, 1), size, -1)


@njit(cache=True)
def contrast_band(image, background, sign, centre, first, half):  # type: ignore[no-untyped-def]
    """Background and contrast to it in the straightened band; the background is given, or closed across rows."""
    if background.size:
        level = straighten(background, sign, centre, first, half)
        return level, level - straighten(image, sign, centre, first, half)
    margin = BACKGROUND_ROWS - 1
    band = straighten(image, sign, centre, first, half + margin)
    level = closing(smooth_along(band, ALONG), BACKGROUND_ROWS)
    return level, level - band[margin : margin + 2 * half + 1]
