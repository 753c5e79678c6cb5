"""How sure a name is: a logistic function of what is known of the line and of its whisker.

What is wrong are mostly names of whole whiskers, which no probability of a single frame shows. Its weights are those of
rendered movies whose whiskers are known (``benchmarks/identity_certainty.py``).
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.whisker_models import deviations

LEAST = 1e-6  # of a probability, and of its complement
FARTHEST = 20.0  # squared distance of a line from its whisker beyond which it says no more
MOST_TORN = 0.05  # rate of torn links likewise
WEIGHTS = np.array([-3.21, 0.0958, -43.7, -0.0705, 0.352, -0.32, 4.89])  # of 1, and of what :func:`evidence` gives
AGREED = np.array([1.35, 0.926])  # the same of 1, and of the log odds of the mean over several linkings
UNNAMED = 0.6  # what a linking that gives a line no name says for nobody's
WHOLE = np.array([1.0, 0.0, 1.0, 1.0, 1.0, 1.0])  # evidence times this is as if no link of the whisker were torn


def evidence(solution: Solution, whisker: int, seen: Integers, chance: Array, torn: float) -> Array:
    """What speaks for the name of each line.

    Parameters
    ----------
    solution : Solution
        Of the pad.
    whisker : int
        Whose lines they are.
    seen : (n,) array of int
        Segments.
    chance : (n,) array
        Probability of the name as far as its own frames and meetings with others say.
    torn : float
        Rate of torn links of the whisker.

    Returns
    -------
    (n, 6) array
        Log odds of ``chance``; rate of torn links; squared distance from the whisker's place; logarithm of the number
        of lines in its plain stretch, and of the whisker's spread [°]; share of the frames with lines in
        which the whisker has one.
    """
    model, lines = solution.labels[whisker].model, solution.lines
    chance = np.clip(chance, LEAST, 1 - LEAST)
    off = deviations(model, lines.place[seen], solution.phase[seen], solution.frame[seen])
    far = np.einsum("ni,nij,nj->n", off, np.linalg.inv(model.spread + lines.covariance[seen]), off)
    stretch = np.bincount(solution.tracklet[solution.tracklet >= 0], minlength=1)
    length = np.where(solution.tracklet[seen] >= 0, stretch[np.maximum(solution.tracklet[seen], 0)], 1)
    return np.stack(
        [
            np.log(chance / (1 - chance)),
            np.full(seen.size, min(torn, MOST_TORN)),
            np.minimum(far, FARTHEST),
            np.log(length),
            np.full(seen.size, np.log(np.trace(model.spread) / 3) / 2),
            np.full(seen.size, seen.size / np.unique(solution.frame[solution.who]).size),
        ],
        axis=1,
    )


def certainty(found: Array, weights: Array = WEIGHTS) -> Array:
    """Probability that names are right, from their :func:`evidence` (n, 6)."""
    return np.asarray(1 / (1 + np.exp(-weights[0] - found @ weights[1:])))


def agreement(mean: Array, weights: Array = AGREED) -> Array:
    """Probability that names are right, from the mean (n,) of what several linkings say."""
    mean = np.clip(mean, LEAST, 1 - LEAST)
    return np.asarray(1 / (1 + np.exp(-weights[0] - weights[1] * np.log(mean / (1 - mean)))))


def mean_of_agreement(sure: Array, weights: Array = AGREED) -> Array:
    """Mean (n,) of which :func:`agreement` makes these probabilities."""
    sure = np.clip(sure, LEAST, 1 - LEAST)
    return np.asarray(1 / (1 + np.exp((weights[0] - np.log(sure / (1 - sure))) / weights[1])))
