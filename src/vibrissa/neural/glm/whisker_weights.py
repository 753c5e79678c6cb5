"""Weights of all whiskers in the rate of one unit: every envelope above one threshold, with one latency for all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.neural.coupling.stimulus_blocks import even_starts
from vibrissa.neural.glm.delayed_envelopes import LATEST, Copies

BLOCK = 0.2  # [s] pieces beside trials: longer than envelopes, and most of what else drives units, are alike
_STEPS = 8  # of Gauss and Newton from the best node; two mostly do


class Map(NamedTuple):
    """Weights of all whiskers for one unit, with the threshold and latency they share.

    Attributes
    ----------
    weight, error : (W,) arrays
        Rise of the rate above the threshold and its standard error [1/(s m)]; negative where the whisker suppresses.
    threshold, latency : float
        θ [m] and τ [s].
    columns : (W, K') array
        Hinged envelopes at them [m].
    free : int
        Degrees of freedom of the errors.
    """

    weight: Array
    error: Array
    threshold: float
    latency: float
    columns: Array
    free: int


class SurroundGrid:
    """Drives of all whiskers over thresholds and latencies: made once for a stimulus, used for every unit."""

    def __init__(self, copies: Copies, *, n_thresholds: int = 9, n_latencies: int = 13) -> None:
        self.copies = copies
        self.thresholds = np.linspace(*copies.thresholds(), n_thresholds)
        self.latencies = np.linspace(0.0, LATEST, n_latencies)
        # (I, J, W, K')
        self.hinges = np.array([copies.hinged(one, self.latencies).swapaxes(0, 1) for one in self.thresholds])
        centred = self.hinges - self.hinges.mean(-1, keepdims=True)
        gram = np.einsum("ijwk,ijvk->ijwv", centred, centred, optimize=True)
        self.centred, self.inverse = centred, np.linalg.pinv(gram, hermitian=True, rcond=1e-10)

    def start(self, rate: Array) -> tuple[float, float]:
        """Threshold and latency of the node whose columns explain most of the rate's variance.

        Parameters
        ----------
        rate : (K',) array
            Mean rate in the bins that count [Hz].

        Returns
        -------
        threshold, latency : float
            [m], [s].
        """
        product = self.centred @ rate
        explained = np.einsum("ijw,ijwv,ijv->ij", product, self.inverse, product)
        i, j = divmod(int(np.argmax(explained)), len(self.latencies))
        return float(self.thresholds[i]), float(self.latencies[j])


def _with_constant(columns: Array) -> Array:
    return np.vstack([np.ones(columns.shape[-1]), columns])


def _misfit(columns: Array, rate: Array, weights: Array) -> float:
    b = _solve(columns, weights) @ rate
    return float(weights @ (rate - b @ columns) ** 2)


def _solve(columns: Array, weights: Array) -> Array:
    """(W + 1, K') matrix that gives the coefficients of weighted least squares; columns that follow share a weight."""
    weighted = columns * weights
    scale = np.sqrt((weighted * columns).sum(1))
    scale = np.where(scale > 0, scale, 1.0)
    gram = weighted @ columns.T / np.outer(scale, scale)
    return (np.linalg.pinv(gram, hermitian=True, rcond=1e-10) @ (weighted / scale[:, None])) / scale[:, None]


def whisker_weights(grid: SurroundGrid, counts: Array, width: float, starts: Integers | None = None) -> Map:
    """Weight of each whisker in the rate of one unit.

    The rate of bin k is b + Σ_w g_w · mean over the bin of max(A_w(t − τ) − θ, 0), with one threshold and one latency
    for all whiskers. Least squares weighted by the inverse of the fitted rate, the variance of counts; weights may be
    negative. The error is that of the mean over trials or, where it is larger, that from pieces of the stimulus: a unit
    that answers something else, in every trial alike, pulls at the weights by chance. Where blocks of the stimulus are
    given, the error is that from these alone. θ's and τ's error is included.

    Parameters
    ----------
    grid : SurroundGrid
        The stimulus.
    counts : (N, K') array
        Counts of each trial in the bins that count; at least 2 trials, or blocks.
    width : float
        Width of a bin [s].
    starts : (M,) array of int, optional
        First bin of each block of the stimulus, where trials are too few to be the draws.

    Returns
    -------
    Map
        Where whiskers move exactly alike, their weight is shared out evenly among them.
    """
    rates = counts / width
    rate = rates.mean(0)
    threshold, latency = grid.start(rate)
    fitted = _fitted_rate(grid.copies, threshold, latency, rate)
    weights = 1 / np.maximum(fitted, 0.1 * rate.mean())
    threshold, latency, b, columns, slopes = _refined(grid, threshold, latency, rate, weights)
    whole = _solve(np.vstack([columns, slopes]), weights)
    error, free = _error(whole, rates, rate - b @ columns, width, starts)
    return Map(b[1:], error[1 : len(columns)], threshold, latency, columns[1:], free)


def _error(whole: Array, rates: Array, residual: Array, width: float, starts: Integers | None) -> tuple[Array, int]:
    """Error of the coefficients, and its degrees of freedom: of trials and pieces, or of the blocks given."""
    if starts is not None:
        return _misfit_error(whole, residual, starts), starts.size - 1
    of_trials = rates @ whole.T  # every trial's own estimate: the estimate is linear in the counts
    noise = of_trials.std(0, ddof=1) / np.sqrt(len(rates))
    pieces = even_starts(residual.size, max(min(round(BLOCK / width), residual.size // 2), 1))
    return np.maximum(noise, _misfit_error(whole, residual, pieces)), min(len(rates), pieces.size) - 1


def _misfit_error(whole: Array, residual: Array, starts: Integers) -> Array:
    """Error of the coefficients from pieces of the stimulus: what else the unit answers to does not differ by trial."""
    pulls = np.add.reduceat(whole * residual, starts, axis=1)
    free = residual.size - len(whole)
    return np.sqrt((pulls**2).sum(1) * residual.size / max(free, 1))


def _fitted_rate(copies: Copies, threshold: float, latency: float, rate: Array) -> Array:
    columns = _with_constant(copies.hinged(threshold, latency))
    return _solve(columns, np.ones(rate.size)) @ rate @ columns


def _refined(
    grid: SurroundGrid, threshold: float, latency: float, rate: Array, weights: Array
) -> tuple[float, float, Array, Array, Array]:
    """Gauss and Newton from a node; a step that does not gain is halved. Last, the change with θ and τ."""
    least = np.array([grid.thresholds[0], grid.latencies[0]])
    most = np.array([grid.thresholds[-1], grid.latencies[-1]])
    at = np.array([threshold, latency])
    columns = _with_constant(grid.copies.hinged(*at))
    b = _solve(columns, weights) @ rate
    lost = float(weights @ (rate - b @ columns) ** 2)
    slopes = _slopes(grid.copies, at, most - least, b)
    for _ in range(_STEPS):
        # the rate is linear in the whiskers' weights, which follow by least squares: steps are of θ and τ alone
        step = (_solve(np.vstack([columns, slopes]), weights) @ rate)[-2:]
        found = lost
        for share in (1.0, 0.5, 0.25, 0.1):
            there = np.clip(at + share * step, least, most)
            columns_there = _with_constant(grid.copies.hinged(*there))
            found = _misfit(columns_there, rate, weights)
            if found < lost:
                break
        if not found < lost * (1 - 1e-6):
            break
        at, lost, columns = there, found, columns_there
        b = _solve(columns, weights) @ rate
        slopes = _slopes(grid.copies, at, most - least, b)
    return float(at[0]), float(at[1]), b, columns, slopes


def _slopes(copies: Copies, at: Array, span: Array, b: Array) -> Array:
    """Change of the fitted rate with threshold and latency, by differences of 1 % of their ranges; (2, K')."""
    found = []
    for move in np.diag(0.01 * span):
        low, high = at - move, at + move
        low[1] = max(low[1], 0.0)
        change = copies.hinged(*high) - copies.hinged(*low)
        found.append(b[1:] @ change / (high - low).sum())
    return np.array(found)
