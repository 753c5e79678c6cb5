"""Motion of nodes about their mean, across the shaft and along it; how alike repeated runs are."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import RangeError, TooFewError
from vibrissa.quantities import measured_sd

if TYPE_CHECKING:
    import xarray as xr

_DEGREE = 8  # of the polynomial through the mean profile: its tangent to 1e-3 rad
_LEAST = 9  # least nodes of a mean profile
_STILL = 1e-18  # power over that of the node that moves most, below which a node does not move


class NodeMotion(NamedTuple):
    """Motion of the nodes of one whisker about their mean.

    Attributes
    ----------
    nodes : (N,) array of int
        Those placed in at least half of the frames.
    measured : (N,) array of bool
        Whether measured in at least half of them, not only carried on straight to the skin.
    arc : (N,) array
        Arc length from the skin [m].
    x, y : (N,) arrays
        Mean position [m].
    angle : (N,) array
        Direction of the mean profile from the skin on, from x to y [rad].
    across, along : (T, N) arrays
        Displacement along the normal (−sin, cos) and the tangent (cos, sin) of the mean profile [m]; NaN where lost.
    """

    nodes: Integers
    measured: Mask
    arc: Array
    x: Array
    y: Array
    angle: Array
    across: Array
    along: Array

    @property
    def along_unstretched(self) -> Array:
        """Motion along the shaft that follows from that across it, since the shaft does not stretch, (T, N) [m].

        With the arc length σ from the skin, dw/dσ = u dφ/dσ and w = 0 at the first node.
        """
        mean = (self.across[:, 1:] + self.across[:, :-1]) / 2
        return np.pad(np.cumsum(mean * np.diff(self.angle), axis=1), ((0, 0), (1, 0)))


def node_motion(profile: xr.Dataset) -> NodeMotion:
    """Motion of the nodes of one tracked whisker across its mean profile and along it.

    A tracker measures one coordinate, the row in each column (or the column in each row). Which point of the line is
    the node follows from arc length. So the motion across the shaft is measured; the motion along it is what a shaft
    that does not stretch, held at the skin, must do.

    Parameters
    ----------
    profile : Dataset
        One whisker: ``x``, ``y``, ``y_sd`` or ``x_sd`` (time, node), ``arc_length`` (node).

    Returns
    -------
    NodeMotion
        About the mean.

    Raises
    ------
    InputError
        If too few nodes are seen in half of the frames.
    """
    index = np.flatnonzero(np.isfinite(profile.x.values).mean(axis=0) >= 0.5)
    if len(index) < _LEAST:
        raise TooFewError("profile", f"must have {_LEAST} nodes seen in half of the frames", len(index))
    measured = np.isfinite(measured_sd(profile).values[:, index]).mean(axis=0) >= 0.5
    x, y, arc = profile.x.values[:, index], profile.y.values[:, index], profile.arc_length.values[index]
    mean_x, mean_y = np.nanmean(x, axis=0), np.nanmean(y, axis=0)
    slopes = [Polynomial.fit(arc, mean, min(_DEGREE, len(arc) // 3)).deriv()(arc) for mean in (mean_x, mean_y)]
    angle = np.unwrap(np.arctan2(slopes[1], slopes[0]))
    dx, dy = x - mean_x, y - mean_y
    across, along = np.cos(angle) * dy - np.sin(angle) * dx, np.cos(angle) * dx + np.sin(angle) * dy
    return NodeMotion(index, measured, arc, mean_x, mean_y, angle, across, along)


def motion_of_truth(true: xr.Dataset, motion: NodeMotion) -> tuple[Array, Array]:
    """Motion of true points across and along the tracked mean profile, (T, N) each [m].

    Parameters
    ----------
    true : Dataset
        ``x``, ``y`` (time, node), ``arc_length`` (node); linear between its points.
    motion : NodeMotion
        The tracked nodes.

    Returns
    -------
    across, along : (T, N) arrays
        [m].
    """
    dx, dy = (between(true[name].values, true.arc_length.values, motion.arc) for name in ("x", "y"))
    cos, sin = np.cos(motion.angle), np.sin(motion.angle)
    return cos * dy - sin * dx, cos * dx + sin * dy


def between(values: Array, known: Array, wanted: Array) -> Array:
    """Values (T, K) at known places, about their mean, at wanted ones (T, N), linear between.

    Parameters
    ----------
    values : (T, K) array
        At the known places.
    known : (K,) array
        Places, rising.
    wanted : (N,) array
        Places.

    Returns
    -------
    (T, N) array
        About their means.
    """
    right = np.searchsorted(known, wanted).clip(1, len(known) - 1)
    share = (wanted - known[right - 1]) / (known[right] - known[right - 1])
    centred = values - values.mean(axis=0)
    return (1 - share) * centred[:, right - 1] + share * centred[:, right]


def share_along(across: Array, along: Array) -> Array:
    """Share of the power of the motion that is along the shaft.

    Parameters
    ----------
    across, along : (T, N) arrays
        Displacements about the mean [m]; NaN where lost.

    Returns
    -------
    (N,) array
        ⟨w²⟩ / (⟨u²⟩ + ⟨w²⟩); NaN where nothing moves but round-off.
    """
    u2, w2 = np.nanmean(across**2, axis=0), np.nanmean(along**2, axis=0)
    moves = u2 + w2 > _STILL * np.max(u2 + w2)
    return np.divide(w2, u2 + w2, out=np.full(len(u2), np.nan), where=moves)


def pooled_share_along(across: Array, along: Array) -> float:
    """Share of the power along the shaft, of all nodes together.

    Parameters
    ----------
    across : (T, N) array
        Displacement across the shaft [m]; NaN where lost.
    along : (T, N) array
        The same along it.

    Returns
    -------
    float
        0 to 1; NaN where nothing moves.
    """
    u2, w2 = np.nanmean(across**2), np.nanmean(along**2)
    return float(w2 / (u2 + w2)) if u2 + w2 > 0 else float("nan")


def run_correlations(runs: Array) -> tuple[Array, Array]:
    """Correlation of each run with the mean of all runs, and with the mean of the others.

    The mean of all holds the run itself: N runs that have nothing in common still correlate with it at 1/√N. Of runs
    alike at r, any two of them, the first is √[(1 + (N − 1) r)/N] and the second r/√[(1 + (N − 2) r)/(N − 1)].

    Parameters
    ----------
    runs : (…, N, T) array
        N ≥ 2 runs on one grid of time.

    Returns
    -------
    with_mean, with_others : (…, N) arrays
        Pearson correlations over time.
    """
    if runs.shape[-2] < 2:
        raise RangeError("runs", "must be at least 2", runs.shape[-2])
    total = runs.sum(axis=-2, keepdims=True)
    return _pearson(runs, total), _pearson(runs, total - runs)


def _pearson(a: Array, b: Array) -> Array:
    a, b = a - a.mean(axis=-1, keepdims=True), b - b.mean(axis=-1, keepdims=True)
    return (a * b).sum(axis=-1) / np.sqrt((a * a).sum(axis=-1) * (b * b).sum(axis=-1))


def most_alike(correlation: Array) -> int:
    """The experiment whose runs are most alike, which Figure 3D shows.

    Parameters
    ----------
    correlation : (R, N) array
        Of each run of each experiment with the mean of its runs.

    Returns
    -------
    int
        Its place.
    """
    return int(correlation.mean(axis=1).argmax())
