"""What of a response repeats from trial to trial, and how variable trials are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array


class Variability(NamedTuple):
    """Variability of a unit's counts from trial to trial.

    Attributes
    ----------
    fano_factor : float
        Variance over mean of the counts of a bin, over all bins: 1 for Poisson counts.
    gain_sd : float
        Standard deviation, over the mean, of what multiplies whole trials beyond that; 0 where there is none.
    """

    fano_factor: float
    gain_sd: float


def explainable_variance(rates: Array) -> float:
    """Variance over bins of the rate that all trials share, without that of their noise.

    The mean over pairs of different trials of their covariance over bins, as Sahani and Linden (2003) do: what one
    trial has for itself, Poisson or not, adds nothing on average.

    Parameters
    ----------
    rates : (N, K) array
        Rate of each trial and bin.

    Returns
    -------
    float
        In the square of the rate's unit; chance may make it negative. NaN for one trial.
    """
    n = len(rates)
    if n < 2:
        return np.nan
    return float((rates.sum(0).var() - rates.var(1).sum()) / (n * (n - 1)))


def r_squared_ceiling(rates: Array) -> float:
    """Largest share of the variance of the mean rate that a function of the stimulus can explain.

    Parameters
    ----------
    rates : (N, K) array
        Rate of each trial and bin.

    Returns
    -------
    float
        0 to 1; NaN for one trial or a constant rate.
    """
    total = float(rates.mean(0).var())
    return float(np.clip(explainable_variance(rates) / total, 0, 1)) if total > 0 else np.nan


def variability(counts: Array) -> Variability:
    """Fano factor of the bins, and the gain that whole trials share.

    Parameters
    ----------
    counts : (N, K) array
        Counts of each trial and bin.

    Returns
    -------
    Variability
        NaN for one trial, or without a spike.
    """
    n, level = len(counts), float(counts.sum(1).mean())
    if n < 2 or level == 0:
        return Variability(np.nan, np.nan)
    within = counts.var(0, ddof=1).sum()
    beyond = (float(counts.sum(1).var(ddof=1)) - within) / level**2
    return Variability(float(within / level), float(np.sqrt(max(beyond, 0.0))))
