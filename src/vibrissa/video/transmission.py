"""What whiskers let through: a pixel darkens with its distance from the nearest point of each centreline."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["FWHM", "Canvas", "compiled"]

Array = NDArray[np.float64]
Function = TypeVar("Function", bound=Callable[..., Any])

FWHM = 2 * np.sqrt(2 * np.log(2))  # of a Gaussian, over its standard deviation
REACH = 5.0  # standard deviations; beyond, a line of full contrast darkens by less than 1e-3 grey levels


def compiled(function: Function) -> Function:
    """Machine code on first use, kept on disk; the static type stays that of the function."""
    return cast(Function, njit(cache=True)(function))


class Canvas:
    """The field of view, where one image after another is drawn.

    Parameters
    ----------
    height, width : int
        Size [pixels].
    """

    def __init__(self, height: int, width: int) -> None:
        self.seen = np.ones((height, width))
        self._squared, self._place, self._light = (
            np.full(self.seen.shape, np.inf),
            np.empty_like(self.seen),
            self.seen + 0,
        )
        self._near, self._dim = (np.empty((self.seen.size, 2), np.int32) for _ in range(2))

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
        work = self._squared, self._place, self._light, self._near, self._dim
        _transmitted(x, y, opacity, variance, *work, self.seen)
        return self.seen


@compiled
def _transmitted(
    x: Array,
    y: Array,
    opacity: Array,
    variance: Array,
    squared: Array,
    place: Array,
    light: Array,
    near: NDArray[np.int32],
    dim: NDArray[np.int32],
    seen: Array,
) -> None:
    """Only pixels near a whisker are visited; ``squared`` is infinite and ``light`` 1 everywhere, before and after."""
    whiskers, instants, _ = x.shape
    seen[:] = 1.0
    for instant in range(instants):
        dimmed = 0
        for whisker in range(whiskers):
            reach = REACH * np.sqrt(variance[whisker].max())
            found = _nearest_point(x[whisker, instant], y[whisker, instant], reach, squared, place, near)
            dimmed = _darken(near[:found], squared, place, opacity[whisker], variance[whisker], light, dim, dimmed)
        for index in range(dimmed):
            row, column = dim[index, 0], dim[index, 1]
            seen[row, column] -= (1 - light[row, column]) / instants
            light[row, column] = 1.0


@compiled
def _nearest_point(x: Array, y: Array, reach: float, squared: Array, place: Array, near: NDArray[np.int32]) -> int:
    """Squared distance [pixels²] from pixel centres to a polyline, the node (with fraction) where it is; pixels met."""
    height, width = squared.shape
    found, last = 0, x.size - 2
    for k in range(x.size - 1):
        dx, dy = x[k + 1] - x[k], y[k + 1] - y[k]
        on_x, on_y = (x[k + 2] - x[k + 1], y[k + 2] - y[k + 1]) if k < last else (0.0, 0.0)
        step = dx * dx + dy * dy
        top, bottom = max(0.0, min(y[k], y[k + 1]) - reach), min(height - 1.0, max(y[k], y[k + 1]) + reach)
        left, right = max(0.0, min(x[k], x[k + 1]) - reach), min(width - 1.0, max(x[k], x[k + 1]) + reach)
        for row in range(int(np.ceil(top)), int(np.floor(bottom)) + 1):
            for column in range(int(np.ceil(left)), int(np.floor(right)) + 1):
                along = (column - x[k]) * dx + (row - y[k]) * dy
                beyond = (column - x[k + 1]) * on_x + (row - y[k + 1]) * on_y
                if (along < 0 and k > 0) or (along > step and k < last and beyond >= 0):
                    continue  # the neighbouring segment is nearer, or as near
                u = min(1.0, max(0.0, along / step)) if step > 0 else 0.0
                distance = (column - x[k] - u * dx) ** 2 + (row - y[k] - u * dy) ** 2
                if distance < squared[row, column]:
                    if squared[row, column] == np.inf:
                        near[found] = row, column
                        found += 1
                    squared[row, column] = distance
                    place[row, column] = k + u
    return found


@compiled
def _darken(
    near: NDArray[np.int32],
    squared: Array,
    place: Array,
    opacity: Array,
    variance: Array,
    light: Array,
    dim: NDArray[np.int32],
    dimmed: int,
) -> int:
    """Light times what a whisker transmits, 1 − opacity·exp(−distance²/2·variance); forgets the distances."""
    last = opacity.size - 2
    for index in range(len(near)):
        row, column = near[index, 0], near[index, 1]
        k = min(int(place[row, column]), last)
        u = place[row, column] - k
        taken = opacity[k] * (1 - u) + opacity[k + 1] * u
        spread = variance[k] * (1 - u) + variance[k + 1] * u
        kept = 1 - taken * np.exp(-squared[row, column] / (2 * spread))
        squared[row, column] = np.inf
        if kept < 1:
            if light[row, column] == 1:
                dim[dimmed] = row, column
                dimmed += 1
            light[row, column] *= kept
    return dimmed
