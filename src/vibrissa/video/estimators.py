"""Where a line lies in each column, to a fraction of a pixel: the five-pixel barycentre, and the matched profile.

Both read a window of nine pixels about the line's extremum and give a row, the standard deviation that the pixel
noise gives it, and the five-pixel sum of the contrast. They work column by column: nothing is smoothed along the
line, and nothing of the frame before draws it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from vibrissa.video.band import SCALE

PROFILE = 1.1  # SD of the profile that is matched [px]; a sharper one is drawn to the pixels' middles by 0.01 px
REACH = 4  # rows on either side that are matched
STEPS = 2  # of Newton's method, before and after the window is moved to the pixel nearest to what was found
STRAY = 2.5  # rows from the path beyond which a line is another one
ASIDE = 1.0  # rows from the barycentre beyond which a profile is another line's
G1, G2, G3, G4 = (np.float32(np.exp(-0.5 * (d / PROFILE) ** 2)) for d in range(1, REACH + 1))
CURVE = np.float32(1 / PROFILE**2)
SPREAD = np.float32(np.sqrt(np.sqrt(np.pi) / 2 * PROFILE**3))  # √Σ u² g(u)²
UNLIKE = {"contract", "reassoc", "nsz", "arcp"}  # arithmetic that may be reordered, with NaN as NaN


@njit(cache=True, nogil=True)
def read_windows(grey, level, top, old, offset, closed, window):  # type: ignore[no-untyped-def]
    """Contrast [grey levels] in nine rows about ``top``, (9, n), in the columns in which that differs from ``old``.

    A closed background fills the line up to its lower brim, which under a slope of grey levels is a tilted error:
    it is drawn straight from 5 rows above the middle to 5 rows below.
    """
    n, unit = top.size, np.float32(1 / SCALE)
    greys, background = grey.reshape(-1), level.reshape(-1)
    for j in range(n):
        if top[j] == old[j]:
            continue
        at = np.uint64((top[j] - 5) * n + j)
        brim = np.float32(background[at])
        rise = (np.float32(background[at + np.uint64(10 * n)]) - brim) * np.float32(0.1)
        for d in range(9):
            at += np.uint64(n)
            behind = brim + np.float32(d + 1) * rise if closed else np.float32(background[at])
            window[d, j] = (behind - np.float32(greys[at])) * unit - offset


@njit(cache=True, nogil=True, error_model="numpy", fastmath=UNLIKE)
def five_pixel_sums(a, b, c, d, e, total, shift):  # type: ignore[no-untyped-def]
    """Sum of the contrast over five pixels, and its barycentre about the middle one."""
    for j in range(total.size):
        total[j] = a[j] + b[j] + c[j] + d[j] + e[j]
        shift[j] = (2 * (e[j] - a[j]) + d[j] - b[j]) / total[j]


@njit(cache=True, nogil=True)
def _move(top, shift, most, rows):  # type: ignore[no-untyped-def]
    """Take the pixels nearest to ``top + shift`` for the tops, if no more than ``most`` away; the tops as they were."""
    old = top.copy()
    for j in range(top.size):
        if 0.5 < abs(shift[j]) < most:
            top[j] = min(max(old[j] + round(shift[j]), 5), rows - 6)
            shift[j] -= np.float32(top[j] - old[j])
    return old


@njit(cache=True, nogil=True)
def barycentres(grey, level, top, path, noise, offset, closed):  # type: ignore[no-untyped-def]
    """Five-pixel barycentre in each column: row, its standard deviation, and the sum; and the window it is read in.

    ``top`` is the row of the extremum. It is moved once to the pixel nearest to the barycentre, else noise at a
    faint tip cuts off one flank of the line.
    """
    rows, n = grey.shape
    window, flux, shift = np.empty((9, n), np.float32), np.empty(n, np.float32), np.empty(n, np.float32)
    read_windows(grey, level, top, np.zeros(n, np.int64), offset, closed, window)
    five_pixel_sums(window[2], window[3], window[4], window[5], window[6], flux, shift)
    old = _move(top, shift, 2.5, rows)
    read_windows(grey, level, top, old, offset, closed, window)
    five_pixel_sums(window[2], window[3], window[4], window[5], window[6], flux, shift)
    row, sd = np.full(n, np.nan), np.full(n, np.nan)
    for j in range(n):
        if flux[j] > 0 and abs(shift[j]) < 2 and abs(top[j] + shift[j] - path[j]) < STRAY:
            # Σ (d − c)² over five pixels
            row[j], sd[j] = top[j] + shift[j], noise * np.sqrt(10 + 5 * shift[j] ** 2) / flux[j]
    return row, sd, flux, window


@njit(cache=True, nogil=True, inline="always")
def exponential(x):  # type: ignore[no-untyped-def]
    """Exponential function for |x| < 1.5 to single precision: the library has none that is made for vectors."""
    y = x * np.float32(0.25)
    c = np.float32(1 / 24) + y * np.float32(1 / 120)
    z = np.float32(1) + y * (np.float32(1) + y * (np.float32(0.5) + y * (np.float32(1 / 6) + y * c)))
    return (z * z) * (z * z)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=UNLIKE)
def ascend(a, b, c, d, e, f, g, h, i, shift, step, bend):  # type: ignore[no-untyped-def]
    """One step of Newton's method, of at most half a pixel and never down, to the maximum of Σ C(d) g(d − shift).

    With g(d − s) = g(s) g(d) E^d and E = exp(s / σ²), slope and bend are sums of d C g E^d and d² C g E^d; g(s) is
    left out of both.
    """
    half, most = np.float32(0.5), np.float32(1.5)
    for j in range(shift.size):
        s = shift[j]
        up, down = exponential(s * CURVE), exponential(-s * CURVE)
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


@njit(cache=True, nogil=True)
def matched(grey, level, top, path, noise, offset, closed):  # type: ignore[no-untyped-def]
    """Row in each column where a Gaussian profile of ``PROFILE`` px fits best, its standard deviation, five-pixel sum.

    The maximum of Σ C(k) g(k − c): maximum likelihood in white noise for a line of that width; for one r times as
    wide the SD is ((r + 1/r)/2)^1.5 of the least possible, 1.1 at r = 0.7 or 1.45. Neither a constant left in the
    background moves it, nor the place from which it is sought. Where no profile fits within ``ASIDE`` rows of the
    barycentre, that stands, with its own standard deviation.
    """
    rows, n = grey.shape
    row, sd, flux, window = barycentres(grey, level, top, path, noise, offset, closed)
    shift = np.empty(n, np.float32)
    step, bend = np.empty(n, np.float32), np.empty(n, np.float32)
    for j in range(n):
        shift[j] = min(max(np.float32(row[j] - top[j]), np.float32(-1)), np.float32(1)) if row[j] == row[j] else 0
    w = window
    for again in range(2):
        for _ in range(STEPS):
            ascend(w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8], shift, step, bend)
        if again == 0:
            read_windows(grey, level, top, _move(top, shift, 1.6, rows), offset, closed, window)
    for j in range(n):
        found = top[j] + np.float64(shift[j])
        if bend[j] < 0 and abs(step[j]) < 0.01 and abs(shift[j]) < 0.75 and abs(found - row[j]) < ASIDE:
            height = exponential(np.float32(-0.5) * CURVE * shift[j] ** 2)
            row[j], sd[j] = found, noise * SPREAD / (-bend[j] * height)
    return row, sd, flux
