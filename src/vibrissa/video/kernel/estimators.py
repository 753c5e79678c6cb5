"""Where a line lies in each column, to a fraction of a pixel, by one of the estimators of ``estimator_table``.

All read a window of nine pixels about the line's extremum and give a row, the standard deviation that the pixel
noise gives it, and the five-pixel sum of the contrast. They work column by column: nothing is smoothed along the
line, and nothing of the frame before draws it.
"""

from __future__ import annotations

import numpy as np

from vibrissa.loops import njit
from vibrissa.video.kernel.band import RUN, SCALE, Image, Places, Rows, Single, copy_run
from vibrissa.video.kernel.estimator_table import code_of

MATCHED, THREE_POINT = code_of("matched"), code_of("three-point")

PROFILE = 1.1  # SD of the profile that is matched [px]; a sharper one is drawn to the pixels' middles by 0.01 px
REACH = 4  # rows on either side that are matched
STEPS = 1, 2  # of Newton's method, before and after the window is moved to the pixel nearest to what was found
STRAY = 2.5  # rows from the path beyond which a line is another one
ASIDE = 1.0  # rows from the barycentre beyond which a profile is another line's
G1, G2, G3, G4 = (np.float32(np.exp(-0.5 * (d / PROFILE) ** 2)) for d in range(1, REACH + 1))
CURVE = np.float32(1 / PROFILE**2)
SPREAD = np.float32(np.sqrt(np.sqrt(np.pi) / 2 * PROFILE**3))  # √Σ u² g(u)²


@njit(cache=True, nogil=True)
def _read_windows(grey: Image, level: Image, top: Places, offset: np.float32) -> Single:
    """Contrast [grey levels] in nine rows about ``top``, (9, n).

    A closed background fills the line up to its lower brim, which under a slope of grey levels is a tilted error:
    it is drawn straight from 5 rows above the middle to 5 rows below.
    """
    n, j = top.size, 0
    raw, window = np.empty((11, n), grey.dtype), np.empty((9, n), np.float32)
    greys, levels, out = grey.reshape(-1), level.reshape(-1), raw.reshape(-1)
    while j + RUN <= n:
        stop = j + 1  # of the columns whose tops are at one height
        while stop < j + RUN and top[stop] == top[j]:
            stop += 1
        # a whole run, of which the next one writes over what is beyond ``stop``
        for d in range(9):
            copy_run(greys, np.uint64((top[j] - 4 + d) * n + j), out, np.uint64(d * n + j))
        copy_run(levels, np.uint64((top[j] - 5) * n + j), out, np.uint64(9 * n + j))
        copy_run(levels, np.uint64((top[j] + 5) * n + j), out, np.uint64(10 * n + j))
        j = stop
    for d in range(9):
        _below_the_brim(raw[d], raw[9], raw[10], np.float32(d + 1) * np.float32(0.1), offset, window[d])
    while j < n:
        _read_window(grey, level, top, offset, window, j)
        j += 1
    return window


@njit(cache=True, nogil=True)
def _read_window(grey: Image, level: Image, top: Places, offset: np.float32, window: Single, j: int) -> None:
    """The same in one column."""
    k, n = top[j], top.size
    greys, levels, out = grey.reshape(-1), level.reshape(-1), window.reshape(-1)
    above, below = levels[np.uint64((k - 5) * n + j)], levels[np.uint64((k + 5) * n + j)]
    for d in range(9):
        share = np.float32(d + 1) * np.float32(0.1)
        out[np.uint64(d * n + j)] = _contrast(greys[np.uint64((k - 4 + d) * n + j)], above, below, share, offset)


@njit(cache=True, nogil=True)
def _below_the_brim(
    grey: Image, upper: Image, lower: Image, share: np.float32, offset: np.float32, out: Single
) -> None:
    for j in range(out.size):
        out[j] = _contrast(grey[j], upper[j], lower[j], share, offset)


@njit(cache=True, nogil=True, inline="always")
def _contrast(grey: int, upper: int, lower: int, share: np.float32, offset: np.float32) -> np.float32:
    """A share of the way down from the upper to the lower level of the background."""
    high, low = np.float32(upper), np.float32(lower)
    return (high + share * (low - high) - np.float32(grey)) * np.float32(1 / SCALE) - offset


