"""Spikes, trials and signals as objects of pynapple."""

from __future__ import annotations

import shlex
import sys
from importlib import import_module
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.api.objects.signals import seconds_of
from vibrissa.api.objects.trials import as_trials
from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, MissingError, PackageError, RangeError, ShapeError
from vibrissa.neural.io.tables.selection import at_places
from vibrissa.neural.io.tables.spikes import observed_trials
from vibrissa.neural.io.tables.trials import recorded_windows
from vibrissa.quantities import require

RESOLUTION = 1e-9  # [s] of pynapple's times
ABOUT_UNITS = ("unit_whisker", "unit_quality")
APART = (
    "units",
    "must be observed in the same intervals, as those of a TsGroup",
    None,
    "convert each unit: of_unit(spikes, name)",
)


def to_pynapple(data: xr.Dataset | xr.DataArray, *, trials: Any = None) -> Any:
    """Spikes as a ``TsGroup``, trials as an ``IntervalSet``, a signal as a ``Tsd`` or ``TsdFrame``.

    Parameters
    ----------
    data : Dataset or DataArray
        Spikes: on the session's clock, where spikes in trials are put back by their onsets, ``trial_start``. A table of
        trials, as ``spikes[["trial_start", "trial_stop"]]``. Or a signal, (time) or one other dimension and time.
    trials : object, optional
        Onsets of trials that a table of spikes does not hold, see :func:`vibrissa.api.objects.trials.as_trials`.

    Returns
    -------
    pynapple.TsGroup, pynapple.IntervalSet, pynapple.Tsd or pynapple.TsdFrame
        Times in seconds, to pynapple's 1 ns. Of a group the keys are ``unit_id`` where the table has it (each once),
        the metadata ``unit_name``, ``whisker`` and ``quality``; units without spikes are there; the time support is
        where they were observed: the windows of their trials, the intervals, or else from the first to the last spike.
        Trials that touch end 1 ns early, as pynapple's intervals include their ends. Intervals are in the order of
        their starts.

    Raises
    ------
    InputError
        If pynapple is not installed; if onsets are not known, windows of trials overlap, units were observed in
        different times, or the signal has more dimensions.

    Examples
    --------
    >>> from vibrissa.api.objects.spikes import as_spikes
    >>> group = to_pynapple(as_spikes({"a": [0.1, 1.2, 1.3], "b": []}))
    >>> [str(name) for name in group["unit_name"]], group[0].t.tolist()
    (['a', 'b'], [0.1, 1.2, 1.3])
    """
    nap = _pynapple()
    if isinstance(data, xr.DataArray) or not {"spike_time", "trial_start"} & set(data.variables):
        return _signal(nap, data)
    if "spike_time" not in data:
        return _intervals(nap, data)
    data = at_places(data)
    time, support = _on_one_clock(nap, data, trials)
    unit, names = data.spike_unit.values, data.unit_name.values
    ids = data.unit_id.values.tolist() if "unit_id" in data else []
    keys = ids if len(set(ids)) == names.size else list(range(names.size))
    trains = {key: nap.Ts(np.sort(time[unit == k]), time_support=support) for k, key in enumerate(keys)}
    about = {name.removeprefix("unit_"): data[name].values for name in ABOUT_UNITS if name in data}
    metadata = {"unit_name": names, **about}
    return nap.TsGroup(trains, time_support=support, metadata={k: list(map(str, v)) for k, v in metadata.items()})


def _pynapple() -> Any:
    try:
        return import_module("pynapple")
    except ImportError as error:
        remedy = f"{shlex.quote(sys.executable)} -m pip install pynapple"
        raise PackageError("to_pynapple", "needs pynapple", remedy=remedy) from error


