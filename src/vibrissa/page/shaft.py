"""Where the shaft is while a scan goes on: where its contact is tells it all but for the vibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from vibrissa.mechanics.projection import profiles
from vibrissa.mechanics.response import Response
from vibrissa.mechanics.topography import ReliefPrediction

if TYPE_CHECKING:
    from vibrissa.mechanics.ground import GroundResponse
    from vibrissa.page.bench import Motion

Array = NDArray[np.float64]

NODE = 5e-3  # [m] from the base: where the paper's stimulator held the whiskers, and what it replayed
FREE, HELD = 8, 28  # points of the free end and of the shaft behind the contact that are drawn
STEP = 1e-3  # [L] of the excursion from one tabulated profile to the next: the spline errs by some 1e-9 L


@dataclass(frozen=True)
class Way:
    """Where points of the shaft are without vibration, for any excursion and height of the contact.

    Attributes
    ----------
    response : Response or GroundResponse
        Exact.
    s : (S,) array
        The points, ascending; below ε the free end, straight.
    table : CubicSpline or (2, S, J, K) array
        Positions (2, S) over L by the excursion, or Chebyshev coefficients by excursion and height.
    """

    response: Response | GroundResponse
    s: Array
    table: CubicSpline | Array

    def at(self, prediction: Motion, t: Array, q: Array) -> tuple[Array, Array]:
        """Positions from the base, along the substrate and up, over L, (T, S) each, with the vibration q (M, T)."""
        x, y = self._still(prediction, t)
        along, up = self.response.basis.displacement(self.s)
        return x + q.T @ along, y + q.T @ up

    def across(self, prediction: Motion, t: Array, q: Array) -> Array:
        """Displacement along the normal of the profile on the flat, away from the ground, over L, (T, S)."""
        angle, (x0, y0) = self.response.flat.angle(self.s), self.response.flat.position(self.s)
        x, y = self.at(prediction, t, q)
        return np.asarray(np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0))

    def _still(self, prediction: Motion, t: Array) -> tuple[Array, Array]:
        if isinstance(prediction, ReliefPrediction):
            return prediction.response.placed(*prediction.contact(t)[:2], np.asarray(self.table))
        spline: Any = self.table
        both = spline(prediction.excursion(t))
        return both[:, 0], both[:, 1]


@dataclass(frozen=True)
class Ways:
    """What live moves of speed and damping keep: ways of the shaft that is drawn, and of the point 5 mm from the base.

    Attributes
    ----------
    shaft, node : Way
        Of the points drawn, from the physical tip to the base, and of the one point.
    """

    shaft: Way
    node: Way


def ways(prediction: Motion) -> Ways:
    """Tabulate the ways of a prediction whose response is exact; they serve any speed and damping."""
    response, contact = prediction.response, prediction.posture.contact
    free, held = np.linspace(prediction.whisker.tip, contact, FREE, endpoint=False), np.linspace(0, 1, HELD)
    s = np.concatenate([free, contact + (1 - contact) * held**1.5])
    node = 1 - NODE / prediction.whisker.length
    which = np.searchsorted(s, node)
    every = np.insert(s, which, node)
    drawn = np.delete(np.arange(len(every)), which)
    if isinstance(response, Response):
        d, still = _by_excursion(response, every)
        return Ways(*(Way(response, every[k], CubicSpline(d, still[..., k])) for k in (drawn, [which])))
    places = response.places(every)
    return Ways(*(Way(response, every[k], places[:, k]) for k in (drawn, [which])))


def _by_excursion(response: Response, s: Array) -> tuple[Array, Array]:
    """Excursions (E,), and positions without vibration there (E, 2, S), over L."""
    low, high = response.reach
    chains = [np.linspace(0, end, max(4, int(abs(end) / STEP) + 2))[1:] for end in (low, high) if end]
    d = np.concatenate([[0.0], *chains])
    held = np.concatenate([np.stack(response.flat.position(s))[None], *(_held(response, one, s) for one in chains)])
    order = np.argsort(d)
    return d[order], held[order]


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
