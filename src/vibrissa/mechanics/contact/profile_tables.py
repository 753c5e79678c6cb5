"""Profiles read from their tables, in compiled loops: contact angle, rise ahead, state of the contact."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.mechanics.statics.chebyshev import clenshaw_slope, polynomials

_ROUNDS = 80
Tables = tuple[Array, Array, Array, float]


@njit(cache=True, error_model="numpy")
def touch_row(z: float, tables: Tables) -> Array:
    """The slope tan θ_ε at one height, as a Chebyshev series in δ.

    Parameters
    ----------
    z : float
        Height over L.
    tables : tuple
        The profiles, see the module.

    Returns
    -------
    (J,) array
        Coefficients.
    """
    _, touch, box, _ = tables
    basis = np.empty(touch.shape[0])
    polynomials((2 * z - box[1] - box[3]) / (box[3] - box[1]), basis)
    out = np.zeros(touch.shape[1])
    for k in range(basis.size):
        out += basis[k] * touch[k]
    return out


@njit(cache=True, error_model="numpy")
def lowest(c: Array, slope: float, x: float) -> float:
    """Where in [x, 1] a falling series has come down to a slope: 1 if nowhere, x if at once.

    Parameters
    ----------
    c : (J,) array
        Coefficients.
    slope : float
        The slope.
    x : float
        Where to start, in [−1, 1].

    Returns
    -------
    float
        Place in [x, 1].
    """
    low, high = x, 1.0
    value, rate = clenshaw_slope(c, x)
    if value <= slope:
        return x
    if clenshaw_slope(c, 1.0)[0] > slope:
        return 1.0
    for _ in range(_ROUNDS):
        x = x - (value - slope) / rate
        if not low <= x <= high:
            x = (low + high) / 2
        value, rate = clenshaw_slope(c, x)
        if value > slope:
            low = x
        else:
            high = x
        if abs(value - slope) <= 4e-16 or high - low <= 4e-16:
            break
    return x


@njit(cache=True, error_model="numpy")
def along(z: float, slope: float, tables: Tables) -> float:
    """Excursion at which the contact angle lies along a slope, at height z; ∓∞ below and above the box.

    Parameters
    ----------
    z : float
        Height over L.
    slope : float
        Of the ground.
    tables : tuple
        The profiles, see the module.

    Returns
    -------
    float
        d over L.
    """
    box = tables[2]
    c = touch_row(z, tables)
    x = lowest(c, slope, -1.0)
    if x == -1.0 or x == 1.0:
        return x * np.inf
    return (box[0] + box[2]) / 2 + (box[2] - box[0]) / 2 * x + box[4] * z


@njit(cache=True, error_model="numpy")
def curve_at(d: float, z: float, tables: Tables) -> Array:
    """Rise y/u of one profile, as a Chebyshev series in u.

    Parameters
    ----------
    d, z : float
        Excursion and height over L.
    tables : tuple
        The profiles, see the module.

    Returns
    -------
    (n,) array
        Coefficients.
    """
    ahead, _, box, _ = tables
    in_z, in_d = np.empty(ahead.shape[0]), np.empty(ahead.shape[1])
    polynomials((2 * z - box[1] - box[3]) / (box[3] - box[1]), in_z)
    polynomials((2 * (d - box[4] * z) - box[0] - box[2]) / (box[2] - box[0]), in_d)
    out = np.zeros(ahead.shape[2])
    for k in range(in_z.size):
        for j in range(in_d.size):
            weight = in_z[k] * in_d[j]
            for i in range(out.size):
                out[i] += weight * ahead[k, j, i]
    return out


@njit(cache=True, error_model="numpy")
def state(p: float, gliding: bool, place: float, z: float, slope: float, tables: Tables) -> tuple[float, float, float]:
    """Place X, height z and excursion d of a state.

    Parameters
    ----------
    p : float
        Excursion if stuck, place if gliding, over L.
    gliding : bool
        Whether the contact glides.
    place, z : float
        Where it stuck or began to glide, over L.
    slope : float
        Of its facet.
    tables : tuple
        The profiles, see the module.

    Returns
    -------
    X, z, d : float
        Over L.
    """
    if not gliding:
        return place, z, p
    height = z + slope * (p - place)
    return p, height, along(height, slope, tables)
