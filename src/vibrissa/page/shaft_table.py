"""Where the shaft is during a scan: without vibration it follows from where its contact is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline

from vibrissa.arrays import Array
from vibrissa.mechanics.quasi_static.projection import profiles
from vibrissa.mechanics.quasi_static.response import Response
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction

if TYPE_CHECKING:
    from vibrissa.mechanics.quasi_static.relief_response import GroundResponse
    from vibrissa.mechanics.scan.sampled import Predicted


NODE = 5e-3  # [m] from the base: where the paper's stimulator held the whiskers, and what it replayed
FREE, HELD = 8, 28  # points of the free end and of the shaft behind the contact that are drawn
STEP = 1e-3  # [L] of the excursion from one tabulated profile to the next: the spline errs by some 1e-9 L


@dataclass(frozen=True)
class ShaftTable:
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

    def at(self, prediction: Predicted, t: Array, q: Array) -> tuple[Array, Array]:
        """Positions from the base, along the substrate and up.

        Parameters
        ----------
        prediction : Prediction or ReliefPrediction
            Of the same posture and surface.
        t : (T,) array
            Times [s].
        q : (M, T) array
            Vibration, over L.

        Returns
        -------
        x, y : (T, S) arrays
            Over L.
        """
        x, y = self._still(prediction, t)
        along, up = self.response.basis.displacement(self.s)
        return x + q.T @ along, y + q.T @ up

    def across(self, prediction: Predicted, t: Array, q: Array) -> Array:
        """Displacement along the normal of the profile on the flat.

        Parameters
        ----------
        prediction, t, q
            As in :meth:`at`.

        Returns
        -------
        (T, S) array
            Over L, positive away from the ground.
        """
        angle, (x0, y0) = self.response.flat.angle(self.s), self.response.flat.position(self.s)
        x, y = self.at(prediction, t, q)
        return np.asarray(np.cos(angle) * (y - y0) - np.sin(angle) * (x - x0))

    def _still(self, prediction: Predicted, t: Array) -> tuple[Array, Array]:
        if isinstance(prediction, ReliefPrediction):
            return prediction.response.placed(*prediction.contact(t)[:2], np.asarray(self.table))
        spline: Any = self.table
        both = spline(prediction.excursion(t))
        return both[:, 0], both[:, 1]


@dataclass(frozen=True)
class ShaftTables:
    """Tables that live moves of speed and damping keep: the shaft that is drawn, and the point 5 mm from the base.

    Attributes
    ----------
    shaft, node : ShaftTable
        Of the points drawn, from the physical tip to the base, and of the one point.
    """

    shaft: ShaftTable
    node: ShaftTable


def shaft_tables(prediction: Predicted) -> ShaftTables:
    """Tabulate where the shaft is, for a prediction whose response is exact; the tables serve any speed and damping.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        Of a state.

    Returns
    -------
    ShaftTables
        Of the shaft, and of the one point.
    """
    response, contact = prediction.response, prediction.posture.contact
    free, held = np.linspace(prediction.whisker.tip, contact, FREE, endpoint=False), np.linspace(0, 1, HELD)
    s = np.concatenate([free, contact + (1 - contact) * held**1.5])
    node = 1 - NODE / prediction.whisker.length
    which = np.searchsorted(s, node)
    every = np.insert(s, which, node)
    drawn = np.delete(np.arange(len(every)), which)
    if isinstance(response, Response):
        d, still = _by_excursion(response, every)
        return ShaftTables(*(ShaftTable(response, every[k], CubicSpline(d, still[..., k])) for k in (drawn, [which])))
    places = response.places(every)
    return ShaftTables(*(ShaftTable(response, every[k], places[:, k]) for k in (drawn, [which])))


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
