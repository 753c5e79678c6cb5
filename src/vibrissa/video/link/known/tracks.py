"""Lines that go on from one another from frame to frame, whatever their names."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.chains.whisker_models import Model, deviations
from vibrissa.video.link.pad.common_swing import REACH

NEAR = 36.0  # squared distance of a line from the last one at most, in standard deviations


def longest(solution: Solution, lines: Integers) -> Integers:
    """Longest of some lines in each frame, −1 for none."""
    out = np.full(solution.frames, -1)
    lines = lines[np.isfinite(solution.lines.place[lines]).all(axis=1)]
    order = lines[np.argsort(np.ptp(solution.lines.reach[lines], axis=1), kind="stable")]
    out[solution.frame[order]] = order
    return out


def track(solution: Solution, among: Integers, lines: Integers, model: Model, farthest: int | None = None) -> Integers:
    """Lines that go on from some lines, frame by frame.

    Parameters
    ----------
    solution : Solution
        Of a pad.
    among : array of int
        Segments that may be on the track.
    lines : (n,) array of int
        Segments of it; it is followed before the first and after the last one.
    model : Model
        Whisker as which they swing.
    farthest : int, optional
        Frames up to which it is followed; none if not given.

    Returns
    -------
    (T,) array of int
        Segment in each frame, −1 for none.
    """
    out = longest(solution, lines)
    among = np.sort(among)
    bounds = np.searchsorted(solution.frame[among], np.arange(solution.frames + 1))
    at = np.flatnonzero(out >= 0)
    for way, last in ((1, out[at[-1:]]), (-1, out[at[:1]])):
        missed, t = 0, int(solution.frame[last].sum()) + way
        stop = solution.frames if farthest is None else farthest
        while last.size and 0 <= t < solution.frames and missed < REACH and stop > 0:
            step = _next(solution, among[bounds[t] : bounds[t + 1]], last, model, way)
            missed = 0 if step.size else missed + 1
            if step.size:
                out[t], last = step[0], step
            t, stop = t + way, stop - 1
    return out


def _next(solution: Solution, here: Integers, last: Integers, model: Model, way: int) -> Integers:
    """Line of a frame that goes on from the last one (1,); none (0,) if there is none."""
    plain = (solution.after if way > 0 else solution.before)[last]
    if np.isin(plain, here)[0] or not here.size:
        return plain[: here.size]
    lines, frame = solution.lines, solution.frame
    x, x_last = (deviations(model, lines.place[s], solution.phase[s], frame[s]) for s in (here, last))
    off = far(x - x_last, model.spread + lines.covariance[here] + lines.covariance[last])
    return here[[off.argmin()]] if off.min() < NEAR else here[:0]


def far(off: Array, spread: Array) -> Array:
    """Squared lengths of deviations (n, 3), in standard deviations of a covariance (n, 3, 3)."""
    return np.asarray(np.einsum("ni,nij,nj->n", off, np.linalg.inv(spread), off))
