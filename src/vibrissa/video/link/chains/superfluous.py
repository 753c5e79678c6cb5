"""Whiskers too many: those whose lines the others of the pad explain when they are taken away.

Where two whiskers touch, pieces of their lines look different from either, and may have been taken for a third one.
A whisker that exists is seen beside all others, which have lines of their own then: nobody else explains its lines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vibrissa.video.link.chains.exclusion import ChainLabel, Solution
from vibrissa.video.link.chains.whisker_models import Model

LEFT = 0.5  # share of its lines that nobody else explains, below which a whisker is superfluous
TRIED = 0.7  # the same before the others have been fitted to these lines
CLEAR = 0.5  # probability from which on a line is a whisker's


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
        before, wanted = [replace(one) for one in solution.labels], solution.wanted.copy()
        most, support = _explained(solution), _support(solution.labels[number])
        _take_away(solution, number)
        if most - _explained(solution) < TRIED * support:
            solution.place(refitted())
            solution.settle()
            if most - _explained(solution) < LEFT * support:
                left.remove(whisker)
                continue
        solution.labels, solution.wanted = before, wanted


def _support(one: ChainLabel) -> float:
    """Number of lines that are clearly a whisker's."""
    return float(np.count_nonzero(one.chance > CLEAR))


def _explained(solution: Solution) -> float:
    """Number of lines that are clearly somebody's."""
    return sum(map(_support, solution.labels))


def _take_away(solution: Solution, number: int) -> None:
    """Take one whisker away and settle those that wanted lines of it."""
    gone = solution.labels.pop(number)
    solution.wanted[gone.seen] -= gone.want
    solution.decided = {}
    solution.settle([n for n, one in enumerate(solution.labels) if np.isin(one.seen, gone.seen).any()])
