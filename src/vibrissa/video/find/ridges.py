"""Long thin lines in one image: how much darker than both sides it is, along short straight pieces of every direction.

Directions are angles from increasing columns towards increasing rows, 0 to 180° in ``DIRECTIONS`` equal steps.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrissa.arrays import Array

Volume = NDArray[np.float32]

DIRECTIONS = 60
ACROSS, ALONG = 1.0, 10.0  # standard deviations of the piece over which grey levels are averaged [px]
UNEVEN = 3.0  # contrast to both sides over that to the darker one, above which it is an edge
SIDE = 4.0  # distance of the two sides it is held against [px]: clear of a line of 2.5 px full width
MARGIN = 5  # pixels at the image's edge where one side is missing
STEP = 3.0  # of a trace [px]
TURN = 0.1  # share of the contrast that a turn by one direction costs
PATIENCE = 6  # steps in a row a trace may make where the line is hidden


def ridges(image: NDArray[np.generic], sign: float) -> tuple[Volume, float]:
    """Darkness of straight pieces against their two sides, and its scatter where there is no line.

    Parameters
    ----------
    image : (height, width) array
        Grey levels.
    sign : float
        1 for dark lines, −1 for bright ones.

    Returns
    -------
    volume : (DIRECTIONS, height, width) array
        Contrast of the averaged piece to the mean of its sides, but at most ``UNEVEN`` times that to the darker one
        [grey levels]: an edge has none, as it is dark on one side, and a slope of the light changes nothing.
    scatter : float
        Standard deviation of that mean, from its median magnitude [grey levels].
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    pad = int(3 * ALONG)
    grey = np.pad(sign * np.asarray(image, np.float32), pad, mode="edge")
    shape = [next_fast_len(n, real=True) for n in grey.shape]
    spectrum = rfft2(grey, shape)
    v, u = np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None]
    out = np.full((DIRECTIONS, *image.shape), -np.inf, np.float32)
    scatter = []
    inner = slice(MARGIN, -MARGIN)
    for k in range(DIRECTIONS):
        cos, sin = np.cos(np.pi * k / DIRECTIONS), np.sin(np.pi * k / DIRECTIONS)
        along, across = u * cos + v * sin, v * cos - u * sin
        piece = np.exp(-2 * np.pi**2 * ((ALONG * along) ** 2 + (ACROSS * across) ** 2)).astype(np.float32)
        mean = irfft2(spectrum * piece, shape)[: grey.shape[0], : grey.shape[1]]
        down, right = round(SIDE * cos), -round(SIDE * sin)
        one, other = (np.roll(mean, (side * down, side * right), (0, 1)) for side in (1, -1))
        contrast, darker = (one + other) / 2 - mean, np.minimum(one, other) - mean
        middle = contrast[pad:-pad, pad:-pad]
        scatter.append(np.median(np.abs(middle[::3, ::3])) / 0.6745)
        out[k, inner, inner] = np.minimum(middle, UNEVEN * darker[pad:-pad, pad:-pad])[inner, inner]
    return out, float(np.median(scatter))


@njit(cache=True)
def trace(volume: Volume, row: float, column: float, heading: int, faint: float) -> Array:
    """Follow a line from a point one way, by steps of ``STEP``.

    Parameters
    ----------
    volume : (DIRECTIONS, height, width) array
        From :func:`ridges`.
    row, column : float
        Where to start [px].
    heading : int
        Direction of travel in steps of 180°/DIRECTIONS, 0 to 2 DIRECTIONS − 1.
    faint : float
        Contrast below which the line is not seen; it may be hidden for ``PATIENCE`` steps.

    Returns
    -------
    (n, 4) array
        Row, column, heading and contrast of each step; the last one was seen.
    """
    directions, height, width = volume.shape
    path = np.empty((2 * (height + width), 4))
    count, hidden = 0, 0
    while count < len(path):
        best, turn, off = -np.inf, 0, 0.0
        for by in (0, -1, 1):
            angle = np.pi * (heading + by) / directions
            for lateral in (0.0, -1.0, 1.0):
                r = round(row + STEP * np.sin(angle) + lateral * np.cos(angle))
                c = round(column + STEP * np.cos(angle) - lateral * np.sin(angle))
                if not (0 <= r < height and 0 <= c < width):
                    continue
                value = volume[(heading + by) % directions, r, c] * (1.0 - TURN * abs(by) - 0.05 * abs(lateral))
                if value > best:
                    best, turn, off = value, by, lateral
        seen = best > faint
        hidden = 0 if seen else hidden + 1
        if best == -np.inf or hidden > PATIENCE:
            break
        if seen:
            heading = (heading + turn) % (2 * directions)
        else:
            off = 0.0
        angle = np.pi * heading / directions
        row += STEP * np.sin(angle) + off * np.cos(angle)
        column += STEP * np.cos(angle) - off * np.sin(angle)
        path[count, 0], path[count, 1], path[count, 2], path[count, 3] = row, column, heading, best
        count += 1
    return path[: max(count - hidden, 0)]
