"""What of a rate follows the envelope and what the carrier's phase: columns, and each trial's own estimates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.special import stdtrit

from vibrissa.neural.presentation import Presentation

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

KNOTS = (0.25, 0.5, 0.75)  # shares of the time at which the rate may bend with the envelope


class Estimate(NamedTuple):
    """A number and its 95 % interval, from leaving out one trial at a time."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Explained:
    """What the envelope and the phase can explain of a rate at one latency.

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
        """Take the columns at bins' centres less a latency; phase: of the carrier, unwrapped (T,) [rad]."""
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

    def variance_told(self, rate: Array) -> float:
        """Variance of a rate that all columns explain."""
        product = np.vstack([self.envelope, self.phase]) @ rate
        return float(product @ (self.solver @ rate)) / rate.size


def by_chance(columns: Array, rate: Array, reach: int, guard: int) -> float:
    """How often columns explain as much of a rate at shifts where they cannot have driven it.

    Variance explained at every circular shift by the Fourier transform, the largest of as many shifts as latencies are
    tried. What a unit answers in every trial alike, such as some other feature of the stimulus, goes with envelope or
    phase by chance at every shift; scatter between trials does not tell.

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
        (1 + shifts at least as good) / (1 + shifts).
    """
    spectra = np.conj(np.fft.rfft(columns)) * np.fft.rfft(rate - rate.mean())
    product = np.fft.irfft(spectra, rate.size)
    told = np.einsum("ck,cd,dk->k", product, np.linalg.inv(columns @ columns.T), product, optimize=True)
    largest = maximum_filter1d(told, reach + 1, mode="wrap", origin=-((reach + 1) // 2))  # of each shift and the next
    chance = largest[reach + guard : rate.size - reach - guard]
    return float((1 + np.sum(chance >= largest[0] * (1 - 1e-9))) / (1 + chance.size))


def _centred(columns: Array) -> Array:
    return np.asarray(columns - columns.mean(1, keepdims=True))


def of_pairs(z: Array | Complex) -> float:
    """Mean over pairs of different trials of their scalar product: the squared mean without the noise's share.

    The principle of the pairwise phase consistency of [Vinck2010]_, between trials, so that a unit's own past does not
    count.

    Parameters
    ----------
    z : (N, M) array
        One vector for each trial.
    """
    n, total = len(z), z.sum(0)
    return float((np.vdot(total, total) - np.vdot(z, z)).real / (n * (n - 1)))


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Each trial's own estimates of what follows the envelope and what the phase.

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
    def of(cls, best: Explained, counts: Array) -> Parts:
        """Take the estimates of each trial; they are linear in its counts."""
        found = counts @ best.solver.T
        n_envelope, size = len(best.envelope), counts.shape[1]
        envelope, phase = found[:, :n_envelope], found[:, n_envelope:]
        return cls(
            envelope=envelope @ np.linalg.cholesky(best.envelope @ best.envelope.T / size),
            phase=phase @ np.linalg.cholesky(best.phase @ best.phase.T / size),
            locked=(phase @ (best.phase @ best.carrier.conj() / size))[:, None],
            level=counts.mean(1, keepdims=True),
        )

    def without(self, trial: int) -> Parts:
        """Leave out a trial."""
        rest = np.arange(len(self.level)) != trial
        return Parts(
            envelope=self.envelope[rest], phase=self.phase[rest], locked=self.locked[rest], level=self.level[rest]
        )

    def measures(self) -> dict[str, Measure]:
        """Functions of the parts, by the names of the results."""
        return {
            "demodulation_index": lambda one: _index(of_pairs(one.envelope), of_pairs(one.phase)),
            "envelope_modulation": lambda one: _root(of_pairs(one.envelope) / of_pairs(one.level)),
            "phase_modulation": lambda one: _root(of_pairs(one.phase) / of_pairs(one.level)),
            "vector_strength": lambda one: _root(of_pairs(one.locked) / of_pairs(one.level)),
        }

    def interval(self, measure: Measure) -> Estimate:
        """Value and interval of a function of the parts."""
        n, whole = len(self.level), measure(self)
        rest = np.array([measure(self.without(trial)) for trial in range(n)])
        half = float(stdtrit(n - 1, 0.975) * np.sqrt((n - 1) / n * np.sum((rest - rest.mean()) ** 2)))
        return Estimate(whole, whole - half, whole + half)


def _index(envelope: float, phase: float) -> float:
    """(V_E − V_C)/(V_E + V_C) within −1 to 1: an estimated variance may fall below 0."""
    envelope, phase = max(envelope, 0.0), max(phase, 0.0)
    return (envelope - phase) / (envelope + phase) if envelope + phase > 0 else 0.0


def _root(squared: float) -> float:
    """Root that keeps the sign: chance makes an unbiased square negative as often as positive."""
    return float(np.sign(squared) * np.sqrt(abs(squared)))


Measure = Callable[[Parts], float]
