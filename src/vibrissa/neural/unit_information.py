"""Information of every unit of a recording, with why it cannot be told where it cannot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.neural.information import Information, count_information, information_rate, spike_information
from vibrissa.neural.response import bin_edges, psth
from vibrissa.quantities import dataset, require

if TYPE_CHECKING:
    import xarray as xr

ENDS = ("_plain", "", "_extrapolated", "_low", "_high")  # in the order of Information
MEASURES = ("spike_information", "information_rate", "count_information")
NOTHING = Information(*[np.nan] * 5)
MOST_BINS = 1_000_000  # a window in milliseconds would fill the memory
FEWEST_TRIALS = 32  # below them both corrections of the count's information are too high, by a fifth at 16 trials
FEWEST_SPIKES = 1.0  # for each bin, summed over trials: below, bits for each spike come out a fifth too high


def unit_information(
    spikes: xr.Dataset, n_trials: int, *, window: tuple[float, float], bin_width: float = 0.01
) -> xr.Dataset:
    """Bits for each spike, bits for each second, and bits of the count in a bin, of every unit.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.spikes.spike_table`, in trials.
    n_trials : int
        Trials presented, silent ones included.
    window : (float, float)
        Part of the stimulus [s] that is analysed; leave out the onset, where units adapt.
    bin_width : float
        Width of the bins [s], which must divide the window.

    Returns
    -------
    Dataset
        ``spike_information`` [bit], ``information_rate`` [bit/s] and ``count_information`` [bit] (unit), each also as
        ``_plain``, ``_extrapolated``, ``_low`` and ``_high`` (:class:`vibrissa.neural.information.Information`);
        ``unit_rate``; ``informative`` where the interval lies above 0; ``reason`` where nothing can be told.

    Raises
    ------
    InputError
        If there are no trials in the table, the bins do not fill the window or are more than a million.
    """
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    if n_trials < 2:
        raise InputError("number of trials", "must be at least 2", n_trials, "information is told by repeats")
    if window[1] - window[0] > MOST_BINS * bin_width > 0:
        raise InputError("window", f"must hold at most {MOST_BINS:,} bins", window, "times are in seconds")
    counts = psth(spikes, bin_edges(*window, bin_width), n_trials=n_trials).spike_count.values
    rows = [_row(own, bin_width) for own in counts]
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return dataset(
        {"n_trials": n_trials, "bin_width": bin_width, "window": np.array(window, float)},
        unit_name=spikes.unit_name.values,
        unit_rate=counts.mean((1, 2)) / bin_width,
        **columns,
    )


def _row(counts: NDArray[np.int64], width: float) -> dict[str, Any]:
    """One unit; NaN where there are too few spikes or trials."""
    if counts.any():
        found = spike_information(counts), information_rate(counts, width), count_information(counts)
    else:
        found = (NOTHING,) * 3
    row: dict[str, Any] = {
        name + end: value
        for name, one in zip(MEASURES, found, strict=True)
        for end, value in zip(ENDS, one, strict=True)
    }
    row["reason"] = _reason(counts)
    row["informative"] = not row["reason"] and row["spike_information_low"] > 0
    return row


def _reason(counts: NDArray[np.int64]) -> str:
    in_bin = counts.sum() / counts.shape[1]
    if in_bin < FEWEST_SPIKES:
        return f"cannot tell: {counts.sum()} spikes in {counts.shape[1]} bins, fewer than one for each; wider bins"
    if len(counts) < FEWEST_TRIALS:
        return f"cannot tell bits of the count: {len(counts)} trials, fewer than {FEWEST_TRIALS}"
    return ""
