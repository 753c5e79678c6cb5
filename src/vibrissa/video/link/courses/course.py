"""Where each whisker of a linked pad runs in every frame, as its lines show over the whole movie.

A line that goes over from one whisker to another where they cross begins as the one and ends as the other. Such a line
is off its whisker's usual place, and by more than readings are; it counts the less, and what the whisker did before
and after it counts the more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.loops import njit
from vibrissa.video.link.chains.exclusion import ChainLabel, Solution
from vibrissa.video.link.chains.swap_moves import best_lines
from vibrissa.video.link.pad.common_swing import _inverse
from vibrissa.video.link.pad.pads import Lines, parabola_weights

Values = NDArray[np.float64]
Places = NDArray[np.int64]

EDGES = np.linspace(-1.6, 3.2, 49)  # distances from the pad between which a whisker's own shape is read
FEW = 8  # lines of a whisker below which nothing is said of its course
READ = 10  # points between two edges from which on its shape is read there
TAILS = 4.0  # degrees of freedom of Student's t: lines that go over to another whisker are no Gaussian's
PRIOR = 10.0  # lines that the spread of the whisker's model counts for
ERROR = 0.1  # standard deviation of a reading at least [°]
ROUNDS = 4  # in which spread and weights are estimated in turn
NEAR = 5  # frames from its nearest line up to which the course is known
LONG = 0.8  # share of the lines that do not reach beyond the tip


class Courses(NamedTuple):
    """Courses of the whiskers of a pad.

    Attributes
    ----------
    place : (whisker, frame, 3) array
        Across the pad at the three radii [°], as of :class:`vibrissa.video.link.pad.pads.Lines`.
    shape : (whisker, distance) array
        By how much lines run beside the parabola through these places, between ``EDGES`` [°].
    tip : (whisker,) array
        Distance from the pad up to which the whisker is seen, as ``reach``.
    known : (whisker, frame) array of bool
        Whether a line of the whisker is near in time.
    """

    place: Array
    shape: Array
    tip: Array
    known: Mask


def courses_of(
    solution: Solution, lines: Lines, along: Array, across: Array, first: Integers, stop: Integers
) -> Courses:
    """Courses of all whiskers of a pad.

    Parameters
    ----------
    solution : Solution
        Of the pad, settled.
    lines : Lines
        Segments as they were read, without corrections common to the pad.
    along, across : (P,) arrays
        Points of all segments in the coordinates of the pad.
    first, stop : (S,) arrays of int
        Points of each segment, the latter not included.

    Returns
    -------
    Courses
        Of its labels.
    """
    count, best, phase = len(solution.labels), best_lines(solution), solution.phases
    out = Courses(
        np.zeros((count, solution.frames, 3)),
        np.zeros((count, EDGES.size + 1)),
        np.zeros(count),
        np.zeros((count, solution.frames), np.bool_),
    )
    for n, one in enumerate(solution.labels):
        frame = np.flatnonzero(best[n] >= 0)
        if frame.size < FEW:
            continue
        seen, usual = best[n, frame], _usual(one, phase)
        place = usual + _deviation(lines.place[seen] - usual[frame], lines.covariance[seen], frame, one, len(usual))
        out.place[n] = place
        out.shape[n] = _shape(place, along, across, frame, first[seen], stop[seen])
        out.tip[n] = np.quantile(lines.reach[seen, 1], LONG)
        out.known[n] = np.abs(np.arange(len(usual))[:, None] - frame).min(axis=1) <= NEAR
    return out


def _usual(one: ChainLabel, phase: Array) -> Array:
    """Place of a whisker that follows the pad as it usually does, (T, 3)."""
    usual = one.model.place + phase @ one.model.gain
    return usual if one.model.course is None else usual + one.model.course


def _deviation(x: Array, error: Array, frame: Integers, one: ChainLabel, frames: int) -> Array:
    """Deviation of a whisker from its usual place in every frame (T, 3), from that of its lines (n, 3)."""
    sure = 1 / (np.trace(error, axis1=1, axis2=2) + 1)
    weight, spread, middle = np.ones(frame.size), one.model.spread, np.zeros(3)
    for _ in range(ROUNDS):
        w = weight * sure / (weight * sure).sum()
        middle = w @ x
        off = x - middle
        far = np.einsum("ni,nij,nj->n", off, np.linalg.inv(spread + error), off)
        weight = np.minimum((TAILS + 3) / (TAILS + far), 1.0)
        w = weight * sure / (weight * sure).sum()
        found = np.einsum("n,ni,nj->ij", w, off, off)
        spread = (found * frame.size + one.model.spread * PRIOR) / (frame.size + PRIOR)
    doubt = error / weight[:, None, None] + ERROR**2 * np.eye(3) + (1 / weight - 1)[:, None, None] * spread
    return middle + smoothed(frames, frame, x - middle, doubt, spread, one.model.keep)


@njit(cache=True)
def smoothed(frames: int, when: Places, x: Values, error: Values, spread: Values, keep: float) -> Values:
    """Mean of a stationary process that forgets, given readings (Kalman filter and Rauch's smoother).

    Parameters
    ----------
    frames : int
        Frames.
    when : (n,) array of int
        Frame of each reading, ascending.
    x, error : (n, 3) and (n, 3, 3) arrays
        Readings and their covariances.
    spread : (3, 3) array
        Covariance of the process.
    keep : float
        Its correlation from frame to frame.

    Returns
    -------
    (frames, 3) array
        0 where nothing is known.
    """
    mean, ahead = np.zeros((frames, 3)), np.zeros((frames, 3))
    cov, before = np.zeros((frames, 3, 3)), np.zeros((frames, 3, 3))
    m, p, i = np.zeros(3), spread.copy(), 0
    for t in range(frames):
        if t:
            m, p = keep * m, keep * keep * p + (1 - keep * keep) * spread
        ahead[t], before[t] = m, p
        if i < when.size and when[i] == t:
            gain = p @ _inverse(p + error[i])
            m, p = m + gain @ (x[i] - m), p - gain @ p
            i += 1
        mean[t], cov[t] = m, p
    for t in range(frames - 2, -1, -1):
        back = keep * cov[t] @ _inverse(before[t + 1])
        mean[t] += back @ (mean[t + 1] - ahead[t + 1])
    return mean


def weights_at(along: Array) -> Array:
    """Weights (n, 3) of the places at the three radii in their parabola at distances (n,), those of its ends beyond."""
    return parabola_weights(np.clip(along, EDGES[0], EDGES[-1]))


def _shape(place: Array, along: Array, across: Array, frame: Integers, first: Integers, stop: Integers) -> Array:
    """Median over all lines of how far they run beside the parabola, between ``EDGES``."""
    points = np.concatenate([np.arange(a, b) for a, b in zip(first, stop, strict=True)])
    rest = across[points] - (weights_at(along[points]) * place[np.repeat(frame, stop - first)]).sum(axis=1)
    part, out = np.digitize(along[points], EDGES), np.full(EDGES.size + 1, np.nan)
    for k in np.flatnonzero(np.bincount(part, minlength=out.size) >= READ):
        out[k] = np.median(rest[part == k])
    known = np.flatnonzero(np.isfinite(out))
    return np.interp(np.arange(out.size), known, out[known]) if known.size else np.zeros(out.size)
