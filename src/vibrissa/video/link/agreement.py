"""What several linkings of a movie say of each line, though each has cut lines and numbered whiskers its own way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.agreed_names import Agreed
from vibrissa.video.link.certainty import UNNAMED
from vibrissa.video.link.consensus import consensus, shares
from vibrissa.video.link.whisker_linking import Linking, linked_as

SEEN = 0.1  # share of the frames in which a whisker has a line at least


class CutLinking(NamedTuple):
    """A linking, and which point of the lines before they were cut each point of its lines is."""

    linking: Linking
    points: Integers


class Said(NamedTuple):
    """Whisker that each linking calls each point or line, −1 for none, and its probability (both (linking, n))."""

    whisker: Integers
    sure: Array


def common_linking(each: list[CutLinking], count: int) -> tuple[int, Linking]:
    """Linking whose whiskers are those on which several linkings agree.

    Parameters
    ----------
    each : list of CutLinking
        Linkings of the same lines.
    count : int
        Points of these lines.

    Returns
    -------
    int
        The linking in which most points probably have the right name; its lines are taken.
    Linking
        Of these lines, with what all linkings say of them.
    """
    said = [_names_of_points(one, count) for one in each]
    points = Said(*(np.stack(one) for one in zip(*said, strict=True)))
    best = int(np.argmax(((2 * points.sure - 1) * (points.whisker >= 0)).sum(axis=1)))
    linking, lines = each[best].linking, _names_of_lines(points, each[best])
    part = consensus(*lines, _stretches(linking))
    whisker = _in_order(part, linking)
    found = linked_as(linking, whisker)
    found.common = Agreed(whisker, _said(lines, whisker))
    return best, found


def _names_of_points(one: CutLinking, count: int) -> tuple[Integers, Array]:
    """What a linking says of each point; points that it has left out are nobody's. Numbered through over the pads."""
    identity, pieces = one.linking.identity(), one.linking.pieces
    whisker, sure, size = np.full(count, -1), np.zeros(count), pieces.stop - pieces.start
    whisker[one.points] = np.repeat(identity.segment_whisker.values, size)
    sure[one.points] = np.repeat(identity.segment_probability.values, size)
    return whisker, sure


def _names_of_lines(points: Said, of: CutLinking) -> Said:
    """The name that most points of each line of a linking have in each linking, with their mean probability."""
    size = of.linking.pieces.stop - of.linking.pieces.start
    line, every = np.repeat(np.arange(size.size), size), np.arange(size.size)
    whisker, sure = np.full((2, len(points.whisker), size.size), -1.0)
    for n, (name, likely) in enumerate(zip(points.whisker, points.sure, strict=True)):
        names = int(name.max(initial=-1)) + 2  # with nobody's, the first
        weight = np.where(name >= 0, likely, UNNAMED)[of.points]
        said = np.bincount(line * names + name[of.points] + 1, weight, size.size * names).reshape(-1, names)
        most = said.argmax(axis=1)
        whisker[n], sure[n] = most - 1, said[every, most] / size
    return Said(whisker.astype(np.int64), sure)


def _stretches(linking: Linking) -> Integers:
    """Plain stretch of each line, numbered through over the pads; −1 for none."""
    out, count = np.full(linking.pieces.frame.size, -1), 0
    for one in linking.solutions:
        plain = one.tracklet >= 0
        out[plain] = one.tracklet[plain] + count
        count = int(out.max(initial=-1)) + 1
    return out


def _in_order(part: Integers, linking: Linking) -> Integers:
    """Whisker of each line: parts that are seen often enough, by their pads and their angle there; −1 for none."""
    whisker, first, count = np.full(part.size, -1), 0, int(part.max(initial=-1)) + 1
    home = np.zeros((len(linking.solutions), count), np.int64)
    for n, one in enumerate(linking.solutions):
        home[n] = np.bincount(part[one.who][part[one.who] >= 0], minlength=count)
    for n, one in enumerate(linking.solutions):
        own = one.who[part[one.who] >= 0]
        kept = np.flatnonzero((home[n] >= max(SEEN * one.frames, 1)) & (home.argmax(axis=0) == n))
        rest = linking.lines.place[own, 1] - one.phase[own, 0]
        kept = kept[np.argsort([np.median(rest[part[own] == k]) for k in kept], kind="stable")]
        number = np.full(count, -1)
        number[kept] = first + np.arange(kept.size)
        whisker[own] = number[part[own]]
        first += kept.size
    return whisker


def _said(lines: Said, whisker: Integers) -> Array:
    """Mean over linkings of the probabilities that each line is each whisker's, or nobody's (S, whiskers + 1).

    A name in a linking stands for each whisker by the share of its lines that are that one's.
    """
    count = int(whisker.max(initial=-1)) + 1
    part, said = np.where(whisker >= 0, whisker, count), np.zeros((whisker.size, count + 1))
    for name, sure in zip(*lines, strict=True):
        mine = shares(name, sure, part, count + 1, int(name.max(initial=-1)) + 1)
        mine /= np.maximum(mine.sum(axis=0), 1e-9)
        named = name >= 0
        said[named] += sure[named, None] * mine[:, name[named]].T
        said[~named, count] += sure[~named]
    return said / len(lines.whisker)
