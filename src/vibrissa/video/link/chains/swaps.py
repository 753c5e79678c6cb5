"""Two whiskers that may have changed names: where they could have, and whether the rest of the movie says so.

Whiskers that meet can be confused from then on. The frames between two such meetings are a block. In every block
the difference of the two lines, in place and look, is the same vector, or its opposite where they are swapped.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.loops import njit

Values = NDArray[np.float64]

PLAIN = 10.0  # log odds against a swap above which there is none
PRIOR = 1.0  # log odds against a swap that nothing speaks for or against
ROUNDS = 6
STARTS = 4  # blocks whose difference is tried first
KEPT = 60.0  # log odds that the heaviest block keeps its sign
LASTS = 60  # frames over which a slow drift is one and the same
FEW = 6  # frames of both whiskers below which nothing is tried
APART = np.array([0.3, 0.4])  # standard deviation of the two parts of a line's look
UNLIKE = np.diag([1e-6] * 3 + [1 / 0.25**2] * 6 + [1e-6] * 2)  # prior of the difference: that of the gains is 0.25


class Swap(NamedTuple):
    """Names of two whiskers over time.

    Attributes
    ----------
    frames : (n,) array of int
        Frames in which both are seen.
    chance : (n,) array
        Probability that they are swapped there.
    """

    frames: Integers
    chance: Array


class Wandering(NamedTuple):
    """How two whiskers stray from their places.

    Attributes
    ----------
    spread, slow : (3, 3) arrays
        Covariances of a deviation and of a slow drift.
    error : (2, n, 3, 3) array
        Of each reading of either; where a line is short, places beyond it are hardly known.
    keep : float
        Correlation of the deviation from frame to frame.
    alone : bool
        Whether each block is evidence independent of its neighbours: decisive, for a search; else what is
        sure of it, each block counting for the time that it takes.
    """

    spread: Array
    slow: Array
    error: Array
    keep: float
    alone: bool


def _steps(frame: Integers, one: Array, other: Array, known: Wandering) -> Array:
    """Log odds against a swap between each frame and the next, from deviations (n, 3) of both whiskers."""
    gap = np.diff(frame)
    k = known.keep**gap
    stray = known.spread * (1 - k**2)[:, None, None]
    of_one, of_other = known.error

    def far(a: Array, b: Array, before: Array, after: Array) -> Array:
        off = b[1:] - k[:, None] * a[:-1]
        cov = stray + before[:-1] * (k**2)[:, None, None] + after[1:]
        q = np.einsum("ni,nij,nj->n", off, np.linalg.inv(cov), off)
        return np.asarray(9 * np.log(1 + q / 6) + np.log(np.linalg.det(cov)))

    changed = far(one, other, of_one, of_other) + far(other, one, of_other, of_one)
    return np.asarray(0.5 * (changed - far(one, one, of_one, of_one) - far(other, other, of_other, of_other)))


@njit(cache=True)
def _either(a: float, b: float) -> float:
    """Logarithm of the sum of two chances, from their logarithms."""
    return max(a, b) + np.log1p(np.exp(-abs(a - b)))


@njit(cache=True)
def _ways(block: Values, cut: Values) -> tuple[Values, Values]:
    """Signs of blocks by Viterbi, and the log odds that each is swapped, from log odds for 'as named'."""
    n = block.size
    best, came = np.zeros((n, 2)), np.zeros((n, 2), np.int64)
    ahead, back = np.zeros((n, 2)), np.zeros((n, 2))
    sign, signs, odds = np.zeros(n, np.int64), np.zeros(n), np.zeros(n)
    for b in range(n):
        for k in range(2):
            own, cost = (0.5 - k) * block[b], cut[b - 1] if b else 0.0
            stays, comes = best[b - 1, k], best[b - 1, 1 - k] - cost
            came[b, k] = k if stays > comes or (stays == comes and k == 0) else 1 - k
            best[b, k] = own + (max(stays, comes) if b else 0.0)
            ahead[b, k] = own + (_either(ahead[b - 1, k], ahead[b - 1, 1 - k] - cost) if b else 0.0)
    for b in range(n - 2, -1, -1):
        for k in range(2):
            stays, goes = back[b + 1, k] + (0.5 - k) * block[b + 1], back[b + 1, 1 - k] + (k - 0.5) * block[b + 1]
            back[b, k] = _either(stays, goes - cut[b])
    sign[n - 1] = 1 if best[n - 1, 1] > best[n - 1, 0] else 0
    for b in range(n - 1, 0, -1):
        sign[b - 1] = came[b, sign[b]]
    for b in range(n):
        signs[b] = 1.0 - 2.0 * sign[b]
        odds[b] = (ahead[b, 1] + back[b, 1]) - (ahead[b, 0] + back[b, 0])
    return signs, odds


def _chain(block: Array, cut: Array) -> tuple[Array, Array]:
    """Signs of blocks, and the probability that each is swapped, from log odds for 'as named'."""
    sign, odds = _ways(block, cut)
    return sign, 1 / (1 + np.exp(-np.clip(odds, -40, 40)))


def swap_of(
    frame: Integers,
    one: Array,
    other: Array,
    unlike: Array,
    known: Wandering,
    phase: Array,
    plain: Array,
) -> Swap | None:
    """Where two whiskers are swapped.

    Parameters
    ----------
    frame : (n,) array of int
        Frames in which both are seen.
    one, other : (n, 3) arrays
        Places of either at phase 0 [°], both with their mean gain.
    unlike : (n, 2) array
        Difference of the looks of their lines.
    known : Wandering
        How the whiskers stray.
    phase : (n, 2) array
        Phase of the pad and its quarter [°]: whiskers of unlike gains cross as it goes up and down.
    plain : (n − 1,) array
        Log odds against a swap that the lines' plain links add between each frame and the next.

    Returns
    -------
    Swap or None
        None where there is nothing to decide: too few frames, or no meeting.
    """
    if frame.size < FEW:
        return None
    middle = (np.median(one, axis=0) + np.median(other, axis=0)) / 2
    against = PRIOR + plain + _steps(frame, one - middle, other - middle, known)
    cuts = np.flatnonzero(against < PLAIN)
    if not cuts.size:
        return None
    number = np.searchsorted(cuts, np.arange(frame.size), side="left")
    apart = np.concatenate([one - other, unlike], axis=1)
    blocks = _blocks(number, frame, apart, phase, known)
    found = (_signs(blocks, against[cuts], start) for start in _starts(blocks))
    _, sign, chance = max(found, key=lambda one: one[0])
    if (blocks.size * sign).sum() < 0:
        chance = 1 - chance
    return Swap(frame, chance[number])


class Blocks(NamedTuple):
    """What the frames between two meetings say of the difference d + φ g of two whiskers, their looks' last.

    Attributes
    ----------
    size, phase : (b,) arrays
        Frames, and mean phase.
    weight, weighted : (b, 11, 11) and (b, 11) arrays
        Normal equations of (d, g, look), as if the names were right.
    """

    size: Array
    phase: Array
    weight: Array
    weighted: Array


def _blocks(number: Integers, frame: Integers, apart: Array, phase: Array, known: Wandering) -> Blocks:
    """Sums over the blocks."""
    size = np.bincount(number)
    span = np.diff(frame[np.searchsorted(number, np.arange(size.size))], append=frame[-1] + 1)
    each = _weights(size, span, number, known)
    design = np.zeros((frame.size, 5, 11))
    design[:, range(5), [0, 1, 2, 9, 10]] = 1.0
    design[:, range(3), range(3, 6)] = phase[:, :1]
    design[:, range(3), range(6, 9)] = phase[:, 1:]
    weighted = np.einsum("nij,nik->njk", design, each)
    weight, right = np.zeros((size.size, 11, 11)), np.zeros((size.size, 11))
    np.add.at(weight, number, weighted @ design)
    np.add.at(right, number, np.einsum("njk,nk->nj", weighted, apart))
    return Blocks(size.astype(float), np.bincount(number, phase[:, 0]) / size, weight, right)


def _starts(blocks: Blocks) -> list[Array]:
    """First signs of the blocks: as one of the largest says, and where whiskers of unlike gains would cross."""
    crossing = np.where(blocks.phase >= np.median(blocks.phase), 1.0, -1.0)
    out = [crossing, (-1.0) ** np.arange(crossing.size)]
    for start in np.argsort(-blocks.size)[:STARTS]:
        apart = np.linalg.solve(blocks.weight[start] + UNLIKE, blocks.weighted[start])
        out.append(np.where(blocks.weighted @ apart >= 0, 1.0, -1.0))
    return out


def _weights(size: Integers, span: Integers, number: Integers, known: Wandering) -> Array:
    """What each reading (n, 5, 5) adds to the inverse covariance of the mean difference over its block."""
    # readings of a block are not independent: the deviation lasts
    rate = (1 - known.keep) / (1 + known.keep)
    if known.alone:
        independent, drifts = np.maximum(size * rate, 1), np.maximum(size / LASTS, 1)
    else:
        independent, drifts = np.minimum(span * rate, size), np.minimum(span / LASTS, size)
    cov = np.zeros((number.size, 5, 5))
    as_one, drift = ((2 * size / few)[number, None, None] for few in (independent, drifts))
    cov[:, :3, :3] = known.spread * as_one + known.slow * drift + known.error.sum(axis=0)
    cov[:, [3, 4], [3, 4]] = as_one[:, 0] * APART**2 + 0.02 * size[number, None]
    return np.asarray(np.linalg.inv(cov), np.float64)


def _signs(blocks: Blocks, cut: Array, sign: Array) -> tuple[float, Array, Array]:
    """Score, signs and chances of blocks, from first signs."""
    left = blocks.weight.sum(axis=0) + UNLIKE
    for _ in range(ROUNDS):
        apart = np.linalg.solve(left, sign @ blocks.weighted)
        before, (sign, _) = sign, _chain(2 * blocks.weighted @ apart, cut)
        if (sign == before).all():
            break
    apart = np.linalg.solve(left, sign @ blocks.weighted)
    fit = float(apart @ left @ apart) / 2 - float(cut[np.diff(sign) != 0].sum())
    return fit, sign, _chain(_held_out(blocks, sign), cut)[1]


def _held_out(blocks: Blocks, sign: Array) -> Array:
    """Log odds of each block against the difference that all others show; the heaviest one keeps its sign."""
    weighted = sign[:, None] * blocks.weighted
    others = np.linalg.inv(blocks.weight.sum(axis=0) - blocks.weight + UNLIKE)
    apart = np.einsum("bij,bj->bi", others, weighted.sum(axis=0) - weighted)
    # that difference is uncertain, too
    heard = np.linalg.solve(np.eye(11) + blocks.weight @ others, blocks.weighted[..., None])[..., 0]
    odds = 2 * np.einsum("bi,bi->b", heard, apart)
    heaviest = np.argmax(np.trace(blocks.weight[:, :3, :3], axis1=1, axis2=2))
    odds[heaviest] = KEPT * sign[heaviest]
    return np.asarray(odds)


def confusable(place: Array, spread: Array) -> list[tuple[int, int]]:
    """Pairs of whiskers at places (n, 3) that are near enough to meet."""
    inverse = np.linalg.inv(spread)
    off = place[:, None] - place[None]
    far = np.einsum("abi,ij,abj->ab", off, inverse, off)
    return [(int(a), int(b)) for a, b in np.argwhere(np.triu(far < 60, 1))]


def swapped(chance: Array) -> Mask:
    """Frames in which the other names are likelier."""
    return np.asarray(chance > 0.5)
