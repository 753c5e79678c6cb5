"""Names withheld from what does not swing though the pad does: fur of the cheek, and edges."""

from __future__ import annotations

import numpy as np

from vibrissa.video.link.agreed_names import Others
from vibrissa.video.link.chains.exclusion import ChainLabel, Solution
from vibrissa.video.link.estimation_rounds import SWINGING
from vibrissa.video.link.pad.pads import parabola_weights
from vibrissa.video.link.whisker_linking import Linking

CLEAR = 0.5  # probability from which on a line is a whisker's
MOVES = 0.25  # standard deviation of the place of a whisker's lines over that of the pad's swing there, at least


def without_still(linking: Linking) -> None:
    """Take away whiskers that do not swing with their pad where their lines are; these lines are nobody's then.

    While whiskers are looked for they stay, since they keep such lines from the others.

    Parameters
    ----------
    linking : Linking
        The movie; it is changed.
    """
    first = 0
    for solution in linking.solutions:
        still = [n for n, one in enumerate(solution.labels) if _still(solution, one)]
        for n in reversed(still):
            solution.labels.pop(n)
            solution.decided = {}
            if linking.others is not None:
                linking.others = _without(linking.others, first + n)
        first += len(solution.labels)


def _still(solution: Solution, one: ChainLabel) -> bool:
    """Whether a whisker's lines hardly move where they are, in frames in which the pad swings."""
    seen = one.seen[one.chance > CLEAR]
    if not seen.size or (swing := float(np.std(solution.phase[seen, 0]))) <= SWINGING:
        return False
    middle = np.median(solution.lines.reach[seen].mean(axis=1))
    at = parabola_weights(np.clip(middle, -1, 1)[None])[0]
    return bool(np.std(solution.lines.place[seen] @ at) < MOVES * swing * (solution.lever @ at))


def _without(others: Others, number: int) -> Others:
    """Votes for a whisker are for nobody."""
    votes = np.delete(others.votes, number, axis=1)
    votes[:, -1] += others.votes[:, number]
    return others._replace(votes=votes)
