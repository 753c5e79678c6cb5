"""Table of spikes, on the session's clock or within trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import ConflictError, RangeError, ShapeError, TooFewError, UnknownError
from vibrissa.neural.io.tables.selection import at_places, labelled
from vibrissa.quantities import dataset, require


def spike_table(
    time: Array,
    unit: Integers,
    names: list[str],
    *,
    trial: Integers | None = None,
    amplitude: Array | None = None,
    attrs: Mapping[str, Any] | None = None,
    **about_units: Any,
) -> xr.Dataset:
    """Sort spikes by unit, trial and time, and label them.

    Parameters
    ----------
    time : (N,) array
        Times [s], on the session's clock, or from the trial's onset where trials are given.
    unit : (N,) array of int
        Index of each spike's unit among the names.
    names : list of str
        Names of all units, silent ones included, each once.
    trial : (N,) array of int, optional
        Trial of each spike, from 0.
    amplitude : (N,) array, optional
        Amplitude of each spike, in the unit of its sorter.
    attrs : mapping, optional
        Further attributes.
    **about_units
        Variables of dimension unit: ``unit_whisker``, ``unit_quality`` and the like.

    Returns
    -------
    Dataset
        ``spike_time``, ``spike_unit`` and, with trials, ``spike_trial`` (spike); ``unit_name`` (unit). The attribute
        ``spikes_out_of_order`` counts the spikes given earlier than the one before them in their unit and trial, and
        ``spikes_repeated`` those at the very time of the one before: both are kept.

    Raises
    ------
    InputError
        If two units have one name.
    """
    if len(set(names)) < len(names):
        raise ConflictError("names of units", "must differ from each other", names)
    time, unit = np.asarray(time, float), np.asarray(unit, int)
    group = [unit] if trial is None else [np.asarray(trial, int), unit]
    given, order = np.lexsort(group), np.lexsort([time, *group])
    same = np.all([np.diff(key[given]) == 0 for key in group], axis=0)
    step, sorted_step = np.diff(time[given]), np.diff(time[order])
    oddities = {"spikes_out_of_order": same & (step < 0), "spikes_repeated": same & (sorted_step == 0)}
    about_spikes: dict[str, Any] = {} if trial is None else {"spike_trial": group[0][order]}
    if amplitude is not None:
        about_spikes["spike_amplitude"] = np.asarray(amplitude, float)[order]
    return dataset(
        {**(attrs or {}), **{name: int(one.sum()) for name, one in oddities.items()}},
        spike_time=time[order],
        spike_unit=unit[order],
        unit_name=np.array(names, str),
        **about_spikes,
        **about_units,
    )


def table_of_trains(
    trains: Sequence[Array], names: list[str], attrs: Mapping[str, Any], **about_units: Any
) -> xr.Dataset:
    """Table of spikes on the session's clock from the spike times of each unit.

    Parameters
    ----------
    trains : sequence of arrays
        Times of each unit's spikes [s].
    names : list of str
        Names of the units.
    attrs, **about_units
        As in :func:`spike_table`.

    Returns
    -------
    Dataset
        As :func:`spike_table`.

    Raises
    ------
    InputError
        If two units have one name.
    """
    unit = np.repeat(np.arange(len(trains)), [len(train) for train in trains])
    return spike_table(np.concatenate([*trains, np.zeros(0)]), unit, names, attrs=attrs, **about_units)


def with_intervals(spikes: xr.Dataset, each: Sequence[Array]) -> xr.Dataset:
    """Add the intervals in which units were observed, as one flat table.

    Parameters
    ----------
    spikes : Dataset
        On the session's clock.
    each : sequence of (R, 2) arrays
        Start and stop of the intervals of each unit [s].

    Returns
    -------
    Dataset
        With ``interval_start``, ``interval_stop`` and ``interval_unit`` (interval).
    """
    flat = np.concatenate([*(np.reshape(one, (-1, 2)) for one in each), np.zeros((0, 2))])
    unit = np.repeat(np.arange(len(each)), [np.size(one) // 2 for one in each])
    found = dataset(interval_start=flat[:, 0], interval_stop=flat[:, 1], interval_unit=unit)
    return spikes.assign(found.data_vars)


NOT_OBSERVED = "cannot tell: the unit was observed in no trial"


def observed_trials(spikes: xr.Dataset, n_trials: int) -> Mask:
    """Trials in which each unit was observed; the others were not presented to it.

    Parameters
    ----------
    spikes : Dataset
        In trials, with ``unit_name``; all are observed unless ``unit_observed`` (unit, trial) says otherwise.
    n_trials : int
        Trials presented, silent ones included.

    Returns
    -------
    (U, N) array of bool
        Whether it was.

    Raises
    ------
    InputError
        If the table knows of another number of trials.
    """
    if "unit_observed" not in spikes:
        return np.ones((spikes.sizes["unit"], n_trials), bool)
    observed = spikes.unit_observed.transpose("unit", "trial").values.astype(bool)
    if observed.shape[1] != n_trials:
        rule = f"must be the {observed.shape[1]} in which the spikes' units were observed or not"
        raise ShapeError("number of trials", rule, n_trials, "leave it out: the spikes have it")
    return observed


def refuse_partly_observed(spikes: xr.Dataset, observed: Mask) -> None:
    """Refuse units that were observed in some of the trials only.

    Parameters
    ----------
    spikes : Dataset
        With ``unit_name``.
    observed : (U, N) array of bool
        From :func:`observed_trials`.

    Raises
    ------
    InputError
        Names the first such unit.
    """
    less = np.flatnonzero(~observed.all(1))
    if less.size:
        first = less[0]
        found = f"{observed[first].sum()} of {observed.shape[1]} for {str(spikes.unit_name.values[first])!r}"
        raise TooFewError("units", "must be observed in all trials", found, "leave it out, or take the trials it has")


def of_unit(spikes: xr.Dataset, name: str) -> xr.Dataset:
    """Spikes of one unit.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`spike_table`.
    name : str
        The unit.

    Returns
    -------
    Dataset
        The same variables, for that unit alone.

    Raises
    ------
    InputError
        If there is no such unit; names those there are.
    """
    require(spikes, "spike_time", "spike_unit", "unit_name")
    names = [str(one) for one in spikes.unit_name.values]
    if name not in names:
        raise UnknownError(f"unit {name!r}", "must be one of the table's", remedy=f"they are {', '.join(names)}")
    return of_units(spikes, [names.index(name)])


def of_units(spikes: xr.Dataset, places: Sequence[int]) -> xr.Dataset:
    """Spikes of some units.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`spike_table`.
    places : sequence of int
        Of the units in the table.

    Returns
    -------
    Dataset
        The same variables, for these units alone.
    """
    return at_places(labelled(at_places(spikes)).isel(unit=list(places)))


def join_units(tables: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Put the spikes of single units, recorded in the same trials, into one table.

    Parameters
    ----------
    tables : mapping
        ``spike_time`` and ``spike_trial`` of each unit, by its name, as
        :func:`vibrissa.neural.simulated.virtual.simulate_spikes` gives them.

    Returns
    -------
    Dataset
        Table of :func:`spike_table`; ``n_trials`` as in the tables.

    Raises
    ------
    InputError
        If there is no table, or their numbers of trials differ.
    """
    if not tables:
        raise RangeError("tables of units", "must be at least one", "none")
    for table in tables.values():
        require(table, "spike_time", "spike_trial")
    n_trials = {table.attrs.get("n_trials") for table in tables.values()}
    if len(n_trials) > 1:
        raise ConflictError("n_trials", "must be the same for all units", n_trials)
    parts = list(tables.values())
    return spike_table(
        np.concatenate([part.spike_time.values for part in parts]),
        np.repeat(np.arange(len(parts)), [part.sizes["spike"] for part in parts]),
        list(tables),
        trial=np.concatenate([part.spike_trial.values for part in parts]),
        attrs={} if n_trials == {None} else {"n_trials": n_trials.pop()},
    )
