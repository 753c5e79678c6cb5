"""Phase of a pad, its whiskers and their lines, each estimated from the others in turn."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.chains.drift import with_drift
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.superfluous import without_superfluous
from vibrissa.video.link.chains.swap_moves import unswap
from vibrissa.video.link.chains.whisker_models import Model, deviations, prior_spread, refit
from vibrissa.video.link.pad.common_swing import OWN, weight_of
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.phase import Along, gains_at, quartered
from vibrissa.video.link.starts.tracklets import smoothed_phase
from vibrissa.video.link.starts.whisker_discovery import (
    LEAST,
    SAME,
    SUPPORT,
    TOGETHER,
    groups,
    models_of,
    tracklet_table,
)

SETTLED = 1  # rounds after which whiskers may drift
UNOWNED = 0.3  # mean probability to be a whisker's below which a tracklet is nobody's
SLOW = 4.0  # frames over which motions common to the pad are averaged
STEADY = 1.5  # whiskers that such a motion must be seen in, about
IN_TURN = 15  # frames in which two whiskers would be seen at once by chance, from which on that says something
STILL = 0.3  # gain on the phase below which a line does not swing with the pad
SWINGING = 3.0  # standard deviation of the phase from which on that is seen [°]


def iterated(
    solution: Solution, models: list[Model], name: Integers, lines: Lines, swing: Array, rounds: range
) -> Solution:
    """Phase, whiskers and lines estimated in turn; whiskers too many are taken away in the end.

    Parameters
    ----------
    solution : Solution
        Without whiskers; it is changed.
    models : list of Model
        First whiskers.
    name : (S,) array of int
        Tracklets from which more whiskers may be born.
    lines : Lines
        All lines, without corrections.
    swing : (frames − 1, 2) array
        Swing of the pad from each frame to the next.
    rounds : range
        From which on whiskers may drift is counted in it.

    Returns
    -------
    Solution
        The same.
    """
    frames, gain, along = solution.frames, solution.lever, solution.along
    for again in rounds:
        solution.place(models)
        solution.settle()
        solution.phase = quartered(phase_of_whiskers(solution, frames, swing), along)[solution.frame]
        solution.lines = steadied(solution, lines, gain, frames)
        unswap(solution, gain)
        models = refitted(solution, gain, along)
        if again >= SETTLED:
            models = with_drift(solution, models)
        if again < rounds[-1]:
            models = thinned(solution, models, frames)
            models += _born(solution, name, gain, along, frames)
    kept = thinned(solution, models, frames)
    solution.place([kept[i] for i in np.argsort([one.place[1] for one in kept])])
    solution.settle()
    without_superfluous(solution, lambda: refitted(solution, gain, along))
    return solution


def phase_of_whiskers(solution: Solution, frames: int, swing: Array) -> Array:
    """Phase of the pad from the lines that are probably known.

    Parameters
    ----------
    solution : Solution
        With whiskers.
    frames : int
        Frames of the movie.
    swing : (frames − 1, 2) array
        Swing of the pad from each frame to the next.

    Returns
    -------
    (frames,) array
        Mean 0 [°].
    """
    top, weight = np.zeros(frames), np.zeros(frames)
    for one in solution.labels:
        clear = one.chance > 0.3
        seen, model = one.seen[clear], one.model
        gain = model.gain[0, 1]
        precision = gain**2 / (solution.lines.covariance[seen, 1, 1] + model.spread[1, 1])
        # a line that is far off counts little, and a hair
        w = (
            weight_of(solution.lines.reach[seen])
            * one.chance[clear]
            * precision
            / (1 + (one.x[clear, 1] / (3 * OWN)) ** 2)
        )
        np.add.at(weight, solution.frame[seen], w)
        off = deviations(model, solution.lines.place[seen], solution.phase[seen], solution.frame[seen])[:, 1]
        np.add.at(top, solution.frame[seen], w * (off / gain + solution.phase[seen, 0]))
    found = smoothed_phase(top / np.maximum(weight, 1e-9), weight, swing[:, 0])
    return np.asarray(found - found.mean())


def steadied(solution: Solution, lines: Lines, gain: Array, frames: int) -> Lines:
    """Lines without slow motions that the whole pad has in common beside its swing, such as the head's.

    Parameters
    ----------
    solution : Solution
        With whiskers.
    lines : Lines
        All lines, without corrections.
    gain : (3,) array
        Lever of the pad.
    frames : int
        Frames of the movie.

    Returns
    -------
    Lines
        Corrected.
    """
    left, right = np.zeros((frames, 2, 2)), np.zeros((frames, 2, 3))
    scale = max(np.ptp([0.0, *(one.model.place[1] for one in solution.labels)]) / 2, 1.0)
    for one in solution.labels:
        clear = one.chance > 0.5
        seen = one.seen[clear]
        off = deviations(one.model, lines.place[seen], solution.phase[seen], solution.frame[seen])
        off /= np.maximum(1.0, np.abs(off) / (4 * np.sqrt(np.diag(one.model.spread)) + 1))
        terms = np.tile((one.model.place[1] / scale) ** np.arange(2), (seen.size, 1))
        np.add.at(left, solution.frame[seen], terms[:, :, None] * terms[:, None])
        np.add.at(right, solution.frame[seen], terms[:, :, None] * off[:, None])
    left, right = (gaussian_filter1d(x, SLOW, axis=0, mode="nearest") for x in (left, right))
    drift = np.linalg.solve(left + STEADY * np.eye(2), right)
    where = lines.place[:, 1] - solution.phase[:, 0]
    at = np.clip(where / scale, -1.5, 1.5)[:, None] ** np.arange(2)
    common = np.einsum("si,sij->sj", at, drift[solution.frame])
    return lines._replace(place=lines.place - common)


def refitted(solution: Solution, gain: Array, along: Along) -> list[Model]:
    """Models from the lines that are probably theirs.

    Parameters
    ----------
    solution : Solution
        With whiskers.
    gain : (3,) array
        Lever of the pad.
    along : Along
        How whiskers follow the phase by their place.

    Returns
    -------
    list of Model
        Of its labels.
    """
    return [
        refit(
            one.model,
            solution.lines,
            one.seen,
            one.chance,
            solution.phase,
            solution.frame,
            gains_at(one.model.place[1:2], along).T * gain,
        )
        for one in solution.labels
    ]


def thinned(solution: Solution, models: list[Model], frames: int) -> list[Model]:
    """Models without those that are seen too rarely, do not swing, or are another one.

    Parameters
    ----------
    solution : Solution
        With the lines that are probably each whisker's.
    models : list of Model
        Of its labels.
    frames : int
        Frames of the movie.

    Returns
    -------
    list of Model
        Those seen most first.
    """
    labels = solution.labels
    seen = np.zeros((len(labels), frames), np.bool_)
    for i, one in enumerate(labels):
        seen[i, solution.frame[one.seen[one.chance > 0.5]]] = True
    support = seen.sum(axis=1)
    swinging = np.std(solution.phase[:, 0]) > SWINGING
    kept: list[int] = []
    for i in np.argsort(-support, kind="stable"):
        model = models[i]
        if support[i] < SUPPORT * frames or (swinging and model.gain[0, 1] < STILL):
            continue
        if not any(_same(model, models[j], seen[i], seen[j]) for j in kept):
            kept.append(int(i))
    return [models[i] for i in kept]


def _same(one: Model, other: Model, here: Mask, there: Mask) -> bool:
    """Whether two models are one whisker: near one another, and seen at once less often than two whiskers would be."""
    both, least = np.count_nonzero(here & there), min(here.sum(), there.sum())
    if both > TOGETHER * least:
        return False
    off = one.place - other.place
    far = off @ np.linalg.solve((one.spread + other.spread) / 2, off)
    far += ((one.look - other.look) ** 2 / (one.look_sd * other.look_sd)).sum()
    in_turn = here.sum() * there.sum() / here.size > IN_TURN
    return bool(far < (2 * SAME if in_turn else SAME / 2))


def _born(solution: Solution, name: Integers, gain: Array, along: Along, frames: int) -> list[Model]:
    """Models of whiskers that nobody has found yet: tracklets that are nobody's."""
    owned = np.zeros(solution.frame.size)
    for one in solution.labels:
        owned[one.seen] += one.chance
    sizes = np.maximum(np.bincount(name[name >= 0], minlength=1), 1)
    share = np.bincount(name[name >= 0], owned[name >= 0], minlength=1) / sizes
    free = np.where((name >= 0) & (share[np.maximum(name, 0)] < UNOWNED), name, -1)
    if not (free >= 0).any():
        return []
    place, look = tracklet_table(name, solution.lines, solution.phase, gain, along)
    found = groups(solution.frame, free, place, look, prior_spread(gain), LEAST)
    return models_of(found, free, place, look, gain, along, SUPPORT * frames)
