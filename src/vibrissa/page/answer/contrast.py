"""Discrimination of two textures by one neuron in a single scan."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array

BIN = 0.01  # [s] the paper's bins


def expected_counts(time: Array, rate: Array, duration: float) -> Array:
    """Spikes expected in each whole bin of 10 ms.

    Parameters
    ----------
    time, rate : (T,) arrays
        Times [s] and rates [Hz].
    duration : float
        End of the last bin at most [s].

    Returns
    -------
    (B,) array
        Expected counts.
    """
    edges = BIN * np.arange(int(duration / BIN + 1e-9) + 1)
    area = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(time))])
    return np.diff(np.interp(edges, time, area))


def discrimination(first: Array, second: Array) -> float:
    """d′ of the linear observer of independent Poisson counts, √Σ (μ₁ − μ₂)²/((μ₁ + μ₂)/2).

    Its weights are the best linear ones for the mean of the two variances; d′ is the difference of its means over the
    root mean square of its two standard deviations. It knows both rates, and when the scan began.

    Parameters
    ----------
    first, second : (B,) arrays
        Counts expected in each bin; their sums alone give d′ by the number of spikes.

    Returns
    -------
    float
        d′, not negative.
    """
    mean = (first + second) / 2
    return float(np.sqrt(np.sum(np.divide((first - second) ** 2, mean, out=np.zeros_like(mean), where=mean > 0))))
