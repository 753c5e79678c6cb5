"""Many lines marked at once, as a whisker's, as nobody's, or as a new whisker's, in a copy of a solution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.exclusion import ChainLabel, Solution
from vibrissa.video.link.chains.whisker_models import KEEP, LOOK, Model, prior_spread

MISSED = 0.2  # chance that a new whisker has no line in a frame


def with_marks(solution: Solution, marks: Mapping[int, int], lever: Array, born: Sequence[int] = ()) -> Solution:
    """A solution with more marks, settled; the one given is not changed.

    Parameters
    ----------
    solution : Solution
        Of a pad.
    marks : mapping
        Number of the whisker in the pad by segment, −1 for nobody's; earlier marks of these segments are replaced.
    lever : (3,) array
        Expected gain of the pad's whiskers.
    born : sequence of int
        Segments of one more whisker, which gets the next number; none by default.

    Returns
    -------
    Solution
        A copy.
    """
    made = solution.copied()
    labels = made.labels
    made.marks = {**solution.marks, **marks, **dict.fromkeys(born, len(labels))}
    due = {k for k, one in enumerate(labels) if np.isin(one.seen, [*marks, *born]).any()}
    for k in {k for k in marks.values() if k >= 0}:
        labels[k] = _renewed(made, k)
        due.add(k)
    if born:
        due.add(len(labels))
        labels.append(made._label(len(labels), _model(made, np.array(born), lever)))
    made.settle(sorted(due))
    return made


def _renewed(solution: Solution, number: int) -> ChainLabel:
    """A chain whose marked lines are among its candidates, with the messages that it had."""
    before = solution.labels[number]
    label = solution._label(number, before.model)
    _, here, there = np.intersect1d(label.seen, before.seen, assume_unique=True, return_indices=True)
    label.want[here], label.chance[here] = before.want[there], before.chance[there]
    return label


def _model(solution: Solution, segments: Integers, lever: Array) -> Model:
    """A new whisker from lines of it; it swings like the whisker nearest to it."""
    place, phase = solution.lines.place[segments], solution.phase[segments]
    middle = np.median(place - phase[:, :1] * lever, axis=0)[1]
    near = sorted(solution.labels, key=lambda one: abs(float(one.model.place[1]) - middle))
    gain = near[0].model.gain if near else np.stack([lever, np.zeros(3)])
    look = np.median(solution.lines.look[segments], axis=0)
    where = np.asarray(np.median(place - phase @ gain, axis=0))
    return Model(where, gain, prior_spread(lever), KEEP, MISSED, look, 1.5 * LOOK)
