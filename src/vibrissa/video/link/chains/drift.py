"""Slow drift of each whisker from its place in the pad, over hundreds of frames, as far as the lines show one.

A fan that opens and closes, or an obstacle, moves whiskers against one another for longer than their deviations
last. Without drift such a whisker is nearer to the place of its neighbour, and would take its name.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibrissa.arrays import Array
from vibrissa.video.link.chains.exclusion import ChainLabel, Solution
from vibrissa.video.link.chains.whisker_models import Model, deviations

SLOW = 20.0  # standard deviation of the Gaussian over which a drift is averaged [frames]
LASTS = 12.0  # frames of a deviation that are as good as one
CLEAR = 0.5  # probability from which on a line counts


def with_drift(solution: Solution, models: list[Model]) -> list[Model]:
    """Models with the drift of their whiskers.

    The variance of drift is estimated over all whiskers of the pad; where it is no larger than the means of fast
    deviations vary, nothing drifts.

    Parameters
    ----------
    solution : Solution
        With the lines that are probably each whisker's.
    models : list of Model
        Of its labels.

    Returns
    -------
    list of Model
        With ``course``.
    """
    found = [_slow(solution, one, model) for one, model in zip(solution.labels, models, strict=True)]
    if not found:
        return models
    mean, error, fast = (np.stack(part) for part in zip(*found, strict=True))
    seen = np.isfinite(error[..., 0])
    if not seen.any():
        return models
    error = error * np.median(fast[np.isfinite(fast).all(axis=1)], axis=0)
    spread = (1.48 * np.median(np.abs(mean[seen]), axis=0)) ** 2 - np.median(error[seen], axis=0)
    spread = np.maximum(spread, 0.0)
    course = mean * np.where(seen[..., None], spread / (spread + error + 1e-9), 0.0)
    return [model._replace(course=one) for model, one in zip(models, course, strict=True)]


def _slow(solution: Solution, one: ChainLabel, model: Model) -> tuple[Array, Array, Array]:
    """Mean deviation about each frame (T, 3), its variance over that of fast deviations (T, 3), and the latter (3,)."""
    clear = one.chance > CLEAR
    seen = one.seen[clear]
    x = deviations(model._replace(course=None), solution.lines.place[seen], solution.phase[seen], solution.frame[seen])
    top, count = np.zeros((solution.frames, 3)), np.zeros(solution.frames)
    np.add.at(top, solution.frame[seen], x)
    np.add.at(count, solution.frame[seen], 1.0)
    wide = SLOW * np.sqrt(2 * np.pi)
    top, count = (gaussian_filter1d(part, SLOW, axis=0, mode="constant") * wide for part in (top, count))
    mean = top / np.maximum(count, 1e-9)[:, None]
    fast = (1.48 * np.median(np.abs(x - mean[solution.frame[seen]]), axis=0)) ** 2 if seen.size else np.full(3, np.nan)
    error = np.where(count > 1, LASTS / np.maximum(count, LASTS / 4), np.nan)
    return mean, np.repeat(error[:, None], 3, axis=1), fast
