"""What a decomposition makes of the model's own motion, so that both sides of a fit are seen alike.

The contact's excursion bends the shaft to a shape that few modes do not hold: the point that stood at ε leaves the
ground as the edge slides on, where every V_i is 0. What least squares over some nodes make of it is not Q_i(d), but
differs by what goes in step with d; held against Q_i(d) it moves the resonance of mode 1 by −0.02 %, that of mode 2 by
−0.2 %.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.motion import PredictedMotion

_FEWEST = 100  # frames with every node, from which the decomposition's weights can be read
_MEAN = 400  # instants for the mean profile
_RIDGE = 1e-13  # of the mean square of a node: rounding, where the motion has fewer dimensions than nodes
_CHUNK = 12_000  # instants at a time: each time the held profiles are integrated anew


class Seen(NamedTuple):
    """What is found of the model's motion.

    Attributes
    ----------
    own : (M,) array
        Share of each mode's vibration that is found in that mode.
    beside : (M, T) array
        Everything else that is found in it: the quasi-static motion and the other modes' vibration, over L.
    """

    own: Array
    beside: Array


def seen_motion(prediction: PredictedMotion, modal: xr.Dataset, t: Array) -> Seen:
    """What the decomposition that made ``modal`` finds of a prediction.

    Parameters
    ----------
    prediction : PredictedMotion
        The model.
    modal : Dataset
        ``mode_displacement`` (mode, time), and, from :func:`vibrissa.mechanics.inverse.decomposition.decompose`,
        ``displacement`` (time, node) and ``arc_length``. Without these, or with fewer than 100 frames in which all
        nodes were seen, the modes are taken for what is found: the model's q + Q(d).
    t : (T,) array
        Times [s].

    Returns
    -------
    Seen
        Shares of the vibration, and all else that is found.
    """
    count = modal.sizes["mode"]
    weights = _weights(modal) if "displacement" in modal else None
    if weights is None:
        return Seen(np.ones(count), prediction.mode_drive(t)[:count])
    by_node, s = weights
    angle = _mean_angle(prediction, t, s)
    along, up = prediction.response.basis.displacement(s)
    mixed = by_node @ (up * np.cos(angle) - along * np.sin(angle)).T
    own = np.diag(mixed).copy()
    beside = (mixed - np.pad(np.diag(own), ((0, 0), (0, mixed.shape[1] - count)))) @ prediction.amplitudes(t)
    for first in range(0, len(t), _CHUNK):
        part = slice(first, first + _CHUNK)
        x, y = prediction.quasi_static_position(t[part], s)
        beside[:, part] += (by_node * np.cos(angle)) @ y.T - (by_node * np.sin(angle)) @ x.T
    return Seen(own, beside)


def _mean_angle(prediction: PredictedMotion, t: Array, s: Array) -> Array:
    """Angle θ of the mean profile at points s [rad]: a movie's displacements are along its normals, not the flat's."""
    x, y = (one.mean(axis=0) for one in prediction.quasi_static_position(t[:: max(1, len(t) // _MEAN)], s))
    return np.unwrap(np.arctan2(*(np.gradient(one, s, edge_order=2) for one in (y, x))))


def _weights(modal: xr.Dataset) -> tuple[Array, Array] | None:
    """Matrix (M, N) that made the amplitudes, over L, of the nodes' displacements over L, and the nodes' s."""
    length = float(modal.attrs["whisker_length"])
    s = 1 - modal.arc_length.values / length
    displacement = modal.displacement.values
    finite = np.isfinite(displacement)
    used = finite.any(axis=0) & (s >= float(modal.contact)) & (s <= 1)
    whole = finite[:, used].all(axis=1)
    if whole.sum() < _FEWEST:
        return None
    u, q = displacement[np.ix_(whole, used)], modal.mode_displacement.values[:, whole]
    u /= length
    square = u.T @ u
    square.flat[:: len(square) + 1] += _RIDGE * np.trace(square)
    return np.linalg.solve(square, u.T @ q.T).T, s[used]
