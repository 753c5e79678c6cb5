"""Parts of a rate that follow the envelope and the carrier's phase: columns, and estimates of each trial or block."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.special import stdtrit

from vibrissa.arrays import Array, Complex, Integers
from vibrissa.neural.coupling.envelope_coupling import tail_p_value
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.stats import jackknife_half_width
from vibrissa.stats.intervals import UPPER

Vectors = Array | Complex

KNOTS = (0.25, 0.5, 0.75)  # shares of the time at which the rate may bend with the envelope


class Estimate(NamedTuple):
    """A number and its 95 % interval, from leaving out one draw at a time: a trial, or a block of the stimulus."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Explained:
    """Columns by which envelope and phase explain a rate at one latency.

    Attributes
    ----------
    latency : float
        [s].
    envelope : (E, K) array
        Envelope and its bends, mean 0.
    phase : (C, K) array
        Cosine and sine of the phase, the same times the envelope, and of twice the phase; mean 0.
    carrier : (K,) complex array
        exp(iφ).
    """

    latency: float
    envelope: Array
    phase: Array
    carrier: Complex

    @classmethod
    def of(cls, shown: Presentation, phase: Array, centre: Array, latency: float) -> Explained:
        """Columns at the centres of the bins less a latency.

        Parameters
        ----------
        shown : Presentation
            The stimulus.
        phase : (T,) array
            Phase of the carrier, unwrapped [rad].
        centre : (K,) array
            Centres of the bins that count [s].
        latency : float
            [s].

        Returns
        -------
        Explained
            Columns at this latency.
        """
        at = centre - latency
        a = np.interp(at, shown.time, shown.envelope) / shown.envelope.mean()
        phi = np.interp(at, shown.time, phase)
        bends = [np.maximum(a - knot, 0) for knot in np.quantile(a, KNOTS)]
        turn = [np.cos(phi), np.sin(phi), a * np.cos(phi), a * np.sin(phi), np.cos(2 * phi), np.sin(2 * phi)]
        return cls(
            latency=latency,
            envelope=_centred(np.array([a, *bends])),
            phase=_centred(np.array(turn)),
            carrier=np.exp(1j * phi),
        )

    def likeness(self) -> float:
        """Largest correlation of anything the envelope explains with anything the phase explains."""
        bases = [np.linalg.qr(columns.T)[0] for columns in (self.envelope, self.phase)]
        return float(np.linalg.svd(bases[0].T @ bases[1], compute_uv=False)[0])

    @cached_property
    def solver(self) -> Array:
        """(E + C, K) matrix that gives the coefficients of least squares."""
        columns = np.vstack([self.envelope, self.phase])
        return np.asarray(np.linalg.solve(columns @ columns.T, columns), float)

    def residual(self, rate: Array) -> Array:
        """What the columns do not explain of a rate.

        Parameters
        ----------
        rate : (K,) array
            Mean rate in the bins that count.

        Returns
        -------
        (K,) array
            Mean 0.
        """
        columns = np.vstack([self.envelope, self.phase])
        return np.asarray(rate - rate.mean() - (self.solver @ rate) @ columns)

    def variance_explained(self, rate: Array) -> float:
        """Variance of a rate that all columns explain.

        Parameters
        ----------
        rate : (K,) array
            Mean rate in the bins that count.

        Returns
        -------
        float
            In the square of the rate's unit.
        """
        product = np.vstack([self.envelope, self.phase]) @ rate
        return float(product @ (self.solver @ rate)) / rate.size


