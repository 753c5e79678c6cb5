"""Decisions by hand as marks of the linker, so that the lines about them find their whiskers again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Integers
from vibrissa.video.correct.decisions import NOBODY, Linked
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.held_lines import with_marks
from vibrissa.video.link.identities import names_of
from vibrissa.video.link.whisker_linking import Linking

SAMPLED = 9  # lines of a decision that the linker hears of: the others are held all the same


class Chains(NamedTuple):
    """Chains of the linker.

    Attributes
    ----------
    solutions : tuple of Solution
        One for each pad.
    roster : tuple of (int, int)
        Pad of each whisker, and its number there.
    """

    solutions: tuple[Solution, ...]
    roster: tuple[tuple[int, int], ...]


def chains_of(linking: Linking) -> Chains:
    """Chains of a movie that is linked; whiskers are numbered as there."""
    roster = [(pad, k) for pad, one in enumerate(linking.solutions) for k in range(len(one.labels))]
    return Chains(tuple(linking.solutions), tuple(roster))


def sampled(frame: Integers, held: Integers, changed: Integers) -> dict[int, int]:
    """A few lines of what has been decided.

    Parameters
    ----------
    frame, held : (S,) arrays
        Frame of each segment, and what was decided of it.
    changed : (n,) array of int
        Segments of which it was decided anew.

    Returns
    -------
    dict
        Whisker of some segments, −1 for nobody's, evenly over the frames of each whisker.
    """
    found: dict[int, int] = {}
    value = np.maximum(held[changed], NOBODY)
    for one in np.unique(value):
        mine = changed[value == one]
        mine = mine[np.argsort(frame[mine], kind="stable")]
        few = mine[np.unique(np.linspace(0, mine.size - 1, SAMPLED).round().astype(int))]
        found |= dict.fromkeys(few.tolist(), int(one))
    return found


def relinked(linking: Linking, chains: Chains, decided: dict[int, int]) -> Chains:
    """Chains that keep to some more decisions.

    Parameters
    ----------
    linking : Linking
        The movie.
    chains : Chains
        Before; they are not changed.
    decided : dict
        Whisker of some segments, −1 for nobody's; the next number makes a new whisker.

    Returns
    -------
    Chains
        Settled.
    """
    roster, solutions = list(chains.roster), list(chains.solutions)
    usable = [set(one.who.tolist()) for one in solutions]
    pad_of = {s: n for s in decided for n, who in enumerate(usable) if s in who}
    new = [s for s, k in decided.items() if k == len(roster) and s in pad_of]
    for pad, one in enumerate(chains.solutions):
        marks = {}
        for s in (s for s, n in pad_of.items() if n == pad):
            there, k = roster[decided[s]] if 0 <= decided[s] < len(roster) else (pad, NOBODY)
            marks[s] = k if there == pad else NOBODY
        born = [s for s in new if pad_of[s] == pad]
        if marks:
            solutions[pad] = with_marks(one, marks, linking.lever(pad), born)
        if born:
            roster.append((pad, len(one.labels)))
            new = []
    if max(decided.values(), default=NOBODY) == len(roster):  # a new whisker that the linker cannot follow
        roster.append((-1, 0))
    return Chains(tuple(solutions), tuple(roster))


def settled_again(chains: Chains) -> Chains:
    """The same chains, each run once more: what the linker would say of lines without any decision.

    Parameters
    ----------
    chains : Chains
        Of lines that had names; they are not changed.

    Returns
    -------
    Chains
        Settled.
    """
    solutions = tuple(one.copied() for one in chains.solutions)
    for one in solutions:
        one.settle()
    return Chains(solutions, chains.roster)


def linked_names(linking: Linking, chains: Chains) -> Linked:
    """Names of all segments by the linker.

    Parameters
    ----------
    linking : Linking
        The movie.
    chains : Chains
        Settled.

    Returns
    -------
    Linked
        Whiskers numbered by the roster.
    """
    count = linking.pieces.frame.size
    whisker, other = np.full((2, count), NOBODY)
    sure = np.zeros(count)
    for pad, one in enumerate(chains.solutions):
        number = _numbers(chains.roster, pad)
        names = names_of(one, linking.lever(pad))
        mine = names.whisker >= 0
        whisker[mine], sure[mine] = number[names.whisker[mine]], names.sure[mine]
        other[names.also >= 0] = number[names.also[names.also >= 0]]
    return Linked(whisker, other, sure)


def still_said(linked: Linked, undecided: Sequence[Linked], said: Linked) -> Linked:
    """Names that lines had at first, and those of the linker where decisions have changed its mind.

    Parameters
    ----------
    linked : Linked
        What the linker says now.
    undecided : sequence of Linked
        What it said without decisions, at first and when its chains are run again.
    said : Linked
        The names at first.

    Returns
    -------
    Linked
        Names now.
    """
    same = np.any([linked.whisker == one.whisker for one in undecided], axis=0)
    return Linked(*(np.where(same, before, now) for before, now in zip(said, linked, strict=True)))


def _numbers(roster: Iterable[tuple[int, int]], pad: int) -> Integers:
    """Number of each whisker of a pad."""
    mine = [(k, number) for number, (there, k) in enumerate(roster) if there == pad]
    return np.array([number for _, number in sorted(mine)], np.int64)
