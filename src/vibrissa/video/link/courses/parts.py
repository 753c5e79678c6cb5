"""Whiskers that are a part of another one: their lines go on as its lines do.

Where a whisker's line is broken in the same place in many frames, its further piece may get a separate name. It is
seen beside the other piece in every frame, as a second whisker would be; but one smooth curve goes through both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.superfluous import pieces_of_one, seen_in, take_away
from vibrissa.video.link.courses.meetings import ARM
from vibrissa.video.link.courses.smooth_curve import misfit, scatter
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.pieces import Pieces
from vibrissa.video.link.pad.placing import in_head
from vibrissa.video.link.whisker_linking import Linking

MOST = 0.5  # share of its lines that go on as another whisker's, from which on it is a part of that one
SMOOTH = 2.5  # root mean square misfit of a cubic through two pieces of a line at most [SD]
GAP = 40.0  # distance between them at most, over the width of a line


class Points(NamedTuple):
    """Points of all lines (P, 2), their standard deviations, and the width of lines [px]."""

    place: Array
    sd: Array
    width: float


def without_parts(linking: Linking) -> Linking:
    """Take away whiskers that are a part of another one, those with few lines first.

    Parameters
    ----------
    linking : Linking
        The movie; it is changed.

    Returns
    -------
    Linking
        The same.
    """
    pieces = in_head(linking.pieces, linking.motion)
    points = Points(np.stack([pieces.column, pieces.row], axis=1), scatter(pieces), float(np.median(pieces.width)))
    for solution in linking.solutions:
        while (number := _part_of_another(solution, pieces, linking.lines, points)) is not None:
            take_away(solution, number)
    return linking


def _part_of_another(solution: Solution, pieces: Pieces, lines: Lines, points: Points) -> int | None:
    """Whisker with the fewest lines of those that are a part of another one; None if none is."""
    seen = [seen_in(solution, one) for one in solution.labels]
    support = np.array([np.count_nonzero(one >= 0) for one in seen])
    for number in np.argsort(support, kind="stable"):
        for other in np.flatnonzero((support >= support[number]) & (support[number] > 0)):
            here = (seen[number] >= 0) & (seen[other] >= 0) & (number != other)
            pairs = np.stack([seen[number][here], seen[other][here]], axis=1)
            pairs = pairs[pieces_of_one(lines.reach[pairs])]
            if len(pairs) < MOST * support[number]:
                continue
            if sum(_goes_on(pieces, lines, points, pair) for pair in pairs) >= MOST * support[number]:
                return int(number)
    return None


def _goes_on(pieces: Pieces, lines: Lines, points: Points, pair: Integers) -> bool:
    """Whether two lines of a frame are near pieces of one smooth curve."""
    first, second = pair[np.argsort(lines.reach[pair, 0])]
    arms = []
    for segment, outer in ((first, True), (second, False)):
        part = np.arange(pieces.start[segment], pieces.stop[segment])
        # from the gap between them: the nearer piece from its tip, the further one from its base
        arms.append((part[::-1] if lines.turned[segment] != outer else part)[: int(ARM * points.width)])
    before, beyond = map(np.ascontiguousarray, arms)  # each layout would be compiled by itself
    if np.hypot(*(points.place[before[0]] - points.place[beyond[0]])) > GAP * points.width:
        return False
    return misfit(points.place, points.sd, before, beyond) <= SMOOTH**2 * (before.size + beyond.size)
