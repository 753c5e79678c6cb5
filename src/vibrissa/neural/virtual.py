"""Simulated units of known truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]


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


def simulate_spikes(
    unit: HingeUnit, time: Array, envelope: Array, n_trials: int, *, rng: np.random.Generator
) -> xr.Dataset:
    """Poisson spikes of one unit on repeated presentations, by thinning.

    Parameters
    ----------
    unit : HingeUnit
        Gives the rate.
    time, envelope : (T,) arrays
        One presentation: time [s], ascending, and envelope [m].
    n_trials : int
        Repeats.
    rng : Generator
        Source of randomness.

    Returns
    -------
    Dataset
        Flat event table: ``spike_time`` [s], ``spike_trial`` (spike); sorted by trial, then time.

    Raises
    ------
    InputError
        If there is no trial.
    """
    if n_trials < 1:
        raise InputError("number of trials", "must be at least 1", n_trials)
    rate = unit.rate(time, envelope)
    highest, duration = float(rate.max()), float(time[-1] - time[0])
    trial = np.repeat(np.arange(n_trials), rng.poisson(highest * duration, n_trials))
    candidate = time[0] + duration * rng.random(trial.size)
    kept = rng.random(trial.size) * highest < np.interp(candidate, time, rate)
    order = np.lexsort((candidate[kept], trial[kept]))
    return dataset(
        {"n_trials": n_trials, "duration": duration},
        spike_time=candidate[kept][order],
        spike_trial=trial[kept][order],
    )
