"""Coherence of two signals by frequency, corrected for the number of segments."""

from __future__ import annotations

import numpy as np
from scipy.signal import coherence, welch

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, ShapeError

_OVERLAP_COST = 1 + 2 / 36  # Hann segments that overlap by half: their periodograms correlate by (1/6)²


def band_coherence(
    signal: Array, reference: Array, sampling_rate: float, segment: float, band: tuple[float, float]
) -> float:
    """Mean squared coherence over a band, weighted by the reference's power, less what unrelated signals give.

    Parameters
    ----------
    signal, reference : (T,) arrays
        On one even grid, any units.
    sampling_rate : float
        [Hz].
    segment : float
        Length of the Hann-tapered segments [s], overlapping by half; its inverse is the resolution.
    band : (float, float)
        [Hz].

    Returns
    -------
    float
        Mean of (C − 1/n)/(1 − 1/n) for n independent segments: 0 on average where nothing is shared, 1 where all is;
        NaN where the band holds no frequency, or a signal is constant.

    Raises
    ------
    InputError
        If the lengths differ, or there are fewer than 4 segments.
    """
    size = round(segment * sampling_rate)
    if signal.shape != reference.shape or signal.ndim != 1:
        raise ShapeError("signals", "must have one length", f"{signal.shape}, {reference.shape}")
    count = (len(signal) - size // 2) // (size - size // 2) if size > 1 else 0
    if count < 4:
        raise RangeError("segment", "must fit into the record four times, half overlapping (s)", segment)
    if np.ptp(signal) == 0 or np.ptp(reference) == 0:
        return np.nan
    frequency, squared = coherence(signal, reference, sampling_rate, nperseg=size)
    chance = _OVERLAP_COST / count
    power = welch(reference, sampling_rate, nperseg=size)[1] * ((frequency >= band[0]) & (frequency <= band[1]))
    total = power.sum()
    return float(power @ ((squared - chance) / (1 - chance)) / total) if total > 0 else np.nan
