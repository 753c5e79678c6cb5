"""One name for each line from what several linkings say of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.quantities.identity import SURE
from vibrissa.video.link.certainty import UNNAMED, agreement
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.identities import ABSENT, OVERLAP, SHARED, TORN, UNSURE, Names

STRETCH = 1 / 3  # weight of all lines of a plain stretch in what is said of each
SAID = 0.1  # mean probability from which on a line is perhaps a whisker's that has none in the frame


class Others(NamedTuple):
    """What other linkings of the same lines say.

    Attributes
    ----------
    votes : (S, whiskers + 1) array
        Sum of their probabilities that each segment is each whisker's, or nobody's.
    linkings : int
        How many they are.
    """

    votes: Array
    linkings: int


def agreed(names: Names, solution: Solution, others: Others) -> Names:
    """Names on which several linkings of the same lines agree most.

    Each gives a line its probability to be a whisker's, or to be nobody's if it has no name there. What counts is the
    mean over the linkings, two thirds for the line itself and one for all lines of its plain stretch. The line gets the
    name with the largest, unless nobody's is larger, or a likelier line with that name lies beside it.

    Parameters
    ----------
    names : Names
        Of one linking.
    solution : Solution
        What they were made from.
    others : Others
        Of the same pad.

    Returns
    -------
    Names
        ``sure`` is made from the mean; the rest follows. ``evidence`` is as before.
    """
    if not len(names.main):
        return names
    frame, every = solution.frame, np.arange(solution.frame.size)
    said = others.votes + said_by(names)
    said = ((1 - STRETCH) * said + STRETCH * _of_stretches(said, solution.tracklet)) / (others.linkings + 1)
    best = said[:, :-1].argmax(axis=1)
    likely = said[every, best]
    whisker = np.where(likely > said[:, -1], best, -1)
    whisker[_beside_likelier(whisker, frame, solution.lines.reach, likely)] = -1
    sure = agreement(likely)
    perhaps = np.zeros(names.chance.shape)
    np.maximum.at(perhaps.T, frame, said[:, :-1])
    return _with(names, frame, whisker, np.where(whisker >= 0, sure, 0.0), perhaps > SAID)


def said_by(names: Names) -> Array:
    """What one linking says of each line: its probability to be each whisker's, or nobody's (S, whiskers + 1)."""
    said = np.zeros((names.whisker.size, len(names.main) + 1))
    said[np.arange(names.whisker.size), names.whisker] = np.where(names.whisker >= 0, names.sure, UNNAMED)
    return said


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