@njit(cache=True, nogil=True, error_model="numpy")
def _five_pixel_sums(a: Single, b: Single, c: Single, d: Single, e: Single, total: Single, shift: Single) -> None:
    """Sum of the contrast over five pixels, and its barycentre about the middle one."""
    for j in range(total.size):
        total[j] = a[j] + b[j] + c[j] + d[j] + e[j]
        shift[j] = (2 * (e[j] - a[j]) + d[j] - b[j]) / total[j]


@njit(cache=True, nogil=True)
def _move(
    grey: Image, level: Image, top: Places, offset: np.float32, shift: Single, most: np.float32, window: Single
) -> None:
    """Take the pixels nearest to ``top + shift`` for the tops, if no more than ``most`` away, and read about these."""
    rows = grey.shape[0]
    for j in range(top.size):
        if np.float32(0.5) < abs(shift[j]) < most:
            to = min(max(top[j] + np.int64(np.floor(shift[j] + np.float32(0.5))), 5), rows - 6)
            if to != top[j]:
                shift[j] -= np.float32(to - top[j])
                top[j] = to
                _read_window(grey, level, top, offset, window, j)


@njit(cache=True, nogil=True, error_model="numpy")
def _barycentres(
    grey: Image, level: Image, top: Places, path: Places, noise: np.float32, offset: np.float32
) -> tuple[Rows, Rows, Single, Single]:
    """Five-pixel barycentre in each column: row, its standard deviation, and the sum; and the window it is read in.

    ``top`` is the row of the extremum. It is moved once to the pixel nearest to the barycentre, else noise at a
    faint tip cuts off one flank of the line.
    """
    n = top.size
    flux, shift = np.empty(n, np.float32), np.empty(n, np.float32)
    window = _read_windows(grey, level, top, offset)
    _five_pixel_sums(window[2], window[3], window[4], window[5], window[6], flux, shift)
    _move(grey, level, top, offset, shift, np.float32(2.5), window)
    _five_pixel_sums(window[2], window[3], window[4], window[5], window[6], flux, shift)
    row, sd = np.empty(n), np.empty(n)
    for j in range(n):
        found = top[j] + np.float64(shift[j])
        on_line = flux[j] > 0 and abs(shift[j]) < 2 and abs(found - path[j]) < STRAY
        row[j] = found if on_line else np.nan
    for j in range(n):
        # Σ (d − c)² over five pixels
        sd[j] = noise * np.sqrt(np.float32(10) + np.float32(5) * shift[j] * shift[j]) / flux[j]
    return row, sd, flux, window


@njit(cache=True, nogil=True, inline="always")
def _exponential(x: np.float32) -> np.float32:
    """Exponential function for |x| < 1.5 to single precision: the library has none that is made for vectors."""
    y = x * np.float32(0.25)
    c = np.float32(1 / 24) + y * np.float32(1 / 120)
    z = np.float32(1) + y * (np.float32(1) + y * (np.float32(0.5) + y * (np.float32(1 / 6) + y * c)))
    return (z * z) * (z * z)


@njit(cache=True, nogil=True, error_model="numpy")
def _ascend(window: Single, shift: Single, step: Single, bend: Single) -> None:
    """One step of Newton's method, of at most half a pixel and never down, to the maximum of Σ C(d) g(d − shift).

    With g(d − s) = g(s) g(d) E^d and E = exp(s / σ²), slope and bend are sums of d C g E^d and d² C g E^d; g(s) is
    left out of both.
    """
    half, most = np.float32(0.5), np.float32(1.5)
    a, b, c, d, e = window[0], window[1], window[2], window[3], window[4]
    f, g, h, i = window[5], window[6], window[7], window[8]
    for j in range(shift.size):
        s = shift[j]
        up, down = _exponential(s * CURVE), _exponential(-s * CURVE)
        up2, down2 = up * up, down * down
        p1, q1 = G1 * f[j] * up, G1 * d[j] * down
        p2, q2 = G2 * g[j] * up2, G2 * c[j] * down2
        p3, q3 = G3 * h[j] * up2 * up, G3 * b[j] * down2 * down
        p4, q4 = G4 * i[j] * up2 * up2, G4 * a[j] * down2 * down2
        m0 = e[j] + (p1 + q1) + (p2 + q2) + (p3 + q3) + (p4 + q4)
        m1 = (p1 - q1) + 2 * (p2 - q2) + 3 * (p3 - q3) + 4 * (p4 - q4)
        m2 = (p1 + q1) + 4 * (p2 + q2) + 9 * (p3 + q3) + 16 * (p4 + q4)
        curve = (m2 - 2 * s * m1 + s * s * m0) * CURVE - m0
        move = (m1 - s * m0) / abs(curve)
        move = move if move < half else half
        move = move if move > -half else -half
        s = s + move
        s = s if s < most else most
        shift[j] = s if s > -most else -most
        step[j], bend[j] = move, curve


