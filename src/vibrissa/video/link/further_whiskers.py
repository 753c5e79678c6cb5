"""Whiskers that nobody was named after: found among the lines that have no name once several linkings agree.

A linking of whiskers that drift as far as they are apart has few whiskers, lest they compete for lines. Those left out
are looked for where nobody competes any more. Lines of a known whisker that were not named must not become a second
one: what is found is a whisker only if the known ones are seen beside it as often as apart from it.
"""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.agreed_names import Others, said_by
from vibrissa.video.link.certainty import mean_of_agreement
from vibrissa.video.link.chains.drift import with_drift
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.superfluous import pieces_of_one, without_superfluous
from vibrissa.video.link.chains.swap_moves import unswap
from vibrissa.video.link.estimation_rounds import SETTLED, refitted, thinned
from vibrissa.video.link.identities import Names, names_of
from vibrissa.video.link.starts.whisker_discovery import SUPPORT, best_groups
from vibrissa.video.link.whisker_linking import Linking

ROUNDS = 4  # in which the whiskers and their lines are estimated in turn
SEEN = 0.1  # share of the frames in which a further whisker has a line at least
LIKELY = 0.2  # mean probability of its names, at least
LONG = 0.85  # median length of its lines over half the radii's distance, at least: hairs are shorter
OFTEN = 0.3, 0.5, 0.5  # share of the frames and mean probability from which on a shorter one is no hair, and its length
RIGHT = 0.5, 0.3  # share of names that are right (0.69 of 639 in rendered movies), and its growth with what they say
BESIDE = 0.6  # frames in which a known whisker is seen beside it, over those by chance, at least
BY_CHANCE = 5.0  # frames from which on that says something
PIECES = 0.8  # share of its lines that are seen where a known whisker's line ends, from which on they are its pieces


def name_further_whiskers(linking: Linking) -> None:
    """Give a name to lines without one where they are plainly those of further whiskers.

    Parameters
    ----------
    linking : Linking
        With what other linkings say; further whiskers are added to it. Names that lines have stay.
    """
    first = 0
    for number, (solution, known) in enumerate(zip(linking.solutions, linking.names(), strict=True)):
        count = len(solution.labels)
        found = _looked_for(linking, number, known.whisker < 0)
        theirs = names_of(found, found.lever)
        kept = [n for n in range(len(found.labels)) if _is_one(solution, known, theirs, n)]
        if kept:
            _add(linking, number, first, found, theirs, kept)
        first += count + len(kept)


def _looked_for(linking: Linking, number: int, free: Mask) -> Solution:
    """Whiskers of a pad to which its lines without a name may belong; nobody else competes for these."""
    known, pieces = linking.solutions[number], linking.pieces
    who, along = known.who[free[known.who]], known.along
    name = np.full(free.size, -1)
    plain = who[known.tracklet[who] >= 0]
    name[plain] = np.unique(known.tracklet[plain], return_inverse=True)[1]
    found = Solution(known.frames, pieces.frame, known.lines, who, known.phase, known.lever, name, along)
    given = known.lines, known.phase, known.lever, along
    models = best_groups(found.frame, name, *given, SUPPORT * known.frames) if plain.size else []
    for again in range(ROUNDS):
        found.place(models)
        found.settle()
        unswap(found, found.lever)
        models = refitted(found, found.lever, along)
        if again >= SETTLED:
            models = with_drift(found, models)
        models = thinned(found, models, found.frames)
    found.place(models)
    found.settle()
    without_superfluous(found, lambda: refitted(found, found.lever, along))
    return found


def _is_one(known: Solution, names: Names, theirs: Names, number: int) -> bool:
    """Whether a whisker found is none of the known ones of the pad."""
    frame, reach = known.frame, known.lines.reach
    own = np.flatnonzero(theirs.whisker == number)
    seen, sure = np.unique(frame[own]).size / known.frames, theirs.sure[own].mean() if own.size else 0.0
    if seen < SEEN or sure < LIKELY:
        return False
    often, likely, short = OFTEN
    if np.median(np.ptp(reach[own], axis=1)) < (short if seen >= often and sure >= likely else LONG):
        return False
    here = np.isin(np.arange(known.frames), frame[own])
    for n in range(len(known.labels)):
        lines = np.flatnonzero(names.whisker == n)
        there = np.isin(np.arange(known.frames), frame[lines])
        by_chance = here.sum() * there.sum() / known.frames
        if by_chance > BY_CHANCE and (here & there).sum() < BESIDE * by_chance:
            return False
        if _pieces(frame, reach, own, lines) > PIECES:
            return False
    return True


def _pieces(frame: Integers, reach: Array, own: Integers, others: Integers) -> float:
    """Share of lines beside which another one of some lines ends or begins."""
    one, other = np.nonzero(frame[own, None] == frame[others])
    pairs = reach[np.stack([own[one], others[other]], axis=1)]
    return np.unique(one[pieces_of_one(pairs)]).size / own.size


def _add(linking: Linking, number: int, first: int, found: Solution, theirs: Names, kept: list[int]) -> None:
    """Add whiskers to a pad in the order of their places; ``first`` is the number of its first whisker in the movie."""
    solution, others, added = linking.solutions[number], linking.others, [found.labels[n] for n in kept]
    assert others is not None
    who, before, labels = solution.who, names_of(solution, solution.lever), [*solution.labels, *added]
    order = np.argsort([one.model.place[1] for one in labels], kind="stable")
    known, new = np.split(first + np.argsort(order), [len(solution.labels)])  # numbers of the whiskers
    solution.labels, solution.decided = [labels[n] for n in order], {}
    last = others.votes.shape[1] - 1 + len(added)  # nobody
    column = np.concatenate([np.arange(first), known, np.arange(first + len(labels), last + 1)])
    said = np.zeros((others.votes.shape[0], last + 1))
    said[:, column] = others.votes
    said[np.ix_(who, [*known, last])] += said_by(before)[who]
    for n, whisker in zip(kept, new, strict=True):
        own = np.flatnonzero(theirs.whisker == n)
        said[own] = 0.0
        said[own, whisker] = (others.linkings + 1) * mean_of_agreement(RIGHT[0] + RIGHT[1] * theirs.sure[own])
    # the linking itself now knows whiskers that the others do not: what all say together stays as it was
    after, pad = names_of(solution, solution.lever), [*range(first, first + len(labels)), last]
    said[np.ix_(who, pad)] -= said_by(after)[who]
    linking.others = Others(said, others.linkings)
