"""Trials: when the stimulus was presented, and which spikes belong to which presentation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array, Mask, Window
from vibrissa.errors import FormatError, MissingError, RangeError, TooFewError, require_positive
from vibrissa.neural.io.tables.inputs import require_session_clock
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.quantities import dataset, require
from vibrissa.tables.reader import read_table
from vibrissa.tables.table import Table
from vibrissa.tables.units import TEXT

NEEDED = {"start": "s", "stop": "s"}  # columns of a table of trials, and their SI units
OPTIONAL = {"stimulus": TEXT}


def trial_table(start: Array, stop: Array, stimulus: Any = None, attrs: dict[str, Any] | None = None) -> xr.Dataset:
    """Label trials.

    Parameters
    ----------
    start, stop : (R,) arrays
        Onset and end of each trial on the session's clock [s]; onsets ascend.
    stimulus : (R,) array of str, optional
        What was presented.
    attrs : mapping, optional
        Further attributes.

    Returns
    -------
    Dataset
        ``trial_start``, ``trial_stop`` and ``trial_stimulus`` (trial).

    Raises
    ------
    InputError
        At the first trial that is not finite, does not last, or does not start after the one before it.
    """
    start, stop = np.asarray(start, float), np.asarray(stop, float)
    for wrong, rule in (
        (~(np.isfinite(start) & np.isfinite(stop)), "must start and stop at finite times"),
        (~(start < stop), "must stop after its start"),
        (np.diff(start, prepend=-np.inf) <= 0, "must start after the one before it"),
    ):
        if wrong.any():
            k = int(np.flatnonzero(wrong)[0])
            raise RangeError(f"trial {k}", rule, f"{start[k]:.6g} to {stop[k]:.6g} s")
    named: dict[str, Any] = {} if stimulus is None else {"trial_stimulus": np.array(stimulus, str)}
    return dataset({"n_trials": start.size, **(attrs or {})}, trial_start=start, trial_stop=stop, **named)


def read_trials(path: str | Path, *, only: tuple[str, str] | None = None) -> xr.Dataset:
    """Trials from a file of comma-separated values, one line for each.

    Parameters
    ----------
    path : path
        UTF-8 text below a header with the columns ``start`` and ``stop`` [s], or ``start_ms`` and ``stop_ms``, and, if
        known, ``stimulus``. Other columns may be there.
    only : (column, value), optional
        Keep the lines with that value in that column: the protocol of interest among interleaved ones.

    Returns
    -------
    Dataset
        See :func:`trial_table`.

    Raises
    ------
    InputError
        Names file and line; or no line has the value wanted, and those that occur are named.
    """
    return trials_of_table(read_table(path, NEEDED, OPTIONAL), Path(path).name, only=only)


def trials_of_table(table: Table, source: str, *, only: tuple[str, str] | None = None) -> xr.Dataset:
    """Trials from a table with a row for each, as :func:`read_trials` gives them.

    Parameters
    ----------
    table : Table
        With the columns of ``NEEDED``, maybe those of ``OPTIONAL``.
    source : str
        Where it is from.
    only : (column, value), optional
        As in :func:`read_trials`.

    Returns
    -------
    Dataset
        See :func:`trial_table`.

    Raises
    ------
    InputError
        As :func:`read_trials`.
    """
    start, stop = table.seconds("start"), table.seconds("stop")
    table.refuse_first(~(start < stop), "stop", "must be after the start")
    kept = np.ones(start.size, bool)
    if only is not None:
        cells = table.text(only[0]) if only[0] in table.header else None
        kept = rows_with(cells, table.path, *only, columns=table.header)
    if not kept.any():
        raise TooFewError(table.path, "must have a line for each trial below its header", "none")
    later = np.zeros(start.size, bool)
    later[np.flatnonzero(kept)[1:]] = np.diff(start[kept]) <= 0
    table.refuse_first(later, "start", "must be after the trial before it", "sort the table by its start")
    stimulus = np.array(table.text("stimulus"), str)[kept] if "stimulus" in table else None
    attrs: dict[str, Any] = {"source": source, "trials_left_out": int((~kept).sum())}
    if not kept.all():
        attrs["onsets_left_out"] = start[~kept]
    return trial_table(start[kept], stop[kept], stimulus, attrs)


def rows_with(cells: Sequence[str] | None, here: str, column: str, value: str, columns: Sequence[str]) -> Mask:
    """Rows of a table that have a value in a column.

    Parameters
    ----------
    cells : (R,) sequence of str or None
        The column; None where there is none.
    here : str
        The table, for messages.
    column, value : str
        Name of the column, and what is wanted in it.
    columns : sequence of str
        Columns that there are.

    Returns
    -------
    (R,) array of bool
        True where the cell is the value; in one row at least.

    Raises
    ------
    InputError
        If there is no such column, or no row has the value: those that occur are named.
    """
    if cells is None:
        raise MissingError(here, f"must have a column {column}", remedy=f"it has {', '.join(columns)}")
    if value not in cells:
        remedy = f"it is {', '.join(sorted(set(cells))[:9])}"
        raise FormatError(f"{here}, {column}", f"must be {value!r} in a row", remedy=remedy)
    return np.array([cell == value for cell in cells], bool)


def trials_at(onsets: Array, duration: float) -> xr.Dataset:
    """Trials of one duration, from the times of an event.

    Parameters
    ----------
    onsets : (R,) array
        Times of the event that starts each trial [s].
    duration : float
        Length of each trial [s].

    Returns
    -------
    Dataset
        See :func:`trial_table`.

    Raises
    ------
    InputError
        If the duration is not positive; as :func:`trial_table`.
    """
    require_positive("duration of a trial", duration, "s")
    return trial_table(onsets, np.asarray(onsets, float) + duration)


def cut_into_trials(spikes: xr.Dataset, trials: xr.Dataset, window: Window | None = None) -> xr.Dataset:
    """Spikes of each trial, those that fall in its window, timed from the trial's onset.

    Parameters
    ----------
    spikes : Dataset
        Spikes on the session's clock, without ``spike_trial``; see
        :func:`vibrissa.neural.io.tables.spikes.spike_table`.
    trials : Dataset
        See :func:`trial_table`.
    window : (start, stop), optional
        Window about the onset [s], half-open: (−0.5, 10.5) keeps half a second of spontaneous firing on either side.
        Default: from the start to the stop of each trial.

    Returns
    -------
    Dataset
        ``spike_time`` from the onset, ``spike_trial``, ``spike_unit``, what is known of the units, and the trials.
        ``spikes_outside`` counts spikes that fall into no window, ``spikes_shared`` those in two of them, kept twice.
        Where the units' intervals of observation are known, ``unit_observed`` (unit, trial) says whether the window
        lies within them, without a gap.

    Raises
    ------
    InputError
        If the spikes are in trials already, or the window is empty.
    """
    require_session_clock(spikes, "they are cut already")
    require(trials, "trial_start", "trial_stop")
    start, low, high = trials.trial_start.values, *_windows(trials, window)
    time, order = np.sort(spikes.spike_time.values), np.argsort(spikes.spike_time.values, kind="stable")
    first, last = np.searchsorted(time, low), np.searchsorted(time, high)
    trial = np.repeat(np.arange(start.size), last - first)
    place = np.arange(trial.size) - np.repeat(np.cumsum(last - first) - last, last - first)
    taken = order[place]
    times_taken = np.bincount(taken, minlength=time.size)
    attrs = spikes.attrs | {
        "n_trials": start.size,
        "spikes_outside": int((times_taken == 0).sum()),
        "spikes_shared": int((times_taken > 1).sum()),
    }
    if "onsets_left_out" in trials.attrs:
        attrs["onsets_left_out"] = trials.attrs["onsets_left_out"]
    if window is not None:
        attrs |= {"window_start": float(window[0]), "window_stop": float(window[1])}
    about = {str(name): v.values for name, v in spikes.variables.items() if v.dims == ("unit",) and name != "unit_name"}
    if "interval_unit" in spikes:
        about["unit_observed"] = _observed(spikes, low, high)
    cut = spike_table(
        spikes.spike_time.values[taken] - start[trial],
        spikes.spike_unit.values[taken],
        [str(name) for name in spikes.unit_name.values],
        trial=trial,
        attrs=attrs,
        **about,
    )
    oddities = {name: spikes.attrs[name] for name in ("spikes_out_of_order", "spikes_repeated") if name in spikes.attrs}
    return cut.assign({name: v for name, v in trials.data_vars.items() if v.dims == ("trial",)}).assign_attrs(oddities)


def recorded_windows(spikes: xr.Dataset, trials: xr.Dataset) -> tuple[Array, Array]:
    """Part of each trial in which its spikes were taken, on the session's clock.

    Parameters
    ----------
    spikes : Dataset
        In trials; ``window_start`` and ``window_stop`` if they were cut by a window about the onset.
    trials : Dataset
        See :func:`trial_table`.

    Returns
    -------
    start, stop : (R,) arrays
        [s].
    """
    known = spikes.attrs
    cut = "window_start" in known and "window_stop" in known
    return _windows(trials, (float(known["window_start"]), float(known["window_stop"])) if cut else None)


def _windows(trials: xr.Dataset, window: Window | None) -> tuple[Array, Array]:
    """Start and stop of each trial's window [s] on the session's clock."""
    if window is None:
        return trials.trial_start.values, trials.trial_stop.values
    if not -np.inf < window[0] < window[1] < np.inf:
        raise FormatError("window", "must be a start and a later stop (s)", window)
    return trials.trial_start.values + window[0], trials.trial_start.values + window[1]


NEAR = 1e-6  # [s] by which ends of intervals and windows may differ by rounding


def _observed(spikes: xr.Dataset, low: Array, high: Array) -> Mask:
    """Whether each unit was observed throughout each window; intervals that touch are one."""
    observed = np.zeros((spikes.sizes["unit"], low.size), bool)
    owner, starts, stops = (spikes[f"interval_{name}"].values for name in ("unit", "start", "stop"))
    for unit in np.unique(owner):
        own = np.flatnonzero(owner == unit)
        own = own[np.argsort(starts[own], kind="stable")]
        reach = np.maximum.accumulate(stops[own])
        first = np.append(True, starts[own][1:] > reach[:-1] + NEAR)
        joined = zip(starts[own][first], reach[np.append(first[1:], True)], strict=True)
        for start, stop in joined:
            observed[unit] |= (start <= low + NEAR) & (high <= stop + NEAR)
    return observed
