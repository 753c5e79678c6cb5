"""Whether the base side of a held profile clears the ground, and where the contact goes when it does not.

Lengths are over L. A state is (p, gliding): stuck at (X, z) with excursion p, or on a facet at X = p with the contact
angle along it. ``tables`` = (ahead (K, J, n), touch (K, J), box (5,), reach) of the profiles; ``ground`` = (x, h,
slope, peak, chord, offset): points, facets, blocks of 8ⁿ facets.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_ROUNDS = 80
_CLOSE = 1e-15  # [L]
_TOUCH = 1e-16  # [L] what rounding may take for a touch


@njit(cache=True, error_model="numpy")
def _row(x, out):  # type: ignore[no-untyped-def]
    # Chebyshev polynomials at x
    out[0] = 1.0
    if out.size > 1:
        out[1] = x
    for k in range(2, out.size):
        out[k] = 2 * x * out[k - 1] - out[k - 2]


@njit(cache=True, error_model="numpy")
def touch_row(z, tables):  # type: ignore[no-untyped-def]
    """The slope tan θ_ε at one height, as a Chebyshev series in δ."""
    _, touch, box, _ = tables
    basis = np.empty(touch.shape[0])
    _row((2 * z - box[1] - box[3]) / (box[3] - box[1]), basis)
    out = np.zeros(touch.shape[1])
    for k in range(basis.size):
        out += basis[k] * touch[k]
    return out


@njit(cache=True, error_model="numpy")
def series(c, x):  # type: ignore[no-untyped-def]
    """Value and derivative by x of a Chebyshev series."""
    b1, b2, d1, d2 = 0.0, 0.0, 0.0, 0.0
    for k in range(c.size - 1, 0, -1):
        b0 = c[k] + 2 * x * b1 - b2
        d0 = 2 * b1 + 2 * x * d1 - d2
        b2, b1, d2, d1 = b1, b0, d1, d0
    return c[0] + x * b1 - b2, b1 + x * d1 - d2


@njit(cache=True, error_model="numpy")
def lowest(c, slope, x):  # type: ignore[no-untyped-def]
    """Where in [x, 1] a falling series has come down to a slope: 1 if nowhere, x if at once."""
    low, high = x, 1.0
    value, rate = series(c, x)
    if value <= slope:
        return x
    if series(c, 1.0)[0] > slope:
        return 1.0
    for _ in range(_ROUNDS):
        x = x - (value - slope) / rate
        if not low <= x <= high:
            x = (low + high) / 2
        value, rate = series(c, x)
        if value > slope:
            low = x
        else:
            high = x
        if abs(value - slope) <= 4e-16 or high - low <= 4e-16:
            break
    return x


@njit(cache=True, error_model="numpy")
def along(z, slope, tables):  # type: ignore[no-untyped-def]
    """Excursion at which the contact angle lies along a slope, at height z; ∓∞ below and above the box."""
    box = tables[2]
    c = touch_row(z, tables)
    x = lowest(c, slope, -1.0)
    if x == -1.0 or x == 1.0:
        return x * np.inf
    return (box[0] + box[2]) / 2 + (box[2] - box[0]) / 2 * x + box[4] * z


@njit(cache=True, error_model="numpy")
def curve_at(d, z, tables):  # type: ignore[no-untyped-def]
    """Rise y/u of one profile, as a Chebyshev series in u."""
    ahead, _, box, _ = tables
    in_z, in_d = np.empty(ahead.shape[0]), np.empty(ahead.shape[1])
    _row((2 * z - box[1] - box[3]) / (box[3] - box[1]), in_z)
    _row((2 * (d - box[4] * z) - box[0] - box[2]) / (box[2] - box[0]), in_d)
    out = np.zeros(ahead.shape[2])
    for k in range(in_z.size):
        for j in range(in_d.size):
            weight = in_z[k] * in_d[j]
            for i in range(out.size):
                out[i] += weight * ahead[k, j, i]
    return out


@njit(cache=True, error_model="numpy")
def _height(c, u, reach):  # type: ignore[no-untyped-def]
    # y and dy/du
    value, rate = series(c, 2 * u / reach - 1)
    return u * value, value + u * rate * 2 / reach


@njit(cache=True, error_model="numpy")
def least(c, j, place, z, tables, ground):  # type: ignore[no-untyped-def]
    """Least height of the profile above facet j, and where."""
    reach, (x, h) = tables[3], ground[:2]
    low, high = x[j] - place, x[j + 1] - place
    first, slope = _height(c, low, reach)
    if high == low:
        return first + z - max(h[j], h[j + 1]), low
    m = ground[2][j]
    high_in = min(high, reach)
    last, last_slope = _height(c, high_in, reach)
    if slope >= m:
        return first + z - h[j], low
    if last_slope <= m:
        return last + z - (h[j + 1] - m * (high - high_in)), high_in
    u, start = high_in - (high_in - low) * (last_slope - m) / (last_slope - slope), low
    for _ in range(_ROUNDS):
        value, rate = _height(c, u, reach)
        if rate < m:
            low, slope = u, rate
        else:
            high_in, last_slope = u, rate
        if abs(rate - m) < 1e-13 or high_in - low < _CLOSE:
            break
        u = high_in - (high_in - low) * (last_slope - m) / (last_slope - slope)
        if min(u - low, high_in - u) < 0.05 * (high_in - low):
            u = (low + high_in) / 2
    return value + z - (h[j] + m * (u - start)), u


@njit(cache=True, error_model="numpy")
def suspect(j, c, place, z, tables, ground):  # type: ignore[no-untyped-def]
    """First facet from j on that the bounds of its block do not clear; the last if all do, −1 beyond the table."""
    reach, (x, h, _, peak, chord, offset) = tables[3], ground
    last, top = x.size - 1, peak[-1]
    while j < last:
        u = x[j] - place
        if u >= reach:
            return -1
        value, rate = _height(c, u, reach)
        if rate > 0 and value >= top - z:
            return last
        level = 0
        while level + 2 < offset.size and (j >> 3 * level) & 7 == 0:
            level += 1
        while level >= 0:
            stop = min(((j >> 3 * level) + 1) << 3 * level, last)
            block, width = offset[level] + (j >> 3 * level), x[stop] - x[j]
            if u + width <= reach and (
                value + z - h[j] >= (chord[block] - rate) * width  # the profile is convex: above its tangent
                or value + min(rate, 0.0) * width >= peak[block] - z
            ):
                break
            level -= 1
        if level < 0:
            return j
        j = stop
    return last


@njit(cache=True, error_model="numpy")
def state(p, gliding, place, z, slope, tables):  # type: ignore[no-untyped-def]
    """Place X, height z and excursion d of a state."""
    if not gliding:
        return place, z, p
    height = z + slope * (p - place)
    return p, height, along(height, slope, tables)


@njit(cache=True, error_model="numpy")
def travel(gliding, start, stop, i, place, z, slope, tables, ground):  # type: ignore[no-untyped-def]
    """Where the base side touches first on the way from p = start to stop: p, the facet, the distance from X.

    The facet is 0 for none, −1 beyond the tables.
    """
    p, touched, far = stop, 0, 0.0
    x, height, d = state(p, gliding, place, z, slope, tables)
    if not np.isfinite(d):
        return p, -1, 0.0
    c = curve_at(d, height, tables)
    j = suspect(i + 1, c, x, height, tables, ground)
    while 0 <= j < ground[0].size - 1:
        gap, u = least(c, j, x, height, tables, ground)
        if gap < -_TOUCH:
            low, high, above, below = max(start, ground[0][j] - 0.999 * tables[3]) if gliding else start, p, 0.0, gap
            x, height, d = state(low, gliding, place, z, slope, tables)
            c = curve_at(d, height, tables)
            above, u = least(c, j, x, height, tables, ground)
            touched, far = j, u
            if above <= 0:
                return low, touched, far
            side = 0
            for _ in range(_ROUNDS):
                p = (low * below - high * above) / (below - above)
                x, height, d = state(p, gliding, place, z, slope, tables)
                c = curve_at(d, height, tables)
                gap, far = least(c, j, x, height, tables, ground)
                if gap > 0:
                    low, above = p, gap
                    if side == 1:
                        below /= 2
                    side = 1
                else:
                    high, below = p, gap
                    if side == -1:
                        above /= 2
                    side = -1
                if abs(gap) <= 2e-17 or high - low <= _CLOSE:
                    break
        j = suspect(j + 1, c, x, height, tables, ground)
    return (p, -1, 0.0) if j < 0 else (p, touched, far)
