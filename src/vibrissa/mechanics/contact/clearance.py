"""Whether the base side of a held profile clears the ground, and where the contact goes when it does not.

Lengths are over L. A state is (p, gliding): stuck at (X, z) with excursion p, or on a facet at X = p with the contact
angle along it. ``tables`` = (ahead (K, J, n), touch (K, J), box (5,), reach) of the profiles; ``ground`` = (x, h,
slope, peak, chord, offset): points, facets, blocks of 8ⁿ facets.
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.loops import njit
from vibrissa.mechanics.contact.profile_tables import Tables, curve_at, state
from vibrissa.mechanics.statics.chebyshev import clenshaw_slope

Ground = tuple[Array, Array, Array, Array, Array, Integers]

_ROUNDS = 80
_CLOSE = 1e-15  # [L]
_TOUCH = 1e-16  # [L] what rounding may take for a touch


@njit(cache=True, error_model="numpy")
def _height(c: Array, u: float, reach: float) -> tuple[float, float]:
    # y and dy/du
    value, rate = clenshaw_slope(c, 2 * u / reach - 1)
    return u * value, value + u * rate * 2 / reach


@njit(cache=True, error_model="numpy")
def least(c: Array, j: int, place: float, z: float, tables: Tables, ground: Ground) -> tuple[float, float]:
    """Least height of the profile above facet j, and where.

    Parameters
    ----------
    c : (n,) array
        Profile, of ``curve_at``.
    j : int
        Facet.
    place, z : float
        Contact, over L.
    tables : tuple
        The profiles, see the module.
    ground : tuple
        The ground, see the module.

    Returns
    -------
    gap, u : float
        Height above the facet and distance from the contact, over L.
    """
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
def suspect(j: int, c: Array, place: float, z: float, tables: Tables, ground: Ground) -> int:
    """First facet from j on that the bounds of its block do not clear; the last if all do, −1 beyond the table.

    Parameters
    ----------
    j : int
        Facet to start from.
    c : (n,) array
        Profile, of ``curve_at``.
    place, z : float
        Contact, over L.
    tables : tuple
        The profiles, see the module.
    ground : tuple
        The ground, see the module.

    Returns
    -------
    int
        The facet.
    """
    reach, (x, h, _, peak, chord, offset) = tables[3], ground
    last, top = x.size - 1, peak[-1]
    while j < last:
        u = x[j] - place
        value, rate = _height(c, min(u, reach), reach)
        if rate > 0 and value >= top - z:  # a convex profile: from here on it clears all
            return last
        if u >= reach:
            return -1
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
def travel(
    gliding: bool,
    start: float,
    stop: float,
    i: int,
    place: float,
    z: float,
    slope: float,
    tables: Tables,
    ground: Ground,
) -> tuple[float, int, float]:
    """Where the base side touches first on the way from p = start to stop: p, the facet, the distance from X.

    The facet is 0 for none, −1 beyond the tables.

    Parameters
    ----------
    gliding : bool
        Whether the contact glides.
    start, stop : float
        Range of p, over L.
    i : int
        Facet of the contact.
    place, z : float
        Contact at the start, over L.
    slope : float
        Of its facet.
    tables : tuple
        The profiles, see the module.
    ground : tuple
        The ground, see the module.

    Returns
    -------
    p, facet, far : float, int, float
        Over L.
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
