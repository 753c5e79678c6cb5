"""Vibration of the modes under any quasi-static drive, exact from event to event (Eq. 6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline, PPoly

from vibrissa.errors import InputError
from vibrissa.mechanics.excitation import TABLE, add_polynomial, horner
from vibrissa.mechanics.oscillator import ascending, excite, grid, oscillators, rows

Array = NDArray[np.float64]
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
                raise InputError(f"Drive.{name}", "must be finite")
        shape = self.coefficients.shape
        if len(shape) != 3 or self.time.shape != shape[1:2] or self.before.shape != shape[:1] or shape[2] == 0:
            got = f"{self.time.shape}, {shape}, {self.before.shape}"
            raise InputError("Drive", "must have time (E,), coefficients (M, E, n ≥ 1) and before (M,)", got)
        if np.any(np.diff(self.time) < 0):
            raise InputError("Drive.time", "must ascend")

    def __call__(self, t: ArrayLike) -> Array:
        """Q at ascending times t [s], (M, T) over L; at an event, its new value."""
        return self._at(t, self.coefficients, self.before)

    def rate(self, t: ArrayLike) -> Array:
        """Q̇ at ascending times t [s], (M, T) over L [1/s]; at an event, its new value."""
        return self._at(t, _derivative(self.coefficients), np.zeros_like(self.before))

    def _at(self, t: ArrayLike, coefficients: Array, before: Array) -> Array:
        t = ascending(t)
        out = np.empty(len(before) * t.size + TABLE)
        even, first = grid(t, self.time)
        follow = _follow_even if even else _follow_anywhere
        follow(t, first, self.time, coefficients, before, out)
        return rows(out, len(before), t.size)

    @classmethod
    def from_piecewise(cls, amplitude: PPoly, before: ArrayLike | None = None) -> Self:
        """Drive that follows piecewise polynomials of time, an event at each breakpoint.

        Parameters
        ----------
        amplitude : PPoly
            Of values () or (M,), over L, of time [s]; its last piece goes on.
        before : (M,) array, optional
            Where Q rests before the first breakpoint; by default at its first value.
        """
        if not amplitude.x[0] < amplitude.x[-1]:
            raise InputError("breakpoints of the drive", "must ascend")
        pieces = amplitude.c.reshape(*amplitude.c.shape[:2], -1)[::-1].transpose(2, 1, 0)
        return cls(amplitude.x[:-1], pieces, pieces[:, 0, 0] if before is None else np.asarray(before))

    @classmethod
    def from_samples(cls, time: ArrayLike, amplitude: ArrayLike, before: ArrayLike | None = None) -> Self:
        """Drive through samples, by a cubic spline: error of order 4 in their spacing.

        Parameters
        ----------
        time : (T,) array
            Times of the samples [s], strictly ascending, two at least.
        amplitude : (M, T) array
            Q_i there, over L.
        before : (M,) array, optional
            See :meth:`from_piecewise`.
        """
        time, amplitude = np.asarray(time, dtype=float), np.asarray(amplitude, dtype=float)
        if amplitude.ndim != 2 or amplitude.shape[1:] != time.shape or time.size < 2:
            raise InputError("samples of the drive", "must be (M, T ≥ 2) at (T,) times", f"{amplitude.shape}")
        if not (np.isfinite(time).all() and np.isfinite(amplitude).all() and np.all(np.diff(time) > 0)):
            raise InputError("samples of the drive", "must be finite, at strictly ascending times")
        return cls.from_piecewise(CubicSpline(time, amplitude, axis=1), before)


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
    step, kick = _steps(drive, omega, zeta, jump)
    q, rate = excite(t, drive.time, step, kick, _force(drive), omega, zeta, orders=(0, 1))
    return q, rate


def amplitudes(t: ArrayLike, drive: Drive, omega: ArrayLike, zeta: ArrayLike, jump: JumpRule = "continuous") -> Array:
    """Vibration q of every mode, (M, T) over L, without its rate; see :func:`vibrate`."""
    step, kick = _steps(drive, omega, zeta, jump)
    return excite(t, drive.time, step, kick, _force(drive), omega, zeta)[0]


def _steps(drive: Drive, omega: ArrayLike, zeta: ArrayLike, jump: JumpRule) -> tuple[Array, Array]:
    """Steps (M, E) of q and q̇ at every event of the drive, by the rule."""
    if jump not in RECOIL:
        raise InputError("jump", f"must be one of {', '.join(RECOIL)}", repr(jump))
    omega, zeta = oscillators(omega, zeta, len(drive.before))
    step, kick = np.empty((2, *drive.coefficients.shape[:2]))
    _fall(drive.time, drive.coefficients, drive.before, step, kick)
    return step, kick - RECOIL[jump] * (zeta * omega)[:, None] * step


def _force(drive: Drive) -> Array:
    """Coefficients of −Q̈, (M, E, n − 2)."""
    k = np.arange(2, drive.coefficients.shape[2])
    return drive.coefficients[..., 2:] * (-k * (k - 1.0))


def _derivative(coefficients: Array) -> Array:
    """Coefficients of the derivative, along the last axis."""
    return coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])


@njit(cache=True, error_model="numpy")
def _fall(time, coefficients, before, step, kick):  # type: ignore[no-untyped-def]
    # −ΔQ and −ΔQ̇ at every event
    n = coefficients.shape[2]
    for i in range(before.size):
        value, rate = before[i], 0.0
        for e in range(time.size):
            slope = coefficients[i, e, 1] if n > 1 else 0.0
            step[i, e], kick[i, e] = value - coefficients[i, e, 0], rate - slope
            if e + 1 < time.size:
                value, rate = horner(coefficients[i, e], n, time[e + 1] - time[e])


@njit(cache=True, error_model="numpy")
def _follow_anywhere(t, first, time, coefficients, before, out):  # type: ignore[no-untyped-def]
    for i in range(before.size):
        row = out[i * t.size : (i + 1) * t.size]
        row[: first[0] if time.size else t.size] = before[i]
        for e in range(time.size):
            stop = first[e + 1] if e + 1 < time.size else t.size
            for j in range(first[e], stop):
                row[j] = horner(coefficients[i, e], coefficients.shape[2], t[j] - time[e])[0]


@njit(cache=True, error_model="numpy")
def _follow_even(t, first, time, coefficients, before, out):  # type: ignore[no-untyped-def]
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
