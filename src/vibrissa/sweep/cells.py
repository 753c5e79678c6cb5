"""The cells of a map in compiled loops: quasi-static polynomials of one posture, and the vibration that they drive."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.dynamics import _fall
from vibrissa.mechanics.excitation import TABLE, excite_even
from vibrissa.mechanics.march import excursion_at_jump, hold, place, unit_displacement
from vibrissa.mechanics.oscillator import _first_even

Array = NDArray[np.float64]

OK, FOLD, TIP, JUMP, LINEARITY, REACH = range(6)  # why a cell has no value; 0: it has one
_LONGEST = 0.05  # step in ln x of a profile: 1e-9 of the displacements
_SIDE = 8  # nodes of an exact response on each side of d = 0: polynomials through 0 of that degree
_WIDTHS = 12  # Chebyshev nodes of d₂/λ² between the narrowest and the widest gap
_FINE = 12  # samples in a period of the highest mode of a peak
_DENSE = 150  # samples in a period of mode 1 of an rms: its displacement has jumps in slope


class Shaft(NamedTuple):
    """What the cells of one contact share.

    Attributes
    ----------
    s : (P,) array
        Points from ε to 1.
    project : (R, P) array
        Turns displacements of the points into the modes' amplitudes, ∫ s² u V_i ds, and the displacement looked at.
    shape : (R,) array
        V_i where the displacement is looked at; 0 last.
    kappa : (R,) array
        κ_i; the last, of no mode, is a place-holder.
    """

    s: Array
    project: Array
    shape: Array
    kappa: Array


@lru_cache(maxsize=16)  # rows that differ in friction follow one another
def shaft(contact: float, n_modes: int, node: float) -> Shaft:
    """Points, quadrature and modes of one contact; the displacement is looked at in ``node``, between ε and 1."""
    log_s, weight = _clenshaw_curtis(40 + 2 * n_modes)
    s, weight = contact ** (1 - log_s), -np.log(contact) * weight
    s[0], s[-1] = contact, 1.0
    kappa = cone_kappa(contact, n_modes)
    shape = cone_modes(kappa, contact, np.append(s, node))
    project = np.zeros((n_modes + 1, len(s) + 1))
    project[:-1, :-1] = shape[:, :-1] * weight * s**3  # s² ds, ds = s d ln s
    project[-1, -1] = 1.0
    order = np.argsort(np.append(s, node), kind="stable")
    return Shaft(
        np.append(s, node)[order],
        np.ascontiguousarray(project[:, order]),
        np.append(shape[:, -1], 0.0),
        np.append(kappa, 1.0),
    )


def _clenshaw_curtis(count: int) -> tuple[Array, Array]:
    """Nodes and weights on [0, 1], the ends included."""
    z = -np.cos(np.pi * np.arange(count + 1) / count)
    even = np.arange(0, count + 1, 2)
    moments = np.zeros(count + 1)
    moments[even] = 1 / (1.0 - even**2)
    return (z + 1) / 2, np.asarray(np.linalg.solve(chebyshev.chebvander(z, count).T, moments), float)


def side_nodes(count: int = _SIDE) -> tuple[Array, Array]:
    """Nodes z in (0, 1], and the matrix that turns values there into Σ_k a_k z^k, k = 1 … count."""
    z = (1 - np.cos(np.pi * np.arange(1, count + 1) / count)) / 2
    return z, np.asarray(np.linalg.inv(z[:, None] ** np.arange(1, count + 1)), float)


def width_nodes() -> tuple[Array, Array]:
    """Chebyshev nodes on [−1, 1], and the matrix from values there to coefficients."""
    z = chebyshev.chebpts1(_WIDTHS)
    return z, np.asarray(np.linalg.inv(chebyshev.chebvander(z, _WIDTHS - 1)), float)


@njit(cache=True, nogil=True, error_model="numpy")
def jumps(posture, widths, z, fit, out):  # type: ignore[no-untyped-def]
    """d₂ of every gap (J,), over L; whether all are crossed before the fold. One width is solved, many interpolated."""
    contact, load, angle, distance, height, phi = posture
    low, high = widths.min(), widths.max()
    if low == high:
        out[:] = excursion_at_jump(contact, load, angle, distance, height, phi, low, _LONGEST)
        return bool(np.isfinite(out[0]))
    ratio, coefficients = np.empty(z.size), np.zeros(z.size)
    for k in range(z.size):
        width = (low + high) / 2 + (high - low) / 2 * z[k]
        ratio[k] = excursion_at_jump(contact, load, angle, distance, height, phi, width, _LONGEST) / width**2
    for k in range(z.size):
        for m in range(z.size):
            coefficients[k] += fit[k, m] * ratio[m]
    for j in range(widths.size):
        at, one, two = (2 * widths[j] - low - high) / (high - low), 0.0, 0.0
        for k in range(z.size - 1, 0, -1):  # Clenshaw
            one, two = coefficients[k] + 2 * at * one - two, one
        out[j] = widths[j] ** 2 * (coefficients[0] + at * one - two)
    return bool(np.isfinite(coefficients[0]))


@njit(cache=True, nogil=True, error_model="numpy")
def linear(posture, s, project, out):  # type: ignore[no-untyped-def]
    """Rows c_i and Ū, into out (R,); whether the posture stands before the fold."""
    contact, load, _, _, _, phi = posture
    unit = np.empty(s.size)
    if not unit_displacement(contact, load, phi, s, _LONGEST, unit) < 0:
        return False
    out[:] = 0.0
    for r in range(project.shape[0]):
        for j in range(s.size):
            out[r] += project[r, j] * unit[j]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def exact(posture, end, s, project, z, fit, out):  # type: ignore[no-untyped-def]
    """Rows Q(d) = Σ_k out[r, k − 1] d^k between 0 and ``end``, out (R, K); whether the whisker can follow so far."""
    contact, load, angle, distance, height, phi = posture
    unknown = np.array([contact, 0.0, load])
    x0, y0, tilt0, x, y, tilt = np.empty((6, s.size))
    place(unknown, phi, s, _LONGEST, x0, y0, tilt0)
    values, before = np.zeros((z.size, project.shape[0])), 0.0
    for k in range(z.size):
        if not hold(unknown, angle, distance + end * before, height, phi, end * (z[k] - before), _LONGEST):
            return False
        before = z[k]
        place(unknown, phi, s, _LONGEST, x, y, tilt)
        for j in range(s.size):
            u = np.cos(tilt0[j]) * (y[j] - y0[j]) - np.sin(tilt0[j]) * (x[j] - x0[j])
            for r in range(project.shape[0]):
                values[k, r] += project[r, j] * u
    out[:] = 0.0
    for r in range(project.shape[0]):
        for k in range(z.size):
            for m in range(z.size):
                out[r, k] += fit[k, m] * values[m, r] / end ** (k + 1)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def follow(rise, fall, start, widths, crossed, speed):  # type: ignore[no-untyped-def]
    """Events (3J,) [s] and the polynomials (R, 3J, K + 1) in time from each to the next; lengths over L.

    d grows from 0 at ``start`` (J,), drops by the width at d₂ = ``crossed`` (J,), and grows back to 0.
    """
    rows, degree = rise.shape
    time, out = np.empty(3 * widths.size), np.zeros((rows, 3 * widths.size, degree + 1))
    for j in range(widths.size):
        time[3 * j] = start[j] / speed
        time[3 * j + 1] = (start[j] + crossed[j]) / speed
        time[3 * j + 2] = (start[j] + widths[j]) / speed
        d = crossed[j] - widths[j]
        for r in range(rows):
            for k in range(1, degree + 1):
                out[r, 3 * j, k] = rise[r, k - 1] * speed**k
            for m in range(1, degree + 1):
                term = fall[r, m - 1] * d**m
                for k in range(m + 1):  # C(m, k) d^(m − k) v^k
                    out[r, 3 * j + 1, k] += term
                    term *= (m - k) / (k + 1) / d * speed
    return time, out


@njit(cache=True, nogil=True, error_model="numpy")
def vibration(t, time, coefficients, omega, damping, recoil):  # type: ignore[no-untyped-def]
    """Amplitudes q (R, T) at even times from the first event, by :mod:`vibrissa.mechanics.oscillator`."""
    rows, events, terms = coefficients.shape
    step, kick, force = np.empty((rows, events)), np.empty((rows, events)), np.empty((rows, events, max(terms - 2, 0)))
    _fall(time, coefficients, np.zeros(rows), step, kick)
    for r in range(rows):
        kick[r] -= recoil * damping * omega[r] * step[r]
        for k in range(2, terms):
            force[r, :, k - 2] = -k * (k - 1.0) * coefficients[r, :, k]
    out = np.empty(rows * t.size + TABLE)
    zeta = np.full(rows, damping)
    excite_even(t, _first_even(t, time), time, step, kick, force, omega, zeta, False, out)
    return out[: rows * t.size].reshape(rows, t.size)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_quasi_static(t, time, coefficients, out):  # type: ignore[no-untyped-def]
    first = _first_even(t, time)
    for e in range(time.size):
        stop = first[e + 1] if e + 1 < time.size else t.size
        for i in range(first[e], stop):
            value = 0.0
            for k in range(coefficients.shape[1] - 1, -1, -1):
                value = value * (t[i] - time[e]) + coefficients[e, k]
            out[i] += value


@njit(cache=True, nogil=True, error_model="numpy")
def peak(time, coefficients, omega, shape, damping, recoil):  # type: ignore[no-untyped-def]
    """Largest |displacement| of the last row with the modes' vibration, over L, until a period after the last event."""
    modes = shape.size - 1
    end = time[-1] + 2 * np.pi / omega[0]
    t = np.linspace(time[0], end, 2 + int((end - time[0]) * omega[modes - 1] * _FINE / (2 * np.pi)))
    q = vibration(t, time, coefficients[:modes], omega[:modes], damping, recoil)
    total = np.zeros(t.size)
    for i in range(modes):
        for j in range(t.size):
            total[j] += shape[i] * q[i, j]
    _add_quasi_static(t, time, coefficients[modes], total)
    return np.abs(total).max()


