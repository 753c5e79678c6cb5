"""Curves that carry the last visible part of a whisker on to where it lies tangent to a straight substrate.

In the frame of the substrate: u along it, growing from the contact to the base; v above it, on the whisker's side.
Each curve gives (arc length, u, v) of the point at which v'(u) = 0 [m], NaN where it has none ahead of the nodes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from vibrissa.arrays import Array

_NOWHERE = np.full(3, np.nan)
_GAUSS = np.polynomial.legendre.leggauss(16)
_MICRO = 1e6  # residuals are in µm, of the order of 1
_TRIED = np.linspace(0.2, 0.98, 27)  # contact over the last visible node, both from the cone's tip, to start from


def parabola(u: Array, v: Array, arc: Array, weight: Array) -> Array:
    """Vertex of the second-degree polynomial v(u), as in [Boubenec2014]_.

    Parameters
    ----------
    u, v : (N,) arrays
        Nodes [m].
    arc : (N,) array
        Their arc length, which grows towards the contact [m].
    weight : (N,) array
        One over their standard deviation.

    Returns
    -------
    (3,) array
        Arc length, u and v of the contact [m].
    """
    last, scale = u[-1], float(np.ptp(u))
    bend, slope, height = np.polyfit((u - last) / scale, v, 2, w=weight)
    if not (bend > 0 and slope > 0):
        return _NOWHERE
    vertex = -slope / (2 * bend)
    t = vertex * (1 + _GAUSS[0]) / 2
    hidden = -vertex / 2 * np.sum(_GAUSS[1] * np.hypot(1, (slope + 2 * bend * t) / scale))
    return np.array([arc[-1] + scale * hidden, last + scale * vertex, height - slope**2 / (4 * bend)])


def tapered(u: Array, v: Array, arc: Array, weight: Array, length: float) -> Array:
    """Contact of a cone bent by a force at it, across the substrate.

    The moment grows from 0 as s − ε and the stiffness as s⁴, so that θ' = k (s − ε)/s⁴ and
    θ = k [1/(6ε²) − 1/(2s²) + ε/(3s³)], which is Eq. (1) with cos(φ − θ) left out; k, ε and the height are fitted.

    Parameters
    ----------
    u, v, arc, weight
        As in :func:`parabola`.
    length : float
        Length L of the nontruncated cone [m]: s = 1 − arc/L.

    Returns
    -------
    (3,) array
        Arc length, u and v of the contact [m].
    """
    s = 1 - arc / length
    if not s[-1] > 0:
        return _NOWHERE

    square, scaled = weight**2, _MICRO * weight / weight.max()
    total = square.sum()

    def residual(p: Array) -> Array:
        piece, angle = _bent(s, *p)
        off = v - (piece * np.sin(angle)).sum(axis=1) * length
        return scaled * (off - (off * square).sum() / total)

    best = least_squares(residual, _start(s, u, v, residual), method="lm", xtol=1e-13, ftol=1e-13, gtol=1e-13).x
    contact = s[-1] / (1 + np.exp(best[0]))
    if not contact < s[-1] * (1 - 1e-6):
        return _NOWHERE
    piece, angle = _bent(s, *best)
    along, above = (piece * np.cos(angle)).sum(axis=1), (piece * np.sin(angle)).sum(axis=1)
    off = np.average(v - above * length, weights=square)
    return np.array([length * (1 - contact), np.mean(u - along * length), off])


def _start(s: Array, u: Array, v: Array, residual: Callable[[Array], Array]) -> Array:
    """The best of some places of the contact, each with the stiffness that gives the visible end its slope."""
    contact, middle = _TRIED * s[-1], (s[0] + s[-1]) / 2
    slope = np.arctan2(v[0] - v[-1], u[0] - u[-1])
    per_k = 1 / (6 * contact**2) - 1 / (2 * middle**2) + contact / (3 * middle**3)
    tried = np.stack([np.log(1 / _TRIED - 1), np.log(max(slope, 1e-6) / per_k)], axis=1)
    return np.asarray(min(tried, key=lambda p: float(np.sum(residual(p) ** 2))))


def _bent(s: Array, place: float, stiffness: float) -> tuple[Array, Array]:
    """Pieces of the shaft from the contact to each s, over L, and their angles to the substrate, both (S, points).

    Where ε = s_end/(1 + exp(place)) and k = exp(stiffness).
    """
    contact, k = s[-1] / (1 + np.exp(min(max(place, -30.0), 30.0))), np.exp(min(max(stiffness, -30.0), 5.0))
    half = (s - contact)[:, None] / 2
    t = contact + half * (1 + _GAUSS[0])
    angle = k * (1 / (6 * contact**2) - 1 / (2 * t**2) + contact / (3 * t**3))
    return half * _GAUSS[1], angle
