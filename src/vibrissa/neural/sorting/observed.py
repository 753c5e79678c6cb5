"""When each unit was observed, and its spikes on a clock that runs only while it is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers, Mask, Window
from vibrissa.errors import RangeError, require_positive
from vibrissa.neural.io.tables.inputs import require_session_clock
from vibrissa.neural.io.tables.spikes import observed_trials, spike_table, with_intervals
from vibrissa.neural.simulated.refractoriness import ROUNDING
from vibrissa.quantities import require

APART = 1.0  # [s] between trials that are laid one after the other, so that no interval reaches from one to the next


class Train(NamedTuple):
    """Spikes of one unit while it was observed.

    Attributes
    ----------
    time : (N,) array
        On the session's clock, ascending [s].
    elapsed : (N,) array
        Time observed until each spike [s].
    place : (N,) array of int
        Index of each spike in its table.
    duration : float
        Time observed [s].
    """

    time: Array
    elapsed: Array
    place: Integers
    duration: float


def observed_for(spikes: xr.Dataset, duration: float | None = None) -> xr.Dataset:
    """Spikes on the session's clock, with the intervals in which their units were observed.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`.
    duration : float, optional
        Length of the session [s], from 0, or from the first spike where that would not reach the last. By default the
        intervals that the table has; without them the session lasts from the first spike of any unit to the last.

    Returns
    -------
    Dataset
        With ``interval_start``, ``interval_stop``, ``interval_unit``; the attribute ``window`` says whence.

    Raises
    ------
    InputError
        If the spikes are in trials, or last longer than the session.
    """
    require_session_clock(spikes)
    if duration is None and "interval_unit" in spikes:
        return spikes.assign_attrs(window="intervals of observation")
    time = spikes.spike_time.values
    first, last = (float(time.min()), float(time.max())) if time.size else (0.0, 0.0)
    if duration is None:
        return _of_session(spikes, first, last).assign_attrs(window="first to last spike")
    require_positive("duration", duration, "s")
    start = 0.0 if first >= 0 and last <= duration + ROUNDING else first
    if last > start + duration + ROUNDING:
        rule = f"must reach from the first spike to the last, {last - first:.6g} s"
        raise RangeError("duration", rule, duration, "give it in seconds")
    return _of_session(spikes, start, start + duration).assign_attrs(window="session")


def _of_session(spikes: xr.Dataset, start: float, stop: float) -> xr.Dataset:
    bare = spikes.drop_dims("interval", errors="ignore")
    return with_intervals(bare, [np.array([[start, stop]])] * spikes.sizes["unit"])


def trials_laid_out(spikes: xr.Dataset, window: Window | tuple[Array, Array], n_trials: int) -> xr.Dataset:
    """Spikes in trials put on one clock, trial after trial, with the trials as intervals of observation.

    Parameters
    ----------
    spikes : Dataset
        In trials, from their onsets.
    window : (start, stop)
        Part of each trial that was observed, half-open, the same of all or one of each, (K,) arrays [s]; spikes outside
        are left out.
    n_trials : int
        Trials, silent ones included.

    Returns
    -------
    Dataset
        On the session's clock, as :func:`observed_for` gives it. Trials in which a unit was not observed
        (``unit_observed``) are none of its intervals.

    Raises
    ------
    InputError
        If the window is empty, or a spike lies in a later trial.
    """
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    low, high = np.broadcast_arrays(*window, np.zeros(n_trials))[:2]
    length = high - low
    longest = float(length.max(initial=0.0))
    if n_trials:
        require_positive("window", float(length.min()), "s")
    time, trial = spikes.spike_time.values, spikes.spike_trial.values
    if trial.size and trial.max() >= n_trials:
        raise RangeError("trial", f"must lie below the number of trials, {n_trials}", trial.max())
    kept = (time >= low[trial]) & (time < high[trial])
    onsets = (longest + APART) * np.arange(n_trials)
    seen = observed_trials(spikes, n_trials)
    about = {str(name): v.values for name, v in spikes.variables.items() if v.dims == ("unit",) and name != "unit_name"}
    if "unit_waveform" in spikes:
        about |= {name: spikes[name].values for name in ("unit_waveform", "unit_waveform_sd") if name in spikes}
    laid = spike_table(
        (time - low[trial] + onsets[trial])[kept],
        spikes.spike_unit.values[kept],
        [str(name) for name in spikes.unit_name.values],
        attrs={**spikes.attrs, "window": "trials"},
        **about,
    )
    return with_intervals(laid, [np.column_stack([onsets[one], (onsets + length)[one]]) for one in seen])


def within_trials(spikes: xr.Dataset, start: Array, stop: Array) -> xr.Dataset:
    """Limit the time in which units were observed to that of trials.

    Parameters
    ----------
    spikes : Dataset
        On the session's clock; its intervals of observation, where it has any, are cut too.
    start, stop : (K,) arrays
        Of the trials [s].

    Returns
    -------
    Dataset
        With ``interval_start``, ``interval_stop`` and ``interval_unit``; without the spikes outside of the trials, as
        one at the stop of a trial, which is no part of it.
    """
    trials = np.column_stack([start, stop])
    spikes = spikes.isel(spike=np.flatnonzero(_within(spikes.spike_time.values, trials)))
    own = [trials] * spikes.sizes["unit"]
    if "interval_unit" in spikes:
        own = [_shared(one, trials) for one in _intervals(spikes)]
    bare = spikes.drop_dims("interval", errors="ignore")
    return with_intervals(bare, own).assign_attrs(window="trials")


def trains_of(spikes: xr.Dataset) -> list[Train]:
    """Spikes of each unit while it was observed.

    Parameters
    ----------
    spikes : Dataset
        From :func:`observed_for`, :func:`trials_laid_out` or :func:`within_trials`.

    Returns
    -------
    list of Train
        One for each unit.
    """
    time, unit = spikes.spike_time.values, spikes.spike_unit.values
    places = [np.flatnonzero(unit == k) for k in range(spikes.sizes["unit"])]
    return [_train(time, place, one) for place, one in zip(places, _intervals(spikes), strict=True)]


def _train(time: Array, place: Integers, intervals: Array) -> Train:
    """Spikes within the union of some intervals."""
    joined = _union(intervals)
    lengths = joined[:, 1] - joined[:, 0]
    before = np.cumsum(lengths) - lengths
    place = place[np.argsort(time[place], kind="stable")]
    own = time[place]
    index = np.searchsorted(joined[:, 0], own + ROUNDING, side="right") - 1
    inside = index >= 0
    inside[inside] &= own[inside] <= joined[index[inside], 1] + ROUNDING
    own, place, index = own[inside], place[inside], index[inside]
    return Train(own, own - joined[index, 0] + before[index], place, float(lengths.sum()))


def _intervals(spikes: xr.Dataset) -> list[Array]:
    """Start and stop of the intervals of each unit, (R, 2) [s]."""
    flat = np.column_stack([spikes.interval_start.values, spikes.interval_stop.values])
    return [flat[spikes.interval_unit.values == k] for k in range(spikes.sizes["unit"])]


def _union(intervals: Array) -> Array:
    """Intervals that do not overlap, in the order of time, and hold the same times."""
    if not len(intervals):
        return np.zeros((0, 2))
    ordered = intervals[np.argsort(intervals[:, 0], kind="stable")]
    reach = np.maximum.accumulate(ordered[:, 1])
    first = np.append(True, ordered[1:, 0] > reach[:-1] + ROUNDING)
    last = np.append(first[1:], True)
    return np.column_stack([ordered[first, 0], reach[last]])


def _within(time: Array, trials: Array) -> Mask:
    """Whether each time is in one of some trials, which are half-open."""
    joined = _union(trials)
    index = np.searchsorted(joined[:, 0], time, side="right") - 1
    return (index >= 0) & (time < np.append(joined[:, 1], -np.inf)[index])


def _shared(one: Array, other: Array) -> Array:
    """Times that lie in both of two sets of intervals."""
    one, other = _union(one), _union(other)
    low = np.maximum(one[:, None, 0], other[None, :, 0])
    high = np.minimum(one[:, None, 1], other[None, :, 1])
    both = high > low
    return np.column_stack([low[both], high[both]])
