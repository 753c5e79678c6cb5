"""How many whiskers a pad has, and where: from tracklets that lie at one place of the pad, one after the other."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.whisker_models import KEEP, LOOK, Model, prior_spread
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.phase import Along, gains_at

LEAST = 8  # frames of a tracklet from which on a whisker may be found
SAME = 14.0  # squared distance of two tracklets of one whisker at most
SUPPORT = 0.05  # share of the frames in which a whisker is seen at least
TOGETHER = 0.05  # share of the frames of a whisker in which another one, if it is the same, is seen too
SWINGS = 1.0, 0.5, 0.7, 1.4, 2.0  # of whiskers over what is expected at their place, the likeliest first
BETTER = 1.1  # lines of a group over those of one with a likelier swing, at least
SLACK = 2  # frames in which two tracklets of one whisker may overlap


def tracklet_table(
    name: Integers, lines: Lines, phase: Array, lever: Array, along: Along, swing: float = 1.0
) -> tuple[Array, Array]:
    """Median place at phase 0 (n, 3) and look (n, 2) of each tracklet; ``phase`` (S, 2) is that of each segment.

    Lines swing ``swing`` times as far as the pad does at their place.
    """
    count = int(name.max(initial=-1)) + 1
    middle = lines.place[:, 1] - swing * phase[:, 0]
    for _ in range(2):
        swung = swing * (phase * gains_at(middle, along)).sum(axis=1)
        middle = lines.place[:, 1] - swung
    rest = lines.place - swung[:, None] * lever
    place, look = (
        np.stack([_medians(name, column, count) for column in values.T], axis=1) for values in (rest, lines.look)
    )
    return place, look


def _medians(name: Integers, values: Array, count: int) -> Array:
    """Median of the values (S,) of each of ``count`` tracklets, NaN of one without any; those of −1 are nobody's."""
    order = np.lexsort((values, name))
    size = np.bincount(name[name >= 0], minlength=count)
    first = name.size - size.sum() + np.cumsum(size) - size
    middle = (values[order[first + (size - 1) // 2]] + values[order[first + size // 2]]) / 2
    return np.where(size > 0, middle, np.nan)


def groups(frame: Integers, name: Integers, place: Array, look: Array, spread: Array, least: int) -> list[list[int]]:
    """Tracklets of one whisker each: the longest first, each joins the nearest group that it does not overlap.

    Parameters
    ----------
    frame, name : (S,) arrays
        Frame and tracklet of each segment; −1 where it has none.
    place, look : (n, 3) and (n, 2) arrays
        Of the tracklets.
    spread : (3, 3) array
        Covariance of a whisker's deviation.
    least : int
        Frames of a tracklet that counts.

    Returns
    -------
    list of list of int
        Tracklets of each group.
    """
    count = len(place)
    sizes = np.bincount(name[name >= 0], minlength=count)
    inverse = np.linalg.inv(spread)
    found: list[list[int]] = []
    covered: list[Array] = []
    known = np.concatenate([place, look], axis=1)
    total, weight = np.zeros((count, known.shape[1])), np.zeros(count)  # of the members of each group
    order = np.argsort(name, kind="stable")
    parts = np.split(frame[order], np.searchsorted(name[order], np.arange(count)))[1:]
    for n in np.argsort(-sizes, kind="stable"):
        if sizes[n] < max(least, 1):
            break
        off = total[: len(found)] / weight[: len(found), None] - known[n]
        far = np.einsum("gi,ij,gj->g", off[:, :3], inverse, off[:, :3]) + ((off[:, 3:] / LOOK) ** 2).sum(axis=1)
        near = (g for g in np.argsort(far, kind="stable") if far[g] < SAME and covered[g][parts[n]].sum() <= SLACK)
        best = int(next(near, len(found)))
        if best == len(found):
            found.append([])
            covered.append(np.zeros(frame.max() + 1))
        found[best].append(int(n))
        covered[best][parts[n]] = 1
        total[best] += sizes[n] * known[n]
        weight[best] += sizes[n]
    return found


def models_of(
    members: list[list[int]],
    name: Integers,
    place: Array,
    look: Array,
    lever: Array,
    along: Along,
    least: float,
    swing: float = 1.0,
) -> list[Model]:
    """First models of groups that are seen in enough frames; ``swing`` as of :func:`tracklet_table`."""
    sizes = np.bincount(name[name >= 0], minlength=len(place))
    models = []
    for group in members:
        if sizes[group].sum() < least:
            continue
        weight = sizes[group].astype(float)
        middle = np.average(place[group], axis=0, weights=weight)
        usual = np.average(look[group], axis=0, weights=weight)
        gain = swing * gains_at(middle[1:2], along).T * lever
        models.append(Model(middle, gain, prior_spread(lever), KEEP, 0.2, usual, 1.5 * LOOK))
    return models


def best_groups(
    frame: Integers, name: Integers, lines: Lines, phase: Array, lever: Array, along: Along, least: float
) -> list[Model]:
    """First models of groups, the largest first, each with that of some swings which puts most lines at one place.

    Parameters
    ----------
    frame, name : (S,) arrays
        Frame and tracklet of each segment; −1 where it has none.
    lines : Lines
        All lines.
    phase : (S, 2) array
        Phase of the pad in the frame of each segment, and its quarter [°].
    lever : (3,) array
        Displacement at the three radii over that at the middle one.
    along : Along
        How whiskers follow the phase by their place.
    least : float
        Lines of a group that counts.

    Returns
    -------
    list of Model
        None with a line in common with another one.
    """
    models: list[Model] = []
    tables = [tracklet_table(name, lines, phase, lever, along, swing) for swing in SWINGS]
    while (name >= 0).any():
        sizes, most, best = np.bincount(name[name >= 0], minlength=len(tables[0][0])), 0.0, None
        for swing, table in zip(SWINGS, tables, strict=True):
            for group in groups(frame, name, *table, prior_spread(lever), LEAST):
                if sizes[group].sum() >= least and sizes[group].sum() > BETTER * most:
                    most, best = float(sizes[group].sum()), (group, table, swing)
        if best is None:
            break
        group, table, swing = best
        models += models_of([group], name, *table, lever, along, 0, swing)
        name = np.where(np.isin(name, group), -1, name)
    return models
