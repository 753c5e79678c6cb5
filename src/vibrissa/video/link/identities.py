"""From probabilities to names: which segments are a whisker's in each frame, how sure that is, and why it is lost."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.quantities.identity import SURE
from vibrissa.video.link.certainty import WHOLE, certainty, evidence
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.swap_moves import best_lines, swap_doubt, unswap
from vibrissa.video.link.chains.torn_links import torn_links
from vibrissa.video.link.pad.pads import Lines

REASONS = (
    "",
    "no line there",
    "which line it is cannot be decided",
    "one line with another whisker",
    "names leave plain lines",
)
ABSENT, UNSURE, SHARED, TORN = 1, 2, 3, 4
AGREES = 3.0  # standard deviations within which a further piece lies on a whisker
OVERLAP = 0.25  # share of a further piece that may lie beside the main one
OFTEN = 0.5  # of the frames in which a whisker is seen, those in which another is that may run along its line
ONE_LINE = 2.2  # distance of two whiskers that are seen as one line, at the middle and the outer radius [°]


class Names(NamedTuple):
    """Whiskers of one pad.

    Attributes
    ----------
    whisker, also : (S,) arrays of int
        Whisker of each segment, and that of another one that runs along the same line; −1 for none.
    sure : (S,) array
        Probability that the segment is that whisker's.
    main : (whisker, frame) array of int
        Likeliest segment, −1 for none.
    chance : (whisker, frame) array
        Probability that what is said of the whisker in the frame is right; NaN where it is lost.
    reason : (whisker, frame) array of int
        Place in ``REASONS``; 0 where the whisker is followed.
    evidence : (S, 6) array
        What ``sure`` is made of, see :func:`evidence`; NaN for all but main segments.
    """

    whisker: Integers
    also: Integers
    sure: Array
    main: Integers
    chance: Array
    reason: Integers
    evidence: Array


def names_of(solution: Solution, lever: Array) -> Names:
    """Names from the probabilities of a pad.

    Parameters
    ----------
    solution : Solution
        Settled; it is not changed.
    lever : (3,) array
        Expected gain of the pad's whiskers.

    Returns
    -------
    Names
        Of all segments; those of other pads are nobody's.
    """
    view = replace(solution, labels=[replace(one) for one in solution.labels])
    unswap(view, lever)
    doubt = swap_doubt(view, lever)
    count, frames = doubt.shape
    whisker, also = np.full((2, solution.frame.size), -1)
    sure, chance = np.zeros(solution.frame.size), np.full((count, frames), np.nan)
    known = np.full((solution.frame.size, WHOLE.size), np.nan)
    main, reason = best_lines(view), np.full((count, frames), ABSENT, np.int64)
    table = np.zeros((count, solution.frame.size))
    for n, one in enumerate(view.labels):
        table[n, one.seen] = one.chance
    # no line for two: the likelier one keeps it
    for n in np.argsort([one.chance.sum() for one in view.labels]):
        here = np.flatnonzero(main[n] >= 0)
        taken = table[:, main[n, here]].argmax(axis=0) != n
        main[n, here[taken]] = -1
    for n in range(count):
        whisker[main[n, main[n] >= 0]] = n
    torn = torn_links(view.frame, view.tracklet, whisker, count)
    for n in range(count):
        here = np.flatnonzero(main[n] >= 0)
        seen = main[n, here]
        own = table[n, seen] * (1 - doubt[n, here])
        found = known[seen] = evidence(view, n, seen, own, float(torn[n]))
        sure[seen] = chance[n, here] = certainty(found)
        unsure = np.where(certainty(found * WHOLE) >= SURE, TORN, UNSURE)
        reason[n, here] = np.where(sure[seen] >= SURE, 0, unsure)
    _join(view, main, whisker, sure)
    _share(view, main, also, reason)
    return Names(whisker, also, sure, main, chance, reason, known)


def _expected(solution: Solution, n: int, lines: Lines, main: Integers) -> Array:
    """Place of a whisker in each frame (T, 3) from its lines, as far as they show it; NaN where it is long lost."""
    model = solution.labels[n].model
    here = np.flatnonzero(main >= 0)
    out = np.full((main.size, 3), np.nan)
    if here.size < 2:
        return out
    swung = model.place + solution.phases @ model.gain
    x = lines.place[main[here]] - swung[here]
    # a piece that shows only a part of the whisker says less of the rest
    trust = model.spread.diagonal() / (model.spread.diagonal() + np.diagonal(lines.covariance[main[here]], 0, 1, 2))
    for m in range(3):
        out[:, m] = np.interp(np.arange(main.size), here, trust[:, m] * x[:, m])
    gap = np.abs(
        np.arange(main.size)[:, None]
        - here[np.clip(np.searchsorted(here, np.arange(main.size)), 0, here.size - 1)][:, None]
    )
    return np.where(gap <= 5, out + swung, np.nan)


def _join(solution: Solution, main: Integers, whisker: Integers, sure: Array) -> None:
    """Further pieces of whiskers that are broken where others cross them."""
    lines = solution.lines
    free = solution.who[whisker[solution.who] < 0]
    where = [_expected(solution, n, lines, main[n]) for n in range(len(main))]
    if not where or not free.size:
        return
    frame = solution.frame[free]
    off = np.array([lines.place[free] - place[frame] for place in where])
    spread = lines.covariance[free] + np.diag([0.5, 0.5, 1.0]) ** 2
    far = np.einsum("nsi,sij,nsj->ns", off, np.linalg.inv(spread), off)
    near = np.where(np.isfinite(far), far, np.inf)
    best = near.argmin(axis=0)
    order = np.sort(near, axis=0)
    clear = order[0] < AGREES**2
    if len(main) > 1:
        clear &= order[1] > order[0] + 4
    for s, n in zip(free[clear], best[clear], strict=True):
        own = main[n, solution.frame[s]]
        if own >= 0:
            (a, b), (c, d) = lines.reach[own], lines.reach[s]
            if min(b, d) - max(a, c) > OVERLAP * (d - c):
                continue
            whisker[s], sure[s] = n, sure[own]


def _share(solution: Solution, main: Integers, also: Integers, reason: Integers) -> None:
    """Lines along which another whisker runs that has none in the frame."""
    lines, seen = solution.lines, np.count_nonzero(main >= 0, axis=1)
    for n in range(len(main)):
        place = _expected(solution, n, lines, main[n])
        for other in np.flatnonzero((seen[n] >= OFTEN * seen) & (np.arange(len(main)) != n)):
            t = np.flatnonzero((main[n] < 0) & (main[other] >= 0) & np.isfinite(place[:, 0]))
            off = np.abs(lines.place[main[other, t], 1:] - place[t, 1:]).max(axis=1)
            here = t[off < ONE_LINE]
            also[main[other, here]], reason[n, here] = n, SHARED


def with_named(names: Names, frame: Integers, segment: Integers, whisker: Integers, sure: Array | float) -> Names:
    """The same with names for some lines.

    Parameters
    ----------
    names : Names
        Of the pad; it is not changed.
    frame : (S,) array
        Frame of each segment.
    segment, whisker : (n,) arrays of int
        Lines without a name, and whose they are, each in a frame in which this whisker has no line.
    sure : (n,) array or float
        Probability that this is right.

    Returns
    -------
    Names
        The names that lines have stay.
    """
    if not segment.size:
        return names
    words, when = ("whisker", "also", "sure", "main", "chance", "reason"), frame[segment]
    out = names._replace(**{word: getattr(names, word).copy() for word in words})
    out.whisker[segment], out.sure[segment] = whisker, sure
    out.main[whisker, when], out.chance[whisker, when], out.reason[whisker, when] = segment, sure, 0
    alone = (out.also >= 0) & (out.main[out.also, frame] >= 0)
    out.also[alone] = -1
    return out
