"""Threshold-linear drives averaged over bins, one for each threshold and latency, tabulated for many units."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import RangeError

Surfaces = tuple[Array, Array, Array]  # misfit, slope and baseline at every node, (I, J, B) each


class Hinge(NamedTuple):
    """Parameters of r = baseline + slope · max(A(t − latency) − threshold, 0).

    Attributes
    ----------
    threshold, slope, latency, baseline : float
        Threshold θ [m], slope s [1/(s m)], latency τ [s], rate b below the threshold [Hz].
    """

    threshold: float
    slope: float
    latency: float
    baseline: float


def between_edges(time: Array, values: Array, edges: Array) -> Array:
    """Mean between neighbouring edges of a signal, which between two samples is taken as their mean.

    Parameters
    ----------
    time, values : (T,) arrays
        Times [s], ascending, and the signal; its last value holds for one more step.
    edges : (..., K + 1) array
        Ascending [s].

    Returns
    -------
    (..., K) array
        In the unit of the values.
    """
    # integrate once by trapezoids, then read the integral at the edges
    times = np.append(time, 2 * time[-1] - time[-2])
    pieces = np.append((values[1:] + values[:-1]) / 2, values[-1]) * np.diff(times)
    area = np.append(0.0, np.cumsum(pieces))
    return np.asarray(np.diff(np.interp(edges, times, area)) / np.diff(edges))


@dataclass(frozen=True, kw_only=True)
class BinnedDrive:
    """The envelope averaged over bins: the drive above any threshold, at any latency, in each bin.

    Attributes
    ----------
    time, envelope : (T,) arrays
        Times [s] on an even grid, and envelope [m].
    edges : (K + 1,) array
        Edges of the bins [s].
    valid : (K,) array of bool
        Bins that count, at any latency in the range.
    latencies : (float, float)
        Range of the latency [s].
    """

    time: Array
    envelope: Array
    edges: Array
    valid: Mask
    latencies: tuple[float, float] = (0.0, 0.03)

    def __post_init__(self) -> None:
        if not 0 <= self.latencies[0] < self.latencies[1]:
            raise RangeError("latencies", "must ascend from zero or later (s)", self.latencies)
        if self.valid.sum() < 20:
            raise RangeError("bins that count", "must be at least 20", int(self.valid.sum()), "give a longer record")

    def hinged(self, threshold: float, latency: float | Array) -> Array:
        """Mean over each bin that counts of max(A(t − τ) − θ, 0).

        Parameters
        ----------
        threshold : float
            θ [m].
        latency : float or (J,) array
            τ [s].

        Returns
        -------
        (..., K') array
            In metres, for the K' bins that count.
        """
        return self.seen(np.maximum(self.envelope - threshold, 0), latency)

    def seen(self, values: Array, latency: float | Array) -> Array:
        """Mean over each bin that counts of a function of the envelope, at a latency.

        Parameters
        ----------
        values : (T,) array
            The function at the times of the envelope.
        latency : float or (J,) array
            τ [s].

        Returns
        -------
        (..., K') array
            In the unit of the values, for the K' bins that count.
        """
        first, last = self._ends()
        means = between_edges(self.time, values, self.edges[first : last + 2] - np.asarray(latency)[..., None])
        inside = self.valid[first : last + 1]
        return means if inside.all() else means[..., inside]

    def range(self) -> tuple[float, float]:
        """Least envelope that counts, and the one exceeded 2 % of the time [m]: thresholds lie between them."""
        return float(self.counted().min()), float(np.quantile(self.counted(), 0.98))

    def identifiable_range(self) -> tuple[float, float]:
        """Envelopes exceeded 95 % and 5 % of the time [m]: a threshold beyond them has too few bins on one side."""
        low, high = np.quantile(self.counted(), [0.05, 0.95])
        return float(low), float(high)

    def spread(self) -> float:
        """Standard deviation of the envelope that counts [m]."""
        return float(self.counted().std())

    def counted(self) -> Array:
        """Envelope at the times that count [m]."""
        first, last = self._ends()
        return self.envelope[(self.time >= self.edges[first]) & (self.time <= self.edges[last + 1])]

    def _ends(self) -> tuple[int, int]:
        """First and last bin that count."""
        inside = np.flatnonzero(self.valid)
        return int(inside[0]), int(inside[-1])


@dataclass(frozen=True, kw_only=True)
class HingeGrid:
    """Binned threshold-linear drives over all thresholds and latencies: made once for a stimulus, used for every unit.

    Attributes
    ----------
    drive : BinnedDrive
        What they were made of.
    thresholds, latencies : (I,), (J,) arrays
        θ [m] and τ [s].
    hinges : (I, J, K') array
        Binned hinge [m] in each bin that counts.
    """

    drive: BinnedDrive
    thresholds: Array
    latencies: Array
    hinges: Array

    @classmethod
    def of(cls, drive: BinnedDrive, *, n_thresholds: int = 40, n_latencies: int = 21) -> HingeGrid:
        """Tabulate the drive.

        Parameters
        ----------
        drive : BinnedDrive
            The envelope seen through bins.
        n_thresholds, n_latencies : int
            Nodes of the grid, even over both ranges.

        Returns
        -------
        HingeGrid
            Hinges at every node.
        """
        thresholds, latencies = np.linspace(*drive.range(), n_thresholds), np.linspace(*drive.latencies, n_latencies)
        return cls(
            drive=drive,
            thresholds=thresholds,
            latencies=latencies,
            hinges=np.array([drive.hinged(threshold, latencies) for threshold in thresholds]),
        )

    def least_squares(self, rates: Array, weights: Array) -> Surfaces:
        """Weighted least squares of slope and baseline at every node, both kept at or above zero.

        Parameters
        ----------
        rates : (B, K') array
            Rates [Hz] of several samples.
        weights : (K',) array
            Weight of each bin, such as the inverse of the variance of its rate.

        Returns
        -------
        misfit, slope, baseline : (I, J, B) arrays
            Weighted sum of squares less that of the data alone; s [1/(s m)]; b [Hz].
        """
        weights, (flat, squares) = weights / weights.sum(), self._flat
        h, hh = (flat @ weights)[:, None], (squares @ weights)[:, None]
        return self._lines(h, hh, rates @ weights, flat @ (weights * rates).T)

    @cached_property
    def _flat(self) -> tuple[Array, Array]:
        """Drives of all nodes and their squares, (M, K') each."""
        flat = self.hinges.reshape(-1, self.hinges.shape[-1])
        return flat, flat**2

    def _lines(self, h: Array, hh: Array, r: Array, hr: Array) -> Surfaces:
        """Slope and baseline from weighted means of the drive, its square, the rate, and their product; (M, B)."""
        spread = hh - h**2
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = np.where(spread > 1e-12 * hh, np.maximum((hr - h * r) / spread, 0), 0.0)
            baseline = r - slope * h
            through_zero = np.where(hh > 0, hr / hh, 0.0)
        slope = np.where(baseline < 0, through_zero, slope)
        baseline = np.maximum(baseline, 0)
        misfit = slope**2 * hh + 2 * slope * baseline * h + baseline**2 - 2 * (slope * hr + baseline * r)
        shape = (*self.hinges.shape[:2], hr.shape[-1])
        return misfit.reshape(shape), slope.reshape(shape), baseline.reshape(shape)

    def best(self, rates: Array, weights: Array) -> Array:
        """Fits of least weighted misfit, between nodes by the parabola through the nodes around the best one.

        Parameters
        ----------
        rates, weights
            As in :meth:`least_squares`.

        Returns
        -------
        (4, B) array
            Rows in the order of :class:`Hinge`.
        """
        return self._between_nodes(self.least_squares(rates, weights))

    def best_of_blocks(self, rate: Array, weights: Array, starts: Integers, drawn: Array) -> Array:
        """Fits of least weighted misfit to resampled blocks of the stimulus, each with its own piece of the rate.

        Parameters
        ----------
        rate, weights : (K',) arrays
            Mean rate [Hz] and weight of each bin.
        starts : (M,) array of int
            First bin of each block.
        drawn : (B, M) array
            How often each block is drawn.

        Returns
        -------
        (4, B) array
            Rows in the order of :class:`Hinge`.
        """
        (flat, squares), total = self._flat, drawn @ np.add.reduceat(weights, starts)

        def means(values: Array) -> Array:
            return np.asarray(np.add.reduceat(values, starts, axis=-1) @ drawn.T / total)

        return self._between_nodes(
            self._lines(
                means(flat * weights), means(squares * weights), means(weights * rate), means(flat * (weights * rate))
            )
        )

    def _between_nodes(self, surfaces: Surfaces) -> Array:
        """Place of the least misfit, and slope and baseline there."""
        n_i, n_j, n_b = surfaces[0].shape
        node = surfaces[0].reshape(-1, n_b).argmin(0)
        i, j = np.clip(node // n_j, 1, n_i - 2), np.clip(node % n_j, 1, n_j - 2)
        off = np.arange(-1, 2)
        around = (i + off[:, None, None], j + off[None, :, None], np.arange(n_b))
        misfit, slope, baseline = (_taylor(surface[around]) for surface in surfaces)
        step = _lowest(*misfit[1:], fallback=np.array([node // n_j - i, node % n_j - j], float))
        threshold = self.thresholds[i] + step[0] * (self.thresholds[1] - self.thresholds[0])
        latency = self.latencies[j] + step[1] * (self.latencies[1] - self.latencies[0])
        return np.array([threshold, np.maximum(_at(slope, step), 0), latency, np.maximum(_at(baseline, step), 0)])


Taylor = tuple[Array, Array, Array]


def _taylor(around: Array) -> Taylor:
    """Value, gradient (2, B) and curvatures (3, B: 00, 11, 01) at the centre of (3, 3, B) nodes."""
    gradient = np.array([around[2, 1] - around[0, 1], around[1, 2] - around[1, 0]]) / 2
    own = [around[2, 1] + around[0, 1] - 2 * around[1, 1], around[1, 2] + around[1, 0] - 2 * around[1, 1]]
    cross = (around[2, 2] + around[0, 0] - around[2, 0] - around[0, 2]) / 4
    return around[1, 1], gradient, np.array([*own, cross])


def _at(taylor: Taylor, step: Array) -> Array:
    value, (g0, g1), (c00, c11, c01) = taylor
    return value + g0 * step[0] + g1 * step[1] + c00 * step[0] ** 2 / 2 + c11 * step[1] ** 2 / 2 + c01 * step.prod(0)


def _lowest(gradient: Array, curvature: Array, *, fallback: Array) -> Array:
    """Step [nodes] to the lowest point of the parabola, at most one node; where it opens downwards, the best node."""
    (g0, g1), (c00, c11, c01) = gradient, curvature
    determinant = c00 * c11 - c01**2
    convex = (determinant > 0) & (c00 > 0)
    safe = np.where(convex, determinant, 1.0)
    step = np.array([c01 * g1 - c11 * g0, c01 * g0 - c00 * g1]) / safe
    return np.clip(np.where(convex, step, fallback), -1, 1)
