"""Drives of units besides the envelope: slow states, unrelated features of the stimulus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, require_not_negative, require_positive

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
            raise RangeError("SlowState.depth", "must lie between 0 and 1", self.depth)
        require_positive("SlowState.timescale", self.timescale, "s")
        require_not_negative("SlowState.trial_sd", self.trial_sd)

    def draw(self, n_trials: int, duration: float, *, rng: np.random.Generator) -> Array:
        """Gain of each trial in equal steps of at most ``STATE_STEP``, (n_trials, K).

        Parameters
        ----------
        n_trials : int
            Trials.
        duration : float
            Of a trial [s].
        rng : Generator
            Source of randomness.

        Returns
        -------
        (n_trials, K) array
            Gain, of mean 1.
        """
        n_steps = int(np.ceil(duration / STATE_STEP))
        switch = -np.expm1(-duration / n_steps / self.timescale) / 2  # by when the sign has forgotten itself so much
        flips = rng.random((n_trials, n_steps)) < np.concatenate([[0.5], np.full(n_steps - 1, switch)])
        up = np.cumsum(flips, axis=1) % 2
        sigma = np.sqrt(np.log1p(self.trial_sd**2))
        factor = np.exp(sigma * rng.standard_normal((n_trials, 1)) - sigma**2 / 2)
        return factor * (1 + self.depth * (2 * up - 1))


def unrelated_feature(time: Array, *, mean: float, timescale: float, rng: np.random.Generator) -> Array:
    """Feature of the stimulus that looks like an envelope but is independent of it.

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
