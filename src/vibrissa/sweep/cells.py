"""The cells of a map in compiled loops: the vibration that the quasi-static response of each posture drives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.vibration.dynamics import excitation, follow_even
from vibrissa.mechanics.vibration.excitation import TABLE, Driven, excite_even
from vibrissa.mechanics.vibration.oscillator import first_even
from vibrissa.sweep.posture_cells import exact, follow, jumps, linear

OK, FOLD, TIP, JUMP, LINEARITY, REACH, RESTLESS = range(7)  # why a cell has no value; 0: it has one
_FINE = 12  # samples in a period of the highest mode of a peak
_DENSE = 150  # samples in a period of mode 1 of an rms: its displacement has jumps in slope
_FEWEST = 200  # of an rms: a single gap may be passed in a small part of a period


@njit(cache=True, nogil=True, error_model="numpy")
def vibration(t: Array, time: Array, coefficients: Array, omega: Array, damping: float, recoil: float) -> Array:
    """Vibration q of the modes (M, T) at even times from the first event.

    Parameters
    ----------
    t : (T,) array
        Times [s].
    time, coefficients : (E,) and (R, E, n) arrays
        Events [s] and polynomials.
    omega : (M,) array
        [rad/s].
    damping, recoil : float
        ζ, and the jump rule.

    Returns
    -------
    (M, T) array
        q over L.
    """
    modes = omega.size
    parts = excitation(time, coefficients, np.zeros(modes), recoil * damping * omega)
    out = np.empty(modes * t.size + TABLE)
    driven = Driven(time, parts[0], parts[1], parts[2], omega, np.full(modes, damping))
    excite_even(t, first_even(t, time), driven, False, out)
    return out[: modes * t.size].reshape(modes, t.size)


@njit(cache=True, nogil=True, error_model="numpy")
def steady(t: Array, time: Array, coefficients: Array) -> Array:
    """The quasi-static part (T,) of one row (1, E, n) at even times.

    Parameters
    ----------
    t : (T,) array
        Times [s].
    time, coefficients : (E,) and (R, E, n) arrays
        Events [s] and polynomials.

    Returns
    -------
    (T,) array
        Over L.
    """
    out = np.empty(t.size + TABLE)
    follow_even(t, first_even(t, time), time, coefficients, np.zeros(1), out)
    return out[: t.size]


@njit(cache=True, nogil=True, error_model="numpy")
def peak(time: Array, coefficients: Array, omega: Array, shape: Array, damping: float, recoil: float) -> float:
    """Largest |displacement| of the last row with the modes' vibration, over L, until a period after the last event.

    Parameters
    ----------
    time, coefficients : (E,) and (R, E, n) arrays
        Events [s] and polynomials.
    omega, shape : (M + 1,) arrays
        [rad/s], and V_i where it is looked at.
    damping, recoil : float
        ζ, and the jump rule.

    Returns
    -------
    float
        Over L.
    """
    modes = shape.size - 1
    end = time[-1] + 2 * np.pi / omega[0]
    t = np.linspace(time[0], end, 2 + int((end - time[0]) * omega[modes - 1] * _FINE / (2 * np.pi)))
    q, total = (
        vibration(t, time, coefficients[:modes], omega[:modes], damping, recoil),
        steady(t, time, coefficients[modes:]),
    )
    for i in range(modes):
        for j in range(t.size):
            total[j] += shape[i] * q[i, j]
    return np.abs(total).max()


@njit(cache=True, nogil=True, error_model="numpy")
def rms(time: Array, coefficients: Array, omega: Array, damping: float, recoil: float) -> float:
    """Standard deviation of mode 1, q₁ + Q₁, over L, from the first event to the last.

    Parameters
    ----------
    time, coefficients : (E,) and (R, E, n) arrays
        Events [s] and polynomials.
    omega : array
        [rad/s].
    damping, recoil : float
        ζ, and the jump rule.

    Returns
    -------
    float
        Over L.
    """
    span = time[-1] - time[0]
    count = max(_FEWEST, 2 + int(span * omega[0] * _DENSE / (2 * np.pi)))
    t = time[0] + span * (np.arange(count) + 0.5) / count
    q = vibration(t, time, coefficients[:1], omega[:1], damping, recoil)[0]
    return (q + steady(t, time, coefficients[:1])).std()


@njit(cache=True, nogil=True, error_model="numpy")
def row(
    postures: Array,
    s: Array,
    project: Array,
    shape: Array,
    omega: Array,
    gaps: Array,
    speeds: Array,
    rule: tuple[bool, bool, float, float, float],
    tables: tuple[Array, Array, Array, Array],
    values: Array,
    ratio: Array,
    reason: NDArray[np.int8],
) -> None:
    """All base angles (B) and speeds (V) of one contact.

    Parameters
    ----------
    postures : (B, 6) array
        ε, Λ̂, θ_b, D, H and μ; Λ̂ is NaN where there is no equilibrium.
    s, project, shape : arrays
        As of :class:`vibrissa.sweep.posture_cells.SharedShaft`.
    omega : (M + 1,) array
        [rad/s].
    gaps : (2, J) array
        Starts and widths over L.
    speeds : (V,) array
        Over L [1/s].
    rule : tuple
        Whether the peak is asked for, and the exact response; least linearity; ζ and the jump rule.
    tables : tuple of arrays
        Of :func:`vibrissa.sweep.posture_cells.side_nodes` and :func:`vibrissa.sweep.posture_cells.width_nodes`.
    values, ratio, reason : (V, B), (B,) and (B,) arrays
        Written: the quantity, the linearity, and why a cell has no value.
    """
    start, widths = gaps
    wants_peak, is_exact, least, damping, recoil = rule
    z, fit, width_z, width_fit = tables
    crossed, slope = np.empty(widths.size), np.empty((project.shape[0], 1))
    rise, fall = np.empty((project.shape[0], z.size)), np.empty((project.shape[0], z.size))
    for b in range(len(postures)):
        if np.isnan(postures[b, 1]):
            reason[b] = REACH
            continue
        posture = postures[b]
        if not linear(posture, s, project, slope[:, 0]):
            reason[b] = FOLD
            continue
        if not jumps(posture, widths, width_z, width_fit, crossed):
            reason[b] = JUMP
            continue
        if is_exact or least >= 0:
            high, low = crossed.max(), (crossed - widths).min()
            if not (exact(posture, high, s, project, z, fit, rise) and exact(posture, low, s, project, z, fit, fall)):
                reason[b] = JUMP
                continue
            jump = 0.0
            for k in range(z.size):
                jump += rise[0, k] * high ** (k + 1) - fall[0, k] * low ** (k + 1)
            ratio[b] = jump / (slope[0, 0] * (high - low))
        if ratio[b] < least:
            reason[b] = LINEARITY
            continue
        for v in range(speeds.size):
            parts = (rise, fall) if is_exact else (slope, slope)
            time, coefficients = follow(parts[0], parts[1], start, widths, crossed, speeds[v])
            if wants_peak:
                values[v, b] = peak(time, coefficients, omega, shape, damping, recoil)
            else:
                values[v, b] = rms(time, coefficients, omega, damping, recoil)
