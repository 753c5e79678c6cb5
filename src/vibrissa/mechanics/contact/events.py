"""The contact's way over the facets, event by event; lengths over L, arguments as in ``clearance``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers
from vibrissa.loops import njit
from vibrissa.mechanics.contact.clearance import Ground, travel
from vibrissa.mechanics.contact.profile_tables import Tables, along, state, touch_row
from vibrissa.mechanics.statics.chebyshev import clenshaw_slope

_LEVEL = 1e-13  # slope between contact angle and facet below which the contact glides
_VIOLATED = 1e-9  # and above which the facet rises through the shaft
_CLOSE = 2e-15  # [L] rounding of the travel

BELOW, ABOVE, SHORT = 1, 2, 3  # the contact left the box, or the tables' reach


@njit(cache=True, error_model="numpy")
def trace(tables: Tables, ground: Ground) -> tuple[Array, Integers, int, float]:
    """Rows (travel, X, z, slope) and (kind, jumped) of the episodes, then status and where it ended.

    Parameters
    ----------
    tables : tuple
        The profiles, see :mod:`vibrissa.mechanics.contact.clearance`.
    ground : tuple
        The ground, see the same.

    Returns
    -------
    record, kind : (4, E) and (2, E) arrays
        Rows of the episodes, over L.
    status : int
        0, or where the tables end.
    place : float
        X at the end.
    """
    size = 1024
    record, kind = np.empty((4, size)), np.empty((2, size), np.int64)
    x, h, slopes = ground[:3]
    i, n, place, z, jumped = 0, 0, x[0], h[0], 0
    d, last = along(z, 0.0, tables), x.size - 2
    status = _left(d)
    while status == 0:
        m, tau = slopes[i], place + d
        gliding = _angle(d, z, tables) <= m + _LEVEL
        if gliding and (m == np.inf or _angle(d, z, tables) < m - _VIOLATED):
            i, place, z = _slip(i, place, tau, tables, ground)
            d, jumped = tau - place, 1
            continue
        if n == size:
            record, kind, size = _longer(record), _longer(kind), 2 * size
        record[0, n], record[1, n], record[2, n], record[3, n] = tau, place, z, m if gliding else 0.0
        kind[0, n], kind[1, n] = gliding, jumped
        jumped = 0
        n += 1
        if gliding and i == last:
            break
        stop, free = _limit(gliding, i, z, tables, ground)
        p, j, u = travel(gliding, place if gliding else d, stop, i, place, z, m, tables, ground)
        if j < 0:
            status = _short(gliding, p, place, z, m, tables)
        elif j == 0 and not free:
            status = ABOVE
        elif j == 0 and gliding:
            i, place, z, d = i + 1, x[i + 1], h[i + 1], along(h[i + 1], m, tables)
        else:
            place, z, d = state(p, gliding, place, z, m, tables)
            if j > 0:
                i, far, z = _landing(j, place, u, ground)
                d, place, jumped = d - (far - place), far, 1
                if d - tables[2][4] * z < tables[2][0]:
                    status = BELOW
            elif not gliding:
                d = stop
    return record[:, :n].copy(), kind[:, :n].copy(), status, place


@njit(cache=True, error_model="numpy")
def _limit(gliding: bool, i: int, z: float, tables: Tables, ground: Ground) -> tuple[float, bool]:
    # p at which the facet ends, or the contact comes free to glide; the top of the box, and False, where it does not
    if gliding:
        return ground[0][i + 1], True
    stop, box = along(z, ground[2][i], tables), tables[2]
    return (stop, True) if stop < np.inf else (box[2] + box[4] * z, False)


@njit(cache=True, error_model="numpy")
def _longer(values: NDArray[Any]) -> NDArray[Any]:
    out = np.empty((values.shape[0], 2 * values.shape[1]), values.dtype)
    out[:, : values.shape[1]] = values
    return out


@njit(cache=True, error_model="numpy")
def _short(gliding: bool, p: float, place: float, z: float, m: float, tables: Tables) -> int:
    # why travel found no end: the box, or the reach
    status = _left(state(p, gliding, place, z, m, tables)[2])
    return SHORT if status == 0 else status


@njit(cache=True, error_model="numpy")
def _left(d: float) -> int:
    # where an excursion without end has left the box; 0 if it has not
    if np.isfinite(d):
        return 0
    return ABOVE if d > 0 else BELOW


@njit(cache=True, error_model="numpy")
def _angle(d: float, z: float, tables: Tables) -> float:
    # tan θ_ε
    box = tables[2]
    return clenshaw_slope(touch_row(z, tables), (2 * (d - box[4] * z) - box[0] - box[2]) / (box[2] - box[0]))[0]


@njit(cache=True, error_model="numpy")
def _landing(j: int, place: float, u: float, ground: Ground) -> tuple[int, float, float]:
    # facet, place and height where the contact lands at the distance u
    x, h, slope = ground[:3]
    if x[j] == x[j + 1]:
        k = j + 1 if h[j + 1] > h[j] else j
        return k, x[k], h[k]
    if u <= x[j] - place:
        return j, x[j], h[j]
    if u >= x[j + 1] - place:
        return j + 1, x[j + 1], h[j + 1]
    return j, place + u, h[j] + slope[j] * (place + u - x[j])


@njit(cache=True, error_model="numpy")
def _slip(i: int, place: float, tau: float, tables: Tables, ground: Ground) -> tuple[int, float, float]:
    # a facet that rises through the shaft: at one travel, the first point of it that the contact angle clears
    x, h, slope = ground[:3]
    low, high, m = place, x[i + 1], slope[i]
    if low == high or _angle(tau - high, h[i + 1], tables) < m:
        return i + 1, high, h[i + 1]
    for _ in range(60):
        middle = (low + high) / 2
        if _angle(tau - middle, h[i] + m * (middle - x[i]), tables) < m:
            low = middle
        else:
            high = middle
    return i, high, h[i] + m * (high - x[i])


@njit(cache=True, error_model="numpy")
def follow(
    tau: Array, episode: Integers, kind: Integers, places: Array, heights: Array, slopes: Array, tables: Tables
) -> Array:
    """X at each travel, in the episode given for each.

    Parameters
    ----------
    tau : (T,) array
        Travels over L.
    episode : (T,) array
        Episode of each.
    kind, places, heights, slopes : (E,) arrays
        Of the episodes.
    tables : tuple
        The profiles, see :mod:`vibrissa.mechanics.contact.clearance`.

    Returns
    -------
    (T,) array
        X over L.
    """
    out = np.empty(tau.size)
    for t in range(tau.size):
        e = episode[t]
        out[t] = places[e]
        if kind[e] == 1:
            m, place = slopes[e], places[e]
            for _ in range(50):  # X + d(X) = τ
                d = along(heights[e] + m * (place - places[e]), m, tables)
                miss = tau[t] - place - d
                if m == 0.0:
                    place += miss
                    break
                place += miss
                if abs(miss) < _CLOSE:
                    break
            out[t] = place
    return out
