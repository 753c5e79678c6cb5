"""Response of units: counts of each trial and bin, and their mean over trials."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from vibrissa.arrays import Array, Integers, Mask, Window
from vibrissa.errors import RangeError, TooFewError
from vibrissa.limits import require_bins
from vibrissa.neural.coupling.envelope_coupling import ON_EDGE, bin_of
from vibrissa.neural.io.tables.spikes import observed_trials, refuse_partly_observed
from vibrissa.quantities import dataset, require


def spike_counts(spikes: xr.Dataset, *, n_trials: int, start: float, n_bins: int, bin_width: float) -> Integers:
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
        raise RangeError("bin width", "must be positive (s)", bin_width)
    column = bin_of(spikes.spike_time.values, start, bin_width)
    inside = (column >= 0) & (column < n_bins)
    counts = np.zeros((n_trials, n_bins), int)
    np.add.at(counts, (trial[inside], column[inside]), 1)
    return counts


@dataclass(frozen=True, kw_only=True)
class UnitCounts:
    """Counts of many units: their totals over trials, and the trials of one unit at a time.

    All units, trials and bins at once would fill the memory: 4.8 GB for 10,000 units, 60 trials and 1,000 bins.

    Attributes
    ----------
    spikes : Dataset
        ``spike_time``, ``spike_trial`` and ``spike_unit``.
    places : tuple of (N,) arrays of int
        Places of each unit's spikes in the table.
    n_trials : int
        Trials presented, silent ones included.
    start, bin_width : float
        Start of the first bin and width of each [s].
    totals : (U, K) array
        Counts of each unit and bin, summed over the trials in which the unit was observed.
    observed : (U, N) array of bool
        Trials in which each unit was observed; the others count for it as not presented.
    """

    spikes: xr.Dataset
    places: tuple[Integers, ...]
    n_trials: int
    start: float
    bin_width: float
    totals: Integers
    observed: Mask

    @classmethod
    def of(
        cls, spikes: xr.Dataset, n_trials: int, edges: Array, bin_width: float, *, partial: bool = False
    ) -> UnitCounts:
        """Count in the even bins between these edges [s].

        Parameters
        ----------
        spikes : Dataset
            ``spike_time``, ``spike_trial``, ``spike_unit`` and ``unit_name``.
        n_trials : int
            Trials presented, silent ones included.
        edges : (K + 1,) array
            Edges of the bins [s].
        bin_width : float
            Width of each [s].
        partial : bool
            Take units too that were observed in some of the trials only.

        Returns
        -------
        UnitCounts
            In the order of the units.

        Raises
        ------
        InputError
            If a spike lies in no trial, or a unit was not observed in all trials and these are not taken.
        """
        require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
        _refuse_trials(spikes.spike_trial.values, n_trials)
        observed = observed_trials(spikes, n_trials)
        if not partial:
            refuse_partly_observed(spikes, observed)
        unit, n_units, start = spikes.spike_unit.values, spikes.sizes["unit"], float(edges[0])
        order = np.argsort(unit, kind="stable")
        places = np.split(order, np.searchsorted(unit, np.arange(1, n_units), sorter=order))
        time, totals = spikes.spike_time.values, np.zeros((n_units, len(edges) - 1), int)
        for total, place in zip(totals, places, strict=True):
            place = place[observed[unit[place], spikes.spike_trial.values[place]]]
            column = bin_of(time[place], start, bin_width)
            total += np.bincount(column[(column >= 0) & (column < total.size)], minlength=total.size)
        return cls(
            spikes=spikes,
            places=tuple(places),
            n_trials=n_trials,
            start=start,
            bin_width=bin_width,
            totals=totals,
            observed=observed,
        )

    def rates(self) -> Array:
        """Rate of each unit in each bin, over the trials in which it was observed; (U, K) [Hz], NaN where in none."""
        number = self.observed.sum(1, keepdims=True)
        return self.totals / np.where(number > 0, number, np.nan) / self.bin_width

    def __iter__(self) -> Iterator[Integers]:
        """Counts of each unit in turn, in each trial and bin; (N, K)."""
        return (self.of_unit(unit) for unit in range(len(self.places)))

    def of_unit(self, unit: int) -> Integers:
        """Counts of one unit in each trial and bin; (N, K).

        Parameters
        ----------
        unit : int
            Its place.

        Returns
        -------
        (N, K) array of int
            Counts.
        """
        own = self.spikes[["spike_time", "spike_trial"]].isel(spike=self.places[unit])
        how = {"start": self.start, "n_bins": self.totals.shape[1], "bin_width": self.bin_width}
        return spike_counts(own, n_trials=self.n_trials, **how)[self.observed[unit]]

    def total_of(self, unit: int, finer: int) -> Integers:
        """Counts of one unit in finer bins, summed over its trials; (K · finer,).

        Parameters
        ----------
        unit, finer : int
            Its place, and the fine bins in each bin.

        Returns
        -------
        (K · finer,) array of int
            Counts.
        """
        place = self.places[unit]
        place = place[self.observed[unit, self.spikes.spike_trial.values[place]]]
        column = bin_of(self.spikes.spike_time.values[place], self.start, self.bin_width / finer)
        n_bins = self.totals.shape[1] * finer
        return np.bincount(column[(column >= 0) & (column < n_bins)], minlength=n_bins)


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
        ``bin``, ``bin_stop`` [s]; ``spike_count`` (trial, bin); ``firing_rate``, ``firing_rate_se`` [Hz] (bin), NaN
        below one and two trials; ``trials_observed``, which ``unit_observed`` decides. Units lead, if any.

    Raises
    ------
    InputError
        If the edges do not ascend, or the number of trials is not known.
    """
    require(spikes, "spike_time", "spike_trial")
    edges, trials = _edges(edges), _n_trials(spikes, n_trials)
    counts = _counts(spikes, edges, trials)
    observed = observed_trials(spikes, trials) if counts.ndim == 3 else np.ones(trials, bool)
    mean, se = _mean_over_trials(counts / np.diff(edges), observed[..., None])
    names = {"unit_name": spikes.unit_name.values} if counts.ndim == 3 else {}
    return dataset(
        {"n_trials": trials},
        lead=("unit",) * len(names),
        bin=edges[:-1],
        bin_stop=edges[1:],
        spike_count=counts,
        firing_rate=mean,
        firing_rate_se=se,
        trials_observed=observed.sum(-1),
        **names,
    )


