"""Direction and curvature of a whisker at its base: an arc of a circle through the part of the shaft next to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from vibrissa.arrays import Array, Mask

LEAST_NODES = 3  # an arc has three parameters
LARGEST_SD = np.deg2rad(30)  # of the direction, from which on the nodes do not determine it
CHANCE = 1e-3  # share of the frames of true arcs in which nodes scatter as much as counts for more than their error
STEPS = 12  # of the fit; each takes off nine tenths of the error, and more, of a part that turns by up to 60°


class BaseArc(NamedTuple):
    """Arc of each frame; NaN where too little of the part was seen.

    Attributes
    ----------
    direction : (T,) array
        Angle of the shaft at the start of the part, base to tip, from the x towards the y axis [rad].
    curvature : (T,) array
        Change of that angle with arc length [1/m].
    direction_sd, curvature_sd : (T,) arrays
        Standard deviations, times the excess; NaN where fewer than three nodes have one.
    misfit : (T,) array
        Root mean square distance of the nodes to the arc [m]: large where the line was followed along something else.
    excess : (T,) array
        Scatter of the nodes about the arc over what their standard deviations explain, 1 where it may be by chance.
    """

    direction: Array
    curvature: Array
    direction_sd: Array
    curvature_sd: Array
    misfit: Array
    excess: Array


def fit_base_arc(arc: Array, x: Array, y: Array, x_sd: Array | None, y_sd: Array | None) -> BaseArc:
    """Least-squares arc through the nodes of a part, in every frame.

    In the frame of the part's chord, u along it and v across, a circle has sin φ = σ + κu, so that
    v = a + u (2σ + κu)/(cos φ(u) + cos φ(0)); a, σ and κ are fitted across the chord. The direction holds at ``arc[0]``
    also where the first nodes were not seen: the arc is continued to it.

    Parameters
    ----------
    arc : (N,) array
        Arc length of the nodes [m]; the part starts with the first.
    x, y : (T, N) arrays
        Nodes [m], NaN where not measured.
    x_sd, y_sd : (T, N) arrays, optional
        Standard deviations of x and y [m]; of neighbouring nodes taken as independent. Where three nodes or more have
        one, the others do not count. Where nodes scatter about the arc by more, as at hairs, the standard deviations
        of direction and curvature are larger in proportion (the factor of Birge).

    Returns
    -------
    BaseArc
        NaN where less than half of the part, or fewer than three nodes, were seen, and where the direction has a
        standard deviation of more than 30° by those of the nodes, or none where others have one.
    """
    seen = np.isfinite(x) & np.isfinite(y)
    rows = np.flatnonzero(seen.sum(axis=1) >= max(LEAST_NODES, arc.size / 2))
    result = [np.full(x.shape[0], np.nan) for _ in BaseArc._fields]
    if rows.size:
        sds = [None if sd is None else sd[rows] for sd in (x_sd, y_sd)]
        found = _fitted(arc, x[rows], y[rows], seen[rows], *sds)
        measured = any(np.isfinite(sd).any() for sd in sds if sd is not None)
        known = found.direction_sd <= LARGEST_SD * found.excess if measured else np.ones(rows.size, bool)
        for whole, part in zip(result, found, strict=True):
            whole[rows[known]] = part[known]
    return BaseArc(*result)


def _fitted(arc: Array, x: Array, y: Array, seen: Mask, x_sd: Array | None, y_sd: Array | None) -> BaseArc:
    """The arc in frames in which enough nodes were seen."""
    every = np.arange(len(x))
    first, last = seen.argmax(axis=1), seen.shape[1] - 1 - seen[:, ::-1].argmax(axis=1)
    chord = np.arctan2(y[every, last] - y[every, first], x[every, last] - x[every, first])
    u, v, h = _in_chord(x, y, seen, chord)
    across = _across(chord, x_sd, y_sd)
    counted, weight = _weights(seen, across)
    design = np.stack([np.ones_like(u), u, u**2 / 2], axis=-1)
    squares = weight**2
    normal = np.einsum("tni,tn,tnj->tij", design, squares, design)
    to_fit = np.linalg.solve(normal, np.swapaxes(design * squares[..., None], 1, 2))
    p = np.zeros((len(x), 3))
    for _ in range(STEPS):
        off = v - _arc(u, *p.T[:, :, None])
        p += np.einsum("tin,tn->ti", to_fit, np.where(seen, off, 0.0))
    a_first = u[every, first]
    turn = np.arcsin(np.clip(p[:, 1] + p[:, 2] * a_first, -1, 1))
    hidden = (arc[first] - arc[0]) / h  # of the part, before the first node seen
    variance = np.where(counted, (across / h[:, None]) ** 2, 0.0)
    covariance = np.einsum("tin,tn,tjn->tij", to_fit, variance, to_fit)
    excess = _excess(np.where(counted, off * h[:, None] / across, 0.0), counted)
    slope = np.stack([0 * h, 1 / np.cos(turn), a_first / np.cos(turn) - hidden], axis=-1)
    return BaseArc(
        direction=chord + turn - p[:, 2] * hidden,
        curvature=p[:, 2] / h,
        direction_sd=excess * np.sqrt(np.einsum("ti,tij,tj->t", slope, covariance, slope)),
        curvature_sd=excess * np.sqrt(covariance[:, 2, 2]) / h,
        misfit=h * np.sqrt(np.where(seen, off**2, 0.0).sum(axis=1) / seen.sum(axis=1)),
        excess=excess,
    )


def _excess(over_sd: Array, counted: Mask) -> Array:
    """Root of χ² per degree of freedom, where true arcs seldom have as much; elsewhere 1."""
    squares, free = (over_sd**2).sum(axis=1), np.maximum(counted.sum(axis=1) - LEAST_NODES, 1)
    enough = counted.sum(axis=1) > LEAST_NODES
    return np.where(enough & (squares > chdtri(free, CHANCE)), np.sqrt(squares / free), 1.0)


def _weights(seen: Mask, across: Array) -> tuple[Mask, Array]:
    """Nodes that count and their weights: those with a standard deviation, or all alike where these are too few."""
    precise = seen & np.isfinite(across) & (across > 0)
    enough = precise.sum(axis=1, keepdims=True) >= LEAST_NODES
    counted = np.where(enough, precise, seen)
    return counted, counted / np.where(enough & precise, across, 1.0)


def _in_chord(x: Array, y: Array, seen: Mask, chord: Array) -> tuple[Array, Array, Array]:
    """Nodes along and across the chord from the middle of those seen, over half of its length; and that half [m]."""
    count = seen.sum(axis=1, keepdims=True)
    x, y = (np.where(seen, one, 0.0) - (np.where(seen, one, 0.0).sum(1, keepdims=True) / count) for one in (x, y))
    cos, sin = np.cos(chord)[:, None], np.sin(chord)[:, None]
    u, v = np.where(seen, x * cos + y * sin, 0.0), np.where(seen, y * cos - x * sin, 0.0)
    h = np.abs(u).max(axis=1)
    return u / h[:, None], v / h[:, None], h


def _across(chord: Array, x_sd: Array | None, y_sd: Array | None) -> Array:
    """Standard deviation across the chord [m]; NaN where a node has none."""
    parts = [
        (sd * np.abs(turn)[:, None]) ** 2
        for sd, turn in ((x_sd, np.sin(chord)), (y_sd, np.cos(chord)))
        if sd is not None
    ]
    return np.asarray(np.sqrt(sum(parts)) if parts else np.full((chord.size, 1), np.nan))


def _arc(u: Array, a: Array, sigma: Array, kappa: Array) -> Array:
    """The circle across its chord, without a division by κ, so that a straight shaft is one too."""
    far, here = (np.sqrt(np.maximum(1 - w**2, 1e-12)) for w in (sigma + kappa * u, sigma))
    return a + u * (2 * sigma + kappa * u) / (far + here)
