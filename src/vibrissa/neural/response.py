"""What a unit answers: counts per trial and bin, and their mean over trials."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import require

if TYPE_CHECKING:
    import xarray as xr


def spike_counts(
    spikes: xr.Dataset, *, n_trials: int, start: float, n_bins: int, bin_width: float
) -> NDArray[np.int64]:
    """Spikes of each trial in each half-open bin [start + k·width, start + (k+1)·width).

    Parameters
    ----------
    spikes : Dataset
        ``spike_time`` [s] and ``spike_trial``.
    n_trials, n_bins : int
        Trials presented, silent ones included; bins.
    start, bin_width : float
        Start of the first bin and width of each [s].

    Returns
    -------
    (n_trials, n_bins) array
        Counts; spikes outside the bins belong to none.

    Raises
    ------
    InputError
        If a spike belongs to a trial that does not exist, or the width is not positive.
    """
    require(spikes, "spike_time", "spike_trial")
    trial = spikes.spike_trial.values
    if trial.size and not 0 <= trial.min() <= trial.max() < n_trials:
        raise InputError("spike_trial", f"must lie between 0 and {n_trials - 1}", f"{trial.min()}…{trial.max()}")
    if not bin_width > 0:
        raise InputError("bin width", "must be positive (s)", bin_width)
    # the margin puts a spike on an edge into the bin that starts there: 0.29/0.01 is 28.999…
    column = np.floor((spikes.spike_time.values - start) / bin_width + 1e-9).astype(int)
    inside = (column >= 0) & (column < n_bins)
    counts = np.zeros((n_trials, n_bins), int)
    np.add.at(counts, (trial[inside], column[inside]), 1)
    return counts
