"""Along each line: of which whisker's course it is, point by point, as long as it does not pay to go over (Viterbi)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.loops import njit
from vibrissa.video.link.courses.course import EDGES, Courses, weights_at
from vibrissa.video.link.pad.pads import BEYOND as FITTED
from vibrissa.video.link.pad.pads import Pad

Values = NDArray[np.float64]
Places = NDArray[np.int64]

OFF = 1.0  # standard deviation of points from the course of their whisker between the radii [px]
NOBODY = 4.0  # distance, over this deviation, beyond which a point is on no course
FAR = 60.0  # squared distance beyond which it is no farther
CHANGE = 25.0  # squared distance that a change of whisker costs
MARGIN, BEYOND = 0.15, 8.0  # distance beyond the tip without cost, as reach, and deviation beyond that [px]
KNOWN = 0.5  # share of its points on a course below which a line stays as it is
FEW = 10  # points within the range in which lines are fitted, below which all points say whose a line is


@njit(cache=True)
def _likeliest(cost: Values) -> Places:
    """Column of each row of ``cost``, a change of column costing ``CHANGE``; by Viterbi."""
    n, count = cost.shape
    total, came = cost[0].copy(), np.zeros((n, count), np.int64)
    for i in range(1, n):
        least = int(np.argmin(total))
        over = total[least] + CHANGE
        for k in range(count):
            came[i, k] = k if total[k] <= over else least
            total[k] = min(total[k], over) + cost[i, k]
    out = np.zeros(n, np.int64)
    out[-1] = np.argmin(total)
    for i in range(n - 1, 0, -1):
        out[i - 1] = came[i, out[i]]
    return out


@njit(cache=True)
def _whose(
    frame: Places,
    first: Places,
    stop: Places,
    along: Values,
    across: Values,
    weights: Values,
    part: Places,
    pixels: Values,
    half: float,
    place: Values,
    shape: Values,
    tip: Values,
    known: NDArray[np.bool_],
) -> Places:
    """Whisker of each point (P,) of some segments; −1 for those of no course."""
    count, out = len(place), np.full(along.size, -1)
    for s in range(frame.size):
        points = range(first[s], stop[s])
        cost = np.full((stop[s] - first[s], count + 1), FAR)
        cost[:, count] = NOBODY**2
        whole = (along[first[s] : stop[s]] <= FITTED).sum() < FEW
        for i, p in enumerate(points):
            if along[p] > FITTED and not whole:  # the course is a guess there: the line stays with its whisker
                cost[i] = 0.0
                continue
            off = OFF * (1 + max(abs(along[p]) - 1, 0.0))
            for k in range(count):
                if not known[k, frame[s]]:
                    continue
                a, b, c = place[k, frame[s]]
                there = weights[p, 0] * a + weights[p, 1] * b + weights[p, 2] * c + shape[k, part[p]]
                beyond = max(along[p] - tip[k] - MARGIN, 0.0) * half
                far = ((across[p] - there) * pixels[p] / off) ** 2 + (beyond / BEYOND) ** 2
                cost[i, k] = min(far, FAR)
        found = _likeliest(cost)
        if (found < count).mean() >= KNOWN:
            for i, p in enumerate(points):
                out[p] = found[i] if found[i] < count else -1
    return out


def whose_points(
    courses: Courses,
    pad: Pad,
    frame: Integers,
    first: Integers,
    stop: Integers,
    along: Array,
    across: Array,
    some: Mask,
) -> Integers:
    """Whisker of a pad that each point is on.

    Parameters
    ----------
    courses : Courses
        Of the pad.
    pad : Pad
        The pad.
    frame, first, stop : (S,) arrays of int
        Frame of each segment, its first point, and the one after its last.
    along, across : (P,) arrays
        Points in the coordinates of the pad.
    some : (S,) array of bool
        Segments that are looked at.

    Returns
    -------
    (P,) array of int
        −1 where a point is on no course, and on lines most of whose points are on none.
    """
    half = (pad.outer - pad.inner) / 2
    pixels = pad.degree * (along * half + pad.centre) / pad.centre  # of a degree across
    weights, part = weights_at(along), np.digitize(along, EDGES)
    place, shape, tip, known = courses
    frame, first, stop = frame[some], first[some], stop[some]
    return np.asarray(_whose(frame, first, stop, along, across, weights, part, pixels, half, place, shape, tip, known))
