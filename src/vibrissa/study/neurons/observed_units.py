"""Units of a recording, on one clock, with the time in which each was observed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array, Window
from vibrissa.errors import ConflictError, RangeError, TooFewError
from vibrissa.neural.io.formats.phy import ALL
from vibrissa.neural.io.recording import refuse_trials_twice, with_waveforms
from vibrissa.neural.io.tables.inputs import refuse_unrecorded
from vibrissa.neural.io.tables.trials import recorded_windows
from vibrissa.neural.sorting.observed import observed_for, trials_laid_out, within_trials
from vibrissa.study.neurons.inputs import read_session
from vibrissa.study.spec.given import SpikesInput

if TYPE_CHECKING:
    import xarray as xr


def read_units(
    given: SpikesInput, folder: Path = Path(), *, window: Window | None = None, duration: float | None = None
) -> tuple[xr.Dataset, list[str]]:
    """Read all units of a recording, whatever their labels, and when each was observed.

    Parameters
    ----------
    given : SpikesInput
        The file, and how it is read. Units of all labels are taken unless groups are named. Where trials are named, by
        a table, an event or a period, the units are judged within them, else in the whole session.
    folder : Path
        Where relative paths start.
    window : (float, float), optional
        Part of each trial, about its onset [s].
    duration : float, optional
        Length of the session [s], where its file does not state it.

    Returns
    -------
    spikes : Dataset
        See :func:`vibrissa.neural.sorting.observed.observed_for`.
    remarks : list of str
        As in :class:`vibrissa.study.neurons.inputs.Recording`, and how long the units were observed.

    Raises
    ------
    InputError
        If the file is bad, has no unit, or the options do not fit it.
    """
    length = None if window is None else window[1]
    spikes, trials, remarks = read_session(replace(given, group=given.group or (ALL,)), folder, length)
    spikes = with_waveforms(spikes, folder / given.spikes)
    asked = [name for name in ("period", "trial_table", "event", "only") if getattr(given, name)]
    if "spike_trial" in spikes:
        refuse_trials_twice(asked, given.spikes)
    seen, more = observed_units(spikes, trials if asked else None, window=window, duration=duration)
    return seen, [*remarks, *more]


def observed_units(
    spikes: xr.Dataset, trials: xr.Dataset | None, *, window: Window | None = None, duration: float | None = None
) -> tuple[xr.Dataset, list[str]]:
    """Put units on one clock, with the time in which each was observed.

    Parameters
    ----------
    spikes : Dataset
        On the session's clock or in trials.
    trials : Dataset, optional
        Within which spikes on the session's clock are judged.
    window, duration
        As in :func:`read_units`.

    Returns
    -------
    spikes, remarks
        As :func:`read_units`.

    Raises
    ------
    InputError
        If there is no unit, or the options do not fit the spikes.
    """
    if not spikes.sizes["unit"]:
        left = spikes.attrs.get("spikes_unsorted", 0)
        source = str(spikes.attrs.get("source", "spikes"))
        found = f"{left} unsorted spikes alone" if left else "none"
        raise TooFewError(source, "must hold sorted units", found, "sort the spikes first, or give `unsorted`")
    if duration is not None and (trials is not None or "spike_trial" in spikes):
        raise ConflictError("duration", "must go with spikes of a whole session", duration, "give `window` for trials")
    if "spike_trial" in spikes:
        if trials is not None:
            rule, remedy = "must go with spikes on a session's clock", "leave it out: the spikes are in trials already"
            raise ConflictError("trials", rule, f"{trials.sizes['trial']} trials", remedy)
        return _in_trials(spikes, window)
    if trials is not None:
        start = trials.trial_start.values
        low, high = (start, trials.trial_stop.values) if window is None else (start + window[0], start + window[1])
        seen = within_trials(spikes, low, high)
        shared = int((low[1:] < high[:-1]).sum())
        overlap = [f"{shared} trials begin before the one before them ends; what they share counts once"]
        judged = f"units are judged in {start.size} trials of {np.mean(high - low):.4g} s"
        return seen, [judged, *(overlap if shared else [])]
    if window is not None:
        raise ConflictError("window", "must go with trials", window, "give `trial_table`, or `period` and `trials`")
    known = spikes.attrs.get("duration") if duration is None and "interval_unit" not in spikes else duration
    seen = observed_for(spikes, known)
    if seen.attrs["window"] == "first to last spike":
        text = "the recording is taken to last from the first spike to the last, {:.6g} s; `duration` gives its length"
        return seen, [text.format(float((seen.interval_stop - seen.interval_start)[0]))]
    return seen, []


def _in_trials(spikes: xr.Dataset, window: Window | None) -> tuple[xr.Dataset, list[str]]:
    """Units of a file whose spikes are in trials."""
    time, remarks = spikes.spike_time.values, []
    count = int(spikes.attrs.get("n_trials", spikes.spike_trial.values.max(initial=0) + 1))
    judged = f"units are judged in {count} trials"
    if window is not None:
        refuse_unrecorded(spikes, window, "window")
    if window is None and {"trial_start", "trial_stop"} <= set(spikes.variables):
        low, high = (one - spikes.trial_start.values for one in recorded_windows(spikes, spikes))
        judged += f" of {np.mean(high - low):.4g} s"
        return trials_laid_out(spikes, (low, _with_last(high)), low.size), [judged]
    if window is None and "duration" in spikes.attrs:
        window = (0.0, float(spikes.attrs["duration"]))
    if window is None:
        first, last = min(0.0, float(time.min(initial=0.0))), float(time.max(initial=0.0))
        if not last > first:
            remedy = "give it: spikes do not show how long trials last"
            raise RangeError("window", "must be positive (s)", last - first, remedy)
        window = (first, float(_with_last(last)))
        remarks = [f"trials are taken to last from {first:.4g} to {last:.4g} s, as the spikes do; `window` gives it"]
    return trials_laid_out(spikes, window, count), [*remarks, judged]


def _with_last(stop: Array | float) -> Array:
    """End of a half-open window, moved so little that a spike at it is inside."""
    return np.nextafter(stop, np.inf)
