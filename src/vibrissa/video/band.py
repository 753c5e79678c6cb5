"""A straightened band of the image around where a whisker is expected, and the background in it.

Row ``half`` of a band is the expected row, rounded, of every column. Grey levels are whole numbers of ninths, as
the background is a mean over nine columns, and turned over if the whisker is bright: it is dark in the band. All
kernels are serial, for one core, and loop over whole rows, which the compiler turns into vector instructions.
"""

from __future__ import annotations

import numpy as np
from numba import njit

BACKGROUND_ROWS = 15  # height of the closing: three times the width of a whisker with its blur
ALONG = 4  # columns on either side over which the closing's input is averaged
SCALE = 2 * ALONG + 1  # of the grey levels in a band


@njit(cache=True, nogil=True)
def straighten(image, centre, first, half):  # type: ignore[no-untyped-def]
    """Band (2 half + 1, n) of an image around the rows ``centre`` of the columns from ``first``; its edges go on."""
    height, width = image.shape
    band = np.empty((2 * half + 1, centre.size), image.dtype)
    pixels, at = image.reshape(-1), np.empty(centre.size, np.uint32)
    top, bottom = np.min(centre) - half, np.max(centre) - half
    start = -1  # row of the band from which every column only goes down, from pixel to pixel of the image
    for k in range(2 * half + 1):
        if start < 0 or bottom + k >= height:
            for j in range(centre.size):
                row = min(max(centre[j] + k - half, 0), height - 1)
                at[j] = row * width + min(max(first + j, 0), width - 1)
            start = k
        pick(pixels[(k - start) * width :], at, band[k])
        if top + k < 0:
            start = -1
    return band


@njit(cache=True, nogil=True)
def pick(values, at, out):  # type: ignore[no-untyped-def]
    """Take the values that stand at given places."""
    for j in range(out.size):
        out[j] = values[at[j]]


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _raise(here, there):  # type: ignore[no-untyped-def]
    for j in range(here.size):
        a, b = here[j], there[j]
        here[j] = a if a > b else b


@njit(cache=True, nogil=True)
def _lower(here, there):  # type: ignore[no-untyped-def]
    for j in range(here.size):
        a, b = here[j], there[j]
        here[j] = a if a < b else b


@njit(cache=True, nogil=True)
def _extremum_rows(band, size, sign):  # type: ignore[no-untyped-def]
    """Maximum (sign 1) or minimum (−1) over ``size`` rows, in place; row k covers k … k + size − 1."""
    rows, reach = band.shape[0], 1
    while reach < size:
        step = min(reach, size - reach)
        rows -= step
        for k in range(rows):
            if sign > 0:
                _raise(band[k], band[k + step])
            else:
                _lower(band[k], band[k + step])
        reach += step
    return band[:rows]


@njit(cache=True, nogil=True)
def closing(band, size):  # type: ignore[no-untyped-def]
    """Closing across ``size`` rows: dark lines narrower than that are filled; loses size − 1 rows at each end.

    The band is written over.
    """
    return _extremum_rows(_extremum_rows(band, size, 1), size, -1)


@njit(cache=True, nogil=True)
def _nine(pixels, sign, out):  # type: ignore[no-untyped-def]
    """Sums of nine neighbours; ``pixels`` has eight more of them than ``out``."""
    p = pixels
    for j in range(out.size):
        a, b, c = p[j] + p[j + 1] + p[j + 2], p[j + 3] + p[j + 4] + p[j + 5], p[j + 6] + p[j + 7] + p[j + 8]
        out[j] = sign * (a + b + c)


@njit(cache=True, nogil=True)
def _scaled(pixels, factor, out):  # type: ignore[no-untyped-def]
    for j in range(out.size):
        out[j] = factor * pixels[j]


@njit(cache=True, nogil=True)
def levels(image, background, sign, centre, first, half):  # type: ignore[no-untyped-def]
    """Grey levels of the band and of the background in it, (2 half + 1, n), in ninths and in the type of ``sign``.

    The background is given, or, if of size 0, closed across rows.
    """
    n = centre.size
    if background.size:
        level = np.rint(straighten(background, centre, first, half) * (SCALE * sign[0])).astype(sign.dtype)
        margin, along = 0, 0
    else:
        margin, along = BACKGROUND_ROWS - 1, ALONG
    wide = np.empty(n + 2 * along, np.int64)
    wide[:along], wide[along : along + n], wide[along + n :] = centre[0], centre, centre[-1]
    band = straighten(image, wide, first - along, half + margin)
    if not background.size:
        level = np.empty((band.shape[0], n), sign.dtype)
        for k in range(band.shape[0]):
            _nine(band[k], sign[0], level[k])
        level = closing(level, BACKGROUND_ROWS)
    grey = np.empty((2 * half + 1, n), sign.dtype)
    for k in range(2 * half + 1):
        _scaled(band[margin + k, along : along + n], SCALE * sign[0], grey[k])
    return grey, level
