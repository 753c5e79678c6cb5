"""Refractoriness: after a spike a unit falls silent, then recovers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammainc, gammaln

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import RangeError, require_not_negative
from vibrissa.loops import njit

ROUNDING = 1e-8  # [s] by which an interval may miss a period on the same clock: 0.011 − 0.010 < 0.001 in binary numbers

_HAZARDS = np.geomspace(1e-3, 1e6, 1024)  # [Hz] tabulated to invert the mean rate; interpolated to about 1e-5


@dataclass(frozen=True, kw_only=True)
class Refractoriness:
    """Recovery of a unit's hazard with the age u since its last spike.

    w(u) = 0 for u < absolute, then 1 − exp(−(u − absolute)/relative). Only the last spike counts (a renewal process
    where the drive is steady).

    Attributes
    ----------
    absolute : float
        Silence after each spike [s].
    relative : float
        Time constant of the recovery that follows [s]; 0 for none.
    """

    absolute: float = 1e-3
    relative: float = 2e-3

    def __post_init__(self) -> None:
        for name in ("absolute", "relative"):
            require_not_negative(f"Refractoriness.{name}", getattr(self, name), "s")

    def firing_rate(self, hazard: ArrayLike) -> Array:
        """Mean rate at a steady hazard: one over the mean interval.

        With a = h·relative the mean interval is absolute + eᵃ a¹⁻ᵃ γ(a, a)/h, γ the lower incomplete gamma function;
        for relative = 0 it is absolute + 1/h.

        Parameters
        ----------
        hazard : (...) array
            h [Hz].

        Returns
        -------
        (...) array
            Spikes per second [Hz].
        """
        h = np.maximum(np.asarray(hazard, float), 1e-300)
        a = np.maximum(h * self.relative, 1e-12)  # the factor is 1 there to as many digits
        wait = np.exp(a - a * np.log(a) + gammaln(1 + a)) * gammainc(a, a) / h
        return 1 / (self.absolute + wait)

    def hazard(self, rate: ArrayLike) -> Array:
        """Hazard that makes a unit fire at this rate: the inverse of :meth:`firing_rate`.

        Exact where the rate is steady, and good where it changes little from one spike to the next.

        Parameters
        ----------
        rate : (...) array
            Rate wanted [Hz].

        Returns
        -------
        (...) array
            h [Hz].

        Raises
        ------
        InputError
            If a unit that rests so long cannot fire at that rate.
        """
        rate = np.asarray(rate, float)
        reached = self.firing_rate(_HAZARDS)
        if rate.size and rate.max() > reached[-1]:
            raise RangeError("firing rate", f"must stay below {reached[-1]:.4g} Hz for this refractoriness", rate.max())
        return rate * np.interp(rate, reached, _HAZARDS / reached)

    def spare(self, time: Array, trial: Integers, chance: Array) -> Mask:
        """Thin the spikes of a Poisson process of rate h to those that a refractory unit fires.

        A spike is kept with probability w(age since the last one kept): exact, as w ≤ 1.

        Parameters
        ----------
        time, trial : (N,) arrays
            Times [s] and trials, sorted by trial, then time.
        chance : (N,) array
            Independent, uniform between 0 and 1.

        Returns
        -------
        (N,) array of bool
            Whether the spike is kept; the first of a trial always is.
        """
        return _spare(time, trial, chance, self.absolute, self.relative)


def below(interval: ArrayLike, period: float) -> Mask:
    """Whether intervals between spikes are shorter than a period, whatever the rounding of the spikes' times.

    Spike times are multiples of the step of the recording's clock, rounded to binary numbers. An interval as long as
    the period must not count as shorter through that rounding, of some 1e-9 s in a session of 100 days; clocks step by
    1e-7 s or more.

    Parameters
    ----------
    interval : (...) array
        Differences of spike times [s].
    period : float
        The period [s].

    Returns
    -------
    (...) array of bool
        Whether each is shorter.
    """
    return np.asarray(np.asarray(interval, float) < period - ROUNDING)


@njit(cache=True, error_model="numpy")
def _spare(
    time: Array, trial: Integers, chance: Array, absolute: float, relative: float
) -> Mask:  # pragma: no cover - compiled
    kept = np.zeros(len(time), np.bool_)
    last = -np.inf
    for i in range(len(time)):
        if i > 0 and trial[i] != trial[i - 1]:
            last = -np.inf
        after = time[i] - last - absolute
        w = 0.0 if after < -ROUNDING else (1.0 if relative == 0 else 1 - np.exp(-after / relative))
        if chance[i] < w:
            kept[i] = True
            last = time[i]
    return kept
