"""What whiskers let through: a pixel darkens with its distance from the nearest point of each centreline."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit

FWHM = 2 * np.sqrt(2 * np.log(2))  # of a Gaussian, over its standard deviation
Pixels = NDArray[np.uint32]  # numbers of pixels, row by row
REACH = 5.0  # standard deviations; beyond, a line of full contrast darkens by less than 1e-3 grey levels
ROUNDED = 1e-6  # [pixels] by which a stretch of a row is taken wider, for what is rounded


class Canvas:
    """The field of view, where one image after another is drawn.

    Parameters
    ----------
    height, width : int
        Size [pixels].
    """

    def __init__(self, height: int, width: int) -> None:
        self.seen = np.ones((height, width))
        near, dimmed = (np.empty(self.seen.size, np.uint32) for _ in range(2))
        infinite = np.full(self.seen.size, np.inf)
        self._work = infinite, np.empty_like(infinite), np.ones_like(infinite), near, dimmed

    def transmitted(self, x: Array, y: Array, opacity: Array, variance: Array) -> Array:
        """Share of the light that passes all whiskers, averaged over the instants.

        Parameters
        ----------
        x, y : (W, T, N) arrays
            Centrelines [pixels].
        opacity : (W, N) array
            Share of the light taken on the centreline, 0 to 1.
        variance : (W, N) array
            Variance of the Gaussian across the line [pixels²].

        Returns
        -------
        (height, width) array
            0 to 1; overwritten by the next call.
        """
        _transmitted(x, y, opacity, variance, *self._work, self.seen)
        return self.seen


@njit(cache=True, nogil=True)
def _transmitted(
    x: Array,
    y: Array,
    opacity: Array,
    variance: Array,
    squared: Array,
    place: Array,
    light: Array,
    near: Pixels,
    dim: Pixels,
    seen: Array,
) -> None:
    """Only pixels near a whisker are visited; ``squared`` is infinite and ``light`` 1 everywhere, before and after."""
    whiskers, instants, _ = x.shape
    seen[:] = 1.0
    whole = seen.ravel()
    for instant in range(instants):
        dimmed = 0
        for whisker in range(whiskers):
            reach = REACH * np.sqrt(variance[whisker].max())
            found = _nearest_point(x[whisker, instant], y[whisker, instant], reach, seen.shape, squared, place, near)
            dimmed = _darken(near[:found], squared, place, opacity[whisker], variance[whisker], light, dim, dimmed)
        for pixel in dim[:dimmed]:
            whole[pixel] -= (1 - light[pixel]) / instants
            light[pixel] = 1.0


@njit(cache=True, nogil=True)
def _nearest_point(
    x: Array, y: Array, reach: float, size: tuple[int, int], squared: Array, place: Array, near: Pixels
) -> int:
    """Squared distance [pixels²] from pixel centres to a polyline, the node (with fraction) where it is; pixels met."""
    height, width = size
    found, last = 0, x.size - 2
    for k in range(x.size - 1):
        x0, y0, x1, y1 = x[k], y[k], x[k + 1], y[k + 1]
        dx, dy = x1 - x0, y1 - y0
        on_x, on_y = (x[k + 2] - x1, y[k + 2] - y1) if k < last else (0.0, 0.0)
        step = dx * dx + dy * dy
        top, bottom = max(0.0, min(y0, y1) - reach), min(height - 1.0, max(y0, y1) + reach)
        left, right = max(0.0, min(x0, x1) - reach), min(width - 1.0, max(x0, x1) + reach)
        rightwards = dx > 0 and (k == last or on_x > 0)  # then one stretch of each row is nearest to this segment
        tilt, on_tilt = (dy / dx, on_y / on_x if k < last else 0.0) if rightwards else (0.0, 0.0)
        for row in range(int(np.ceil(top)), int(np.floor(bottom)) + 1):
            start, end = left, right
            if rightwards and k > 0:
                start = max(left, x0 - (row - y0) * tilt - ROUNDED)
            if rightwards and k < last:
                end = min(right, x1 + max((y1 - row) * tilt, (y1 - row) * on_tilt) + ROUNDED)
            for column in range(int(np.ceil(start)), int(np.floor(end)) + 1):
                along = (column - x0) * dx + (row - y0) * dy
                beyond = (column - x1) * on_x + (row - y1) * on_y
                if (along < 0 and k > 0) or (along > step and k < last and beyond >= 0):
                    continue  # the neighbouring segment is nearer, or as near
                u = min(1.0, max(0.0, along / step)) if step > 0 else 0.0
                distance = (column - x0 - u * dx) ** 2 + (row - y0 - u * dy) ** 2
                pixel = np.uint32(row * width + column)
                if distance < squared[pixel]:
                    if squared[pixel] == np.inf:
                        near[found] = pixel
                        found += 1
                    squared[pixel] = distance
                    place[pixel] = k + u
    return found


@njit(cache=True, nogil=True)
def _darken(
    near: Pixels,
    squared: Array,
    place: Array,
    opacity: Array,
    variance: Array,
    light: Array,
    dim: Pixels,
    dimmed: int,
) -> int:
    """Light times what a whisker transmits, 1 − opacity·exp(−distance²/2·variance); forgets the distances."""
    last = opacity.size - 2
    for pixel in near:
        k = min(int(place[pixel]), last)
        u = place[pixel] - k
        taken = opacity[k] * (1 - u) + opacity[k + 1] * u
        spread = variance[k] * (1 - u) + variance[k + 1] * u
        kept = 1 - taken * np.exp(-squared[pixel] / (2 * spread))
        squared[pixel] = np.inf
        if kept < 1:
            if light[pixel] == 1:
                dim[dimmed] = pixel
                dimmed += 1
            light[pixel] *= kept
    return dimmed
