"""Units of known truth: their rates, and spikes drawn at a rate by thinning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, get_args

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.errors import RangeError, ShapeError, TooFewError, require_not_negative
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.neural.simulated.refractoriness import Refractoriness


Felt = Literal["envelope", "phase"]  # what a whisker's displacement is taken for

_BLOCK = 1_000_000  # candidates that are thinned at a time
_NONE = np.empty(0), np.empty(0, np.int64), np.empty(0)


class Unit(Protocol):
    """Anything that turns a driving signal into a firing rate."""

    drive: ClassVar[Felt]

    def rate(self, time: Array, drive: Array, /) -> Array:
        """Firing rate [Hz], (T,), at times [s] (T,) under a drive (T,).

        Parameters
        ----------
        time, drive : (T,) arrays
            Times [s], and the signal that drives the unit.

        Returns
        -------
        (T,) array
            Firing rate [Hz].
        """


@dataclass(frozen=True, kw_only=True)
class ThresholdLinearUnit:
    """A unit that fires in proportion to the envelope above a threshold.

    Attributes
    ----------
    model : str
        Name of the model in a study file.
    threshold : float
        Envelope below which the unit keeps its baseline [m].
    slope : float
        Gain above the threshold [1/(s m)]: 0.25 AP/s per µm is 2.5e5.
    baseline : float
        Rate below the threshold [Hz].
    latency : float
        Delay from envelope to rate [s].
    """

    drive: ClassVar[Felt] = "envelope"
    model: Literal["threshold-linear"] = "threshold-linear"
    threshold: float = 42.3e-6
    slope: float = 2.5e5
    baseline: float = 5.0
    latency: float = 0.012

    def __post_init__(self) -> None:
        for name in ("threshold", "slope", "baseline", "latency"):
            require_not_negative(f"ThresholdLinearUnit.{name}", getattr(self, name))

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
    model : str
        Name of the model in a study file.
    baseline : float
        Mean rate [Hz].
    depth : float
        Depth of the modulation, 0 to 1; the vector strength is depth/2.
    preferred : float
        Phase of the highest rate [rad].
    latency : float
        Delay from phase to rate [s].
    """

    drive: ClassVar[Felt] = "phase"
    model: Literal["carrier-phase"] = "carrier-phase"
    baseline: float = 5.0
    depth: float = 0.8
    preferred: float = 0.0
    latency: float = 0.012

    def __post_init__(self) -> None:
        for name in ("baseline", "latency"):
            require_not_negative(f"PhaseUnit.{name}", getattr(self, name))
        if not 0 <= self.depth <= 1:
            raise RangeError("PhaseUnit.depth", "must lie between 0 and 1", self.depth)

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


NeuronModel = ThresholdLinearUnit | PhaseUnit  # those that a study file may name, by their key ``model``
NEURON_MODELS: dict[str, type[NeuronModel]] = {kind.model: kind for kind in get_args(NeuronModel)}


def draw_spikes(
    time: Array,
    rate: Array,
    n_trials: int,
    *,
    rng: np.random.Generator,
    gain: Array | None = None,
    refractoriness: Refractoriness | None = None,
) -> tuple[Array, Integers]:
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
        The unit keeps its mean rate (see :meth:`~vibrissa.neural.simulated.refractoriness.Refractoriness.hazard`).

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
        raise RangeError("number of trials", "must be at least 1", n_trials)
    if len(time) < 2:
        raise TooFewError("time", "must have at least 2 samples", len(time))
    gain = np.ones((n_trials, 1)) if gain is None else gain
    if gain.ndim != 2 or len(gain) != n_trials:
        raise ShapeError("gain", f"must have shape ({n_trials}, steps)", gain.shape)
    if not (rate.min() >= 0 and gain.min() >= 0):
        raise RangeError("rate and gain", "must be zero or positive", f"{rate.min()}, {gain.min()}")
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
    """Rate between the samples; on an even grid its place follows from the share of the span, ten times faster."""
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
        One presentation: time [s], ascending, and what drives the unit: the envelope [m] of a
        :class:`ThresholdLinearUnit`, the phase [rad] of a :class:`PhaseUnit`.
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
