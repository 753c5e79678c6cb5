"""Where the shaft is while a scan goes on: at many moments for little work, since without vibration d tells it all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from vibrissa.mechanics.projection import profiles
from vibrissa.mechanics.superposition import Prediction

if TYPE_CHECKING:
    from vibrissa.mechanics.response import Response
    from vibrissa.page.bench import Motion

Array = NDArray[np.float64]

STEP = 1e-3  # [L] of the excursion from one tabulated profile to the next: the spline errs by some 1e-9 L


def way(prediction: Motion, moments: Array, s: Array) -> tuple[Array, Array]:
    """Positions from the base, along the substrate and up, over L, (P, S) each, vibration and all.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        Whose response is exact.
    moments : (P,) array
        Ascending times [s].
    s : (S,) array
        Ascending points of the shaft; below ε the free end, straight.
    """
    if not isinstance(prediction, Prediction):
        return prediction.position(moments, s)
    still = _by_excursion(prediction.response, s)(prediction.excursion(moments))
    q, (along, up) = prediction.amplitudes(moments).T, prediction.response.basis.displacement(s)
    return still[:, 0] + q @ along, still[:, 1] + q @ up


def across(prediction: Motion, t: Array, s: float) -> Array:
    """Displacement of one point along the normal of the profile on the flat, away from the ground, over L, (T,)."""
    place, flat = np.array([s]), prediction.response.flat
    angle, (x, y) = flat.angle(place), way(prediction, t, place)
    x0, y0 = flat.position(place)
    return np.asarray(np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0))[:, 0]


def _by_excursion(response: Response, s: Array) -> CubicSpline:
    """Positions without vibration (…, 2, S) over L as a function of the excursion."""
    low, high = response.reach
    chains = [np.linspace(0, end, max(4, int(abs(end) / STEP) + 2))[1:] for end in (low, high) if end]
    d = np.concatenate([[0.0], *chains])
    held = np.concatenate([np.stack(response.flat.position(s))[None], *(_held(response, one, s) for one in chains)])
    order = np.argsort(d)
    return CubicSpline(d[order], held[order])


def _held(response: Response, excursions: Array, s: Array) -> Array:
    """Profiles carried to each excursion, the free end straight, (E, 2, S)."""
    flat = response.flat
    points = np.append(np.maximum(s, flat.contact / 2), 1.0)  # below that all is free end
    found = profiles(flat, excursions, points)
    contact, turn, _ = found.unknowns.T[:, :, None]
    distance, height = flat.base
    free = s - contact
    straight = np.stack([free * np.cos(turn) - distance - excursions[:, None], free * np.sin(turn) - height], axis=1)
    curved = np.stack([found.x, found.y], axis=1)[..., :-1]
    return np.where((free < 0)[:, None], straight, curved)
