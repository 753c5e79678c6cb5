"""The table of spikes, on the session's clock or within trials, and its file of comma-separated values."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import written_whole
from vibrissa.neural.table import Array, Table, read_table
from vibrissa.quantities import dataset, require

if TYPE_CHECKING:
    import xarray as xr

MOST_TRIALS = 1_000_000
ABOUT_UNITS = {"whisker": "unit_whisker", "quality": "unit_quality"}  # columns with one value for each unit


def spike_table(
    time: Array,
    unit: NDArray[np.int64],
    names: list[str],
    *,
    trial: NDArray[np.int64] | None = None,
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
    attrs : mapping, optional
        What else to tell.
    **about_units
        Variables of dimension unit: ``unit_whisker``, ``unit_quality`` and the like.

    Returns
    -------
    Dataset
        ``spike_time``, ``spike_unit`` and, with trials, ``spike_trial`` (spike); ``unit_name`` (unit). The attribute
        ``spikes_out_of_order`` counts the spikes given earlier than the one before them in their unit and trial, and
        ``spikes_repeated`` those at the very time of the one before: both are kept.
    """
    if len(set(names)) < len(names):
        raise InputError("names of units", "must differ from each other", names)
    time, unit = np.asarray(time, float), np.asarray(unit, int)
    group = [unit] if trial is None else [np.asarray(trial, int), unit]
    given, order = np.lexsort(group), np.lexsort([time, *group])
    same = np.all([np.diff(key[given]) == 0 for key in group], axis=0)
    step, sorted_step = np.diff(time[given]), np.diff(time[order])
    told = {
        "spikes_out_of_order": int((same & (step < 0)).sum()),
        "spikes_repeated": int((same & (sorted_step == 0)).sum()),
    }
    trials: dict[str, Any] = {} if trial is None else {"spike_trial": group[0][order]}
    return dataset(
        {**(attrs or {}), **told},
        spike_time=time[order],
        spike_unit=unit[order],
        unit_name=np.array(names, str),
        **trials,
        **about_units,
    )


def read_csv(path: str | Path, *, duration: float | None = None, first_trial: int | None = None) -> xr.Dataset:
    """Spikes from a file of comma-separated values, one line for each.

    Parameters
    ----------
    path : path
        UTF-8 text below a header with the columns ``time`` [s] or ``time_ms`` [ms], ``unit`` (any name) and, if
        ``time`` counts from the onset of a trial, ``trial`` (its number). ``whisker`` (the principal one) and
        ``quality`` (SU, MU) may be there, with one value for each unit. A line without a time tells that its unit was
        recorded, and its trial presented, without a spike. Other columns are left alone and named in
        ``columns_left_alone``.
    duration : float, optional
        Length of the session or of the trials [s].
    first_trial : int, optional
        Number of the first trial, which becomes 0. Where it is not given, the file must have a trial 0: whether the
        first of a file that begins with trial 1 is trial 1, or trial 0 was silent, only you know.

    Returns
    -------
    Dataset
        See :func:`spike_table`; ``n_trials`` reaches to the largest trial in the file. With a duration,
        ``spikes_outside`` counts the spikes before 0 or from the duration on, which are kept.

    Raises
    ------
    InputError
        Names file and line: what is not a number, a negative trial, a unit on two whiskers; with a duration, times
        that mostly lie outside it, as those in milliseconds do.
    """
    table = read_table(path, ("time|time_ms", "unit"), ("trial", *ABOUT_UNITS))
    time = table.seconds("time", blanks=True)
    trial = _trials(table, first_trial) if "trial" in table.columns else None
    cells = table.columns["unit"]
    unnamed = np.array([not cell or not cell.isprintable() for cell in cells], bool)
    table.refuse_first(unnamed, "unit", "must name a unit in printable signs")
    names = list(dict.fromkeys(cells))
    index = {name: k for k, name in enumerate(names)}
    unit = np.array([index[cell] for cell in cells], int)
    fired = np.isfinite(time)
    attrs: dict[str, Any] = {"source": Path(path).name, "columns_left_alone": _unknown(table)}
    if duration is not None:
        attrs |= {"duration": duration, "spikes_outside": _outside(table, time, duration)}
    if trial is not None:
        attrs["n_trials"] = int(trial.max(initial=-1)) + 1
        trial = trial[fired]
    return spike_table(time[fired], unit[fired], names, trial=trial, attrs=attrs, **about_units(table, unit))


def _trials(table: Table, first: int | None) -> NDArray[np.int64]:
    """Trials from 0."""
    trial = table.numbers("trial") - (first or 0)
    wrong = (trial != np.floor(trial)) | (trial < 0) | (trial >= MOST_TRIALS)
    table.refuse_first(wrong, "trial", f"must be a whole number from {first or 0} to {MOST_TRIALS - 1}")
    if first is None and trial.size and trial.min() > 0:
        remedy = "say first_trial=1 if trials count from 1; if trial 0 was silent, give it a line without a time"
        table.refuse_first(trial == trial.min(), "trial", "must be 0 on a line", remedy)
    return trial.astype(int)


def _unknown(table: Table) -> str:
    known = {"time", "time_ms", "unit", "trial", *ABOUT_UNITS}
    return ",".join(name for name in table.columns if name not in known)