def _on_one_clock(nap: Any, spikes: xr.Dataset, trials: Any) -> tuple[Array, Any]:
    """Times of spikes on the session's clock [s], and the time support."""
    time = spikes.spike_time.values
    if "spike_trial" not in spikes:
        if trials is not None:
            raise ConflictError("trials", "must go with spikes in trials", "spikes on a session's clock")
        return time, _support(nap, spikes)
    table = spikes if trials is None else as_trials(trials)
    if "trial_start" not in table or "trial_stop" not in table:
        remedy = "trials=[(start, stop), …]"
        raise MissingError("trials", "must be given: the table does not hold their onsets and stops", remedy=remedy)
    if table.sizes["trial"] <= spikes.spike_trial.values.max(initial=-1):
        found = f"{table.sizes['trial']} trials, spikes in trial {spikes.spike_trial.values.max()}"
        raise ShapeError("trials", "must be as many as there are spikes of", found)
    low, high = recorded_windows(spikes, table)
    seen = observed_trials(spikes, low.size)
    if (seen != seen[:1]).any():
        raise ConflictError(*APART)
    every = seen.all(0)  # all trials where there is no unit
    return time + table.trial_start.values[spikes.spike_trial.values], _interval_set(nap, low[every], high[every])


def _support(nap: Any, spikes: xr.Dataset) -> Any:
    """When the units were observed, or else from the first to the last spike."""
    time = spikes.spike_time.values
    if "interval_unit" in spikes:
        of = spikes.interval_unit.values
        each = [
            np.stack([spikes.interval_start.values[of == k], spikes.interval_stop.values[of == k]])
            for k in range(spikes.sizes["unit"])
        ]
        if any(one.shape != each[0].shape or not np.allclose(one, each[0]) for one in each):
            raise ConflictError(*APART)
        return _interval_set(nap, *each[0])
    if time.size < 2 or np.ptp(time) < RESOLUTION:
        remedy = "trials give it: as_spikes(…, trials=[(start, stop)])"
        raise RangeError("spikes", "must span some time, which pynapple needs", f"{time.size} spikes", remedy)
    return nap.IntervalSet(time.min(), time.max())


def _intervals(nap: Any, data: xr.Dataset) -> Any:
    require(data, "trial_start", "trial_stop")
    named = {"stimulus": data.trial_stimulus.values.tolist()} if "trial_stimulus" in data else None
    return _interval_set(nap, data.trial_start.values, data.trial_stop.values, named)


def _interval_set(nap: Any, start: Array, stop: Array, metadata: Any = None) -> Any:
    """Intervals that pynapple neither joins nor shortens."""
    order = np.argsort(start, kind="stable")  # as pynapple has them
    start, stop = np.round(start[order], 9), np.round(stop[order], 9)
    if (start[1:] < stop[:-1]).any():
        k = int(np.argmax(start[1:] < stop[:-1]))
        found = f"{order[k]} to {stop[k]:g} s, {order[k + 1]} from {start[k + 1]:g} s"
        raise ConflictError("trials", "must not overlap: pynapple would join them", found, "cut a shorter window")
    touching = np.append(start[1:] == stop[:-1], False)
    named = metadata and {name: [cells[k] for k in order] for name, cells in metadata.items()}
    return nap.IntervalSet(start, stop - RESOLUTION * touching, metadata=named)


def _signal(nap: Any, data: xr.Dataset | xr.DataArray) -> Any:
    timed = [data] if isinstance(data, xr.DataArray) else [one for one in data.values() if "time" in one.dims]
    if len(timed) != 1:
        names = ", ".join(str(one.name) for one in timed)
        raise MissingError("signal", "must be one variable along time", names, "take one: data['point_displacement']")
    array = timed[0]
    lead = [dim for dim in array.dims if dim != "time"]
    if len(lead) > 1 or "time" not in array.dims:
        raise ShapeError("signal", "must have the dimension time and one other at most", array.dims, "data.isel(…)")
    values, time = array.transpose("time", *lead).values, seconds_of(array.time)
    if not lead:
        return nap.Tsd(time, values)
    return nap.TsdFrame(time, values, columns=array[lead[0]].values.tolist())
