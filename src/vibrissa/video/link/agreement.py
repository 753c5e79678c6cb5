"""What several linkings of a movie say of each line, though each has cut lines and numbered whiskers its own way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.agreed_names import Others
from vibrissa.video.link.certainty import UNNAMED
from vibrissa.video.link.whisker_linking import Linking


class CutLinking(NamedTuple):
    """A linking, and which point of the lines before they were cut each point of its lines is."""

    linking: Linking
    points: Integers


class PointNames(NamedTuple):
    """Whisker of each point before lines were cut (P,), −1 for none, and its probability (P,)."""

    whisker: Integers
    sure: Array


def best_and_others(each: list[CutLinking], count: int) -> int:
    """Give the linking in which most points probably have the right name what the others say.

    Parameters
    ----------
    each : list of CutLinking
        Linkings of the same lines; the best is changed.
    count : int
        Points of these lines.

    Returns
    -------
    int
        Which one is the best.
    """
    said = [names_of_points(one, count) for one in each]
    best = int(np.argmax([((2 * one.sure - 1) * (one.whisker >= 0)).sum() for one in said]))
    mine, linking, points = said[best], each[best].linking, each[best].points
    size, names = linking.pieces.stop - linking.pieces.start, linking.whiskers + 1
    line, votes = np.repeat(np.arange(size.size), size), np.zeros((size.size, names))
    for n in np.delete(np.arange(len(each)), best):
        whisker, sure = renamed(said[n], mine, each[n].linking.whiskers, linking.whiskers)
        chance = np.where(whisker >= 0, sure, UNNAMED)[points]
        column = np.where(whisker >= 0, whisker, linking.whiskers)[points]  # the last is nobody's
        votes += np.bincount(line * names + column, chance, votes.size).reshape(votes.shape) / size[:, None]
    linking.others = Others(votes, len(each) - 1)
    return best


def names_of_points(one: CutLinking, count: int) -> PointNames:
    """What a linking says of each point; points that it has left out are nobody's.

    Parameters
    ----------
    one : CutLinking
        The linking.
    count : int
        Points before lines were cut.

    Returns
    -------
    PointNames
        Its whiskers are numbered through over the pads.
    """
    identity, pieces = one.linking.identity(), one.linking.pieces
    whisker, sure, size = np.full(count, -1), np.zeros(count), pieces.stop - pieces.start
    whisker[one.points] = np.repeat(identity.segment_whisker.values, size)
    sure[one.points] = np.repeat(identity.segment_probability.values, size)
    return PointNames(whisker, sure)


def renamed(other: PointNames, mine: PointNames, others: int, whiskers: int) -> PointNames:
    """The same with the numbers of another linking, which has most points in common under the same name.

    Parameters
    ----------
    other, mine : PointNames
        What two linkings say of the same points.
    others, whiskers : int
        How many whiskers they have.

    Returns
    -------
    PointNames
        What ``other`` says of the whiskers of ``mine``; −1 for whiskers that ``mine`` does not have.
    """
    both = (other.whisker >= 0) & (mine.whisker >= 0)
    common = np.zeros((others, whiskers))
    np.add.at(common, (other.whisker[both], mine.whisker[both]), (other.sure * mine.sure)[both])
    return PointNames(numbers_in_common(common)[other.whisker], other.sure)


def numbers_in_common(common: Array) -> Integers:
    """Number in one linking of each whisker of another: the two that have most in common are one.

    Parameters
    ----------
    common : (n, m) array
        How much each whisker of the other has in common with each of the one.

    Returns
    -------
    (n + 1,) array of int
        −1 for a whisker that has nothing in common with its counterpart; the last, for −1, is nobody's.
    """
    number = np.full(len(common) + 1, -1)
    for one, same in zip(*linear_sum_assignment(-common), strict=True):
        number[one] = same if common[one, same] else -1
    return number
