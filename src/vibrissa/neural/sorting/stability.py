"""Whether a unit is there throughout a recording: share of the time in which it fires, drift of rate and amplitude."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Array

BIN = 60.0  # [s] of the bins of presence, as in SpikeInterface; a tenth of a recording shorter than ten minutes
BINS = 10
LEAST_SPIKES = 10  # from which a drift is given


def presence_ratio(elapsed: Array, duration: float) -> float:
    """Share of the whole bins of a recording in which a unit fires.

    Parameters
    ----------
    elapsed : (N,) array
        Time observed until each spike [s].
    duration : float
        Time observed [s].

    Returns
    -------
    float
        0 to 1; NaN if nothing was observed.
    """
    if not duration > 0:
        return np.nan
    width = min(BIN, duration / BINS)
    count = int(duration / width + 1e-9)
    index = np.minimum(elapsed / width + 1e-9, count).astype(int)
    return np.unique(index[index < count]).size / count


def rate_change(elapsed: Array, duration: float) -> float:
    """Change of a unit's rate from the start of a recording to its end, over its mean rate.

    A rate r (1 + c (t/T − ½)) has spikes whose mean time is T (½ + c/12), which gives c. Its standard error, from
    Poisson spikes, is √(12/N).

    Parameters
    ----------
    elapsed : (N,) array
        Time observed until each spike [s].
    duration : float
        Time T observed [s].

    Returns
    -------
    float
        0 for a steady unit, −2 for one that fades evenly to nothing; NaN with fewer than ten spikes.
    """
    if elapsed.size < LEAST_SPIKES or not duration > 0:
        return np.nan
    return float(12 * (np.mean(elapsed) / duration - 0.5))


def amplitude_change(elapsed: Array, amplitude: Array, duration: float) -> float:
    """Change of the spikes' amplitude from the start of a recording to its end, over its mean, by least squares.

    Parameters
    ----------
    elapsed : (N,) array
        Time observed until each spike [s].
    amplitude : (N,) array
        Amplitude of each, in any unit.
    duration : float
        Time observed [s].

    Returns
    -------
    float
        −0.5 for a unit that loses half of its mean amplitude; NaN with fewer than ten spikes.
    """
    centred = elapsed - elapsed.mean() if elapsed.size >= LEAST_SPIKES else np.zeros(0)
    spread, mean = float(centred @ centred), float(np.mean(amplitude)) if amplitude.size else 0.0
    if not spread > 0 or mean == 0:
        return np.nan
    return float(centred @ amplitude) / spread * duration / abs(mean)
