"""One pad: its whiskers over a movie, from its lines alone, from what was known before, or from names."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.drift import with_drift
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.swap_moves import keep_names
from vibrissa.video.link.chains.whisker_models import prior_spread
from vibrissa.video.link.estimation_rounds import SETTLED, iterated, phase_of_whiskers, refitted, steadied
from vibrissa.video.link.pad.common_swing import calmness, common_swing, lever, pairs_of, weight_of
from vibrissa.video.link.pad.pads import HIDDEN, SHORTEST, Lines, Pad
from vibrissa.video.link.pad.phase import along_of, quartered
from vibrissa.video.link.pad.turning import learnt_lever
from vibrissa.video.link.starts.joined_tracklets import carried, joined
from vibrissa.video.link.starts.tracklets import (
    expected,
    phase_of_tracklets,
    tracklets,
)
from vibrissa.video.link.starts.whisker_discovery import (
    LEAST,
    SUPPORT,
    groups,
    models_of,
    tracklet_table,
)
from vibrissa.video.link.starts.windows import lengths, linked_in_windows, some_lines

STARTS = 3  # from which a pad is linked
LEVERS = 2  # times that the pad's lever is learnt
ROUNDS = 4  # in which phase, whiskers and lines are estimated in turn
AGAIN = (2, True), (3, False)  # the same where whiskers are known, and whether bases then say little of a swap
NAMED = 3  # the same where lines have names
SURE_NAME = 0.99  # probability in its chain of a line that has a name


class Stretches(NamedTuple):
    """What is plain of a pad before anybody has a name.

    Attributes
    ----------
    who : (n,) array of int
        Segments that can be whiskers.
    name : (S,) array of int
        Stretch of plain links of each segment, −1 for none.
    pieces : (S,) array of int
        The same where another piece of a line is no alternative to it.
    swing : (frames − 1, 2) array
        Swing of the pad from each frame to the next.
    lever : (3,) array
        Displacement of whiskers at the three radii over that at the middle one.
    """

    who: Integers
    name: Integers
    pieces: Integers
    swing: Array
    lever: Array


def stretches(frames: int, frame: Integers, lines: Lines, number: int, pad: Pad) -> Stretches:
    """Swing of a pad, and stretches of frames in which it is plain which line is which.

    Parameters
    ----------
    frames : int
        Frames of the movie.
    frame : (S,) array
        Frame of each segment.
    lines : Lines
        All lines.
    number : int
        Of the pad.
    pad : Pad
        The pad.

    Returns
    -------
    Stretches
        Of its lines.
    """
    half = (pad.outer - pad.inner) / 2
    usable = (lines.pad == number) & ((lines.reach[:, 1] - lines.reach[:, 0]) * half >= SHORTEST)
    usable &= lines.reach[:, 0] < 2.0
    who, gain = np.flatnonzero(usable), lever(pad.inner, pad.centre, pad.outer, HIDDEN)
    across = np.where(usable, lines.place[:, 1], 0.0)
    calm = 1.0
    for _ in range(LEVERS):
        pairs = pairs_of(frames, frame, who, lines, gain, calm)
        swing = common_swing(frames, frame, pairs, across)
        off = pairs.swing - expected(frame, pairs, swing, across)
        cost = 0.5 * (pairs.unlike + (off / pairs.sd) ** 2)
        name = tracklets(frame, pairs, cost, usable)
        gain, calm = learnt_lever(frame, name, lines, gain), calmness(frame, pairs, off, name)
    return Stretches(who, name, tracklets(frame, pairs, cost, usable, lines.reach), swing, gain)


def link_pad(frames: int, frame: Integers, lines: Lines, number: int, pad: Pad) -> list[Solution]:
    """Whiskers of a pad over all frames, from each of three starts.

    Parameters
    ----------
    frames, frame, lines, number, pad
        As of :func:`stretches`.

    Returns
    -------
    list of Solution
        Its whiskers, and the probability of each candidate line: as they come from windows of several lengths. Where
        the movie is too short for these, as they come from plain stretches, from those joined over gaps, and from
        those in which pieces of one line are no alternatives.
    """
    plain = stretches(frames, frame, lines, number, pad)

    def linked(here: Integers, first: int, stop: int) -> Solution:
        part = stop - first, frame[here] - first, some_lines(lines, here)
        around = stretches(*part, number, pad)
        return _solved(*part, around.name, around)

    starts = [linked_in_windows(frames, frame, length, linked) for length in lengths(frames)]
    if len(starts) < STARTS:
        motion = carried(frames, frame, plain.name, lines, plain.swing, plain.lever)
        starts += [plain.name, joined(frame, plain.name, lines, motion, plain.lever), plain.pieces]
    return [_solved(frames, frame, lines, start, plain) for start in starts[:STARTS]]


def link_pad_again(
    frames: int, frame: Integers, lines: Lines, number: int, pad: Pad, before: Solution
) -> list[Solution]:
    """Whiskers of a pad whose lines have changed since they were linked, from the whiskers that were found then.

    Parameters
    ----------
    frames, frame, lines, number, pad
        As of :func:`stretches`.
    before : Solution
        Of the former lines of the pad.

    Returns
    -------
    list of Solution
        Of these lines: after two rounds in which bases say little of a swap, and after three in which they do.
    """
    plain, out = stretches(frames, frame, lines, number, pad), []
    for rounds, cross in AGAIN:
        phase, along = before.phases[frame], along_of(plain.swing)
        solution = Solution(frames, frame, lines, plain.who, phase, plain.lever, plain.name, along)
        solution.bases_cross = cross
        models = [one.model for one in before.labels]
        out.append(iterated(solution, models, plain.name, lines, plain.swing, range(SETTLED, SETTLED + rounds)))
    return out


def link_pad_named(frames: int, frame: Integers, lines: Lines, number: int, pad: Pad, names: Integers) -> Solution:
    """Whiskers of a pad whose lines have names, in the same order; those without a line of some length are left out.

    Parameters
    ----------
    frames, frame, lines, number, pad
        As of :func:`stretches`.
    names : (S,) array of int
        Whisker of the pad that each segment is; −1 for nobody's.

    Returns
    -------
    Solution
        Of these lines.
    """
    plain = stretches(frames, frame, lines, number, pad)
    name = np.full(names.size, -1)
    some = plain.who[names[plain.who] >= 0]
    every, name[some] = np.unique(names[some], return_inverse=True)
    named = [np.flatnonzero(name == k) for k in range(every.size)]
    solution = _begun(frames, frame, lines, plain, name)
    along = solution.along
    place, look = tracklet_table(name, lines, solution.phase, plain.lever, along)
    models = models_of([[k] for k in range(len(named))], name, place, look, plain.lever, along, 0)
    for _ in range(NAMED):
        solution.place(models)
        for one, seen in zip(solution.labels, named, strict=True):
            one.seen, one.chance, one.x = seen, np.ones(seen.size), np.zeros((seen.size, 3))
        solution.phase = quartered(phase_of_whiskers(solution, frames, plain.swing), along)[frame]
        solution.lines = steadied(solution, lines, plain.lever, frames)
        models = with_drift(solution, refitted(solution, plain.lever, along))
    solution.place(models)
    for one, seen in zip(solution.labels, named, strict=True):
        one.chance = np.where(np.isin(one.seen, seen), SURE_NAME, 0.0)
    keep_names(solution, plain.lever)
    return solution


def _begun(frames: int, frame: Integers, lines: Lines, plain: Stretches, start: Integers) -> Solution:
    """A pad without whiskers, with the phase that the tracklets ``start`` share."""
    across, along = np.where(np.isfinite(lines.place[:, 1]), lines.place[:, 1], 0.0), along_of(plain.swing)
    phase = phase_of_tracklets(frames, frame, start, across, plain.swing, along, LEAST, weight_of(lines.reach))
    return Solution(frames, frame, lines, plain.who, phase[frame], plain.lever, plain.name, along)


def _solved(frames: int, frame: Integers, lines: Lines, start: Integers, plain: Stretches) -> Solution:
    """Whiskers of a pad from tracklets ``start``."""
    solution = _begun(frames, frame, lines, plain, start)
    place, look = tracklet_table(start, lines, solution.phase, plain.lever, solution.along)
    found = groups(frame, start, place, look, prior_spread(plain.lever), LEAST)
    models = models_of(found, start, place, look, plain.lever, solution.along, SUPPORT * frames)
    return iterated(solution, models, start, lines, plain.swing, range(ROUNDS))
