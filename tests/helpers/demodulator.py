"""A unit that finds the envelope itself: rectify, smooth, compare with a threshold."""

from dataclasses import dataclass

import numpy as np

from vibrissa.errors import RangeError
from vibrissa.signals.smoothing import low_pass


@dataclass(frozen=True, kw_only=True)
class Demodulator:
    """A unit driven by the displacement alone, with no envelope computed for it.

    Rectify, smooth and scale: D = (π/2)·low-pass |x|. The mean of |A sin ωt| is 2A/π, so a steady tone of amplitude A
    gives D = A, less a ripple at 2ω. Then the rate is baseline + slope·max(D − θ, 0), with a threshold that adapts,
    θ = threshold + adaptation·(slow low-pass of D).

    Attributes
    ----------
    threshold : float
        Amplitude of a steady tone that just drives the unit, not adapted [m].
    slope : float
        Gain above it [1/(s m)].
    baseline : float
        Rate below it [Hz].
    latency : float
        Delay from displacement to rate, the smoothing's not counted [s].
    smoothing : float
        Time constant of the first low-pass [s]; the envelope is felt late by about as much.
    adaptation : float
        Share of the recent D that is added to the threshold, 0 to 1.
    adaptation_time : float
        Time constant of "recent" [s].
    """

    threshold: float = 30e-6
    slope: float = 2.5e5
    baseline: float = 5.0
    latency: float = 0.008
    smoothing: float = 0.008
    adaptation: float = 0.2
    adaptation_time: float = 0.5

    def __post_init__(self):
        for name in ("threshold", "slope", "baseline", "latency"):
            if not 0 <= getattr(self, name) < np.inf:
                raise RangeError(f"Demodulator.{name}", "must be zero or positive", getattr(self, name))
        for name in ("smoothing", "adaptation_time"):
            if not 0 < getattr(self, name) < np.inf:
                raise RangeError(f"Demodulator.{name}", "must be positive (s)", getattr(self, name))
        if not 0 <= self.adaptation < 1:
            raise RangeError("Demodulator.adaptation", "must lie between 0 and 1", self.adaptation)

    def demodulate(self, time, displacement):
        """Smoothed rectified displacement D [m], (T,), without the latency."""
        return np.pi / 2 * low_pass(time, np.abs(displacement), self.smoothing)

    def rate(self, time, displacement):
        """Firing rate [Hz] at the given times.

        Parameters
        ----------
        time, displacement : (T,) arrays
            Even grid [s] and displacement about rest [m]; at rest before the first sample.

        Returns
        -------
        (T,) array
            baseline + slope·max(D(t − latency) − θ(t − latency), 0).
        """
        found = self.demodulate(time, displacement)
        theta = self.threshold + self.adaptation * low_pass(time, found, self.adaptation_time)
        above = np.maximum(found - theta, 0)
        return self.baseline + self.slope * np.interp(time - self.latency, time, above, left=0.0)
