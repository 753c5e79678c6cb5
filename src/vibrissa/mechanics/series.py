"""Chebyshev series summed in compiled loops: for few places, where NumPy's overhead is all."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_TOGETHER = 512  # places whose sums stay in the cache


def chebyshev_sum(z: ArrayLike, coefficients: NDArray[np.floating[Any]]) -> Array:
    """Chebyshev series at places in [−1, 1], by Clenshaw's recurrence; the numbers are those of NumPy's ``chebval``.

    Parameters
    ----------
    z : array_like
        Places, of any shape; (T,) where each has its own series.
    coefficients : (n,) or (n, T) array
        Of one series for all places, or of one for each; n is at least 2.

    Returns
    -------
    array
        Sums, of the shape of z.
    """
    places = np.asarray(z, float)
    flat, out = np.ascontiguousarray(places.reshape(-1)), np.empty(places.size)
    if coefficients.ndim == 1:
        _one_series(flat, np.ascontiguousarray(coefficients), out)
    else:
        _each_its_own(flat, np.ascontiguousarray(coefficients), out)
    return out.reshape(places.shape)


@njit(cache=True, nogil=True, error_model="numpy")
def _one_series(z, c, out):  # type: ignore[no-untyped-def]
    for t in range(z.size):
        first, second, twice = c[-2], c[-1], 2 * z[t]
        for k in range(c.size - 3, -1, -1):
            first, second = c[k] - second, first + second * twice
        out[t] = first + second * z[t]


@njit(cache=True, nogil=True, error_model="numpy")
def _each_its_own(z, c, out):  # type: ignore[no-untyped-def]
    first, second = np.empty(_TOGETHER), np.empty(_TOGETHER)
    for start in range(0, z.size, _TOGETHER):
        n = min(_TOGETHER, z.size - start)
        first[:n], second[:n] = c[-2, start : start + n], c[-1, start : start + n]
        for k in range(len(c) - 3, -1, -1):
            for t in range(n):
                last = second[t]
                second[t] = first[t] + last * (2 * z[start + t])
                first[t] = c[k, start + t] - last
        for t in range(n):
            out[start + t] = first[t] + second[t] * z[start + t]
