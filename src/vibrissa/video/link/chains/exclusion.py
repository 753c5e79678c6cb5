"""All whiskers of a pad at once: each is a chain over time, and a line belongs to one of them.

The chains exchange messages until they agree (belief propagation): each says how much it wants a line, and hears how
much the others do. What a chain says of the n lines of a plain stretch is mostly one decision: each counts 1/√n, but
1/6 at least, lest two whiskers share a long stretch (where three want two lines it still happens). One more
constraint changes few messages: only the chains that hear of a change are run again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.chain_kernel import LEAVES, LOSE, STAY, chances, edges, log_chance
from vibrissa.video.link.chains.swaps import Swap
from vibrissa.video.link.chains.whisker_models import Model, candidates, worth
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.phase import ALIKE, Along

SWEEPS = 6  # rounds of messages at most
SMALL = 0.15  # change of a message, over 1 more than it, that does not count
WANT = 300.0  # bound of a message, the logarithm of 1 more than odds
MOST = 36  # lines of a plain stretch from which on each counts no less
CERTAIN = 30.0  # what a line is worth more that a whisker surely has
DAMPED = 0.7  # share of a new message


@dataclass
class ChainLabel:
    """A whisker, its candidate lines, and the messages.

    Attributes
    ----------
    model : Model
        The whisker.
    seen, x, again, leaves, gain : (n,) arrays
        Candidate segments, their deviations (n, 3), log chances to come back there and to be lost from there, worth.
    steps : tuple of arrays
        Of :func:`vibrissa.video.link.chains.chain_kernel.edges`.
    chance, want : (n,) arrays
        Probabilities, and how much the chain wants each candidate: logarithm of 1 more than its odds.
    """

    model: Model
    seen: Integers
    x: Array
    again: Array
    leaves: Array
    gain: Array
    steps: tuple[Integers, Integers, Array]
    chance: Array
    want: Array


@dataclass
class Solution:
    """Whiskers of one pad and who wants which line; :meth:`settle` brings it to agreement.

    Attributes
    ----------
    frames : int
        Frames of the movie.
    frame : (S,) array
        Frame of each segment.
    lines : Lines
        All lines.
    who : (n,) array
        Segments of this pad.
    phase : (S, 2) array
        Phase of the pad in the frame of each segment, and its quarter [°].
    lever : (3,) array
        Expected gain of the pad's whiskers at the three radii.
    tracklet : (S,) array of int
        Stretch of plain links that each segment is in; −1 for none.
    along : Along
        How whiskers follow the phase by their place.
    labels : list of ChainLabel
        The whiskers.
    decided : dict
        Where two whiskers may be swapped, by their numbers and lines.
    bases_cross : bool
        Whether lines may begin on another whisker for long, so that bases say less of a swap.
    before, after : (S,) arrays of int
        Segment that plainly precedes and follows each; −1 for none.
    lasts : (S,) array of int
        Number of lines of the plain stretch that each segment is in; 1 where it is in none.
    """

    frames: int
    frame: Integers
    lines: Lines
    who: Integers
    phase: Array
    lever: Array
    tracklet: Integers
    along: Along = ALIKE
    labels: list[ChainLabel] = field(default_factory=list)
    decided: dict[tuple[int, int, int], Swap | None] = field(default_factory=dict)
    bases_cross: bool = False
    before: Integers = field(init=False, repr=False)
    after: Integers = field(init=False, repr=False)
    lasts: Integers = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Find the neighbours of each line in its plain stretch."""
        order = np.lexsort((self.frame, self.tracklet))
        order = order[self.tracklet[order] >= 0]
        plain = self.tracklet[order[1:]] == self.tracklet[order[:-1]]
        self.before, self.after = np.full((2, self.frame.size), -1)
        size = np.bincount(self.tracklet[order], minlength=1)
        self.lasts = np.where(self.tracklet >= 0, size[np.maximum(self.tracklet, 0)], 1)
        self.before[order[1:][plain]], self.after[order[:-1][plain]] = order[:-1][plain], order[1:][plain]

    @property
    def phases(self) -> Array:
        """Phase of the pad in every frame, and its quarter (frames, 2) [°]."""
        known, at = np.unique(self.frame, return_index=True)
        every = np.arange(self.frames)
        return np.stack([np.interp(every, known, one) for one in self.phase[at].T], axis=1)

    def copied(self) -> Solution:
        """The same, with labels and messages of its own."""
        labels = [replace(one) for one in self.labels]
        return replace(self, labels=labels, decided=dict(self.decided))

    def place(self, models: Sequence[Model]) -> None:
        """Set the whiskers."""
        self.labels = [self._label(model) for model in models]
        self.decided = {}

    def log_chance(self, model: Model, lines: Integers) -> float:
        """Logarithm of the chance of a chain that may have some lines and no others."""
        one = self._label(model, np.sort(lines))
        if not one.seen.size:
            return self.frames * float(STAY)
        missed = np.log(one.model.missed)
        return log_chance(self.frames, self.frame[one.seen], one.gain, one.again, one.leaves, *one.steps, missed)

    def visited(self, model: Model, own: Integers, free: Integers, more: float) -> tuple[Integers, Array]:
        """Lines that a chain may have beside those that it has.

        Parameters
        ----------
        model : Model
            The whisker.
        own, free : arrays of int
            Lines that it has, and others.
        more : float
            What the others are worth beyond what they would be while whiskers compete.

        Returns
        -------
        array of int, array
            Those of the others that are candidates, and their probabilities.
        """
        one = self._label(model, np.sort(np.concatenate([own, free])))
        if not one.seen.size:
            return one.seen, one.chance
        other, missed = ~np.isin(one.seen, own), np.log(one.model.missed)
        gain = one.gain + np.where(other, more, CERTAIN)
        chance, _ = chances(self.frames, self.frame[one.seen], gain, one.again, one.leaves, *one.steps, missed)
        return one.seen[other], chance[other]

    def _label(self, model: Model, who: Integers | None = None) -> ChainLabel:
        seen, x, again = candidates(model, self.lines, self.who if who is None else who, self.phase, self.frame)
        before, after = self.before[seen], self.after[seen]
        steps = edges(seen, self.frame, x, self.lines.covariance[seen], model.spread, model.keep, before, after)
        again, leaves = again - LEAVES * (before >= 0), LOSE - LEAVES * (after >= 0)
        gain = worth(model, self.lines.look[seen])
        return ChainLabel(model, seen, x, again, leaves, gain, steps, np.zeros(seen.size), np.zeros(seen.size))

    def _run(self, number: int) -> Integers:
        """Run one chain with what the others want; give the segments that it now wants otherwise."""
        one = self.labels[number]
        if not one.seen.size:
            return one.seen
        others = self._others_want(number)[one.seen]
        heard = -others / np.sqrt(np.minimum(self.lasts[one.seen], MOST))
        missed = np.log(one.model.missed)
        chance, odds = chances(
            self.frames, self.frame[one.seen], one.gain + heard, one.again, one.leaves, *one.steps, missed
        )
        one.chance = np.clip(chance, 0, 1)
        want = np.clip(np.logaddexp(0.0, odds + others), 0, WANT)
        want = DAMPED * want + (1 - DAMPED) * one.want
        changed = one.seen[np.abs(want - one.want) > SMALL * (1 + want)]
        one.want = want
        return np.asarray(changed)

    def _others_want(self, number: int) -> Array:
        """How much others than a whisker want each segment, at most (S,)."""
        out = np.zeros(self.frame.size)
        for other, one in enumerate(self.labels):
            if other != number:
                out[one.seen] = np.maximum(out[one.seen], one.want)
        return out

    def settle(self, first: Sequence[int] | None = None, sweeps: int = SWEEPS) -> None:
        """Exchange messages until they hardly change.

        Parameters
        ----------
        first : sequence of int, optional
            Whiskers that have changed; all if not given.
        sweeps : int
            Rounds at most.
        """
        due = set(range(len(self.labels)) if first is None else first)
        candidate = np.zeros((len(self.labels), self.frame.size), np.bool_)
        for number, label in enumerate(self.labels):
            candidate[number, label.seen] = True
        for _ in range(sweeps):
            heard: set[int] = set()
            for number in sorted(due):
                changed = self._run(number)
                heard |= set(np.flatnonzero(candidate[:, changed].any(axis=1)).tolist()) - {number}
            due = heard
            if not due:
                return
