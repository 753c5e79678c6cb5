"""Second derivatives of an image smoothed by a Gaussian: in which a line of about that width is clear.

Lines are detected by the larger principal curvature of the smoothed image, as in [Steger1998]_. All maps are of the
image in which lines are darker than their sides: the second derivative across a line is positive.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.loops import njit

Single = NDArray[np.float32]
Maps = NDArray[np.float32]  # (3, height, width): by column twice, by column and row, by row twice

REACH = 3.6  # of the filters, in their standard deviations


def derivative_taps(sigma: float) -> Single:
    """Taps of a Gaussian and of its first two derivatives, exact for a parabola.

    Parameters
    ----------
    sigma : float
        Standard deviation of the Gaussian [px].

    Returns
    -------
    (3, n) array
        To be correlated with grey levels; n is odd.
    """
    reach = int(np.ceil(REACH * sigma))
    u = np.arange(-reach, reach + 1, dtype=float)
    smooth = np.exp(-0.5 * (u / sigma) ** 2)
    smooth /= smooth.sum()
    slope = u * smooth
    slope /= slope @ u
    bend = (u**2 / sigma**2 - 1) * smooth
    bend -= smooth * bend.sum()  # nothing of a constant
    bend *= 2 / (bend @ u**2)
    return np.stack([smooth, slope, bend]).astype(np.float32)


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add(source: Single, weight: np.float32, out: Single) -> None:
    for j in range(out.size):
        out[j] += weight * source[j]


@njit(cache=True, nogil=True)
def second_derivatives(grey: Single, taps: Single, rows: Maps, out: Maps) -> None:
    """Second derivatives of the smoothed image; beyond its edges the outermost pixels are repeated.

    Parameters
    ----------
    grey : (height, width) array
        Grey levels.
    taps : (3, n) array
        From :func:`derivative_taps`.
    rows : (3, height, width) array
        Room for work.
    out : (3, height, width) array
        Written: by column twice, by column and row, by row twice [grey levels / px²].
    """
    height, width = grey.shape
    n = taps.shape[1]
    reach = n // 2
    line = np.empty(width + 2 * reach, np.float32)
    for i in range(height):
        line[:reach] = grey[i, 0]
        line[reach : reach + width] = grey[i]
        line[reach + width :] = grey[i, width - 1]
        for d in range(3):
            rows[d, i] = 0
            for k in range(n):
                _add(line[k : k + width], taps[d, k], rows[d, i])
    for i in range(height):
        out[0, i] = 0
        out[1, i] = 0
        out[2, i] = 0
        for k in range(n):
            j = min(max(i + k - reach, 0), height - 1)
            _add(rows[2, j], taps[0, k], out[0, i])
            _add(rows[1, j], taps[1, k], out[1, i])
            _add(rows[0, j], taps[2, k], out[2, i])


@njit(cache=True, nogil=True, fastmath={"contract"})
def line_strength(xx: Single, xy: Single, yy: Single, out: Single) -> None:
    """Larger principal curvature less the magnitude of the other, of one row of pixels: high on lines, low on spots.

    Parameters
    ----------
    xx, xy, yy : (width,) arrays
        Second derivatives.
    out : (width,) array
        Written.
    """
    for j in range(out.size):
        difference = xx[j] - yy[j]
        root = np.sqrt(difference * difference + np.float32(4) * xy[j] * xy[j])
        total = xx[j] + yy[j]
        out[j] = total if total < root else root


@njit(cache=True, nogil=True, inline="always")
def across(maps: Maps, x: float, y: float, c: float, s: float) -> float:
    """Second derivative across the direction (c, s) at a point within the image, bilinear between pixels."""
    j, i = int(x), int(y)
    u, v = x - j, y - i
    pp, pq, qq = s * s, -2 * c * s, c * c
    a = pp * maps[0, i, j] + pq * maps[1, i, j] + qq * maps[2, i, j]
    b = pp * maps[0, i, j + 1] + pq * maps[1, i, j + 1] + qq * maps[2, i, j + 1]
    d = pp * maps[0, i + 1, j] + pq * maps[1, i + 1, j] + qq * maps[2, i + 1, j]
    e = pp * maps[0, i + 1, j + 1] + pq * maps[1, i + 1, j + 1] + qq * maps[2, i + 1, j + 1]
    return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * e)
