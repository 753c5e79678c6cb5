"""The Euler spiral nearest to points: a curve whose curvature is linear in its arc length."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array

_FINE = 400  # points of the curve's table
_FEET = 4  # corrections of the nearest points in each evaluation


def fit_euler_spiral(points: Array) -> tuple[float, float, float]:
    """Least squares of the distances of points from the curve.

    Unknown are its direction and its distance at the first point, and its curvature there and at the end.

    Parameters
    ----------
    points : (N, 2) array
        In order from the beginning to the end.

    Returns
    -------
    length, first, last : float
        Arc length from the first point's foot to the last one's; curvature at both, positive to the left.
    """
    from scipy.optimize import least_squares

    chords = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    scale = float(chords[-1])
    scaled, along = (points - points[0]) / scale, chords / scale
    direction = np.arctan2(*(scaled[max(1, len(scaled) // 4)])[::-1])
    start = np.array([0.0, direction, 0.0, 0.0])
    found = least_squares(lambda curve: _away(curve, scaled, along)[0], start, xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    feet = _away(found, scaled, along)[1]
    first, last = (found[2] + found[3] * feet[end] for end in (0, -1))
    return float(feet[-1] - feet[0]) * scale, float(first) / scale, float(last) / scale


def _away(curve: Array, points: Array, along: Array) -> tuple[Array, Array]:
    """Signed distances of the points from the curve, and the arc lengths of their feet."""
    aside, direction, curvature, rate = curve
    x, y = -aside * np.sin(direction), aside * np.cos(direction)
    t = np.linspace(-0.1, 1.1, _FINE)
    turn = direction + curvature * t + rate * t**2 / 2
    zero, h = np.searchsorted(t, 0.0), t[1] - t[0]
    path = []
    for slope, start, second in ((np.cos(turn), x, -np.sin(turn)), (np.sin(turn), y, np.cos(turn))):
        bend = second * (curvature + rate * t)
        steps = h * (slope[1:] + slope[:-1]) / 2 - h**2 / 12 * np.diff(bend)  # Hermite's rule: h⁴
        whole = np.concatenate([[0.0], np.cumsum(steps)])
        part = t[zero] * slope[zero] - t[zero] ** 2 / 2 * bend[zero]
        path.append(start + whole - whole[zero] + part)
    feet = along
    for _ in range(_FEET):
        off = points - np.stack([np.interp(feet, t, one) for one in path], axis=1)
        turned = direction + curvature * feet + rate * feet**2 / 2
        feet = np.clip(feet + off[:, 0] * np.cos(turned) + off[:, 1] * np.sin(turned), t[0], t[-1])
    off = points - np.stack([np.interp(feet, t, one) for one in path], axis=1)
    turned = direction + curvature * feet + rate * feet**2 / 2
    return off[:, 1] * np.cos(turned) - off[:, 0] * np.sin(turned), feet
