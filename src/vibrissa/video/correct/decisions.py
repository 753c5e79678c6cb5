"""What was decided by hand about each line, laid over the names of the linker."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.video.link.known.known_lines import LineNames

OPEN, GONE, NOBODY = -3, -2, -1  # not decided; no whisker; without a name
OVERLAP = 0.25  # share of a line that may lie beside another one of the same whisker in the same frame
BRIDGED = 3  # frames without a line that do not end a piece


class Decisions(NamedTuple):
    """Decisions by hand.

    Attributes
    ----------
    held : (S,) array of int
        Whisker of each segment, or ``OPEN``, ``GONE``, ``NOBODY``.
    group : (S,) array of int
        Piece without a name that segments were put into, −1 where nothing was said.
    """

    held: Integers
    group: Integers


class Lying(NamedTuple):
    """Where segments are: frame (S,), first and last distance from the pad (S, 2), and the tracklet (S,)."""

    frame: Integers
    reach: Array
    tracklet: Integers


def undecided(count: int) -> Decisions:
    """Decisions before the first one, of this number of segments."""
    return Decisions(np.full(count, OPEN), np.full(count, -1))


def beside(lying: Lying, one: Integers, others: Integers) -> Mask:
    """Which of some segments lie beside one of others in the same frame, (n,).

    Parameters
    ----------
    lying : Lying
        All segments.
    one, others : (n,) and (m,) arrays of int
        Segments.

    Returns
    -------
    (n,) array of bool
        True where more than a quarter of the segment does; pieces of one broken whisker do not.
    """
    low = np.full(int(lying.frame.max()) + 1, np.inf)
    high = -low
    reach = np.nan_to_num(lying.reach, nan=0.0)
    np.minimum.at(low, lying.frame[others], reach[others, 0])
    np.maximum.at(high, lying.frame[others], reach[others, 1])
    at, (start, stop) = lying.frame[one], reach[one].T
    shared = np.minimum(high[at], stop) - np.maximum(low[at], start)
    return np.asarray((high[at] > -np.inf) & (shared >= OVERLAP * (stop - start)))


def overlaid(linked: LineNames, decisions: Decisions, lying: Lying) -> LineNames:
    """Names by hand where there are such, else by the linker.

    A line that the linker gives to a whisker which has another line by hand in that frame is nobody's.

    Parameters
    ----------
    linked : LineNames
        Names by the linker.
    decisions : Decisions
        By hand.
    lying : Lying
        The segments.

    Returns
    -------
    LineNames
        Lines named by hand are sure, and shared with nobody.
    """
    held = decisions.held
    free = held == OPEN
    whisker = np.where(free, linked.whisker, np.maximum(held, NOBODY))
    for k in np.unique(held[held >= 0]):
        rivals = np.flatnonzero(free & (whisker == k))
        whisker[rivals[beside(lying, rivals, np.flatnonzero(held == k))]] = NOBODY
    kept = free & (whisker == linked.whisker)
    return LineNames(
        whisker, np.where(kept, linked.other, NOBODY), np.where(kept, linked.sure, held >= 0).astype(float)
    )


def pieces_of_names(whisker: Integers, decisions: Decisions, lying: Lying) -> Integers:
    """Piece of each segment (S,): stretches of one name, else tracklets and what was put together by hand.

    Parameters
    ----------
    whisker : (S,) array of int
        Name of each segment, −1 for none.
    decisions : Decisions
        By hand.
    lying : Lying
        The segments.

    Returns
    -------
    (S,) array of int
        Numbered from 0; every segment is in one.
    """
    # lines without a name: those put together, then tracklets, deleted ones apart from others
    apart = int(decisions.group.max(initial=-1)) + 1
    unnamed = np.where(decisions.group >= 0, decisions.group, apart + lying.tracklet)
    unnamed = 2 * unnamed + (decisions.held == GONE)
    named = whisker >= 0
    key = np.where(named, whisker, int(whisker.max(initial=0)) + 1 + unnamed)
    order = np.lexsort((lying.frame, key))
    new = np.diff(key[order], prepend=-1) != 0
    new |= named[order] & (np.diff(lying.frame[order], prepend=0) > BRIDGED + 1)
    out = np.empty(key.size, np.int64)
    out[order] = np.cumsum(new) - 1
    return out
