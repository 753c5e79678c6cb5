"""The names on which several linkings agree, and how sure they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.quantities.identity import SURE
from vibrissa.video.link.certainty import agreement
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.identities import ABSENT, OVERLAP, SHARED, TORN, UNSURE, Names

STRETCH = 1 / 3  # weight of all lines of a plain stretch in what is said of each
SAID = 0.1  # mean probability from which on a line is perhaps a whisker's that has none in the frame


class Agreed(NamedTuple):
    """What several linkings say of the same lines together.

    Attributes
    ----------
    whisker : (S,) array of int
        The whisker that most of them take each line for, −1 for nobody's.
    said : (S, whiskers + 1) array
        Mean of their probabilities that each line is each whisker's, or nobody's.
    """

    whisker: Integers
    said: Array


def agreed(names: Names, solution: Solution, common: Agreed) -> Names:
    """Names on which several linkings of the same lines agree.

    How sure a name is follows from the mean of what the linkings say, two thirds for the line itself and one for all
    lines of its plain stretch. A line has no name if a likelier line with that name lies beside it.

    Parameters
    ----------
    names : Names
        Of one linking.
    solution : Solution
        What they were made from.
    common : Agreed
        Of the same pad.

    Returns
    -------
    Names
        ``whisker`` and ``sure`` are those agreed on; the rest follows. ``evidence`` is as before.
    """
    if not len(names.main):
        return names
    frame, every = solution.frame, np.arange(solution.frame.size)
    said = (1 - STRETCH) * common.said + STRETCH * _of_stretches(common.said, solution.tracklet)
    whisker = common.whisker.copy()
    likely = said[every, whisker]
    whisker[_beside_likelier(whisker, frame, solution.lines.reach, likely)] = -1
    perhaps = np.zeros(names.chance.shape)
    np.maximum.at(perhaps.T, frame, said[:, :-1])
    return _with(names, frame, whisker, np.where(whisker >= 0, agreement(likely), 0.0), perhaps > SAID)


def _of_stretches(said: Array, stretch: Integers) -> Array:
    """Mean over the lines of each one's plain stretch; a line in none (−1) is its own."""
    alone = stretch < 0
    number = np.where(alone, stretch.max(initial=-1) + 1 + np.arange(stretch.size), stretch)
    lines = np.bincount(number)
    sums = np.stack([np.bincount(number, one, lines.size) for one in said.T], axis=1)
    return np.asarray(sums[number] / lines[number, None])


def _beside_likelier(whisker: Integers, frame: Integers, reach: Array, likely: Array) -> list[int]:
    """Lines beside a likelier one with the same name in the same frame: a whisker is not in two places."""
    named = np.flatnonzero(whisker >= 0)
    order = named[np.lexsort((-likely[named], frame[named], whisker[named]))]
    new = (np.diff(whisker[order]) != 0) | (np.diff(frame[order]) != 0)
    starts = np.flatnonzero(np.concatenate([[True], new]))
    out: list[int] = []
    for first, stop in zip(starts, [*starts[1:], order.size], strict=True):
        kept = [int(order[first])] if stop > first + 1 else []
        for one in order[first + 1 : stop]:
            beside = any(_overlap(reach[one], reach[other]) > OVERLAP for other in kept)
            (out if beside else kept).append(int(one))
    return out


def _overlap(first: Array, second: Array) -> float:
    """Share of the shorter of two ranges that lies in the other one."""
    (a, b), (c, d) = first, second
    return float((min(b, d) - max(a, c)) / min(b - a, d - c))


def _with(names: Names, frame: Integers, whisker: Integers, sure: Array, perhaps: Mask) -> Names:
    """The same for other names of the lines; ``perhaps`` is where a whisker may have one that has none."""
    main, chance = np.full_like(names.main, -1), np.full_like(names.chance, np.nan)
    order = np.argsort(sure, kind="stable")
    order, before = order[whisker[order] >= 0], names.main[names.main >= 0]
    # the likeliest piece, but the same as before if that has kept its name
    for some in (order, before[whisker[before] == names.whisker[before]]):
        main[whisker[some], frame[some]] = some
    seen = main >= 0
    chance[seen] = sure[main[seen]]
    reason = np.where((names.reason == SHARED) & ~seen, SHARED, np.where(perhaps, UNSURE, ABSENT))
    unsure = np.where(names.reason == TORN, TORN, UNSURE)
    reason[seen] = np.where(chance[seen] >= SURE, 0, unsure[seen])
    shared = (names.also >= 0) & (names.also != whisker) & (main[names.also, frame] < 0)
    return Names(whisker, np.where(shared, names.also, -1), sure, main, chance, reason, names.evidence)
