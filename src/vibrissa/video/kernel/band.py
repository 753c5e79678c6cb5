"""A straightened band of the image around where a whisker is expected, and the background in it.

Row ``half`` of a band is the expected row, rounded, of every column. Grey levels are whole numbers of 64ths, as the
background is a mean over eight columns, in eighths between two of these, and turned over if the whisker is bright: it
is dark in the band. All kernels are serial, for one core, and loop over whole rows, which the compiler turns into
vector instructions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit

Image = NDArray[Any]  # grey levels, in the type of the movie or, in a band, in one that holds sums of them
Rows = NDArray[np.float64]
Places = NDArray[np.int64]
Single = NDArray[np.float32]

BACKGROUND_ROWS = 15  # height of the closing: three times the width of a whisker with its blur
ALONG = 4  # columns on either side over which the closing's input is averaged, and between those closed
SCALE = 64  # of the grey levels in a band: sums of eight columns, and eighths of them
RUN = 8  # columns that are copied at once
_N = tuple(np.uint64(i) for i in range(RUN))


@njit(cache=True, nogil=True)
def fetch(image: Image, expected: Rows, reach: int) -> int:
    """Touch the memory of a band before it is read, so that the processor fetches all of it at once.

    Parameters
    ----------
    image : (height, width) array
        Grey levels, of which one pixel in every 64 bytes is touched.
    expected : (width,) array
        Rows where the line is expected [px].
    reach : int
        Rows on either side that are touched.

    Returns
    -------
    int
        Sum of these pixels, of no meaning, which keeps the compiler from leaving them out.
    """
    height, width = image.shape
    step, pixels, total = 64 // image.itemsize, image.reshape(-1), 0
    for first in range(0, width, step):
        low, high = height, 0
        for j in range(first, min(first + step, width), 8):
            if 0 <= expected[j] < height:
                low, high = min(low, int(expected[j])), max(high, int(expected[j]))
        if low > high:
            continue
        for row in range(max(low - reach, 0), min(high + reach + 1, height)):
            total += pixels[row * width + first]
    return total


@njit(cache=True, nogil=True)
def _straighten(image: Image, centre: Places, first: int, half: int) -> Image:
    """Band (2 half + 1, n) of an image around the rows ``centre`` from the column ``first``; its edges are repeated."""
    height, width = image.shape
    n = centre.size
    band = np.empty((2 * half + 1, n), image.dtype)
    pixels, out = image.reshape(-1), band.reshape(-1)
    j = 0
    while j < n:
        stop = j + 1  # of the columns that lie at one height
        while stop < n and stop < j + RUN and centre[stop] == centre[j]:
            stop += 1
        top, column = centre[j] - half, first + j
        rows_within = top >= 0 and top + 2 * half < height
        if rows_within and column >= 0 and column + RUN <= width and j + RUN <= n:
            # a whole run, of which the next one writes over what is beyond ``stop``
            for k in range(2 * half + 1):
                copy_run(pixels, np.uint64((top + k) * width + column), out, np.uint64(k * n + j))
        else:
            for k in range(2 * half + 1):
                row = min(max(top + k, 0), height - 1)
                for i in range(j, stop):
                    band[k, i] = image[row, min(max(first + i, 0), width - 1)]
        j = stop
    return band


@njit(cache=True, nogil=True)
def copy_run(pixels: Image, p: np.uint64, out: Image, q: np.uint64) -> None:
    """Copy eight neighbours at once: all are read before the first is written, so that they go as one.

    Parameters
    ----------
    pixels, out : (n,) arrays
        From where and to where.
    p, q : uint64
        Index of the first neighbour in either.
    """
    a, b, c, d = pixels[p], pixels[p + _N[1]], pixels[p + _N[2]], pixels[p + _N[3]]
    e, f, g, h = pixels[p + _N[4]], pixels[p + _N[5]], pixels[p + _N[6]], pixels[p + _N[7]]
    out[q], out[q + _N[1]], out[q + _N[2]], out[q + _N[3]] = a, b, c, d
    out[q + _N[4]], out[q + _N[5]], out[q + _N[6]], out[q + _N[7]] = e, f, g, h


@njit(cache=True, nogil=True)
def smooth_along(band: Single, reach: int) -> Single:
    """Running mean along the columns, over fewer at the ends.

    Parameters
    ----------
    band : (rows, n) array
        Grey levels.
    reach : int
        Columns on either side in the mean.

    Returns
    -------
    (rows, n) array
        Means.
    """
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
def _higher(here: Image, there: Image, out: Image) -> None:
    for i in range(out.size):
        a, b = here[i], there[i]
        out[i] = a if a > b else b


@njit(cache=True, nogil=True)
def _lower(here: Image, there: Image, out: Image) -> None:
    for i in range(out.size):
        a, b = here[i], there[i]
        out[i] = a if a < b else b


@njit(cache=True, nogil=True)
def closing(band: Image, size: int) -> Image:
    """Closing across ``size`` rows: dark lines narrower than that are filled; loses size − 1 rows at each end.

    Parameters
    ----------
    band : (rows, n) array
        Grey levels, written over.
    size : int
        Rows.

    Returns
    -------
    (rows − 2 size + 2, n) array
        Row k of a maximum or minimum covers k … k + size − 1.
    """
    rows, n = band.shape
    # maximum, then minimum; a window of 2 r rows is the extremum of two windows of r, so its reach doubles
    here, there = band.reshape(-1), np.empty(band.size, band.dtype)
    for highest in (True, False):
        reach = 1
        while reach < size:
            step = min(reach, size - reach)
            rows, reach = rows - step, reach + step
            low, high, out = here[: rows * n], here[step * n : (step + rows) * n], there[: rows * n]
            if highest:
                _higher(low, high, out)
            else:
                _lower(low, high, out)
            here, there = there, here
    return here[: rows * n].reshape(rows, n)


@njit(cache=True, nogil=True)
def _fours(pixels: Image, sign: int, out: Image) -> None:
    """Sums of four neighbours."""
    for b in range(out.size):
        out[b] = sign * (pixels[4 * b] + pixels[4 * b + 1] + pixels[4 * b + 2] + pixels[4 * b + 3])


@njit(cache=True, nogil=True)
def _eights(fours: Image, out: Image) -> None:
    """Sums of eight neighbours, four columns apart; in the last column of a band, of no meaning."""
    for b in range(out.size - 1):
        out[b] = fours[b] + fours[b + 1]


@njit(cache=True, nogil=True)
def _between(posts: Image, out: Image) -> None:
    """Eight times the values straight between posts, one before every fourth column."""
    for b in range(posts.size - 1):
        left, right = posts[b], posts[b + 1]
        out[4 * b] = 7 * left + right
        out[4 * b + 1] = 5 * left + 3 * right
        out[4 * b + 2] = 3 * left + 5 * right
        out[4 * b + 3] = left + 7 * right


@njit(cache=True, nogil=True)
def _scaled(pixels: Image, factor: int, out: Image) -> None:
    for j in range(out.size):
        out[j] = factor * pixels[j]


@njit(cache=True, nogil=True)
def levels(image: Image, background: Single, sign: Image, centre: Places, first: int, half: int) -> tuple[Image, Image]:
    """Grey levels of the band and of the background in it, (2 half + 1, n), in 64ths and in the type of ``sign``.

    The background is given, or, if of size 0, closed across rows: in the mean over eight columns, for every fourth one,
    and straight between.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    background : (height, width) array
        Grey levels without the whisker, or an array of size 0.
    sign : (1,) array of int
        1 for a dark whisker, −1 for a bright one, in the type of the band.
    centre : (n,) array of int
        Row of the image in the middle of the band, for each column; n in whole fours.
    first : int
        Column of the image that is the band's first.
    half : int
        Rows of the band on either side of its middle.

    Returns
    -------
    grey, level : (2 half + 1, n) arrays
        Image and background.
    """
    n, rows, factor = centre.size, 2 * half + 1, sign[0]
    grey, level = np.empty((rows, n), sign.dtype), np.empty((rows, n), sign.dtype)
    if background.size:
        band, margin = _straighten(image, centre, first, half), 0
        _given(background, centre, first, factor, level)
        for k in range(rows):
            _scaled(band[k], SCALE * factor, grey[k])
        return grey, level
    margin = BACKGROUND_ROWS - 1
    wide = np.empty(n + 2 * ALONG, np.int64)
    for j in range(wide.size):
        wide[j] = centre[min(max(j - ALONG, 0), n - 1)]
    band = _straighten(image, wide, first - ALONG, half + margin)
    fours = np.empty(band.size // 4, sign.dtype)
    posts = np.empty_like(fours)
    _fours(band.reshape(-1), factor, fours)
    _eights(fours, posts)
    posts[-1] = posts[-2]
    posts = closing(posts.reshape(band.shape[0], wide.size // 4), BACKGROUND_ROWS)
    for k in range(rows):
        _between(posts[k, :-1], level[k])
        _scaled(band[margin + k, ALONG : ALONG + n], SCALE * factor, grey[k])
    return grey, level


@njit(cache=True, nogil=True)
def _given(background: Single, centre: Places, first: int, sign: int, level: Image) -> None:
    """A given background in the band; its edges are repeated."""
    height, width = background.shape
    for k in range(level.shape[0]):
        for j in range(centre.size):
            row = min(max(centre[j] + k - level.shape[0] // 2, 0), height - 1)
            value = SCALE * sign * background[row, min(first + j, width - 1)]
            level[k, j] = np.int64(np.floor(value + 0.5))