def bin_edges(start: float, stop: float, bin_width: float) -> Array:
    """Edges of even bins from start to stop.

    Parameters
    ----------
    start, stop, bin_width : float
        Window, and width of a bin [s].

    Returns
    -------
    (B + 1,) array
        [s].

    Raises
    ------
    InputError
        If they are more than a million, or do not fill the window: a bin cut short would show too low a rate.
    """
    if not start < stop:
        raise RangeError("window", "must start before it stops", f"{start:g} to {stop:g} s")
    require_bins(stop - start, bin_width)
    n_bins = round((stop - start) / bin_width) if 0 < bin_width < np.inf and np.isfinite(stop - start) else 0
    if n_bins < 1 or abs(start + n_bins * bin_width - stop) > 1e-6 * bin_width:
        raise RangeError("bin width", f"must divide the window {start:g} to {stop:g} s", bin_width)
    return start + bin_width * np.arange(n_bins + 1, dtype=np.float64)


def trial_counts(spikes: xr.Dataset, n_trials: int, window: Window, bin_width: float) -> tuple[Array, list[str]]:
    """Counts of every unit that was observed in all trials; (T, U, B), and the names of these units.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, times from each trial's onset.
    n_trials : int
        Trials presented, silent ones included.
    window : (start, stop)
        Part of each trial that is read [s].
    bin_width : float
        Width of the bins, a part of the window [s].

    Returns
    -------
    counts : (T, U, B) array
        Counts of each trial, unit and bin.
    names : list of str
        Names of the units.

    Raises
    ------
    InputError
        If no unit was observed in all trials, fewer than two bins fit, or no spike lies in the window.
    """
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    if not -np.inf < window[0] < window[1] < np.inf:
        raise RangeError("window", "must start before it stops (s)", window)
    edges = bin_edges(*window, bin_width)
    if len(edges) < 3:
        raise RangeError("bin width", "must be at most half the window", bin_width)
    counts = psth(spikes, edges, n_trials=n_trials).spike_count.transpose("trial", "unit", "bin").values
    whole = observed_trials(spikes, n_trials).all(1)
    counts, names = counts[:, whole], spikes.unit_name.values[whole].astype(str).tolist()
    if not names:
        raise TooFewError("units", "must include one that was observed in all trials", 0)
    if not counts.any():
        raise TooFewError("window", "must hold a spike", window, "times count in seconds from each trial's onset")
    return counts.astype(float), names


def _n_trials(spikes: xr.Dataset, n_trials: int | None) -> int:
    found = spikes.attrs.get("n_trials") if n_trials is None else n_trials
    if found is None or found < 1:
        raise RangeError("number of trials", "must be at least 1", found, "give n_trials, silent trials included")
    return int(found)


def _refuse_trials(trial: Integers, n_trials: int) -> None:
    if trial.size and not 0 <= trial.min() <= trial.max() < n_trials:
        raise RangeError("spike_trial", f"must lie between 0 and {n_trials - 1}", f"{trial.min()}…{trial.max()}")


def _edges(edges: ArrayLike) -> Array:
    found = np.asarray(edges, float)
    if found.ndim != 1 or found.size < 2 or not np.isfinite(found).all() or not (np.diff(found) > 0).all():
        raise TooFewError("edges of bins", "must be at least two times that ascend (s)", found)
    return found


def _counts(spikes: xr.Dataset, edges: Array, n_trials: int) -> Integers:
    """Spikes of each unit, where there are units, in each trial and bin."""
    trial, time = spikes.spike_trial.values, spikes.spike_time.values
    _refuse_trials(trial, n_trials)
    column = np.searchsorted(edges - ON_EDGE, time, side="right") - 1  # on an edge: in the bin that starts there
    inside = (column >= 0) & (column < edges.size - 1)
    units = () if "spike_unit" not in spikes else (spikes.sizes["unit"],)
    counts = np.zeros((*units, n_trials, edges.size - 1), int)
    where = (trial, column) if not units else (spikes.spike_unit.values, trial, column)
    np.add.at(counts, tuple(index[inside] for index in where), 1)
    return counts


def _mean_over_trials(rate: Array, observed: Mask) -> tuple[Array, Array]:
    """Mean over the trials observed, and its standard error."""
    number = observed.sum(-2)
    mean: Array = np.where(observed, rate, 0).sum(-2) / np.where(number > 0, number, np.nan)
    squares = np.where(observed, (rate - mean[..., None, :]) ** 2, 0).sum(-2)
    error: Array = np.sqrt(squares / np.where(number > 1, number * (number - 1.0), np.nan))
    return mean, error
