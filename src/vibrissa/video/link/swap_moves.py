"""Names of whiskers exchanged where the whole movie speaks for it."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.exclusion import Solution
from vibrissa.video.link.swaps import Swap, confusable, swap_of, swapped
from vibrissa.video.link.whisker_models import prior_spread


def best_lines(solution: Solution) -> Integers:
    """Likeliest segment of each whisker in each frame (whisker, frame), −1 where it has probably none."""
    out = np.full((len(solution.labels), solution.frames), -1)
    for n, one in enumerate(solution.labels):
        order = np.argsort(one.chance, kind="stable")
        order = order[one.chance[order] > 0.4]
        out[n, solution.frame[one.seen[order]]] = one.seen[order]
    return out


def swap_between(solution: Solution, best: Integers, pair: tuple[int, int], lever: Array) -> Swap | None:
    """Where two whiskers may have changed names."""
    a, b = best[pair[0]], best[pair[1]]
    frame = np.flatnonzero((a >= 0) & (b >= 0))
    if not frame.size:
        return None
    one, other = a[frame], b[frame]
    lines, models = solution.lines, [solution.labels[n].model for n in pair]
    gain = (models[0].gain + models[1].gain) / 2
    places = [lines.place[s] - solution.phase[s, None] * gain for s in (one, other)]
    error = np.median(lines.covariance[np.concatenate([one, other])], axis=0)
    strengths = np.stack([lines.strength[one], lines.strength[other]], axis=1)
    keep = min(max(model.keep for model in models), 0.92)
    return swap_of(frame, *places, strengths, prior_spread(lever), error, keep)


def unswap(solution: Solution, lever: Array) -> list[tuple[int, int]]:
    """Exchange probabilities of two whiskers in the frames in which they are likelier swapped; give those pairs."""
    if len(solution.labels) < 2:
        return []
    best = best_lines(solution)
    place = np.array([one.model.place for one in solution.labels])
    done = []
    for pair in confusable(place, prior_spread(lever)):
        found = swap_between(solution, best, pair, lever)
        if found is None or not swapped(found.chance).any():
            continue
        # from the first frame of a swap to the last one before the next change
        when = np.zeros(solution.frames, np.bool_)
        known = np.interp(np.arange(solution.frames), found.frames, swapped(found.chance))
        when[:] = known > 0.5
        _exchange(solution, pair, when)
        best[pair[0]], best[pair[1]] = (
            np.where(when, best[pair[1]], best[pair[0]]),
            np.where(when, best[pair[0]], best[pair[1]]),
        )
        done.append(pair)
    return done


def _exchange(solution: Solution, pair: tuple[int, int], when: Array) -> None:
    """Exchange the probabilities of two whiskers in some frames."""
    one, other = (solution.labels[n] for n in pair)
    chance = np.zeros((2, solution.frame.size))
    for n, label in enumerate((one, other)):
        chance[n, label.seen] = label.chance
    now = when[solution.frame]
    chance = np.where(now, chance[::-1], chance)
    for n, label in enumerate((one, other)):
        seen = np.flatnonzero(chance[n] > 0.01)
        x = np.zeros((seen.size, 3))
        label.seen, label.chance, label.x = seen, chance[n, seen], x
