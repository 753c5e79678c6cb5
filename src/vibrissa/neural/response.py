"""What a unit answers: counts per trial and bin, and their mean over trials."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import dataset, require

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
    _refuse_trials(trial, n_trials)
    if not bin_width > 0:
        raise InputError("bin width", "must be positive (s)", bin_width)
    # the margin puts a spike on an edge into the bin that starts there: 0.29/0.01 is 28.999…
    column = np.floor((spikes.spike_time.values - start) / bin_width + 1e-9).astype(int)
    inside = (column >= 0) & (column < n_bins)
    counts = np.zeros((n_trials, n_bins), int)
    np.add.at(counts, (trial[inside], column[inside]), 1)
    return counts


def raster(spikes: xr.Dataset, *, n_trials: int | None = None) -> list[NDArray[np.float64]]:
    """Spike times of each trial, for a raster plot.

    Parameters
    ----------
    spikes : Dataset
        ``spike_time`` [s] and ``spike_trial`` of one unit; see :func:`vibrissa.neural.spikes.of_unit`.
    n_trials : int, optional
        Trials presented, silent ones included; default: the attribute ``n_trials``.

    Returns
    -------
    list of (N,) arrays
        Times [s], ascending, one array for each trial.
    """
    require(spikes, "spike_time", "spike_trial")
    trials, time, trial = _n_trials(spikes, n_trials), spikes.spike_time.values, spikes.spike_trial.values
    _refuse_trials(trial, trials)
    order = np.lexsort([time, trial])
    return np.split(time[order], np.searchsorted(trial[order], np.arange(1, trials)))


def psth(spikes: xr.Dataset, edges: ArrayLike, *, n_trials: int | None = None) -> xr.Dataset:
    """Spikes of each trial in each bin, and the firing rate averaged over trials.

    Parameters
    ----------
    spikes : Dataset
        ``spike_time`` [s] and ``spike_trial``; with ``spike_unit`` and ``unit_name``, each unit apart.
    edges : (B+1,) array
        Edges of the half-open bins [s], ascending, of any widths; see :func:`bin_edges` for even ones.
    n_trials : int, optional
        Trials presented, silent ones included; default: the attribute ``n_trials``.

    Returns
    -------
    Dataset
        ``bin`` and ``bin_stop`` [s]; ``spike_count`` (trial, bin); ``firing_rate`` and ``firing_rate_se`` [Hz] (bin),
        NaN where too few trials were observed (none; fewer than two); ``trials_observed``. A leading dimension unit
        where the table has units. Trials in which ``unit_observed`` is false count for that unit as not presented.

    Raises
    ------
    InputError
        If the edges do not ascend, or the number of trials is not known.
    """
    require(spikes, "spike_time", "spike_trial")
    edges, trials = _edges(edges), _n_trials(spikes, n_trials)
    counts = _counts(spikes, edges, trials)
    observed = np.ones(counts.shape[:-1], bool)
    if "unit_observed" in spikes:
        observed = spikes.unit_observed.transpose("unit", "trial").values
    mean, se = _mean_over_trials(counts / np.diff(edges), observed[..., None])
    names = {"unit_name": spikes.unit_name.values} if counts.ndim == 3 else {}
    return dataset(
        {"n_trials": trials},
        lead=("unit",) if counts.ndim == 3 else (),
        bin=edges[:-1],
        bin_stop=edges[1:],
        spike_count=counts,
        firing_rate=mean,
        firing_rate_se=se,
        trials_observed=observed.sum(-1),
        **names,
    )


def bin_edges(start: float, stop: float, bin_width: float) -> NDArray[np.float64]:
    """Edges of even bins from start to stop [s].

    Raises
    ------
    InputError
        If the bins do not fill the window: a bin cut short would show too low a rate.
    """
    n_bins = round((stop - start) / bin_width) if 0 < bin_width < np.inf and np.isfinite(stop - start) else 0
    if n_bins < 1 or abs(start + n_bins * bin_width - stop) > 1e-6 * bin_width:
        raise InputError("bin width", f"must divide the window {start:g} to {stop:g} s", bin_width)
    return start + bin_width * np.arange(n_bins + 1, dtype=np.float64)


def _n_trials(spikes: xr.Dataset, n_trials: int | None) -> int:
    found = spikes.attrs.get("n_trials") if n_trials is None else n_trials
    if found is None or found < 1:
        raise InputError("number of trials", "must be at least 1", found, "give n_trials, silent trials included")
    return int(found)


def _refuse_trials(trial: NDArray[np.int64], n_trials: int) -> None:
    if trial.size and not 0 <= trial.min() <= trial.max() < n_trials:
        raise InputError("spike_trial", f"must lie between 0 and {n_trials - 1}", f"{trial.min()}…{trial.max()}")


def _edges(edges: ArrayLike) -> NDArray[np.float64]:
    found = np.asarray(edges, float)
    if found.ndim != 1 or found.size < 2 or not np.isfinite(found).all() or not (np.diff(found) > 0).all():
        raise InputError("edges of bins", "must be at least two times that ascend (s)", found)
    return found


def _counts(spikes: xr.Dataset, edges: NDArray[np.float64], n_trials: int) -> NDArray[np.int64]:
    """Spikes of each unit, where there are units, in each trial and bin."""
    trial, time = spikes.spike_trial.values, spikes.spike_time.values
    _refuse_trials(trial, n_trials)
    # the margin puts a spike on an edge into the bin that starts there, though 29·0.01 is not 0.29
    column = np.searchsorted(edges - 1e-9 * np.diff(edges).min(), time, side="right") - 1
    inside = (column >= 0) & (column < edges.size - 1)
    units = () if "spike_unit" not in spikes else (spikes.sizes["unit"],)
    counts = np.zeros((*units, n_trials, edges.size - 1), int)
    where = (trial, column) if not units else (spikes.spike_unit.values, trial, column)
    np.add.at(counts, tuple(index[inside] for index in where), 1)
    return counts


def _mean_over_trials(
    rate: NDArray[np.float64], observed: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean over the trials observed, and its standard error."""
    number = observed.sum(-2)
    mean: NDArray[np.float64] = np.where(observed, rate, 0).sum(-2) / np.where(number > 0, number, np.nan)
    squares = np.where(observed, (rate - mean[..., None, :]) ** 2, 0).sum(-2)
    error: NDArray[np.float64] = np.sqrt(squares / np.where(number > 1, number * (number - 1.0), np.nan))
    return mean, error
