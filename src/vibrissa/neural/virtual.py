"""Simulated units of known truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.neural.refractoriness import Refractoriness

Array = NDArray[np.float64]

_BLOCK = 1_000_000  # candidates that are thinned at a time
_NONE = np.empty(0), np.empty(0, np.int64), np.empty(0)


class Unit(Protocol):
    """Anything that turns a driving signal into a firing rate."""

    def rate(self, time: Array, drive: Array, /) -> Array:
        """Firing rate [Hz], (T,), at times [s] (T,) under a drive (T,)."""


@dataclass(frozen=True, kw_only=True)
class HingeUnit:
    """A unit that fires in proportion to the envelope above a threshold.

    Attributes
    ----------
    threshold : float
        Envelope below which the unit keeps its baseline [m].
    slope : float
        Gain above the threshold [1/(s m)]: 0.25 AP/s per µm is 2.5e5.
    baseline : float
        Rate below the threshold [Hz].
    latency : float
        Delay from envelope to rate [s].
    """

    threshold: float = 42.3e-6
    slope: float = 2.5e5
    baseline: float = 5.0
    latency: float = 0.012

    def __post_init__(self) -> None:
        for name in ("threshold", "slope", "baseline", "latency"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"HingeUnit.{name}", "must be zero or positive", getattr(self, name))

    def rate(self, time: Array, envelope: Array) -> Array:
        """Firing rate [Hz] at the given times; before the first sample plus latency, the baseline.

        Parameters
        ----------
        time, envelope : (T,) arrays
            Time [s] and envelope [m].

        Returns
        -------
        (T,) array
            baseline + slope · max(A(t − latency) − threshold, 0).
        """
        delayed = np.interp(time - self.latency, time, envelope, left=0.0)
        return self.baseline + self.slope * np.maximum(delayed - self.threshold, 0)


@dataclass(frozen=True, kw_only=True)
class PhaseUnit:
    """A unit locked to the carrier's phase and blind to its amplitude.

    Attributes
    ----------
    baseline : float
        Mean rate [Hz].
    depth : float
        Depth of the modulation, 0 to 1; the vector strength is depth/2.
    preferred : float
        Phase of the highest rate [rad].
    latency : float
        Delay from phase to rate [s].
    """

    baseline: float = 5.0
    depth: float = 0.8
    preferred: float = 0.0
    latency: float = 0.012

    def __post_init__(self) -> None:
        for name in ("baseline", "latency"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"PhaseUnit.{name}", "must be zero or positive", getattr(self, name))
        if not 0 <= self.depth <= 1:
            raise InputError("PhaseUnit.depth", "must lie between 0 and 1", self.depth)

    def rate(self, time: Array, phase: Array) -> Array:
        """Firing rate [Hz] at the given times; before the first sample plus latency, the baseline.

        Parameters
        ----------
        time, phase : (T,) arrays
            Time [s] and phase of the carrier [rad], wrapped or not.

        Returns
        -------
        (T,) array
            baseline·(1 + depth·cos(phase(t − latency) − preferred)).
        """
        felt = np.interp(time - self.latency, time, np.unwrap(phase))
        locked = np.where(time - self.latency < time[0], 0.0, np.cos(felt - self.preferred))
        return self.baseline * (1 + self.depth * locked)


def draw_spikes(
    time: Array,
    rate: Array,
    n_trials: int,
    *,
    rng: np.random.Generator,
    gain: Array | None = None,
    refractoriness: Refractoriness | None = None,
) -> tuple[Array, NDArray[np.int64]]:
    """Spikes at a rate, by thinning: exact for a rate that is straight between the samples.

    Parameters
    ----------
    time, rate : (T,) arrays
        Time of one presentation [s], ascending, and firing rate [Hz].
    n_trials : int
        Repeats.
    rng : Generator
        Source of randomness.
    gain : (n_trials, K) array, optional
        Multiplies the rate, in K equal steps of the presentation.
    refractoriness : Refractoriness, optional
        The unit keeps its mean rate (see :meth:`~vibrissa.neural.refractoriness.Refractoriness.hazard`).

    Returns
    -------
    spike_time, spike_trial : (N,) arrays
        Times [s] and trials, sorted by trial, then time.

    Raises
    ------
    InputError
        If there is no trial, a rate or gain is negative, or the gain is not one per trial.
    """
    if n_trials < 1:
        raise InputError("number of trials", "must be at least 1", n_trials)
    if len(time) < 2:
        raise InputError("time", "must have at least 2 samples", len(time))
    gain = np.ones((n_trials, 1)) if gain is None else gain
    if gain.ndim != 2 or len(gain) != n_trials:
        raise InputError("gain", f"must have shape ({n_trials}, steps)", gain.shape)
    if not (rate.min() >= 0 and gain.min() >= 0):
        raise InputError("rate and gain", "must be zero or positive", f"{rate.min()}, {gain.min()}")
    hazard = refractoriness.hazard if refractoriness else np.asarray
    highest, duration = float(hazard(rate.max() * gain.max())), float(time[-1] - time[0])
    ends = np.cumsum(rng.poisson(highest * duration, n_trials))
    shares = rng.random(ends[-1])
    chances = rng.random(ends[-1])
    found = []
    for first in range(0, int(ends[-1]), _BLOCK):  # a steep unit has candidates by the ten million
        share, chance = shares[first : first + _BLOCK], chances[first : first + _BLOCK] * highest
        trial = np.searchsorted(ends, np.arange(first, first + share.size), side="right")
        candidate = time[0] + duration * share
        step = np.minimum((share * gain.shape[1]).astype(int), gain.shape[1] - 1)
        wanted = hazard(_rate_at(candidate, share, time, rate) * gain[trial, step])
        kept = np.flatnonzero(chance < wanted)
        found.append((candidate[kept], trial[kept], chance[kept] / wanted[kept]))
    candidate, trial, luck = (np.concatenate(part) for part in zip(*found, strict=True)) if found else _NONE
    order = np.lexsort((candidate, trial))
    if refractoriness:
        order = order[refractoriness.spare(candidate[order], trial[order], luck[order])]
    return candidate[order], trial[order]


def _rate_at(when: Array, share: Array, time: Array, rate: Array) -> Array:
    """Rate between the samples; on an even grid the share of its span tells where, ten times faster than a search."""
    step = np.diff(time)
    if not np.allclose(step, step[0], rtol=1e-9, atol=0):
        return np.interp(when, time, rate)
    place = share * len(step)
    left = np.minimum(place.astype(int), len(step) - 1)
    return rate[left] + (place - left) * np.diff(rate)[left]


def simulate_spikes(
    unit: Unit,
    time: Array,
    drive: Array,
    n_trials: int,
    *,
    rng: np.random.Generator,
    gain: Array | None = None,
    refractoriness: Refractoriness | None = None,
) -> xr.Dataset:
    """Spikes of one unit on repeated presentations; Poisson unless it is refractory or its gain wanders.

    Parameters
    ----------
    unit : Unit
        Gives the rate.
    time, drive : (T,) arrays
        One presentation: time [s], ascending, and what drives the unit: the envelope [m] of a :class:`HingeUnit`, the
        phase [rad] of a :class:`PhaseUnit`, the displacement [m] of a
        :class:`~vibrissa.neural.demodulator.Demodulator`.
    n_trials, rng, gain, refractoriness
        As in :func:`draw_spikes`.

    Returns
    -------
    Dataset
        Flat event table: ``spike_time`` [s], ``spike_trial`` (spike); sorted by trial, then time.

    Raises
    ------
    InputError
        As :func:`draw_spikes`.
    """
    when, trial = draw_spikes(time, unit.rate(time, drive), n_trials, rng=rng, gain=gain, refractoriness=refractoriness)
    attrs = {"n_trials": n_trials, "duration": float(time[-1] - time[0])}
    return dataset(attrs, spike_time=when, spike_trial=trial)
