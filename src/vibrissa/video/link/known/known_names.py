"""Names of all lines of a movie after some have become known: their pads, and whiskers that nobody was named after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.whisker_models import KEEP, LOOK, Model, prior_spread
from vibrissa.video.link.identities import names_of
from vibrissa.video.link.known.known_lines import LineNames, with_known
from vibrissa.video.link.known.tracks import track
from vibrissa.video.link.whisker_linking import Linking

PROBABLE = 0.5  # of the names of a new whisker far from its known lines, at least
MISSED = 0.2  # chance that a new whisker has no line in a frame
FARTHEST = 25  # frames from a line without a name in which lines of a whisker say that it is that one's
PLAIN = 5  # such lines at least


class Chains(NamedTuple):
    """Whiskers of a movie.

    Attributes
    ----------
    solutions : tuple of Solution
        One for each pad.
    roster : tuple of (int, int)
        Pad of each whisker, and its number there; pad −1 for one that was named by hand where there is no pad.
    """

    solutions: tuple[Solution, ...]
    roster: tuple[tuple[int, int], ...]


def chains_of(linking: Linking) -> Chains:
    """Whiskers of a movie that is linked, numbered as there."""
    roster = [(pad, k) for pad, one in enumerate(linking.solutions) for k in range(len(one.labels))]
    return Chains(tuple(linking.solutions), tuple(roster))


def names_with(
    chains: Chains, names: LineNames, lines: Integers, whisker: int, known: Mapping[int, int]
) -> tuple[Chains, LineNames]:
    """Names after some lines have become known as a whisker's.

    Parameters
    ----------
    chains : Chains
        The movie; it is not changed.
    names : LineNames
        Before, by the whiskers of the roster.
    lines : (n,) array of int
        Segments.
    whisker : int
        Whose they are; the next number makes a new whisker.
    known : mapping
        Whisker of lines that were known before, −1 for nobody's.

    Returns
    -------
    Chains, LineNames
        As :func:`vibrissa.video.link.known.known_lines.with_known` in the whisker's pad; lines of others have no name
        there. A new whisker also has the lines without a name that are probably its, wherever they are.
    """
    new = whisker == len(chains.roster)
    pad = _pad_of(chains, lines) if new else chains.roster[whisker][0]
    if pad < 0:
        return (chains._replace(roster=(*chains.roster, (-1, 0))) if new else chains), names
    solution = chains.solutions[pad]
    lines = lines[np.isin(lines, solution.who)]
    if new:
        solutions, roster = list(chains.solutions), (*chains.roster, (pad, len(solution.labels)))
        solutions[pad], found = _with_new(solution, names, lines)
        chains, names = Chains(tuple(solutions), roster), _renamed(names, found, whisker)
        solution = solutions[pad]
    numbers = _numbers(chains, pad)
    place = np.full(len(chains.roster) + 2, -2)  # of the whiskers in the pad; the last is that of none
    place[numbers], place[-1] = np.arange(numbers.size), -1
    of_pad = LineNames(place[names.whisker], place[names.other], names.sure)
    now = with_known(solution, of_pad, lines, chains.roster[whisker][1], _in_pad(known, place))
    number = np.array([*numbers, -2, -1])
    name, other = (np.where(one == -2, was, number[one]) for one, was in zip(now[:2], names[:2], strict=True))
    return chains, LineNames(name, other, now.sure)


def gone_on(linking: Linking, names: LineNames, line: int) -> int:
    """Whisker that a line without a name probably is: the one whose lines plainly go on as that line.

    Parameters
    ----------
    linking : Linking
        The movie.
    names : LineNames
        Names of its lines.
    line : int
        Segment.

    Returns
    -------
    int
        The whisker, which has no line in that frame; −1 if none is plain.
    """
    beside, best, found = names.whisker[linking.pieces.frame == linking.pieces.frame[line]], PLAIN - 1, -1
    chains = chains_of(linking)
    for number, (pad, k) in enumerate(chains.roster):
        solution = chains.solutions[pad]
        if number in beside or line not in solution.who:
            continue
        course = track(solution, solution.who, np.array([line]), solution.labels[k].model, FARTHEST)
        seen = int(np.sum(names.whisker[course[course >= 0]] == number))
        if seen > best:
            best, found = seen, number
    return found


def _pad_of(chains: Chains, lines: Integers) -> int:
    """Pad in which most of some lines are, −1 for none."""
    seen = [int(np.isin(lines, one.who).sum()) for one in chains.solutions]
    return int(np.argmax(seen)) if max(seen, default=0) else -1


def _numbers(chains: Chains, pad: int) -> Integers:
    """Number of each whisker of a pad."""
    mine = [(k, number) for number, (there, k) in enumerate(chains.roster) if there == pad]
    return np.array([number for _, number in sorted(mine)], np.int64)


def _in_pad(known: Mapping[int, int], place: Integers) -> dict[int, int]:
    """What is known of lines, by the whiskers of a pad; −1 for nobody's, −2 for those of other pads, or of none."""
    return {line: int(place[who]) if who < place.size - 2 else -2 for line, who in known.items()}


def _with_new(solution: Solution, names: LineNames, lines: Integers) -> tuple[Solution, LineNames]:
    """A pad with one more whisker, from lines of it; and which other lines without a name are its, as number 0."""
    frame, beside = solution.frame, np.isin(solution.frame, solution.frame[lines])
    free = solution.who[(names.whisker[solution.who] == -1) & ~beside[solution.who]]
    given = solution.frames, frame, solution.lines, np.union1d(free, lines), solution.phase, solution.lever
    alone = Solution(*given, solution.tracklet, solution.along)
    alone.place([_model(solution, lines)])
    alone.settle()
    found = names_of(alone, alone.lever)
    name = np.where(found.sure >= PROBABLE, found.whisker, -1)
    name[lines] = -1  # these are not known yet
    labels = [*solution.labels, alone.labels[0]]
    return replace(solution, labels=labels), LineNames(name, np.full_like(name, -1), found.sure)


def _renamed(names: LineNames, found: LineNames, whisker: int) -> LineNames:
    """Names with those of a new whisker."""
    new = found.whisker == 0
    name, other = np.where(new, whisker, names.whisker), np.where(new, -1, names.other)
    return LineNames(name, other, np.where(new, found.sure, names.sure))


def _model(solution: Solution, segments: Integers) -> Model:
    """A new whisker from lines of it; it swings like the whisker nearest to it."""
    lever: Array = solution.lever
    place, phase = solution.lines.place[segments], solution.phase[segments]
    middle = np.median(place - phase[:, :1] * lever, axis=0)[1]
    near = sorted(solution.labels, key=lambda one: abs(float(one.model.place[1]) - middle))
    gain = near[0].model.gain if near else np.stack([lever, np.zeros(3)])
    look = np.median(solution.lines.look[segments], axis=0)
    where = np.asarray(np.median(place - phase @ gain, axis=0))
    return Model(where, gain, prior_spread(lever), KEEP, MISSED, look, 1.5 * LOOK)
