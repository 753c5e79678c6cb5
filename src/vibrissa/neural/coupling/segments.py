"""The paper's fit of rate against envelope: two straight segments through the bins, at the best whole shift."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError, UnknownError

First = Literal["flat-first", "free-first"]


class TwoSegments(NamedTuple):
    """Two segments that meet at the threshold.

    Attributes
    ----------
    threshold, slope : float
        Envelope where they meet [m], slope above it [1/(s m)].
    baseline : float
        Rate where they meet [Hz].
    first_slope : float
        Slope below the threshold [1/(s m)]; 0 for ``flat-first``.
    r_squared : float
        Share of the rate's variance over the points.
    """

    threshold: float
    slope: float
    baseline: float
    first_slope: float
    r_squared: float


def two_segments(envelope: Array, rate: Array, *, first: First = "flat-first") -> TwoSegments:
    """Least squares of two segments that meet.

    The paper prints neither whether the first one is flat (which moves the threshold by about 5 µm) nor how it was
    fitted. Bins blur the hinge and a whole shift misses the latency: threshold and slope are too low, by how much
    depends on the latency within the bin and on the stimulus. For 42.3 µm and 0.25 without noise: 41 µm and 0.24 at a
    latency of whole bins, 33 to 40 µm and 0.19 half a bin from one (``benchmarks/paper_fit.py``).

    Parameters
    ----------
    envelope, rate : (K,) arrays
        Envelope [m] and rate [Hz] of each bin, already shifted.
    first : str
        ``flat-first``, or ``free-first`` for a free slope below the threshold.

    Returns
    -------
    TwoSegments
        NaN where rate or envelope is constant.

    Raises
    ------
    InputError
        If there are fewer than 10 points, or ``first`` is unknown.
    """
    if len(envelope) != len(rate) or len(rate) < 10:
        raise TooFewError("envelope and rate", "must be at least 10 pairs", f"{len(envelope)}, {len(rate)}")
    if first not in ("flat-first", "free-first"):
        raise UnknownError("first segment", "must be flat-first or free-first", first)
    if np.ptp(rate) == 0 or np.ptp(envelope) == 0:
        return TwoSegments(*[np.nan] * 5)
    scale = float(envelope.std())
    x = envelope / scale

    def fitted(threshold: float) -> tuple[float, Array]:
        columns = [np.ones_like(x), np.maximum(x - threshold, 0), *([x - threshold] if first == "free-first" else [])]
        design = np.stack(columns, axis=1)
        found = np.linalg.lstsq(design, rate, rcond=None)[0]
        return float(np.sum((rate - design @ found) ** 2)), found

    knots = np.unique(np.quantile(x, np.linspace(0.02, 0.98, 60)))
    best = int(np.argmin([fitted(knot)[0] for knot in knots]))
    bounds = (knots[max(best - 1, 0)], knots[min(best + 1, len(knots) - 1)])
    threshold = float(minimize_scalar(lambda at: fitted(at)[0], bounds=bounds, method="bounded").x)
    misfit, (baseline, rise, *below) = fitted(threshold)
    below_slope = below[0] / scale if below else 0.0
    total = float(np.sum((rate - rate.mean()) ** 2))
    return TwoSegments(
        threshold * scale, rise / scale + below_slope, float(baseline), float(below_slope), 1 - misfit / total
    )
