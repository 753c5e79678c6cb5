"""Names for lines that begin where one whisker alone does, though they are nowhere near its usual place further out.

A pole bends a whisker far from where it swings, and its line is no candidate then. But its base does not move: a long
line that begins there, in a frame in which the whisker has no other, can be no other whisker's.
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.identities import Names, with_named

APART = 3.0  # standard deviations from where a whisker begins within which a line begins there
LONG = 0.5  # length of a line over that of the whisker's other lines, at least
OFTEN = 20  # lines of a whisker from which on it is known where it begins
STEADY = 4.0  # scatter of where its lines begin at most [px]
SURE = 0.9  # mean probability of its names at least
READ = 1.0  # standard deviation of where a line begins at least [px]
RIGHT = 0.85  # what such a name is called sure; set, not fitted


def named_by_base(names: Names, solution: Solution, base: Array) -> Names:
    """Names of a pad, with those of lines that begin where one lost whisker alone does.

    Parameters
    ----------
    names : Names
        Of the pad; it is not changed.
    solution : Solution
        What they were made from.
    base : (S, 2) array
        Where each line begins, along the pad's radius and across it [px].

    Returns
    -------
    Names
        The names that lines have stay.
    """
    if not solution.labels:
        return names
    frame, who, own = solution.frame, solution.who, [names.whisker == n for n in range(len(solution.labels))]
    each = [_begins(base, solution.phase, one) for one in own]
    begins = np.array([one for one, _ in each]).reshape(len(own), frame.size)
    plain = np.array([steady and names.sure[one].mean() >= SURE for (_, steady), one in zip(each, own, strict=True)])
    owner = begins.argmax(axis=0)
    free = who[(names.whisker[who] < 0) & (begins.sum(axis=0)[who] == 1)]
    free = free[plain[owner[free]] & (names.main[owner[free], frame[free]] < 0)]
    free = free[_long(solution, names.whisker, free, owner[free])]
    pairs, count = np.unique(np.stack([owner[free], frame[free]]), axis=1, return_counts=True)
    alone = {(n, t) for n, t in pairs[:, count == 1].T.tolist()}
    segment = np.array([s for s in free if (owner[s], frame[s]) in alone], np.int64)
    return with_named(names, frame, segment, owner[segment], RIGHT)


def _begins(base: Array, phase: Array, own: Mask) -> tuple[Mask, bool]:
    """Whether each line begins where a whisker does (S,), which may move with the pad; and if that is well known."""
    if np.count_nonzero(own) < OFTEN:
        return np.zeros(own.size, np.bool_), False
    terms = np.column_stack([np.ones(own.size), phase])
    off = base - terms @ np.linalg.lstsq(terms[own], base[own], rcond=None)[0]
    usual = 1.48 * np.median(np.abs(off[own]), axis=0)
    return np.asarray((np.abs(off) < APART * (usual + READ)).all(axis=1)), bool((usual < STEADY).all())


def _long(solution: Solution, whisker: Integers, some: Integers, owner: Integers) -> Mask:
    """Whether lines are long enough to be their owners'."""
    length: Array = np.ptp(solution.lines.reach, axis=1)
    usual = np.array(
        [np.median(length[whisker == n]) if (whisker == n).any() else np.inf for n in range(len(solution.labels))]
    )
    return np.asarray(length[some] >= LONG * usual[owner])