@njit(cache=True, nogil=True, error_model="numpy")
def rms(time, coefficients, omega, damping, recoil):  # type: ignore[no-untyped-def]
    """Standard deviation of mode 1, q₁ + Q₁, over L, from the first event to the last."""
    span = time[-1] - time[0]
    count = 2 + int(span * omega[0] * _DENSE / (2 * np.pi))
    t = time[0] + span * (np.arange(count) + 0.5) / count
    q = vibration(t, time, coefficients[:1], omega[:1], damping, recoil)[0]
    _add_quasi_static(t, time, coefficients[0], q)
    return q.std()


@njit(cache=True, nogil=True, error_model="numpy")
def row(postures, determined, s, project, shape, omega, gaps, speeds, rule, tables, values, ratio, reason):  # type: ignore[no-untyped-def]
    """One contact, all base angles (B) and speeds (V): ``values`` (V, B), ``ratio`` and ``reason`` (B,).

    ``postures`` (B, 6) as :func:`jumps` takes them, ``determined`` (B,) whether each is an equilibrium; ``gaps`` starts
    and widths over L; ``speeds`` over L [1/s]; ``rule`` (peak, exact, linearity asked for, damping, recoil).
    """
    start, widths = gaps
    wants_peak, is_exact, least, damping, recoil = rule
    z, fit, width_z, width_fit = tables
    crossed, slope = np.empty(widths.size), np.empty((project.shape[0], 1))
    rise, fall = np.empty((project.shape[0], z.size)), np.empty((project.shape[0], z.size))
    for b in range(len(postures)):
        if not determined[b]:
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
