"""Lines that are one whisker's by what most linkings say: correlation clustering, as in [Bansal2004]_.

Linkings number whiskers each its own way and exchange some on the way. So they are not asked who a line is, but which
lines are the same whisker's. Two lines with one name in a linking attract each other, two with different names repel
each other, and the lines are divided so that as much attraction and as little repulsion as possible lies within the
parts. What one linking exchanges is outvoted there and then, and no linking decides how many whiskers there are.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers

LITTLE = 0.05  # weight of a name that is as likely wrong as right
ROUNDS = 40  # in which lines move and parts are put together, at most
EMPTY = 5  # parts that lines may begin anew in a round
GAIN = 1e-9  # that a move must bring


def consensus(label: Integers, sure: Array, stretch: Integers) -> Integers:
    """Divide lines into whiskers.

    Parameters
    ----------
    label : (linking, S) array of int
        Name of each line in each linking; −1 for none.
    sure : (linking, S) array
        Probability of that name.
    stretch : (S,) array of int
        Plain stretch of each line, −1 for none; lines of one stretch that have the same names stay together.

    Returns
    -------
    (S,) array of int
        Part of each line; −1 for those without any name.
    """
    part = np.full(stretch.size, -1)
    named = np.flatnonzero((label >= 0).any(axis=0))
    if not named.size:
        return part
    alone = stretch.max() + 1 + np.arange(stretch.size)
    key = np.vstack([np.where(stretch >= 0, stretch, alone), label])[:, named]
    names, element = np.unique(key, axis=1, return_inverse=True)
    weight = np.where(label >= 0, np.maximum(2 * sure - 1, LITTLE), 0.0)[:, named]
    mass = np.stack([np.bincount(element, one, names.shape[1]) for one in weight]).astype(np.float64)
    tries = [_divided(names[1:], mass, start) for start in names[1:]]
    part[named] = max(tries, key=lambda one: one[1])[0][element]
    return part


def shares(label: Integers, weight: Array, part: Integers, parts: int, names: int) -> Array:
    """How much of each name lies in each part (parts, names), for one linking."""
    some = label >= 0
    where = part[some] * names + label[some]
    return np.asarray(np.bincount(where, weight[some], parts * names).reshape(parts, names), np.float64)


def _divided(label: Integers, mass: Array, start: Integers) -> tuple[Integers, float]:
    """Parts of elements, beginning with the names that one linking gives them, and how well they agree."""
    part, names = np.unique(start, return_inverse=True)[1], int(label.max()) + 1
    order = np.argsort(-mass.sum(axis=0), kind="stable")
    for _ in range(ROUNDS):
        count = int(part.max()) + 1 + EMPTY
        table = _tables(label, mass, part, count, names)
        moved = _moves(label, mass, order, part, table, np.bincount(part, minlength=count))
        part = np.unique(part, return_inverse=True)[1]
        merged = _merged(_tables(label, mass, part, int(part.max()) + 1, names))
        part = merged[part]
        if not moved and merged.max() + 1 == merged.size:
            break
    table = _tables(label, mass, part, int(part.max()) + 1, names)
    return part, float(2 * (table**2).sum() - (table.sum(axis=2) ** 2).sum())


def _tables(label: Integers, mass: Array, part: Integers, parts: int, names: int) -> Array:
    """:func:`shares` of all linkings (linking, parts, names)."""
    return np.stack([shares(one, m, part, parts, names) for one, m in zip(label, mass, strict=True)])


def _merged(table: Array) -> Integers:
    """New number of each part, put together as long as two attract each other, those that do so most first."""
    total, number = table.sum(axis=2), np.arange(table.shape[1])
    draw = 2 * np.einsum("lpn,lqn->pq", table, table) - total.T @ total
    np.fill_diagonal(draw, -np.inf)
    while number.size:
        one, other = np.unravel_index(draw.argmax(), draw.shape)
        if draw[one, other] <= GAIN:
            break
        draw[one] += draw[other]
        draw[:, one] = draw[one]
        draw[other] = draw[:, other] = draw[one, one] = -np.inf
        number[number == other] = one
    return np.asarray(np.unique(number, return_inverse=True)[1], np.int64)


@njit(cache=True)
def _moves(
    label: NDArray[np.int64],
    mass: NDArray[np.float64],
    order: NDArray[np.int64],
    part: NDArray[np.int64],
    table: NDArray[np.float64],
    count: NDArray[np.int64],
) -> int:
    """Move each element in turn to the part that attracts it most, or to an empty one; how many moved."""
    linkings, parts, _ = table.shape
    total, moved = table.sum(axis=2), 0
    for i in order:
        own, gain = part[i], np.zeros(parts)
        for n in range(linkings):
            name, m = label[n, i], mass[n, i]
            if name >= 0:
                table[n, own, name] -= m
                total[n, own] -= m
                gain += m * (2 * table[n, :, name] - total[n])
        count[own] -= 1
        best = int(gain.argmax())
        if gain[own] > gain[best] - GAIN:
            best = own
        count[best] += 1
        part[i] = best
        moved += best != own
        for n in range(linkings):
            if label[n, i] >= 0:
                table[n, best, label[n, i]] += mass[n, i]
                total[n, best] += mass[n, i]
    return moved