def by_chance(columns: Array, rate: Array, reach: int, guard: int) -> float:
    """p-value of what columns explain of a rate, from shifts at which they cannot have driven it.

    Variance explained at every circular shift by the Fourier transform, the largest of as many shifts as latencies are
    tried. What a unit answers in every trial alike, such as some other feature of the stimulus, goes with envelope or
    phase by chance at every shift; the scatter between trials does not show it.

    Parameters
    ----------
    columns : (C, K) array
        At latency 0, mean 0.
    rate : (K,) array
        Mean over trials.
    reach : int
        Latencies tried: shifts 0 to this [bins].
    guard : int
        Shifts left out on both sides of these [bins].

    Returns
    -------
    float
        Of :func:`vibrissa.neural.coupling.envelope_coupling.tail_p_value`.
    """
    spectra = np.conj(np.fft.rfft(columns)) * np.fft.rfft(rate - rate.mean())
    product = np.fft.irfft(spectra, rate.size)
    explained = np.einsum("ck,cd,dk->k", product, np.linalg.inv(columns @ columns.T), product, optimize=True)
    largest = maximum_filter1d(
        explained, reach + 1, mode="wrap", origin=-((reach + 1) // 2)
    )  # of each shift and the next
    chance = largest[reach + guard : rate.size - reach - guard]
    return tail_p_value(float(largest[0]), chance)


def _centred(columns: Array) -> Array:
    return np.asarray(columns - columns.mean(1, keepdims=True))


def of_pairs(z: Array | Complex) -> float:
    """Mean over pairs of different draws of their scalar product: the squared mean without the noise's share.

    The principle of the pairwise phase consistency of [Vinck2010]_, between trials or long blocks, so that a unit's own
    past does not count.

    Parameters
    ----------
    z : (N, M) array
        One vector for each draw.

    Returns
    -------
    float
        In the square of the unit of z; noise makes it negative as often as positive.
    """
    n, total = len(z), z.sum(0)
    return float((np.vdot(total, total) - np.vdot(z, z)).real / (n * (n - 1)))


@dataclass(frozen=True, kw_only=True)
class DrawnParts:
    """Estimates from each draw of the parts that follow the envelope and the phase.

    Attributes
    ----------
    envelope : (N, E) array
        Coefficients, turned so that their squares add up to a variance.
    phase : (N, C) array
        The same of the phase.
    locked : (N, 1) complex array
        Mean of rate times exp(−iφ), of what is locked alone.
    level : (N, 1) array
        Mean rate.
    """

    envelope: Array
    phase: Array
    locked: Complex
    level: Array

    @classmethod
    def of_trials(cls, best: Explained, counts: Array) -> DrawnParts:
        """Estimates from each trial; they are linear in its counts.

        Parameters
        ----------
        best : Explained
            Columns at the unit's latency.
        counts : (N, K) array
            Counts of each trial in the bins that count.

        Returns
        -------
        DrawnParts
            One row for each trial.
        """
        return cls._from(best, counts @ best.solver.T, counts.mean(1, keepdims=True))

    @classmethod
    def of_blocks(cls, best: Explained, rate: Array, starts: Integers) -> DrawnParts:
        """Estimates from each block of the stimulus: that of all blocks, moved as far as this one pulls it.

        Parameters
        ----------
        best : Explained
            Columns at the unit's latency.
        rate : (K,) array
            Counts in the bins that count, mean over trials.
        starts : (M,) array of int
            First bin of each block, from 0.

        Returns
        -------
        DrawnParts
            One row for each block; their mean is the estimate from all of them.
        """
        rest = best.residual(rate)
        pulls = starts.size * np.add.reduceat(best.solver * rest, starts, axis=1).T
        level = rate.mean() + starts.size * np.add.reduceat(rest, starts)[:, None] / rate.size
        return cls._from(best, best.solver @ rate + pulls, level)

    @classmethod
    def _from(cls, best: Explained, found: Array, level: Array) -> DrawnParts:
        """From the coefficients (N, E + C) and mean rate (N, 1) of each draw."""
        n_envelope, size = len(best.envelope), best.envelope.shape[1]
        envelope, phase = found[:, :n_envelope], found[:, n_envelope:]
        return cls(
            envelope=envelope @ np.linalg.cholesky(best.envelope @ best.envelope.T / size),
            phase=phase @ np.linalg.cholesky(best.phase @ best.phase.T / size),
            locked=(phase @ (best.phase @ best.carrier.conj() / size))[:, None],
            level=level,
        )

    def without(self, draw: int) -> DrawnParts:
        """Leave out a draw.

        Parameters
        ----------
        draw : int
            Its place.

        Returns
        -------
        DrawnParts
            Of the others.
        """
        rest = np.arange(len(self.level)) != draw
        return DrawnParts(
            envelope=self.envelope[rest], phase=self.phase[rest], locked=self.locked[rest], level=self.level[rest]
        )

    def estimates(self) -> dict[str, Estimate]:
        """Values and 95 % intervals by the names of the results."""
        of: dict[str, Vectors] = {
            "envelope_modulation": self.envelope,
            "phase_modulation": self.phase,
            "vector_strength": self.locked,
        }
        return {"demodulation_index": self._index(), **{name: self._size(part) for name, part in of.items()}}

    def _size(self, part: Vectors) -> Estimate:
        """Size of a mean vector (N, M) over the mean rate, and the ends of its interval.

        The variance of a square V without noise's share is 2 tr Σ² + 4 V uᵀΣu, with Σ the covariance of the mean and u
        its direction. It grows with V, and is taken at the larger of the found one and the end.
        """
        rows = np.hstack([part.real, part.imag]) if np.iscomplexobj(part) else part
        n, level = len(rows), self.level.mean()
        mean = rows.mean(0) / level
        scatter = np.cov((rows - self.level * mean).T / level) / n  # a gain of whole draws leaves the ratio as it is
        total, along = np.trace(scatter), float(mean @ scatter @ mean / (mean @ mean))
        squares = (n - 1) ** 2 / ((n + 1) * (n - 2)) * (np.sum(scatter**2) - total**2 / (n - 1))
        squares = max(squares, total**2 / mean.size)
        value, t = of_pairs(part) / of_pairs(self.level), float(stdtrit(n - 1, UPPER))
        low = value - t * np.sqrt(2 * squares + 4 * max(value, 0.0) * along)
        middle = value + 2 * t**2 * along
        high = middle + t * np.sqrt(max(2 * squares + 4 * along * (value + t**2 * along), 0.0))
        return Estimate(_root(value), _root(low), _root(high))

    def _index(self) -> Estimate:
        """The index, and the ends of its interval, within −1 to 1."""
        whole, rest = self._share(), np.array([self.without(draw)._share() for draw in range(len(self.level))])
        half = float(jackknife_half_width(rest, rest.mean()))
        return Estimate(*np.clip([whole, whole - half, whole + half], -1, 1).tolist())

    def _share(self) -> float:
        """(V_E − V_C)/(V_E + V_C) within −1 to 1: an estimated variance may fall below 0."""
        envelope, phase = (max(of_pairs(part), 0.0) for part in (self.envelope, self.phase))
        return (envelope - phase) / (envelope + phase) if envelope + phase > 0 else 0.0


def _root(squared: float) -> float:
    """Root that keeps the sign: chance makes an unbiased square negative as often as positive."""
    return float(np.sign(squared) * np.sqrt(abs(squared)))