@njit(cache=True, nogil=True, error_model="numpy")
def _matched(
    grey: Image, level: Image, top: Places, noise: np.float32, offset: np.float32, window: Single, row: Rows, sd: Rows
) -> None:
    """Row in each column where a Gaussian profile of ``PROFILE`` px fits best, and its standard deviation.

    The maximum of Σ C(k) g(k − c): maximum likelihood in white noise for a line of that width; for one r times as
    wide the SD is ((r + 1/r)/2)^1.5 of the least possible, 1.1 at r = 0.7 or 1.45. Neither a constant left in the
    background moves it, nor the place from which it is sought. ``row`` and ``sd`` are the barycentre's, in whose
    place they are written; where no profile fits within ``ASIDE`` rows of it, it stays.
    """
    n = top.size
    shift, step, bend = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.float32)
    for j in range(n):
        start = np.float32(row[j] - top[j])
        start = min(max(start, np.float32(-1)), np.float32(1))
        shift[j] = start if row[j] == row[j] else np.float32(0)
    for again in range(2):
        for _ in range(STEPS[again]):
            _ascend(window, shift, step, bend)
        if again == 0:
            _move(grey, level, top, offset, shift, np.float32(1.6), window)
    for j in range(n):
        found = top[j] + np.float64(shift[j])
        sure = bend[j] < 0 and abs(step[j]) < np.float32(0.01) and abs(shift[j]) < np.float32(0.75)
        if sure and abs(found - row[j]) < ASIDE:
            height = _exponential(np.float32(-0.5) * CURVE * shift[j] * shift[j])
            row[j], sd[j] = found, noise * SPREAD / (-bend[j] * height)


@njit(cache=True, nogil=True, error_model="numpy")
def _three_point(top: Places, noise: np.float32, window: Single, row: Rows, sd: Rows) -> None:
    """Peak of the Gaussian through three pixels, as of [FisherNaidu1996]_, and its standard deviation."""
    for j in range(top.size):
        above, here, below = window[3, j], window[4, j], window[5, j]
        # the logarithm of a Gaussian is a parabola, of which slope and bend follow from three values
        if not min(above, here, below) > 0:
            continue
        up, down = np.log(above / here), np.log(below / here)
        bend = up + down
        shift = np.float32(0.5) * (up - down) / bend
        found = top[j] + np.float64(shift)
        if bend < 0 and abs(shift) < 1 and abs(found - row[j]) < ASIDE:
            # derivatives by the logarithms of the three pixels, each over its pixel
            a, b, c = (1 - 2 * shift) / above, 4 * shift / here, (1 + 2 * shift) / below
            row[j], sd[j] = found, noise * np.sqrt(a * a + b * b + c * c) / (-2 * bend)


@njit(cache=True, nogil=True)
def place(
    estimator: int, grey: Image, level: Image, top: Places, path: Places, noise: np.float32, offset: np.float32
) -> tuple[Rows, Rows, Single]:
    """Place a line in each column by one of the estimators.

    Parameters
    ----------
    estimator : int
        By :func:`vibrissa.video.kernel.estimator_table.code_of`.
    grey, level : (rows, n) arrays
        Band and background in it, as of :func:`vibrissa.video.kernel.band.levels`.
    top : (n,) array of int
        Row of the band with the extremum in each column; moved to the pixel nearest to the line.
    path : (n,) array of int
        Row of the band in which the line runs.
    noise, offset : float
        Standard deviation of a pixel, and mean of the contrast away from the line [grey levels].

    Returns
    -------
    row, sd : (n,) arrays
        Row of the band and its standard deviation [px]; NaN where there is no line.
    flux : (n,) array
        Five-pixel sum of the contrast [grey levels × px].
    """
    # the barycentre moves the window to the line, and its row is kept where an estimator finds none
    row, sd, flux, window = _barycentres(grey, level, top, path, noise, offset)
    if estimator == MATCHED:
        _matched(grey, level, top, noise, offset, window, row, sd)
    elif estimator == THREE_POINT:
        _three_point(top, noise, window, row, sd)
    return row, sd, flux
