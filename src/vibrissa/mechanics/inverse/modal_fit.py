"""Amplitudes of modes from displacements of nodes: weighted least squares, and the paper's projection."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.exact import cone_modes

_BLOCK = 12_000  # frames at a time; of longer movies sums are formed in parts, and differ in the last bits
TAIL = 7  # modes above those that are solved for freely
_LIMIT = 5.0  # times their likely size: 20 leaks less where all is seen, and doubles the noise where 4 mm are hidden
_END_NODES = 25  # nodes (about 3 mm) that extrapolate the profile in the paper's form


def blocks(count: int, size: int = 0) -> list[slice]:
    """Parts of a long movie that are worked on one after the other, so that little is held at a time.

    Parameters
    ----------
    count : int
        How many there are.
    size : int
        Of one part; 12,000 by default.

    Returns
    -------
    list of slice
        The parts.
    """
    size = size or _BLOCK
    return [slice(first, first + size) for first in range(0, count, size)]


def some_nodes(values: Array) -> list[slice]:
    """Nodes that are worked on at a time, in all frames: all of them, if the movie is no longer than one block.

    Parameters
    ----------
    values : (T, N) array
        What is worked on.

    Returns
    -------
    list of slice
        Parts of the nodes.
    """
    return blocks(values.shape[1], max(1, _BLOCK * values.shape[1] // len(values)))


def with_tail(u: Array, every: Array, count: int) -> tuple[Array, Array]:
    """Amplitudes of the first modes; the others, small as they are, must not pass for them.

    The contact's excursion bends the shaft in all modes at once; beyond those that ring, by amounts that fall like i⁻³.
    Left out, they leak, in step with the excursion, and raise the resonance of mode 2 in the built-in experiment by
    0.05 %. So they take part, within five times what the last of the first modes makes likely: without a limit, nodes
    that end short of the contact would take noise for them.

    Parameters
    ----------
    u : (T, N) array
        Displacements over L; NaN where lost.
    every : (M, N) array
        Shapes of all modes.
    count : int
        How many of them are free.

    Returns
    -------
    q, sd : (M, T) arrays
        Over L; NaN in frames with few nodes.
    """
    shapes = every[:count]
    weight = _node_weights(u, shapes)
    last = np.nanstd(_least_squares(u, shapes, weight)[0][-1])
    number = np.arange(count + 1, len(every) + 1)
    unit = every.copy()  # the others in units of their limit
    unit[count:] *= _LIMIT * last * (count / number[:, None]) ** 3
    precision = (np.arange(len(every)) >= count).astype(float)
    q, _ = _least_squares(u, unit, weight, precision)
    return _least_squares(u, unit, 1 / _residual_variance(u, q, unit), precision)


def _least_squares(u: Array, shapes: Array, weight: Array, precision: Array | float = 0.0) -> tuple[Array, Array]:
    """Amplitudes (M, T), zero to within 1/√precision, and their standard deviations; NaN in frames with few nodes."""
    found = [_solved(u[part], shapes, weight, precision) for part in blocks(len(u))]
    q, sd = (np.concatenate(one, axis=1) for one in zip(*found, strict=True))
    return q, sd


def _solved(u: Array, shapes: Array, weight: Array, precision: Array | float) -> tuple[Array, Array]:
    seen = np.isfinite(u)
    w = np.where(seen, weight, 0.0)
    moment = np.einsum("in,jn,tn->tij", shapes, shapes, w, optimize=True) + np.diag(precision + np.zeros(len(shapes)))
    right = np.einsum("in,tn->ti", shapes, w * np.where(seen, u, 0.0))
    free = len(shapes) - np.count_nonzero(precision)
    enough = seen.sum(axis=1) >= max(3 * free, u.shape[1] // 2)
    q = np.full((len(shapes), len(u)), np.nan)
    sd = np.full_like(q, np.nan)
    covariance = np.linalg.inv(moment[enough])
    q[:, enough] = np.einsum("tij,tj->it", covariance, right[enough])
    sd[:, enough] = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    return q, sd


def _node_weights(u: Array, shapes: Array) -> Array:
    """1/variance of each node's residual about an unweighted fit, (N,)."""
    q, _ = _least_squares(u, shapes, np.ones(u.shape[1]))
    return 1 / _residual_variance(u, q, shapes)


def _residual_variance(u: Array, q: Array, shapes: Array) -> Array:
    """Variance over time of what the modes leave at each node, (N,)."""
    return np.concatenate([np.nanvar(u[:, part] - q.T @ shapes[:, part], axis=0) for part in some_nodes(u)])


def _mean_square(u: Array, q: Array | None = None, shapes: Array | None = None) -> float:
    """Mean square, or that of what the modes leave."""
    total, count = 0.0, 0
    for part in blocks(len(u)):
        left = (u[part] if q is None or shapes is None else u[part] - q[:, part].T @ shapes) ** 2
        total, count = total + float(np.nansum(left)), count + int(np.count_nonzero(~np.isnan(left)))
    return total / count


def variance_explained(u: Array, shapes: Array, n_modes: int) -> Array:
    """Share of the displacement's variance that each mode adds, by nested unweighted fits.

    Parameters
    ----------
    u : (T, N) array
        Displacements over L.
    shapes : (M, N) array
        Shapes of the modes.
    n_modes : int
        How many are asked for.

    Returns
    -------
    (n_modes,) array
        Shares [1].
    """
    even = np.ones(u.shape[1])
    residual = [_mean_square(u)]
    for count in range(1, n_modes + 1):
        q, _ = _least_squares(u, shapes[:count], even)
        residual.append(_mean_square(u, q, shapes[:count]))
    return -np.diff(residual) / residual[0]


def projection(u: Array, s: Array, kappa: Array, contact: float) -> Array:
    """∫ u s² V ds with u extrapolated: a straight line to the skin, a second-degree polynomial to the contact.

    Parameters
    ----------
    u : (T, N) array
        Displacements over L.
    s : (N,) array
        Nodes.
    kappa : (M,) array
        Frequencies of the modes.
    contact : float
        ε over L.

    Returns
    -------
    (M, T) array
        Amplitudes over L.
    """
    order = np.argsort(s)
    s, u = s[order], u[:, order]
    step = np.median(np.diff(s))
    outer, inner = np.arange(contact, s[0], step), np.arange(s[-1] + step, 1, step)
    to_contact = _extrapolation(s[:_END_NODES], outer, 2)
    to_skin = _extrapolation(s[-_END_NODES:], inner, 1)
    whole = np.concatenate([u[:, :_END_NODES] @ to_contact, u, u[:, -_END_NODES:] @ to_skin], axis=1)
    grid = np.concatenate([outer, s, inner])
    shapes = cone_modes(kappa, contact, grid)
    return np.trapezoid(whole[None] * (grid**2 * shapes)[:, None, :], grid, axis=2)


def _extrapolation(known: Array, wanted: Array, degree: int) -> Array:
    """(K, W) matrix that carries values at known points to wanted ones along a fitted polynomial."""
    centre, width = known.mean(), np.ptp(known)
    fit = np.linalg.pinv(np.vander((known - centre) / width, degree + 1))
    return (np.vander((wanted - centre) / width, degree + 1) @ fit).T