def _outside(table: Table, time: Array, duration: float) -> int:
    """Spikes outside the duration; refused where most of them are."""
    if not 0 < duration < np.inf:
        raise InputError("duration", "must be positive (s)", duration)
    outside = (time < 0) | (time >= duration)
    if 2 * outside.sum() > np.isfinite(time).sum():
        fits = outside & (time >= 0) & (time < 1e3 * duration)
        remedy = (
            "these look like milliseconds: name the column time_ms"
            if fits.sum() == outside.sum()
            else ("give times in seconds, from the start of the session or of the trial")
        )
        table.refuse_first(
            outside, table.column("time"), f"and most others lie outside the {duration:g} s of the record", remedy
        )
    return int(outside.sum())


def about_units(table: Table, unit: NDArray[np.int64]) -> dict[str, Any]:
    """What the columns of ``ABOUT_UNITS`` say of each unit.

    Parameters
    ----------
    table : Table
        One line for each spike.
    unit : (N,) array of int
        Index of each line's unit.

    Returns
    -------
    dict of (U,) arrays
        ``unit_whisker`` and ``unit_quality``, where there is such a column.

    Raises
    ------
    InputError
        If a unit has two values.
    """
    about: dict[str, Any] = {}
    for column in (name for name in ABOUT_UNITS if name in table.columns):
        cells = np.array(table.columns[column], str)
        first = np.unique(unit, return_index=True)[1]
        table.refuse_first(cells != cells[first][unit], column, "must be the same on all lines of a unit")
        about[ABOUT_UNITS[column]] = cells[first]
    return about


def write_csv(spikes: xr.Dataset, path: str | Path) -> None:
    """Write spikes so that :func:`read_csv` gives them back to the last bit; whole or not at all.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`spike_table`. Units without spikes, and the last trial where it has none, get a line without
        a time.
    path : path
        Name of the file; one that is there is replaced.

    Raises
    ------
    InputError
        If a name of a unit would not be read again: empty, with spaces around it, or of several lines.
    """
    require(spikes, "spike_time", "spike_unit", "unit_name")
    about = {column: _text(spikes, name) for column, name in ABOUT_UNITS.items() if name in spikes}
    names = _text(spikes, "unit_name")
    if "" in names:
        raise InputError("names of units", "must not be empty")
    trial = spikes.spike_trial.values.tolist() if "spike_trial" in spikes else None
    text = io.StringIO(newline="")
    write = csv.writer(text, lineterminator="\n").writerow
    write(["time", *(["trial"] if trial is not None else []), "unit", *about])

    def line(time: object, trial: object, unit: int) -> None:
        write([time, *([] if trial is None else [trial]), names[unit], *(column[unit] for column in about.values())])

    first = None if trial is None else 0
    for unit in range(len(names)):  # in their order, which the file keeps
        line("", first, unit)
    if trial is not None and spikes.attrs.get("n_trials", 0) > 1 + max(trial, default=0):
        line("", spikes.attrs["n_trials"] - 1, 0)
    for k, (time, unit) in enumerate(zip(spikes.spike_time.values.tolist(), spikes.spike_unit.values, strict=True)):
        line(repr(time), None if trial is None else trial[k], int(unit))
    with written_whole(path) as temporary:
        temporary.write_bytes(text.getvalue().encode())


def _text(spikes: xr.Dataset, name: str) -> list[str]:
    """Cells of a variable of units, as they will be read again."""
    cells = [str(cell) for cell in spikes[name].values]
    for cell in cells:
        if cell != cell.strip() or not cell.isprintable():
            raise InputError(f"{name} {cell!r}", "must be printable, without spaces around it")
    return cells


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
        raise InputError(f"unit {name!r}", "must be one of the table's", remedy=f"they are {', '.join(names)}")
    index = names.index(name)
    one = spikes.isel(spike=np.flatnonzero(spikes.spike_unit.values == index), unit=[index])
    one["spike_unit"] = one.spike_unit.copy(data=np.zeros(one.sizes["spike"], int))
    return one


def join_units(tables: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Put the spikes of single units, recorded in the same trials, into one table.

    Parameters
    ----------
    tables : mapping
        ``spike_time`` and ``spike_trial`` of each unit, by its name, as :func:`vibrissa.neural.virtual.simulate_spikes`
        gives them.

    Returns
    -------
    Dataset
        Table of :func:`spike_table`; ``n_trials`` as in the tables.

    Raises
    ------
    InputError
        If there is no table, or they tell of different numbers of trials.
    """
    if not tables:
        raise InputError("tables of units", "must be at least one", "none")
    for table in tables.values():
        require(table, "spike_time", "spike_trial")
    told = {table.attrs.get("n_trials") for table in tables.values()}
    if len(told) > 1:
        raise InputError("n_trials", "must be the same for all units", told)
    parts = list(tables.values())
    return spike_table(
        np.concatenate([part.spike_time.values for part in parts]),
        np.repeat(np.arange(len(parts)), [part.sizes["spike"] for part in parts]),
        list(tables),
        trial=np.concatenate([part.spike_trial.values for part in parts]),
        attrs={} if told == {None} else {"n_trials": told.pop()},
    )
