"""Damped oscillators that forces and events set in motion (Eqs. 3, 4, 6 and 7)."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, ShapeError
from vibrissa.loops import njit
from vibrissa.mechanics.vibration.excitation import TABLE, Driven, excite_anywhere, excite_even


def green_function(t: Array, omega: float, zeta: float) -> Array:
    """Displacement of a damped oscillator after a unit impulse.

    Eq. (7) of [Boubenec2014]_: G = exp(−ζωt) sin(Ωt)/Ω, with Ω = ω√(1 − ζ²).

    Parameters
    ----------
    t : (T,) array
        Time since the impulse [s]; G = 0 before it.
    omega, zeta : float
        Resonant angular frequency ω [rad/s], damping ratio ζ below 1.

    Returns
    -------
    (T,) array
        Displacement per unit of velocity given at t = 0 [s].

    Examples
    --------
    >>> green_function(np.array([0.0, 1e-3]), omega=770.0, zeta=0.11).round(6).tolist()
    [0.0, 0.000832]
    """
    t = np.maximum(t, 0.0)
    big_omega = omega * np.sqrt(1 - zeta**2)
    return np.exp(-zeta * omega * t) * np.sin(big_omega * t) / big_omega


def ring(t: Array, event: Array, jump: Array, kick: Array, omega: Array, zeta: Array) -> Array:
    """Exact motion of several modes that events set ringing, on any ascending grid.

    Eq. (3) of [Boubenec2014]_, q̈ + 2ζωq̇ + ω²q = 0, holds between events; Eq. (4) of [Boubenec2014]_ has its
    driving force f here as steps of q and q̇. One pass, linear in events and samples.

    Parameters
    ----------
    t : (T,) array
        Times asked for [s], ascending.
    event : (E,) array
        Times of the events [s], ascending; an event at a sample acts before it.
    jump, kick : (M, E) arrays
        Steps of q and of q̇ at each event, for each mode.
    omega, zeta : (M,) arrays
        Resonant angular frequencies [rad/s] and damping ratios.

    Returns
    -------
    (M, T) array
        q, 0 before the first event.

    Raises
    ------
    InputError
        If ω ≤ 0, ζ is outside [0, 1), or times do not ascend.
    """
    return excite(t, event, jump, kick, np.empty((*np.shape(jump), 0)), omega, zeta)[0]


def excite(
    t: ArrayLike,
    event: Array,
    step: Array,
    kick: Array,
    force: Array,
    omega: ArrayLike,
    zeta: ArrayLike,
    *,
    orders: tuple[Literal[0, 1], ...] = (0,),
) -> Array:
    """Exact motion of oscillators under forces that are polynomial between events, at rest before the first.

    Eq. (6) of [Boubenec2014]_, q̈ + 2ζωq̇ + ω²q = f, where f = −Q̈ (printed without one of its dots). Between events q is
    a polynomial that follows f plus a free decay; the state z of the latter turns as exp(−(ζω + iΩ)t). One pass,
    linear in events and samples.

    Parameters
    ----------
    t : (T,) array
        Times asked for [s], ascending.
    event : (E,) array
        Times of the events [s], ascending; an event at a sample acts before it.
    step, kick : (M, E) arrays
        Steps of q and of q̇ [1/s] at each event.
    force : (M, E, n) array
        f_i(t) = Σ_k force[i, e, k] (t − t_e)^k [s^−(k+2)] from event e to the next; n = 0 for none.
    omega, zeta : (M,) arrays or floats
        Resonant angular frequencies [rad/s] and damping ratios.
    orders : tuple of {0, 1}
        Of the derivatives asked for: q, q̇ [1/s].

    Returns
    -------
    (O, M, T) array
        q, q̇ or both, 0 before the first event.

    Raises
    ------
    InputError
        If ω ≤ 0, ζ is outside [0, 1), or times do not ascend.
    """
    t, event = ascending(t), ascending(event)
    omega, zeta = oscillators(omega, zeta, len(step))
    size = len(step) * t.size
    out = np.empty(len(orders) * size + TABLE)
    step, kick, force = (np.ascontiguousarray(values) for values in (step, kick, force))
    driven = Driven(event, step, kick, force, omega, zeta)
    even, first = grid(t, event)
    run = excite_even if even else excite_anywhere
    for place, order in enumerate(orders):
        run(t, first, driven, order == 1, out[place * size :])
    return rows(out, len(orders), len(step), t.size)


def oscillators(omega: ArrayLike, zeta: ArrayLike, n_modes: int) -> tuple[Array, Array]:
    """ω and ζ, (M,) each, if they are oscillators.

    Parameters
    ----------
    omega, zeta : array_like
        One value, or one for each mode.
    n_modes : int
        M.

    Returns
    -------
    tuple of 2 (M,) arrays
        ω [rad/s] and ζ.

    Raises
    ------
    InputError
        If shapes disagree, ω ≤ 0 or ζ is outside [0, 1).
    """
    omega, zeta = np.asarray(omega, dtype=float), np.asarray(zeta, dtype=float)
    if {omega.shape, zeta.shape} - {(), (n_modes,)}:
        raise ShapeError("omega and damping", f"must have one value, or one for each of {n_modes} modes")
    if not np.all((omega > 0) & np.isfinite(omega)):
        raise RangeError("omega", "must be positive", omega)
    if not np.all((zeta >= 0) & (zeta < 1)):
        raise RangeError("damping", "must lie in [0, 1)", zeta)
    return np.full(n_modes, omega), np.full(n_modes, zeta)


def ascending(t: ArrayLike) -> Array:
    """Times, if they are a finite ascending row.

    Parameters
    ----------
    t : array_like
        Times [s].

    Returns
    -------
    (T,) array
        The times.

    Raises
    ------
    InputError
        If they do not ascend, or one is not finite.
    """
    t = np.require(np.atleast_1d(t), float, ["C", "W"])  # loops are compiled anew for arrays that only may be read
    if t.ndim != 1 or not _ascends(t):
        raise RangeError("times of samples and events", "must ascend and be finite")
    return t


def grid(t: Array, event: Array) -> tuple[bool, Integers]:
    """Whether samples are evenly spaced, and the first one at or after each event, (E,).

    Parameters
    ----------
    t, event : (T,) and (E,) arrays
        Times of samples and events [s].

    Returns
    -------
    tuple
        Whether even, and the first samples (E,).
    """
    even = bool(_is_even(t))
    return even, first_even(t, event) if even else np.searchsorted(t, event)


def rows(out: Array, *shape: int) -> Array:
    """The rows of a flat record: blocks may overrun the end of a row, where the next row then writes.

    Parameters
    ----------
    out : array
        Flat record.
    shape : int
        Of the result.

    Returns
    -------
    array
        Its rows.
    """
    return out[: math.prod(shape)].reshape(shape)


@njit(cache=True, error_model="numpy")
def _ascends(t: Array) -> bool:
    wrong = 0
    for j in range(t.size - 1):
        wrong += not t[j] <= t[j + 1]
    return wrong == 0 and (t.size == 0 or np.isfinite(t[0] + t[-1]))


@njit(cache=True, error_model="numpy")
def _is_even(t: Array) -> bool:
    if t.size < 2 or t[0] == t[-1]:
        return False
    # to the rounding of linspace and of arange/rate, in units of the last place
    spacing = (t[-1] - t[0]) / (t.size - 1)
    slack = 4 * 2.3e-16 * max(abs(t[0]), abs(t[-1]))
    wrong = 0
    for j in range(t.size):
        wrong += not abs(t[j] - (t[0] + j * spacing)) <= slack
    return wrong == 0


@njit(cache=True, error_model="numpy")
def first_even(t: Array, event: Array) -> Integers:
    """First of evenly spaced samples (T,) at or after each event (E,).

    Parameters
    ----------
    t : (T,) array
        Times [s], evenly spaced.
    event : (E,) array
        Times [s].

    Returns
    -------
    (E,) array
        Integers; T where none follows.
    """
    # where it must be, put right by the one sample that rounding may cost
    first = np.empty(event.size, np.int64)
    pace = (t.size - 1) / (t[-1] - t[0])
    for e in range(event.size):
        j = int(min(max((event[e] - t[0]) * pace, 0.0), t.size - 1.0))
        while j > 0 and t[j - 1] >= event[e]:
            j -= 1
        while j < t.size and t[j] < event[e]:
            j += 1
        first[e] = j
    return first
