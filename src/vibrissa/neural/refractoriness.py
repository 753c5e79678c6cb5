"""Refractoriness: after a spike a unit falls silent, then recovers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammainc, gammaln

from vibrissa.errors import InputError

Array = NDArray[np.float64]

_HAZARDS = np.geomspace(1e-3, 1e6, 1024)  # [Hz] tabulated to invert the mean rate; interpolated to about 1e-5


@dataclass(frozen=True, kw_only=True)
class Refractoriness:
    """What is left of a unit's hazard at an age u after its last spike.

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
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"Refractoriness.{name}", "must be zero or positive (s)", getattr(self, name))

    def recovery(self, age: ArrayLike) -> Array:
        """Share w of the hazard that is back at this age [s]."""
        after = np.maximum(np.asarray(age, float) - self.absolute, 0.0)
        if self.relative == 0:
            return np.where(np.asarray(age) >= self.absolute, 1.0, 0.0)
        return -np.expm1(-after / self.relative)

    def survival(self, age: ArrayLike, hazard: float) -> Array:
        """Probability that an interval is longer than this age, at a steady hazard.

        S(u) = exp(−h ∫₀ᵘ w).

        Parameters
        ----------
        age : (...) array
            u [s].
        hazard : float
            Steady hazard h of the recovered unit [Hz].

        Returns
        -------
        (...) array
            S, between 0 and 1.
        """
        after = np.maximum(np.asarray(age, float) - self.absolute, 0.0)
        return np.exp(-hazard * (after - self.relative * self.recovery(age)))

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
            raise InputError("firing rate", f"must stay below {reached[-1]:.4g} Hz for this refractoriness", rate.max())
        return rate * np.interp(rate, reached, _HAZARDS / reached)

    def spare(self, time: Array, trial: NDArray[np.int64], chance: Array) -> NDArray[np.bool_]:
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


@njit(cache=True, error_model="numpy")
def _spare(time, trial, chance, absolute, relative):  # type: ignore[no-untyped-def]
    kept = np.zeros(len(time), np.bool_)
    last = -np.inf
    for i in range(len(time)):
        if i > 0 and trial[i] != trial[i - 1]:
            last = -np.inf
        after = time[i] - last - absolute
        w = 0.0 if after < 0 else (1.0 if relative == 0 else 1 - np.exp(-after / relative))
        if chance[i] < w:
            kept[i] = True
            last = time[i]
    return kept
