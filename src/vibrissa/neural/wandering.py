"""What drives units besides the envelope: slow states, a lively start, features of no concern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from vibrissa.errors import InputError

Array = NDArray[np.float64]

STATE_STEP = 1e-3  # [s] a slow state is held constant for no longer


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
