"""Whiskers too many: those whose lines the others of the pad explain when they are taken away.

Where two whiskers touch, pieces of their lines look different from either, and may have been taken for a third one.
A whisker that exists is seen beside all others, which have lines of their own then: nobody else explains its lines. Two
that are seen in turn, or as pieces of one line, are one if a whisker fitted to the lines of both explains them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.chains.exclusion import ChainLabel, Solution
from vibrissa.video.link.chains.whisker_models import Model

LEFT = 0.5  # share of its lines that nobody else explains, below which a whisker is superfluous
TRIED = 0.7  # the same before the others have been fitted to these lines
CLEAR = 0.5  # probability from which on a line is a whisker's
TOGETHER = 0.05  # share of the frames of a whisker in which another one, if it is the same, is seen too
BY_CHANCE = 15.0  # frames in which two whiskers would be seen together by chance, from which on that says something
OVERLAP = 0.25  # share of the shorter of two lines that may lie beside the other, if they are pieces of one
NEAREST = 2  # whiskers that are tried as one with it


def without_superfluous(solution: Solution, refitted: Callable[[], list[Model]]) -> None:
    """Take away whiskers whose lines the others explain, those with few lines first.

    Parameters
    ----------
    solution : Solution
        Settled; it is changed.
    refitted : callable
        Gives the models of its labels fitted to their lines.
    """
    left = list(range(len(solution.labels)))
    for whisker in np.argsort([_support(one) for one in solution.labels], kind="stable"):
        number = left.index(whisker)
        before = [replace(one) for one in solution.labels]
        most, support = explained(solution), _support(solution.labels[number])
        take_away(solution, number)
        if most - explained(solution) < TRIED * support:
            solution.place(refitted())
            solution.settle()
            if most - explained(solution) < LEFT * support:
                left.remove(whisker)
                continue
        solution.labels = before
        if any(_are_one(solution, number, other, refitted) for other in _in_turn(solution, number)):
            left.remove(whisker)


def _in_turn(solution: Solution, number: int) -> list[int]:
    """Whiskers that are hardly ever seen beside one, though by chance they would be; the nearest first."""
    own = solution.labels[number]
    count = np.array([_support(one) for one in solution.labels])
    beside = np.array([_both(solution, own, one)[1] for one in solution.labels])
    off = np.array([abs(one.model.place[1] - own.model.place[1]) for one in solution.labels])
    turns = (beside <= TOGETHER * np.minimum(count, count[number])) & (np.arange(count.size) != number)
    found = np.flatnonzero(turns & (count * count[number] > BY_CHANCE * solution.frames))
    return [int(n) for n in found[np.argsort(off[found], kind="stable")][:NEAREST]]


def _both(solution: Solution, one: ChainLabel, other: ChainLabel) -> tuple[int, int]:
    """Frames in which two whiskers are seen, and those in which they are seen beside one another, not as two pieces."""
    lines = np.stack([seen_in(solution, label) for label in (one, other)], axis=1)
    pairs = lines[(lines >= 0).all(axis=1)]
    return len(pairs), int(np.count_nonzero(~pieces_of_one(solution.lines.reach[pairs])))


def seen_in(solution: Solution, one: ChainLabel) -> Integers:
    """Line that is clearly a whisker's in each frame (T,); −1 for none."""
    out, seen = np.full(solution.frames, -1), one.seen[one.chance > CLEAR]
    out[solution.frame[seen]] = seen
    return out


def pieces_of_one(reach: Array) -> Mask:
    """Whether two lines may be pieces of one, from their first and last distances (n, 2, 2)."""
    common = reach[:, :, 1].min(axis=1) - reach[:, :, 0].max(axis=1)
    return np.asarray(common <= OVERLAP * (reach[:, :, 1] - reach[:, :, 0]).min(axis=1))


def _are_one(solution: Solution, number: int, other: int, refitted: Callable[[], list[Model]]) -> bool:
    """Make two whiskers one if that one has most of the lines of both; the solution is changed only then."""
    before = [replace(one) for one in solution.labels]
    most, gone, kept = explained(solution), before[number], solution.labels[other]
    pieces, few = _both(solution, gone, kept)[0], min(_support(gone), _support(kept))
    kept.seen, at = np.unique(np.concatenate([gone.seen, kept.seen]), return_inverse=True)
    kept.chance = np.zeros(kept.seen.size)
    np.maximum.at(kept.chance, at, np.concatenate([gone.chance, before[other].chance]))
    solution.labels.pop(number)
    solution.place(refitted())
    solution.settle()
    if most - pieces - explained(solution) < LEFT * few:
        return True
    solution.labels, solution.decided = before, {}
    return False


def _support(one: ChainLabel) -> float:
    """Number of lines that are clearly a whisker's."""
    return float(np.count_nonzero(one.chance > CLEAR))


def explained(solution: Solution) -> float:
    """Number of lines that are clearly somebody's."""
    return sum(map(_support, solution.labels))


def take_away(solution: Solution, number: int) -> None:
    """Take one whisker away and settle those that wanted lines of it."""
    gone = solution.labels.pop(number)
    solution.decided = {}
    solution.settle([n for n, one in enumerate(solution.labels) if np.isin(one.seen, gone.seen).any()])
