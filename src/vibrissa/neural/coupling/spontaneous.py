"""Spontaneous firing: spikes in a window without stimulus."""

from __future__ import annotations

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Mask, Window


def spontaneous_rates(spikes: xr.Dataset, observed: Mask, window: Window | None) -> Array:
    """Rate of each unit in the window without stimulus, over the trials in which it was observed.

    Parameters
    ----------
    spikes : Dataset
        In trials; see :func:`vibrissa.neural.io.tables.spikes.spike_table`.
    observed : (U, N) array of bool
        Trials in which each unit was observed.
    window : (float, float), optional
        From the onset [s], half-open.

    Returns
    -------
    (U,) array
        [Hz]; NaN without a window, and of a unit that was observed in no trial.
    """
    n_units = spikes.sizes["unit"]
    if window is None:
        return np.full(n_units, np.nan)
    start, stop = window
    inside = (spikes.spike_time.values >= start) & (spikes.spike_time.values < stop)
    inside &= observed[spikes.spike_unit.values, spikes.spike_trial.values]
    count = np.bincount(spikes.spike_unit.values[inside], minlength=n_units)
    number = observed.sum(1)
    return count / (np.where(number > 0, number, np.nan) * (stop - start))
