"""Vibration of the modes under any quasi-static drive, exact from event to event (Eq. 6)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, ShapeError, UnknownError
from vibrissa.loops import njit
from vibrissa.mechanics.vibration.excitation import TABLE, add_polynomial, horner
from vibrissa.mechanics.vibration.oscillator import ascending, excite, grid, oscillators, rows

JumpRule = Literal["continuous", "ramp-limit", "paper2014"]

# q̇ after a step Δq that a jump of the quasi-static part causes, in units of −ζωΔq
RECOIL: dict[JumpRule, float] = {"continuous": 0.0, "ramp-limit": 2.0, "paper2014": 1.0}


@dataclass(frozen=True)
class Drive:
    """Quasi-static amplitudes Q_i(t) = ∫ s² U_qs V_i ds of the modes, polynomial in time between events.

    Attributes
    ----------
    time : (E,) array
        Times t_e of the events [s], ascending.
    coefficients : (M, E, n) array
        Q_i(t) = Σ_k coefficients[i, e, k] (t − t_e)^k, over L [s^−k], from event e to the next; the last goes on.
    before : (M,) array
        Q_i before the first event, where it rests.

    Raises
    ------
    InputError
        If shapes disagree, a number is not finite or times do not ascend.
    """

    time: Array
    coefficients: Array
    before: Array

    def __post_init__(self) -> None:
        for name in ("time", "coefficients", "before"):
            value = np.ascontiguousarray(getattr(self, name), dtype=float)
            object.__setattr__(self, name, value)
            if not np.isfinite(value).all():
                raise RangeError(f"Drive.{name}", "must be finite")
        shape = self.coefficients.shape
        if len(shape) != 3 or self.time.shape != shape[1:2] or self.before.shape != shape[:1] or shape[2] == 0:
            got = f"{self.time.shape}, {shape}, {self.before.shape}"
            raise ShapeError("Drive", "must have time (E,), coefficients (M, E, n ≥ 1) and before (M,)", got)
        if np.any(np.diff(self.time) < 0):
            raise RangeError("Drive.time", "must ascend")

    def __call__(self, t: ArrayLike) -> Array:
        """Q at ascending times t [s], (M, T) over L; at an event, its new value."""
        return self._at(t, [self.coefficients], self.before)

    def rate(self, t: ArrayLike) -> Array:
        """Q̇ at ascending times t [s], (M, T) over L [1/s]; at an event, its new value.

        Parameters
        ----------
        t : (T,) array
            Times [s], ascending.

        Returns
        -------
        (M, T) array
            Over L [1/s].
        """
        one_by_one = (_derivative(row) for row in self.coefficients[:, None])  # all at once are as large as the drive
        return self._at(t, one_by_one, np.zeros_like(self.before))

    def _at(self, t: ArrayLike, parts: Iterable[Array], before: Array) -> Array:
        t = ascending(t)
        out = np.empty(len(before) * t.size + TABLE)
        even, first = grid(t, self.time)
        follow = follow_even if even else _follow_anywhere
        done = 0
        for part in parts:
            end = done + len(part)
            follow(t, first, self.time, part, before[done:end], out[done * t.size : end * t.size + TABLE])
            done = end
        return rows(out, len(before), t.size)


def vibrate(
    t: ArrayLike, drive: Drive, omega: ArrayLike, zeta: ArrayLike, jump: JumpRule = "continuous"
) -> tuple[Array, Array]:
    """Vibration of every mode and its rate; :func:`amplitudes` gives the first alone, in half the time.

    After a jump of the drive q rings as Eq. (8) of [Boubenec2014]_ says, from −ΔQ, Eq. (9) of [Boubenec2014]_, and, for
    the rate, −ΔQ̇, Eq. (10) of [Boubenec2014]_; both are printed without the minus.

    Parameters
    ----------
    t : (T,) array
        Times asked for [s], ascending; an event at a sample acts before it. Even grids are the fastest.
    drive : Drive
        Quasi-static amplitudes Q_i(t).
    omega, zeta : (M,) arrays or floats
        Resonant angular frequencies ω > 0 [rad/s] and damping ratios ζ in [0, 1).
    jump : {"continuous", "ramp-limit", "paper2014"}
        What q̇ does when Q jumps and q therefore steps by Δq = −ΔQ: nothing (displacement and velocity of the whole
        whisker are continuous); −2ζωΔq, the limit of ever steeper ramps of Q; −ζωΔq, the paper's lone cosine.

    Returns
    -------
    q, rate : (M, T) arrays
        q over L, 0 before the first event, in the sign of Q; q̇ over L [1/s].

    Raises
    ------
    InputError
        If times do not ascend, or ω, ζ or the rule are out of range.
    """
    q, rate = excite(t, drive.time, *_excitation(drive, omega, zeta, jump), omega, zeta, orders=(0, 1))
    return q, rate


def amplitudes(t: ArrayLike, drive: Drive, omega: ArrayLike, zeta: ArrayLike, jump: JumpRule = "continuous") -> Array:
    """Vibration q of every mode, (M, T) over L, without its rate; see :func:`vibrate`.

    Parameters
    ----------
    t, drive, omega, zeta, jump
        As of :func:`vibrate`.

    Returns
    -------
    (M, T) array
        q over L.
    """
    return excite(t, drive.time, *_excitation(drive, omega, zeta, jump), omega, zeta)[0]


def _excitation(drive: Drive, omega: ArrayLike, zeta: ArrayLike, jump: JumpRule) -> tuple[Array, Array, Array]:
    """Steps (M, E) of q and q̇ at every event of the drive, by the rule, and the force between events."""
    if jump not in RECOIL:
        raise UnknownError("jump", f"must be one of {', '.join(RECOIL)}", repr(jump))
    omega, zeta = oscillators(omega, zeta, len(drive.before))
    return excitation(drive.time, drive.coefficients, drive.before, RECOIL[jump] * (zeta * omega))


def _derivative(coefficients: Array) -> Array:
    """Coefficients of the derivative, along the last axis."""
    return coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])


@njit(cache=True, nogil=True, error_model="numpy")
def excitation(time: Array, coefficients: Array, before: Array, recoil: Array) -> tuple[Array, Array, Array]:
    """What sets the modes ringing: steps −ΔQ and −ΔQ̇ at every event, and −Q̈ between events.

    Parameters
    ----------
    time, coefficients, before : (E,), (M, E, n) and (M,) arrays
        As of a :class:`Drive`.
    recoil : (M,) array
        q̇ after a step Δq, over −Δq [1/s].

    Returns
    -------
    step, kick, force : (M, E), (M, E) and (M, E, n − 2) arrays
        Steps of q and q̇, and coefficients of the force.
    """
    modes, events, terms = coefficients.shape
    step, kick, force = (
        np.empty((modes, events)),
        np.empty((modes, events)),
        np.empty((modes, events, max(terms - 2, 0))),
    )
    for i in range(modes):
        value, rate = before[i], 0.0
        for e in range(events):
            slope = coefficients[i, e, 1] if terms > 1 else 0.0
            step[i, e] = value - coefficients[i, e, 0]
            kick[i, e] = rate - slope - recoil[i] * step[i, e]
            for k in range(2, terms):
                force[i, e, k - 2] = coefficients[i, e, k] * (-k * (k - 1.0))
            if e + 1 < events:
                value, rate = horner(coefficients[i, e], terms, time[e + 1] - time[e])
    return step, kick, force


@njit(cache=True, nogil=True, error_model="numpy")
def _follow_anywhere(t: Array, first: Integers, time: Array, coefficients: Array, before: Array, out: Array) -> None:
    for i in range(before.size):
        row = out[i * t.size : (i + 1) * t.size]
        row[: first[0] if time.size else t.size] = before[i]
        for e in range(time.size):
            stop = first[e + 1] if e + 1 < time.size else t.size
            for j in range(first[e], stop):
                row[j] = horner(coefficients[i, e], coefficients.shape[2], t[j] - time[e])[0]


@njit(cache=True, nogil=True, error_model="numpy")
def follow_even(t: Array, first: Integers, time: Array, coefficients: Array, before: Array, out: Array) -> None:
    """Write a :class:`Drive` at evenly spaced times (T,) into a flat record of M rows, with room for ``TABLE`` more.

    Parameters
    ----------
    t : (T,) array
        Times [s], evenly spaced.
    first : (E,) array
        First sample at or after each event.
    time, coefficients, before : arrays
        As of :class:`Drive`.
    out : (M T + TABLE,) array
        Written.
    """
    value, terms = np.empty(TABLE), coefficients.shape[2]
    spacing = (t[-1] - t[0]) / (t.size - 1)
    for i in range(before.size):
        out[i * t.size : i * t.size + (first[0] if time.size else t.size)] = before[i]
        for e in range(time.size):
            j, stop = first[e], first[e + 1] if e + 1 < time.size else t.size
            if j < stop:
                out[i * t.size + j : i * t.size + stop] = 0.0
                if terms > 0:
                    begin = t[j] - time[e]
                    add_polynomial(out, i * t.size + j, stop - j, coefficients[i, e], terms, begin, spacing, value)
