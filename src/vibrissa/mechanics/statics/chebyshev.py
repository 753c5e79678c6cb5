"""Chebyshev series: nodes, coefficients and sums, in one and two coordinates.

:class:`Chebyshev` is the polynomials of one coordinate on an interval. The compiled sums serve few places, where
NumPy's overhead is all, and other compiled loops.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit

_TOGETHER = 512  # places whose sums stay in the cache


@dataclass(frozen=True)
class Chebyshev:
    """The first Chebyshev polynomials of a coordinate on an interval, with as many nodes.

    Attributes
    ----------
    count : int
        How many polynomials, T₀ to T_{count − 1}.
    low, high : float
        Ends of the interval.
    ends : bool
        Whether the nodes include the ends (Lobatto's, which ascend); else they are Gauss's, which descend.
    """

    count: int
    low: float = -1.0
    high: float = 1.0
    ends: bool = False

    @property
    def nodes(self) -> Array:
        """Nodes in the interval, (n,)."""
        if self.ends:
            return self.low + (self.high - self.low) * _shares(self.count)
        return (self.low + self.high) / 2 + (self.high - self.low) / 2 * unit_nodes(self.count)

    @property
    def to_series(self) -> Array:
        """Matrix (n, n) from values at the nodes to coefficients."""
        return _to_series(self.count, self.ends)

    @cached_property
    def integration(self) -> Array:
        """Matrix (n, n) from values at the nodes to the integral from ``low`` to each, exact for polynomials."""
        half = (self.high - self.low) / 2
        return np.asarray(half * _integrals(self.count, self.ends) @ self.to_series, float)

    def unit(self, x: ArrayLike) -> Array:
        """Coordinate in [−1, 1].

        Parameters
        ----------
        x : array_like
            Places in the interval.

        Returns
        -------
        array
            In [−1, 1], of the shape of x.
        """
        return np.asarray((2 * np.asarray(x, float) - self.low - self.high) / (self.high - self.low))

    def polynomials(self, x: ArrayLike) -> Array:
        """All polynomials at places in the interval.

        Parameters
        ----------
        x : array_like
            Places.

        Returns
        -------
        (…, n) array
            T₀ to T_{n − 1}, the last axis.
        """
        return np.asarray(chebyshev.chebvander(self.unit(x), self.count - 1), float)

    def derivative(self, coefficients: Array) -> Array:
        """Coefficients (n − 1, …) of the derivative by x, of a series (n, …).

        Parameters
        ----------
        coefficients : (n, …) array
            Of the series.

        Returns
        -------
        (n − 1, …) array
            Of its derivative.
        """
        return np.asarray(chebyshev.chebder(coefficients, scl=2 / (self.high - self.low)))


@cache
def unit_nodes(count: int, ends: bool = False) -> Array:
    """Nodes on [−1, 1], (n,): Gauss's from 1 down, or Lobatto's from −1 up with the ends.

    Parameters
    ----------
    count : int
        n.
    ends : bool
        Whether they include the ends.

    Returns
    -------
    (n,) array
        The nodes.
    """
    return 2 * _shares(count) - 1 if ends else np.asarray(np.cos(np.pi * (np.arange(count) + 0.5) / count))


def _shares(count: int) -> Array:
    """Lobatto's nodes on [0, 1]."""
    return np.asarray((1 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2)


@cache
def _to_series(count: int, ends: bool) -> Array:
    return np.asarray(np.linalg.inv(chebyshev.chebvander(unit_nodes(count, ends), count - 1)))


@cache
def _integrals(count: int, ends: bool) -> Array:
    """Integrals from −1 to the nodes, (n, n), of each polynomial."""
    z = unit_nodes(count, ends)
    return np.stack([chebyshev.chebval(z, chebyshev.chebint(c, lbnd=-1)) for c in np.eye(count)], axis=1)


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
def clenshaw(c: Array, z: float) -> float:
    """Value of a series of two terms or more.

    Parameters
    ----------
    c : (n,) array
        Coefficients, n at least 2.
    z : float
        Place in [−1, 1].

    Returns
    -------
    float
        The sum.
    """
    first, second, twice = c[-2], c[-1], 2 * z
    for k in range(c.size - 3, -1, -1):
        first, second = c[k] - second, first + second * twice
    return first + second * z


@njit(cache=True, nogil=True, error_model="numpy")
def clenshaw_slope(c: Array, z: float) -> tuple[float, float]:
    """Value of a series and its derivative by z.

    Parameters
    ----------
    c : (n,) array
        Coefficients.
    z : float
        Place in [−1, 1].

    Returns
    -------
    tuple of 2 floats
        The sum and its derivative.
    """
    b1, b2, d1, d2 = 0.0, 0.0, 0.0, 0.0
    for k in range(c.size - 1, 0, -1):
        b0 = c[k] + 2 * z * b1 - b2
        d0 = 2 * b1 + 2 * z * d1 - d2
        b2, b1, d2, d1 = b1, b0, d1, d0
    return c[0] + z * b1 - b2, b1 + z * d1 - d2


@njit(cache=True, nogil=True, error_model="numpy")
def polynomials(z: float, out: Array) -> None:
    """The first polynomials (n,) at one place.

    Parameters
    ----------
    z : float
        Place in [−1, 1].
    out : (n,) array
        Written: T₀(z) to T_{n − 1}(z).
    """
    out[0] = 1.0
    if out.size > 1:
        out[1] = z
    for k in range(2, out.size):
        out[k] = 2 * z * out[k - 1] - out[k - 2]


@njit(cache=True, nogil=True, error_model="numpy")
def _one_series(z: Array, c: Array, out: Array) -> None:
    for t in range(z.size):
        out[t] = clenshaw(c, z[t])


@njit(cache=True, nogil=True, error_model="numpy")
def _each_its_own(z: Array, c: Array, out: Array) -> None:
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


@njit(cache=True, nogil=True, error_model="numpy")
def sum_of_two(coefficients: Array, first: Array, second: Array, out: Array) -> None:
    """Chebyshev series (M, J, K) in two coordinates at places (T,), (M, T); in blocks that stay in the cache.

    Parameters
    ----------
    coefficients : (M, J, K) array
        Of M series.
    first, second : (T,) arrays
        Coordinates in [−1, 1].
    out : (M, T) array
        Written: the sums.
    """
    rows, j, k = coefficients.shape
    by_first, by_second, inner = np.empty((j, _TOGETHER)), np.empty((k, _TOGETHER)), np.empty(_TOGETHER)
    for start in range(0, first.size, _TOGETHER):
        n = min(_TOGETHER, first.size - start)
        _rows(first[start : start + n], by_first)
        _rows(second[start : start + n], by_second)
        for m in range(rows):
            total = out[m, start : start + n]
            total[:] = 0.0
            for a in range(j):
                inner[:n] = 0.0
                for b in range(k):
                    c = coefficients[m, a, b]
                    for t in range(n):
                        inner[t] += c * by_second[b, t]
                for t in range(n):
                    total[t] += inner[t] * by_first[a, t]


@njit(cache=True, nogil=True, error_model="numpy")
def _rows(x: Array, out: Array) -> None:
    # Chebyshev polynomials at x, one a row
    n = x.size
    out[0, :n] = 1.0
    if len(out) > 1:
        out[1, :n] = x
    for k in range(2, len(out)):
        out[k, :n] = 2 * x * out[k - 1, :n] - out[k - 2, :n]
