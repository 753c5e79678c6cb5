"""Coherence of two signals by frequency, corrected for the number of segments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import coherence, welch

from vibrissa.errors import InputError

Array = NDArray[np.float64]

_OVERLAP_COST = 1 + 2 / 36  # Hann segments that overlap by half: their periodograms correlate by (1/6)²


def corrected_coherence(signal: Array, reference: Array, sampling_rate: float, segment: float) -> tuple[Array, Array]:
    """Squared coherence by Welch's method, less what as many segments of unrelated signals give.

    Parameters
    ----------
    signal, reference : (T,) arrays
        On one even grid, any units.
    sampling_rate : float
        [Hz].
    segment : float
        Length of the Hann-tapered segments [s], overlapping by half; its inverse is the resolution.

    Returns
    -------
    frequency : (F,) array
        [Hz].
    squared : (F,) array
        (C − 1/n)/(1 − 1/n) for n independent segments: 0 on average where nothing is shared, 1 where all is.

    Raises
    ------
    InputError
        If the lengths differ, or there are fewer than 4 segments.
    """
    size = round(segment * sampling_rate)
    if signal.shape != reference.shape or signal.ndim != 1:
        raise InputError("signals", "must have one length", f"{signal.shape}, {reference.shape}")
    count = (len(signal) - size // 2) // (size - size // 2) if size > 1 else 0
    if count < 4:
        raise InputError("segment", "must fit into the record four times, half overlapping (s)", segment)
    frequency, squared = coherence(signal, reference, sampling_rate, nperseg=size)
    chance = _OVERLAP_COST / count
    return frequency, (squared - chance) / (1 - chance)


def banded(
    frequency: Array, squared: Array, reference: Array, sampling_rate: float, band: tuple[float, float]
) -> float:
    """Mean coherence over a band, weighted by the reference's power; NaN where the band holds no frequency.

    Parameters
    ----------
    frequency, squared : (F,) arrays
        From :func:`corrected_coherence`.
    reference : (T,) array
        The reference signal.
    sampling_rate : float
        [Hz].
    band : (float, float)
        [Hz].
    """
    size = 2 * (len(frequency) - 1)
    _, power = welch(reference, sampling_rate, nperseg=size)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    total = power[inside].sum()
    return float(power[inside] @ squared[inside] / total) if total > 0 else np.nan
