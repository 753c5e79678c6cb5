"""Simulated units of known truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from vibrissa.errors import InputError
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.neural.refractoriness import Refractoriness

Array = NDArray[np.float64]

STATE_STEP = 1e-3  # [s] a slow state is held constant for no longer


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


@dataclass(frozen=True, kw_only=True)
class SlowState:
    """Excitability that wanders by itself: up and down states, and good and bad trials.

    The gain is (1 ± depth), switching at random so that its correlation falls as exp(−|lag|/timescale), times a
    log-normal factor for each trial. Its mean is 1. Units given the same gain share their state.

    Attributes
    ----------
    depth : float
        Distance of the up and the down state from 1, below 1.
    timescale : float
        Correlation time of up and down [s].
    trial_sd : float
        Standard deviation of a trial's factor.
    """

    depth: float = 0.5
    timescale: float = 0.15
    trial_sd: float = 0.1

    def __post_init__(self) -> None:
        if not 0 <= self.depth < 1:
            raise InputError("SlowState.depth", "must lie between 0 and 1", self.depth)
        if not 0 < self.timescale < np.inf:
            raise InputError("SlowState.timescale", "must be positive (s)", self.timescale)
        if not 0 <= self.trial_sd < np.inf:
            raise InputError("SlowState.trial_sd", "must be zero or positive", self.trial_sd)

    def draw(self, n_trials: int, duration: float, *, rng: np.random.Generator) -> Array:
        """Gain of each trial in equal steps of at most ``STATE_STEP``, (n_trials, K)."""
        n_steps = int(np.ceil(duration / STATE_STEP))
        switch = -np.expm1(-duration / n_steps / self.timescale) / 2  # by when the sign has forgotten itself so much
        flips = rng.random((n_trials, n_steps)) < np.concatenate([[0.5], np.full(n_steps - 1, switch)])
        up = np.cumsum(flips, axis=1) % 2
        sigma = np.sqrt(np.log1p(self.trial_sd**2))
        factor = np.exp(sigma * rng.standard_normal((n_trials, 1)) - sigma**2 / 2)
        return factor * (1 + self.depth * (2 * up - 1))

    def covariance(self, lag: Array) -> Array:
        """Covariance of the gain with itself, (1 + trial_sd²)(1 + depth² exp(−|lag|/timescale)) − 1, at lags [s]."""
        return (1 + self.trial_sd**2) * (1 + self.depth**2 * np.exp(-np.abs(lag) / self.timescale)) - 1


def adapting(time: Array, rate: Array, *, excess: float = 1.0, timescale: float = 1.0) -> Array:
    """Rate of a unit that starts lively and calms down: rate·(1 + excess·exp(−(t − t₀)/timescale)).

    Parameters
    ----------
    time, rate : (T,) arrays
        Time of the presentation [s] and rate once calm [Hz].
    excess : float
        Share by which the first rate is higher.
    timescale : float
        Time constant [s].

    Returns
    -------
    (T,) array
        Rate [Hz].
    """
    return rate * (1 + excess * np.exp(-(time - time[0]) / timescale))


def unrelated_feature(time: Array, *, mean: float, timescale: float, rng: np.random.Generator) -> Array:
    """Feature of the stimulus that looks like an envelope and has nothing to do with it.

    Length of a wandering vector of two Ornstein–Uhlenbeck components: Rayleigh distributed, and the correlation of
    its square falls as exp(−|lag|/timescale).

    Parameters
    ----------
    time : (T,) array
        Even grid [s].
    mean : float
        Mean, in any unit.
    timescale : float
        Correlation time [s].
    rng : Generator
        Source of randomness.

    Returns
    -------
    (T,) array
        Feature, in the unit of the mean.
    """
    memory = np.exp(-(time[1] - time[0]) / (2 * timescale))
    kicks = rng.standard_normal((2, len(time))) * np.sqrt(1 - memory**2)
    kicks[:, 0] /= np.sqrt(1 - memory**2)  # so that it starts in its steady state
    return mean * np.sqrt(2 / np.pi) * np.hypot(*lfilter([1], [1, -memory], kicks))


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
    gain = np.ones((n_trials, 1)) if gain is None else gain
    if gain.ndim != 2 or len(gain) != n_trials:
        raise InputError("gain", f"must have shape ({n_trials}, steps)", gain.shape)
    if not (rate.min() >= 0 and gain.min() >= 0):
        raise InputError("rate and gain", "must be zero or positive", f"{rate.min()}, {gain.min()}")
    hazard = refractoriness.hazard if refractoriness else np.asarray
    highest, duration = float(hazard(rate.max() * gain.max())), float(time[-1] - time[0])
    trial = np.repeat(np.arange(n_trials), rng.poisson(highest * duration, n_trials))
    share = rng.random(trial.size)
    candidate = time[0] + duration * share
    step = np.minimum((share * gain.shape[1]).astype(int), gain.shape[1] - 1)
    chance = rng.random(trial.size) * highest
    wanted = hazard(np.interp(candidate, time, rate) * gain[trial, step])
    kept = np.flatnonzero(chance < wanted)
    kept = kept[np.lexsort((candidate[kept], trial[kept]))]
    if refractoriness:
        kept = kept[refractoriness.spare(candidate[kept], trial[kept], chance[kept] / wanted[kept])]
    return candidate[kept], trial[kept]


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
