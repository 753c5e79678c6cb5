"""Quasi-static response of one posture in compiled loops: jumps over gaps, polynomials in the excursion and in time."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.loops import njit
from vibrissa.mechanics.statics.chebyshev import Chebyshev, clenshaw_slope
from vibrissa.mechanics.statics.contact_law import ContactLaw
from vibrissa.mechanics.statics.continuation import carry
from vibrissa.mechanics.statics.jump_kernels import jump_ratios
from vibrissa.mechanics.statics.placing import place, unit_displacement
from vibrissa.mechanics.statics.shooting import Clamp, moved

_LONGEST = 0.05  # step in ln x of a profile: 1e-9 of the displacements
_SIDE = 8  # nodes of an exact response on each side of d = 0: polynomials through 0 of that degree
_WIDTHS = 12  # Chebyshev nodes of d₂/λ² between the narrowest and the widest gap


class SharedShaft(NamedTuple):
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
def shaft(contact: float, n_modes: int, node: float) -> SharedShaft:
    """Points, quadrature and modes of one contact; the displacement is looked at in ``node``, between ε and 1.

    Parameters
    ----------
    contact : float
        ε over L.
    n_modes : int
        Number of modes.
    node : float
        s of the point looked at.

    Returns
    -------
    SharedShaft
        What the cells share.
    """
    along = Chebyshev(41 + 2 * n_modes, np.log(contact), 0.0, ends=True)  # ln s
    s, weight = np.exp(along.nodes), along.integration[-1]
    s[0], s[-1] = contact, 1.0
    kappa = cone_kappa(contact, n_modes)
    shape = cone_modes(kappa, contact, np.append(s, node))
    project = np.zeros((n_modes + 1, len(s) + 1))
    project[:-1, :-1] = shape[:, :-1] * weight * s**3  # s² ds, ds = s d ln s
    project[-1, -1] = 1.0
    order = np.argsort(np.append(s, node), kind="stable")
    return SharedShaft(
        np.append(s, node)[order],
        np.ascontiguousarray(project[:, order]),
        np.append(shape[:, -1], 0.0),
        np.append(kappa, 1.0),
    )


def side_nodes(count: int = _SIDE) -> tuple[Array, Array]:
    """Nodes z in (0, 1], and the matrix that turns values there into Σ_k a_k z^k, k = 1 … count.

    Parameters
    ----------
    count : int
        K.

    Returns
    -------
    tuple of arrays
        z (K,) and the matrix (K, K).
    """
    z = Chebyshev(count + 1, 0.0, 1.0, ends=True).nodes[1:]
    return z, np.asarray(np.linalg.inv(z[:, None] ** np.arange(1, count + 1)), float)


def width_nodes() -> tuple[Array, Array]:
    """Chebyshev nodes on [−1, 1], and the matrix from values there to coefficients."""
    along = Chebyshev(_WIDTHS)
    return along.nodes, along.to_series


@njit(cache=True, nogil=True, error_model="numpy")
def _held(posture: Array) -> tuple[float, float, Clamp]:
    # ε, Λ̂ and the clamp of a row of postures
    contact, load, angle, distance, height, friction = posture
    return contact, load, Clamp(angle, distance, height, ContactLaw(friction, 0.0))


@njit(cache=True, nogil=True, error_model="numpy")
def jumps(posture: Array, widths: Array, z: Array, fit: Array, out: Array) -> bool:
    """d₂ of every gap (J,), over L; whether all are crossed before the fold. One width is solved, many interpolated.

    Parameters
    ----------
    posture : (6,) array
        ε, Λ̂, θ_b, D, H and μ.
    widths : (J,) array
        λ over L.
    z, fit : arrays
        Of :func:`width_nodes`.
    out : (J,) array
        Written.

    Returns
    -------
    bool
        Whether all are crossed.
    """
    contact, load, clamp = _held(posture)
    low, high = widths.min(), widths.max()
    nodes = (low + high) / 2 + (high - low) / 2 * z if high > low else widths[:1]
    ratio = np.empty(nodes.size)
    jump_ratios(contact, load, clamp, nodes, _LONGEST, ratio)
    coefficients = np.zeros(ratio.size)
    for k in range(ratio.size):
        for m in range(ratio.size):
            coefficients[k] += (fit[k, m] if high > low else 1.0) * ratio[m]
    for j in range(widths.size):
        z_j = (2 * widths[j] - low - high) / (high - low) if high > low else 0.0
        out[j] = widths[j] ** 2 * clenshaw_slope(coefficients, z_j)[0]
    return bool(np.isfinite(coefficients[0]))


@njit(cache=True, nogil=True, error_model="numpy")
def linear(posture: Array, s: Array, project: Array, out: Array) -> bool:
    """Rows c_i and Ū, into out (R,); whether the posture is before the fold.

    Parameters
    ----------
    posture : (6,) array
        ε, Λ̂, θ_b, D, H and μ.
    s, project : arrays
        As of :class:`SharedShaft`.
    out : (R,) array
        Written.

    Returns
    -------
    bool
        Whether it is before the fold.
    """
    contact, load, clamp = _held(posture)
    unit = np.empty(s.size)
    if not unit_displacement(contact, load, clamp.law, s, _LONGEST, unit) < 0:
        return False
    out[:] = 0.0
    for r in range(project.shape[0]):
        for j in range(s.size):
            out[r] += project[r, j] * unit[j]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def exact(posture: Array, end: float, s: Array, project: Array, z: Array, fit: Array, out: Array) -> bool:
    """Rows Q(d) = Σ_k out[r, k − 1] d^k between 0 and ``end``, out (R, K); whether the whisker can follow so far.

    Parameters
    ----------
    posture : (6,) array
        ε, Λ̂, θ_b, D, H and μ.
    end : float
        Excursion over L, of either sign.
    s, project : arrays
        As of :class:`SharedShaft`.
    z, fit : arrays
        Of :func:`side_nodes`.
    out : (R, K) array
        Written.

    Returns
    -------
    bool
        Whether the whisker can follow so far.
    """
    contact, load, clamp = _held(posture)
    unknown = np.array([contact, 0.0, load])
    states, (x0, y0, x, y) = np.empty((s.size, 8)), np.empty((4, s.size))
    place(unknown, clamp.law, s, _LONGEST, True, states, x0, y0)
    cos, sin = np.cos(states[:, 0]), np.sin(states[:, 0])  # of θ on the flat
    values, before = np.zeros((z.size, project.shape[0])), 0.0
    for k in range(z.size):
        if not carry(unknown, moved(clamp, end * before, 0.0), end * (z[k] - before), 0.0, _LONGEST):
            return False
        before = z[k]
        place(unknown, clamp.law, s, _LONGEST, True, states, x, y)
        for j in range(s.size):
            u = cos[j] * (y[j] - y0[j]) - sin[j] * (x[j] - x0[j])
            for r in range(project.shape[0]):
                values[k, r] += project[r, j] * u
    out[:] = 0.0
    for r in range(project.shape[0]):
        for k in range(z.size):
            for m in range(z.size):
                out[r, k] += fit[k, m] * values[m, r] / end ** (k + 1)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def follow(rise: Array, fall: Array, start: Array, widths: Array, crossed: Array, speed: float) -> tuple[Array, Array]:
    """Events (3J,) [s] and the polynomials (R, 3J, K + 1) in time from each to the next; lengths over L.

    d grows from 0 at ``start`` (J,), drops by the width at d₂ = ``crossed`` (J,), and grows back to 0.

    Parameters
    ----------
    rise, fall : (R, K) arrays
        Polynomials of both sides of d = 0.
    start, widths, crossed : (J,) arrays
        Of the gaps, and d₂, over L.
    speed : float
        Over L [1/s].

    Returns
    -------
    tuple of arrays
        Times and coefficients.
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
