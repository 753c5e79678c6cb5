"""Functions of time as polynomials on panels, and when they pass through zero."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import Chebyshev as Series
from numpy.polynomial import Polynomial

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.mechanics.statics.chebyshev import Chebyshev, unit_nodes
from vibrissa.mechanics.vibration.dynamics import Drive

_HALVINGS = 60


def panels(knots: Array, longest: float) -> Array:
    """Knots, and borders between them, enough that no panel is longer [s].

    Parameters
    ----------
    knots : (K,) array
        Times [s], ascending.
    longest : float
        Longest panel [s].

    Returns
    -------
    (E + 1,) array
        Borders [s].

    Raises
    ------
    InputError
        If the longest panel is not positive.
    """
    if not longest > 0:
        raise RangeError("panel", "must be positive (s)", longest)
    counts = np.ceil(np.diff(knots) / longest).astype(int)
    inner = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(knots[:-1], knots[1:], counts, strict=True)]
    return np.append(np.concatenate(inner), knots[-1])


def panel_nodes(borders: Array, n: int) -> Array:
    """Chebyshev nodes of every panel, ascending, (E, n).

    Parameters
    ----------
    borders : (E + 1,) array
        Of the panels [s].
    n : int
        Nodes of each.

    Returns
    -------
    (E, n) array
        Times [s].
    """
    return np.asarray(borders[:-1, None] + np.diff(borders)[:, None] * (1 + unit_nodes(n)[::-1]) / 2)


def powers(values: Array, borders: Array) -> Array:
    """Coefficients (K, E, n) of the powers of t − t_e from values (K, E, n) at the nodes of every panel.

    Parameters
    ----------
    values : (K, E, n) array
        At the nodes.
    borders : (E + 1,) array
        Of the panels [s].

    Returns
    -------
    (K, E, n) array
        Coefficients.
    """
    n = values.shape[2]
    basis = [Series.basis(k, domain=[0, 1]).convert(kind=Polynomial).coef for k in range(n)]
    whole = np.array([np.pad(np.rint(row), (0, n - len(row))) for row in basis])  # the coefficients are whole numbers
    return np.asarray(values[..., ::-1] @ Chebyshev(n).to_series.T @ whole / np.diff(borders)[:, None] ** np.arange(n))


def fit(function: Callable[[Array], Array], borders: Array, n: int) -> Drive:
    """A function of ascending times (T,), of values (K, T), as polynomials of n terms on panels.

    Parameters
    ----------
    function : callable
        Of times (T,), values (K, T).
    borders : (E + 1,) array
        Of the panels [s].
    n : int
        Terms.

    Returns
    -------
    Drive
        The polynomials.
    """
    values = function(panel_nodes(borders, n).ravel())
    coefficients = powers(values.reshape(len(values), -1, n), borders)
    return Drive(borders[:-1], coefficients, coefficients[:, 0, 0])


def first_above(function: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """When functions (J,) → (J,) that rise come up to 0 between two times, by bisection; infinite where they do not.

    Parameters
    ----------
    function : callable
        Of times (J,), values (J,).
    low, high : (J,) arrays
        Times [s].

    Returns
    -------
    (J,) array
        Times [s].
    """
    missed = function(high) < 0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        above = function(middle) >= 0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(missed, np.inf, high)
