"""Oscillators whose frequency drifts while events and a quasi-static drive set them ringing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, ShapeError
from vibrissa.loops import njit
from vibrissa.mechanics.vibration.dynamics import RECOIL, Drive, JumpRule
from vibrissa.mechanics.vibration.excitation import horner
from vibrissa.mechanics.vibration.oscillator import ascending

_STRIDE = 1.5  # ωT of one power series: some 25 terms to round-off
_MOMENT = 1e-3  # ωT beyond the last event or sample, so that a sample at the last event has a series to be read from
_TERMS = 60  # most terms of one
_SMALL = 1e-17  # last terms over the largest


def drift(
    t: ArrayLike, drive: Drive, frequency: Drive, damping: float, jump: JumpRule = "continuous"
) -> tuple[Array, Array]:
    """Vibration of modes whose frequency ω(t) is polynomial from event to event, and its rate.

    q̈ + 2ζω(t)q̇ + ω(t)²q = −Q̈, with the steps of :func:`vibrissa.mechanics.vibration.dynamics.vibrate` at the
    events. Each stretch of 1.5 radians is a power series whose recurrence multiplies the polynomials of ω² and q: to
    round-off, whatever ω does, so that the adiabatic change of amplitude, ω^−1/2, is a result and not an assumption.

    Parameters
    ----------
    t : (T,) array
        Times asked for [s], ascending, at or after the first event; an event at a sample acts before it.
    drive : Drive
        Quasi-static amplitudes Q_i(t) of M modes, over L.
    frequency : Drive
        ω_i(t) [rad/s] at the same events, positive.
    damping : float
        Damping ratio ζ in [0, 1).
    jump : {"continuous", "ramp-limit", "paper2014"}
        What q̇ does when Q jumps: see :func:`vibrissa.mechanics.vibration.dynamics.vibrate`.

    Returns
    -------
    q, rate : (M, T) arrays
        q over L, q̇ over L [1/s]; at rest before the first event.

    Raises
    ------
    InputError
        If times do not ascend or go back before the first event, the two do not share their events, or ω ≤ 0.
    """
    t = ascending(t)
    if not np.array_equal(drive.time, frequency.time) or len(drive.before) != len(frequency.before):
        raise ShapeError("frequency", "must have the events and modes of the drive")
    if t.size and (drive.time.size == 0 or t[0] < drive.time[0]):
        raise RangeError("times", "must not go back before the first event", t[0])
    if not np.all(frequency.coefficients[..., 0] > 0):
        raise RangeError("frequency", "must be positive", frequency.coefficients[..., 0].min())
    if not 0 <= damping < 1:
        raise RangeError("damping", "must lie in [0, 1)", damping)
    out = np.empty((2, len(drive.before), t.size))
    moment = _MOMENT / frequency.coefficients[..., 0].max() if t.size else 0.0
    end = np.append(drive.time, max(t[-1], drive.time[-1]) + moment) if t.size else drive.time
    first = np.append(np.searchsorted(t, drive.time), t.size)
    if t.size:
        _march(t, first, end, drive.coefficients, drive.before, frequency.coefficients, damping, RECOIL[jump], out)
    return out[0], out[1]


@njit(cache=True, error_model="numpy")
def _march(
    t: Array,
    first: Integers,
    time: Array,
    drive: Array,
    before: Array,
    frequency: Array,
    zeta: float,
    recoil: float,
    out: Array,
) -> None:
    n, m = drive.shape[2], frequency.shape[2]
    a, o, w, c = np.zeros(max(n, 2)), np.empty(m), np.empty(2 * m - 1), np.empty(_TERMS + 2)
    for i in range(before.size):
        q = rate = slope = 0.0
        value = before[i]
        for e in range(time.size - 1):
            span = time[e + 1] - time[e]
            step = value - drive[i, e, 0]
            q += step
            rate += slope - (drive[i, e, 1] if n > 1 else 0.0) - recoil * zeta * frequency[i, e, 0] * step
            fastest = max(frequency[i, e, 0], horner(frequency[i, e], m, span)[0])
            parts = max(int(np.ceil(fastest * span / _STRIDE)), 1)
            h, j = span / parts, first[e]
            for p in range(parts):
                _shift(drive[i, e], p * h, h, a)
                _shift(frequency[i, e], p * h, h, o)
                terms = _series(a, o, w, h, zeta, q, rate, c)
                stop = time[e] + (p + 1) * h
                while j < first[e + 1] and (p == parts - 1 or t[j] < stop):
                    q_j, rate_j = horner(c, terms, (t[j] - time[e]) / h - p)
                    out[0, i, j], out[1, i, j] = q_j, rate_j / h
                    j += 1
                q, rate = horner(c, terms, 1.0)
                rate /= h
            value, slope = horner(drive[i, e], n, span)


@njit(cache=True, error_model="numpy")
def _shift(p: Array, begin: float, unit: float, out: Array) -> None:
    # coefficients of the polynomial about begin, in units of time
    n, power = p.size, 1.0
    out[:n] = p
    for k in range(n - 1):
        for j in range(n - 2, k - 1, -1):
            out[j] += begin * out[j + 1]
    for k in range(n):
        out[k] *= power
        power *= unit


@njit(cache=True, error_model="numpy")
def _series(a: Array, o: Array, w: Array, h: float, zeta: float, q: float, rate: float, c: Array) -> int:
    # power series of q̈ + 2ζωq̇ + ω²q = −Q̈ in units of h; returns how many terms it has
    m, n = o.size, a.size
    w[:] = 0.0
    for k in range(m):
        o[k] *= h
    for k in range(m):
        for j in range(m):
            w[k + j] += o[k] * o[j]
    c[0], c[1] = q, rate * h
    largest = abs(c[0]) + abs(c[1])
    for k in range(_TERMS):
        total = -(k + 2) * (k + 1) * a[k + 2] if k + 2 < n else 0.0
        for j in range(min(k + 1, 2 * m - 1)):
            total -= w[j] * c[k - j]
        for j in range(min(k + 1, m)):
            total -= 2 * zeta * o[j] * (k - j + 1) * c[k - j + 1]
        c[k + 2] = total / ((k + 2) * (k + 1))
        largest = max(largest, abs(c[k + 2]))
        if k + 2 >= n and abs(c[k + 1]) + abs(c[k + 2]) <= _SMALL * largest:
            return k + 2
    return _TERMS + 2
