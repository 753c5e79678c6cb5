"""Compiled loops that write the motion of driven oscillators, exact from event to event."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.loops import njit

Pair = tuple[float, float]

TABLE = 64  # samples that one state serves before it is turned on
_BLOCK = 16  # samples written together: a fixed count is what the compiler unrolls
_LONG = 4.0  # ωT from which the downward recursion is always taken
_SERIES = 38  # terms that a series over ωT < 4 needs beyond the force's own, to 1e-17
_NOTHING = 345.0  # exp(−345) = 1e-150: below that a mode is at rest, and numbers too small for their format are slow


class Driven(NamedTuple):
    """M oscillators and what sets them in motion.

    Attributes
    ----------
    event : (E,) array
        Times of the events [s], ascending.
    step, kick : (M, E) arrays
        Steps of q and of q̇ [1/s] at each event.
    force : (M, E, n) array
        Coefficients of the powers of t − t_e of the force [s^−(k+2)], from event e to the next.
    omega, zeta : (M,) arrays
        ω [rad/s] and ζ.
    """

    event: Array
    step: Array
    kick: Array
    force: Array
    omega: Array
    zeta: Array


@njit(cache=True, error_model="numpy")
def _turn(x: float, y: float, decay: float, big_omega: float, tau: float) -> tuple[float, float]:
    # (x + iy) exp(−(ζω + iΩ)τ)
    if decay * tau > _NOTHING:
        return 0.0, 0.0
    size = np.exp(-decay * tau)
    c, s = size * np.cos(big_omega * tau), size * np.sin(big_omega * tau)
    return x * c + y * s, y * c - x * s


@njit(cache=True, error_model="numpy")
def horner(p: Array, terms: int, tau: float) -> tuple[float, float]:
    """Value and rate of a polynomial: Σ_k p[k] τ^k and its derivative, k < terms.

    Parameters
    ----------
    p : (n,) array
        Coefficients.
    terms : int
        How many count.
    tau : float
        Place.

    Returns
    -------
    tuple of 2 floats
        Value and rate.
    """
    value = rate = 0.0
    for k in range(terms - 1, -1, -1):
        rate = rate * tau + value
        value = value * tau + p[k]
    return value, rate


@njit(cache=True, error_model="numpy")
def _particular(force: Array, omega: float, zeta: float, span: float, p: Array) -> int:
    # p̈ + 2ζωṗ + ω²p = f from the top coefficient down; returns how many coefficients p has
    n = force.size
    while n > 0 and force[n - 1] == 0:
        n -= 1
    size = reach = 0.0
    p[n] = p[n + 1] = 0.0
    for k in range(n - 1, -1, -1):
        p[k] = (force[k] - 2 * zeta * omega * (k + 1) * p[k + 1] - (k + 1) * (k + 2) * p[k + 2]) / omega**2
        size, reach = size * span + abs(p[k]), reach * span + abs(force[k])
    # f that changes faster than the mode makes p vast, to be cancelled by the free decay: digits would be lost
    if n == 0 or omega * span >= _LONG or size * (1 + (omega * span) ** 2) <= 100 * reach * span**2:
        return n
    return _series(force, n, omega, zeta, span, p)


@njit(cache=True, error_model="numpy")
def _series(force: Array, n: int, omega: float, zeta: float, span: float, p: Array) -> int:
    # the solution from rest as a power series: nothing cancels while ωT is small
    p[0] = p[1] = 0.0
    power, size = span, 0.0
    for k in range(n + _SERIES - 2):
        f = force[k] if k < n else 0.0
        p[k + 2] = (f - 2 * zeta * omega * (k + 1) * p[k + 1] - omega**2 * p[k]) / ((k + 1) * (k + 2))
        last, power = abs(p[k + 1]) * power, power * span
        size = max(size, abs(p[k + 2]) * power)
        if k > n and last + abs(p[k + 2]) * power <= 1e-18 * size:
            return k + 1
    return n + _SERIES


@njit(cache=True, error_model="numpy")
def _enter(
    driven: Driven, i: int, e: int, end: Pair, span: float, rate: bool, p: Array
) -> tuple[int, float, float, Pair]:
    # A new stretch: its polynomial, the change of the free state at its start, where the polynomial will end.
    force, omega, zeta = driven.force, driven.omega[i], driven.zeta[i]
    terms = _particular(force[i, e], omega, zeta, span, p) if force.shape[2] > 0 else 0
    x = driven.step[i, e] + end[0] - (p[0] if terms > 0 else 0.0)
    v = driven.kick[i, e] + end[1] - (p[1] if terms > 1 else 0.0)
    end = horner(p, terms, span)
    decay, big_omega = zeta * omega, omega * np.sqrt(1 - zeta**2)
    y = (v + decay * x) / big_omega
    if rate:
        terms = max(terms - 1, 0)
        for k in range(terms):
            p[k] = (k + 1) * p[k + 1]
        x, y = -decay * x + big_omega * y, -big_omega * x - decay * y
    return terms, x, y, end


@njit(cache=True, error_model="numpy")
def _span(event: Array, e: int, last: float) -> float:
    return event[e + 1] - event[e] if e + 1 < event.size else max(last - event[e], 0.0)


@njit(cache=True, error_model="numpy")
def excite_anywhere(t: Array, first: Integers, driven: Driven, rate: bool, out: Array) -> None:
    """Write the motion at ascending times, whatever their spacing.

    Parameters
    ----------
    t : (T,) array
        Times [s], ascending.
    first : (E,) array of int
        First sample at or after each event.
    driven : Driven
        Events, forces and oscillators.
    rate : bool
        Whether q̇ is written, else q.
    out : (M T + TABLE,) array
        Written, one mode after the other.
    """
    event, omega, zeta = driven.event, driven.omega, driven.zeta
    p = np.empty(driven.force.shape[2] + _SERIES)
    for i in range(omega.size):
        decay, big_omega = zeta[i] * omega[i], omega[i] * np.sqrt(1 - zeta[i] ** 2)
        row = out[i * t.size : (i + 1) * t.size]
        row[: first[0] if event.size else t.size] = 0.0
        x = y = 0.0
        end = (0.0, 0.0)
        for e in range(event.size):
            if first[e] == t.size:
                break
            stop = first[e + 1] if e + 1 < event.size else t.size
            span = _span(event, e, t[-1])
            terms, dx, dy, end = _enter(driven, i, e, end, span, rate, p)
            x, y = x + dx, y + dy
            for j in range(first[e], stop):
                tau = t[j] - event[e]
                row[j] = _turn(x, y, decay, big_omega, tau)[0] + horner(p, terms, tau)[0]
            x, y = _turn(x, y, decay, big_omega, span)


@njit(cache=True, error_model="numpy")
def excite_even(t: Array, first: Integers, driven: Driven, rate: bool, out: Array) -> None:
    """Write the motion at evenly spaced times: one state serves a table of samples.

    Parameters
    ----------
    t : (T,) array
        Times [s], evenly spaced.
    first : (E,) array of int
        First sample at or after each event.
    driven : Driven
        Events, forces and oscillators.
    rate : bool
        Whether q̇ is written, else q.
    out : (M T + TABLE,) array
        Written, one mode after the other.
    """
    event, omega, zeta = driven.event, driven.omega, driven.zeta
    p, value = np.empty(driven.force.shape[2] + _SERIES), np.empty(TABLE)
    spacing = (t[-1] - t[0]) / (t.size - 1)
    cosine, sine = np.empty(TABLE + 1), np.empty(TABLE + 1)
    for i in range(omega.size):
        decay, big_omega = zeta[i] * omega[i], omega[i] * np.sqrt(1 - zeta[i] ** 2)
        for k in range(TABLE + 1):
            cosine[k], sine[k] = _turn(1.0, 0.0, decay, big_omega, k * spacing)
        j = first[0] if event.size else t.size
        out[i * t.size : i * t.size + j] = 0.0
        x = y = passed = 0.0
        end = (0.0, 0.0)
        for e in range(event.size):
            if j == t.size:
                break
            stop = first[e + 1] if e + 1 < event.size else t.size
            lead = t[j] - event[e]
            if e > 0:  # the grid's steps miss the time between events by the last place of t: turn by that much more
                slip = event[e] - event[e - 1] + lead - passed
                x, y = x + slip * (big_omega * y - decay * x), y - slip * (big_omega * x + decay * y)
            passed = lead + (stop - j) * spacing
            terms, dx, dy, end = _enter(driven, i, e, end, _span(event, e, t[-1]), rate, p)
            dx, dy = _turn(dx, dy, decay, big_omega, lead)
            x, y = _write_free(out, i * t.size + j, stop - j, x + dx, y + dy, cosine, sine)
            if terms > 0:
                add_polynomial(out, i * t.size + j, stop - j, p, terms, lead, spacing, value)
            j = stop


# The two writers go in whole blocks, the second adding to the first: what overruns is written again by who comes next.


@njit(cache=True, error_model="numpy")
def _write_free(out: Array, start: int, count: int, x: float, y: float, cosine: Array, sine: Array) -> Pair:
    while count > 0:
        served = min(TABLE, count)
        for b in range(0, served, _BLOCK):
            block = out[start + b : start + b + _BLOCK]
            for k in range(_BLOCK):
                block[k] = x * cosine[b + k] - y * sine[b + k]
        x, y = x * cosine[served] - y * sine[served], x * sine[served] + y * cosine[served]
        if abs(x) + abs(y) < 1e-150:  # as _NOTHING
            x = y = 0.0
        start, count = start + served, count - served
    return x, y


@njit(cache=True, error_model="numpy")
def add_polynomial(
    out: Array, start: int, count: int, p: Array, terms: int, tau: float, spacing: float, value: Array
) -> None:
    """Add Σ_m p[m] (τ + k·spacing)^m to sample start + k of a flat record, k < count, in whole blocks.

    Parameters
    ----------
    out : array
        Flat record, in and out.
    start, count : int
        First sample, and how many.
    p : array
        Coefficients, of which ``terms`` count.
    terms : int
        How many.
    tau, spacing : float
        Place of the first sample, and step [s].
    value : (TABLE,) array
        Room to work.
    """
    if count < _BLOCK // 2:
        for k in range(count):
            out[start + k] += horner(p, terms, tau + k * spacing)[0]
        return
    for b in range(0, count, TABLE):
        block, begin = out[start + b : start + b + TABLE], tau + b * spacing
        for k in range(TABLE):
            value[k] = p[terms - 1]
        for m in range(terms - 2, -1, -1):
            c = p[m]
            for k in range(TABLE):
                value[k] = value[k] * (begin + k * spacing) + c
        for k in range(TABLE):
            block[k] += value[k]
