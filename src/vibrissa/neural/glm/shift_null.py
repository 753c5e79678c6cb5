"""Chance of a whisker's term: its columns shifted circularly beside those of all other whiskers."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array
from vibrissa.neural.coupling.envelope_coupling import tail_p_value

LEFT = 0.7  # of the columns' size beyond the others', over that unshifted: with less, they run as another copy does
FEWEST = 100  # shifts that count as chance


def shift_p_values(columns: Array, response: Array, weights: Array, guard: int) -> Array:
    """p-value of each whisker's columns, from all shifts at which they cannot have driven the unit.

    What a unit answers in every trial alike, such as some other feature of the stimulus, goes with a whisker's columns
    by chance at every shift; the scatter between trials does not show it. The statistic is the weighted sum of squares
    that the columns explain of the response beyond those of the other whiskers, at every shift by the Fourier
    transform; of more than counting can tell, a tail. Shifts at which the columns coincide with another
    whisker's are left out: there they can explain nothing beyond it.

    Parameters
    ----------
    columns : (W, C, K) array
        Columns of each whisker in the bins that count.
    response : (K,) or (W, K) array
        The rate, or its logarithm to first order about a fit without each whisker, in any unit.
    weights : (K,) or (W, K) array
        Weight of each bin.
    guard : int
        Shifts left out on both sides of no shift [bins].

    Returns
    -------
    (W,) array
        Not adjusted over whiskers.
    """
    n_whiskers, _, n = columns.shape
    response, weights = (np.broadcast_to(one, (n_whiskers, n)) for one in (response, weights))
    found = []
    for whisker, own in enumerate(columns):
        others = np.delete(columns, whisker, axis=0).reshape(-1, n)
        explained, left = _explained(own, np.vstack([np.ones(n), others]), response[whisker], weights[whisker])
        found.append(p_of_shifts(explained, left, guard))
    return np.array(found)


def p_of_shifts(explained: Array, left: Array, guard: int, latest: int = 0) -> float:
    """p-value of what columns explain unshifted, from what they explain shifted.

    Parameters
    ----------
    explained : (K,) array
        Sum of squares explained beyond the others at every shift, from none.
    left : (K,) array
        Size of the columns beyond the others at every shift.
    guard : int
        Shifts left out on both sides of no shift: as long as a drive is like itself [bins].
    latest : int
        Further shifts left out there: as long as latencies are searched [bins].

    Returns
    -------
    float
        Between 0 and 1.
    """
    n = explained.size
    apart = np.abs((np.arange(n) + n // 2) % n - n // 2) > guard + latest
    chance = explained[apart & (left > LEFT * left[0])]
    chance = chance if chance.size >= FEWEST else explained[apart]
    return tail_p_value(float(explained[0]), chance)


def _explained(own: Array, others: Array, response: Array, weights: Array) -> tuple[Array, Array]:
    """Weighted sum of squares that columns explain beyond others at every shift, and their size beyond; (K,) each."""
    n, base = response.size, _orthonormal(others, weights)
    rest = response - (base * weights @ response) @ base
    x, w = np.fft.rfft(own), np.fft.rfft(weights)
    # sums over bins of weight · something(k) · column(k − s), for all shifts s at once
    pull = np.fft.irfft(np.fft.rfft(weights * rest) * x.conj(), n)
    first, second = np.triu_indices(len(own))
    products = np.fft.irfft(w * np.fft.rfft(own[first] * own[second]).conj(), n)
    within = np.fft.irfft(np.fft.rfft(weights * base)[:, None] * x.conj(), n)
    gram = np.empty((n, len(own), len(own)))
    for i, j, product in zip(first, second, products, strict=True):
        gram[:, i, j] = gram[:, j, i] = product - np.einsum("qk,qk->k", within[:, i], within[:, j])
    ridge = 1e-6 * np.trace(gram.mean(0)) / len(own) * np.eye(len(own))
    found = np.linalg.solve(gram + ridge, pull.T[..., None])[..., 0]
    return np.asarray((found * pull.T).sum(1)), np.asarray(np.einsum("ncc->n", gram))


def _orthonormal(columns: Array, weights: Array) -> Array:
    """Columns of the same span, orthonormal under the weights."""
    root = np.sqrt(weights)
    scaled = columns * root
    scaled = scaled / np.maximum(np.linalg.norm(scaled, axis=1, keepdims=True), 1e-300)
    _, values, rows = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(rows[values > 1e-8 * values[0]] / root)
