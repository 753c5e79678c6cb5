"""Rival codes of a whisker's motion in a population: envelope, spectrum, kinetic events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.signal import find_peaks

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, RangeError
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.signals.spectra import power_spectrum

APART = 2e-3  # [s] kinetic events that follow each other faster count as one


class Code(Protocol):
    """Drive of each unit of a population by one motion."""

    def drive(self, displacement: Array, sampling_rate: float, n_bins: int, /) -> Array:
        """Drive (U, n_bins), summed over each of ``n_bins`` equal parts of the motion (T,) [m]; zero or more.

        Parameters
        ----------
        displacement : (T,) array
            Motion of one point [m], on an even grid.
        sampling_rate : float
            [Hz].
        n_bins : int
            Equal parts of the motion.

        Returns
        -------
        (U, n_bins) array
            Drive of each unit in each part.
        """


@dataclass(frozen=True, kw_only=True)
class EnvelopeCode:
    """Units that fire in proportion to the envelope above their thresholds, as the paper finds in cortex.

    Their latencies are left out: whoever reads them knows them.

    Attributes
    ----------
    units : tuple of ThresholdLinearUnit
        The population; baselines are not part of the drive.
    """

    units: tuple[ThresholdLinearUnit, ...]

    def drive(self, displacement: Array, sampling_rate: float, n_bins: int) -> Array:
        """Spikes above the baseline expected in each part, (U, n_bins).

        Parameters
        ----------
        displacement : (T,) array
            Motion of one point [m], on an even grid.
        sampling_rate : float
            [Hz].
        n_bins : int
            Equal parts of the motion.

        Returns
        -------
        (U, n_bins) array
            Spikes expected above the baseline.
        """
        envelope, _ = analytic_envelope(displacement)
        above = [unit.slope * np.maximum(envelope - unit.threshold, 0) for unit in self.units]
        return _summed(np.array(above), n_bins) / sampling_rate


@dataclass(frozen=True, kw_only=True)
class SpectrumCode:
    """Units tuned to bands of the vibration: each fires in proportion to the rms of the displacement in its band.

    Attributes
    ----------
    edges : (U + 1,) array
        Edges of the bands [Hz], ascending.
    """

    edges: Array

    def __post_init__(self) -> None:
        if self.edges.ndim != 1 or not (np.diff(self.edges) > 0).all() or not self.edges[0] >= 0:
            raise RangeError("SpectrumCode.edges", "must ascend from zero or above (Hz)", self.edges)

    def drive(self, displacement: Array, sampling_rate: float, n_bins: int) -> Array:
        """Time [s] times rms [m] in each band, the same in every part: a spectrum takes all of the motion.

        Parameters
        ----------
        displacement, sampling_rate, n_bins
            As in :meth:`Code.drive`.

        Returns
        -------
        (U, n_bins) array
            [s m].

        Raises
        ------
        InputError
            If a band lies between the frequencies that so short a motion resolves, or above half the sampling rate.
        """
        if self.edges[-1] > sampling_rate / 2:
            rule = f"must not exceed half the sampling rate, {sampling_rate / 2:g} Hz"
            raise RangeError("SpectrumCode.edges", rule, self.edges, "leave out the bands above, or sample faster")
        frequency, power = power_spectrum(displacement, sampling_rate)
        first = np.searchsorted(frequency, self.edges)
        if np.any(np.diff(first) == 0):
            raise ConflictError("SpectrumCode.edges", f"must be wider apart than {frequency[1]:.3g} Hz", self.edges)
        rms = np.sqrt(np.add.reduceat(np.append(power, 0.0), first)[:-1] * frequency[1])
        return np.repeat(rms[:, None] / n_bins, n_bins, axis=1) * displacement.size / sampling_rate


@dataclass(frozen=True, kw_only=True)
class EventCode:
    """Units that answer kinetic events, the high-acceleration slips of the whisker, above a size of their own.

    An event is a peak of the magnitude of the acceleration, at least 2 ms from a larger one. A unit answers each event
    that exceeds its threshold with the same number of spikes.

    Attributes
    ----------
    thresholds : (U,) array
        Accelerations [m/s²].
    """

    thresholds: Array

    def drive(self, displacement: Array, sampling_rate: float, n_bins: int) -> Array:
        """Events that exceed each unit's threshold in each part, (U, n_bins).

        Parameters
        ----------
        displacement : (T,) array
            Motion of one point [m], on an even grid.
        sampling_rate : float
            [Hz].
        n_bins : int
            Equal parts of the motion.

        Returns
        -------
        (U, n_bins) array
            Events in each part.
        """
        place, size = kinetic_events(displacement, sampling_rate)
        part = np.minimum((place * n_bins).astype(int), n_bins - 1)
        return np.array([np.bincount(part[size > one], minlength=n_bins) for one in self.thresholds], float)


def kinetic_events(displacement: Array, sampling_rate: float) -> tuple[Array, Array]:
    """Peaks of the magnitude of the acceleration.

    Parameters
    ----------
    displacement : (T,) array
        [m], on an even grid.
    sampling_rate : float
        [Hz].

    Returns
    -------
    place, size : (E,) arrays
        When, as a share of the motion's duration, 0 to 1; acceleration [m/s²].
    """
    acceleration = np.abs(np.diff(displacement, 2)) * sampling_rate**2
    peaks, _ = find_peaks(acceleration, distance=max(1, round(APART * sampling_rate)))
    return (peaks + 1) / displacement.size, acceleration[peaks]


def _summed(values: Array, n_bins: int) -> Array:
    """Sums over equal parts of the last axis."""
    edges = np.round(np.arange(n_bins) * values.shape[-1] / n_bins).astype(int)
    return np.add.reduceat(values, edges, axis=-1)
