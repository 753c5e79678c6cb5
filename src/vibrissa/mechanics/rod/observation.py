"""What a movie would show of the rod: motion along the normal, and the modes that fit it best."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import cone_modes

_HIDDEN = 0.02  # of the shaft next to the contact, over L, that the fit leaves out
_GRID = 400  # points of the fit


def across(s: Array, at: Array, points: Array) -> Array:
    """Rows whose products with the positions are the motion along the normal at some points.

    Parameters
    ----------
    s : (N + 1,) array
        Nodes.
    at : (2N + 3,) array
        The profile whose normals count.
    points : (P,) array
        Positions along the shaft, over L.

    Returns
    -------
    (P, 2N + 3) array
        Linear between nodes.
    """
    places = at[:-1].reshape(-1, 2)
    turn = np.arctan2(*np.diff(places, axis=0).T[::-1])
    angle = np.interp(points, (s[1:] + s[:-1]) / 2, turn)
    after = np.clip(np.searchsorted(s, points), 1, s.size - 1)
    share = (points - s[after - 1]) / (s[after] - s[after - 1])
    rows, line = np.zeros((points.size, at.size)), np.arange(points.size)
    for node, part in ((after - 1, 1 - share), (after, share)):
        rows[line, 2 * node] -= part * np.sin(angle)
        rows[line, 2 * node + 1] += part * np.cos(angle)
    return rows


def fitted_modes(s: Array, at: Array, contact: float, kappa: Array) -> Array:
    """Rows whose products with the motion are the amplitudes of the pinned modes that fit it best.

    Least squares, weighted by s², of the motion along the normal, over the shaft from ε + 0.02 to the base.

    Parameters
    ----------
    s : (N + 1,) array
        Nodes.
    at : (2N + 3,) array
        The profile whose normals count.
    contact : float
        ε.
    kappa : (M,) array
        Adimensional frequencies of the pinned modes of the straight shaft.

    Returns
    -------
    (M, 2N + 3) array
        Amplitudes over L per position over L.
    """
    edges = np.linspace(contact + _HIDDEN, 1, _GRID + 1)
    points = (edges[1:] + edges[:-1]) / 2
    shapes = cone_modes(kappa, contact, points)
    weighted = shapes * points**2
    return np.asarray(np.linalg.solve(weighted @ shapes.T, weighted @ across(s, at, points)))
