"""Linear models of several terms: every value its own draw, or every whisker (animal) one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import fdtrc, stdtrit

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import RangeError, ShapeError, TooFewError


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Effect of one term on the response, the others held.

    Attributes
    ----------
    name : str
        The term.
    n : int
        Values used.
    f, p : float
        F of the term, and its p-value.
    df : int
        Its columns.
    slope, low, high : float
        Slope and its 95 % interval [unit of the response per unit of the term]; NaN for a term of names.
    """

    name: str
    n: int
    f: float
    p: float
    df: int
    slope: float
    low: float
    high: float


@dataclass(frozen=True)
class _Design:
    """Response and columns, each column with mean 0 and spread 1, and which columns a term has."""

    y: Array
    columns: Array
    spread: Array
    made: Mask
    terms: dict[str, Integers]
    numeric: dict[str, bool]


def linear_model(response: ArrayLike, terms: Mapping[str, ArrayLike]) -> list[Effect]:
    """Ordinary least squares with several terms; type-II F of each, as the paper's "speed: p, ε: p" are read.

    Takes every value for an independent draw. Sweeps of one whisker are not: where a term belongs to the whisker more
    than to the sweep (θ_b, ε, its identity), the p-values are far too small; see :func:`clustered_model`.

    Parameters
    ----------
    response : (N,) array
        Values to be explained.
    terms : mapping of (N,) arrays
        Numbers enter as they are, names as one column for each but the first. There are no products of terms. Rows
        with NaN, not measured, are left out: ``n`` is the number that remains.

    Returns
    -------
    list of Effect
        In the order of the terms.

    Raises
    ------
    InputError
        If lengths differ, fewer values than columns remain, or one term follows from the others.
    """
    from statsmodels.regression.linear_model import OLS  # takes a second, which verbs without a model do not wait for

    design = _design(response, terms)
    fit = OLS(design.y, design.columns).fit()
    free = int(fit.df_resid)
    return [_effect(design, name, fit.params, fit.cov_params(), free, free) for name in design.terms]


def clustered_model(response: ArrayLike, terms: Mapping[str, ArrayLike], clusters: ArrayLike) -> list[Effect]:
    """Ordinary least squares with several terms, with intervals and tests that take whole clusters for the draws.

    Jackknife by cluster (CV3 of MacKinnon, Nielsen and Webb 2023) with G − 1 degrees of freedom for one column, and
    Hotelling's for several: G clusters are the independent draws, however many sweeps each has. The covariance is that
    of statsmodels' ``cluster-crv3``, which refuses a whole model where one of its terms falls with a cluster.

    Parameters
    ----------
    response, terms
        As in :func:`linear_model`.
    clusters : (N,) array
        Cluster of each value: its whisker, or its animal, which holds the whiskers.

    Returns
    -------
    list of Effect
        F and interval are NaN for a term that one cluster alone determines, or has as many columns as there are
        clusters: neither can be estimated.

    Raises
    ------
    InputError
        As :func:`linear_model`; or clusters differ in number from the values.
    """
    design = _design(response, terms)
    labels = np.asarray(clusters)
    if labels.shape != design.made.shape:
        raise ShapeError("clusters", "must be as many as the values", f"{labels.shape}, {design.made.shape}")
    labels = labels[design.made]
    x, y = design.columns, design.y
    whole, right = x.T @ x, x.T @ y
    b = np.asarray(np.linalg.solve(whole, right), float)
    parts, separate = [], dict.fromkeys(design.terms, True)
    names = np.unique(labels)
    for name in names:  # the normal equations without one cluster; a pseudo-inverse, as a term may be gone with it
        one = labels == name
        rest = whole - x[one].T @ x[one]
        parts.append(np.linalg.pinv(rest, hermitian=True, rcond=1e-10) @ (right - x[one].T @ y[one]))
        for term, columns in design.terms.items():
            separate[term] &= _separate(rest, columns)
    shift = np.array(parts) - b
    free = len(names) - 1
    covariance = free / len(names) * shift.T @ shift
    unknown = np.full_like(covariance, np.nan)
    return [
        _effect(design, term, b, covariance if separate[term] else unknown, free, free - len(columns) + 1)
        for term, columns in design.terms.items()
    ]


def _separate(gram: Array, columns: Integers) -> bool:
    """Whether these columns do not follow from the others."""
    rest = np.delete(np.delete(gram, columns, 0), columns, 1)
    whole, without = (np.linalg.matrix_rank(one, rtol=1e-10, hermitian=True) for one in (gram, rest))
    return bool(whole - without == len(columns))


def _effect(design: _Design, name: str, b: Array, covariance: Array, free: int, left: int) -> Effect:
    """Wald's F of one term; free: degrees of freedom of the covariance, left: what a term of this size leaves of it."""
    columns = design.terms[name]
    q, part = len(columns), covariance[np.ix_(columns, columns)]
    f = np.nan
    if left > 0 and np.isfinite(part).all():
        f = float(b[columns] @ np.linalg.solve(part, b[columns])) / q * left / free
    slope = half = np.nan
    if design.numeric[name]:
        scale = float(design.spread[columns[0]])
        slope = float(b[columns[0]]) / scale
        half = float(stdtrit(free, 0.975) * np.sqrt(part[0, 0])) / scale
    return Effect(
        name=name,
        n=len(design.y),
        f=f,
        p=float(fdtrc(q, left, f)) if np.isfinite(f) else np.nan,
        df=q,
        slope=slope,
        low=slope - half,
        high=slope + half,
    )


def _design(response: ArrayLike, terms: Mapping[str, ArrayLike]) -> _Design:
    y = np.asarray(response, float)
    columns = {name: np.asarray(values) for name, values in terms.items()}
    for name, values in columns.items():
        if values.shape != y.shape or y.ndim != 1:
            raise ShapeError(f"term {name}", "must have one value for each response", f"{values.shape}, {y.shape}")
    numeric = {name: bool(np.issubdtype(values.dtype, np.number)) for name, values in columns.items()}
    made = np.isfinite(y)
    for name, values in columns.items():
        made &= np.isfinite(values.astype(float)) if numeric[name] else np.ones(len(y), bool)
    blocks = {name: _coded(values[made], numeric[name]) for name, values in columns.items()}
    x = np.concatenate([np.ones((int(made.sum()), 1)), *blocks.values()], axis=1)
    if len(x) <= x.shape[1]:
        raise TooFewError("response", f"must be measured in more than {x.shape[1]} rows", len(x))
    spread = np.concatenate([[1.0], x[:, 1:].std(axis=0)])
    if not np.all(spread > 0) or not all(block.size for block in blocks.values()):
        raise TooFewError("terms", "must each take more than one value")
    x[:, 1:] = (x[:, 1:] - x[:, 1:].mean(axis=0)) / spread[1:]
    if np.linalg.matrix_rank(x) < x.shape[1]:
        raise RangeError("terms", "must be linearly independent", ", ".join(terms), "leave one out")
    ends = np.cumsum([1, *(block.shape[1] for block in blocks.values())])
    places = {name: np.arange(ends[i], ends[i + 1]) for i, name in enumerate(blocks)}
    return _Design(y[made], x, spread, made, places, numeric)


def _coded(values: NDArray[np.generic], numeric: bool) -> Array:
    """One column of numbers, or one for each name but the first."""
    if numeric:
        return values.astype(float)[:, None]
    return np.array(values[:, None] == np.unique(values)[None, 1:], float)
