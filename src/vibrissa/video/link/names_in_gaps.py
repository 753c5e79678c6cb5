"""Names for lines that nobody has, where they fill a gap between the lines of one whisker.

While whiskers compete, a short visit to a few uncertain lines does not pay: most lines are no whisker's. Once all have
their names, few of the lines that are left are no whisker's where a whisker is missing and would be. That holds for
whiskers that are often missing, since they are faint or short; others are missing where another one hides them, and a
line there is as likely that one's.
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.identities import Names, with_named

LEFT = 1.0  # logarithm of how much rarer lines of no whisker are among those left than among all
LIKELY = 0.5  # probability from which on a line is in a gap of a whisker
FEWEST = 20  # lines of a whisker from which on its gaps are looked at
MOST = 0.6  # share of the frames in which it has a line, up to which they are
SURE = 0.6  # mean probability of its names from which on they are; of less sure whiskers half of these names are right
RIGHT = 0.85  # share of such names that is right: 0.82 of 90 in rendered movies, 0.88 of 1,204 in simulated pads


def named_in_gaps(names: Names, solution: Solution) -> Names:
    """Names of a pad, with those of lines that fill gaps of one whisker alone.

    Each whisker's chain is run once more over the lines that it has, which are certain now, and those that nobody has.

    Parameters
    ----------
    names : Names
        Of the pad; it is not changed.
    solution : Solution
        What they were made from.

    Returns
    -------
    Names
        The names that lines have stay. A name in a gap is as sure as those of its whisker are on average, at most
        ``RIGHT``.
    """
    chance = np.zeros((len(solution.labels), solution.frame.size))
    seen = (names.main >= 0).sum(axis=1)
    sure = np.where(names.main >= 0, names.chance, 0.0).sum(axis=1) / np.maximum(seen, 1)
    for n in np.flatnonzero((seen >= FEWEST) & (seen <= MOST * solution.frames) & (sure >= SURE)):
        segment, likely = _in_gaps(names, solution, int(n))
        chance[n, segment] = likely
    segment = np.flatnonzero((chance > LIKELY).sum(axis=0) == 1)
    whisker = chance[:, segment].argmax(axis=0) if segment.size else segment
    return with_named(names, solution.frame, segment, whisker, np.minimum(sure[whisker], RIGHT))


def _in_gaps(names: Names, solution: Solution, number: int) -> tuple[Integers, Array]:
    """Lines that nobody has in frames in which a whisker is missing, and their probabilities to be its."""
    main, who = names.main[number], solution.who
    free = who[(names.whisker[who] < 0) & (main[solution.frame[who]] < 0)]
    return solution.visited(solution.labels[number].model, main[main >= 0], free, LEFT)
