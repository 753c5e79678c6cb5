"""Spikes in files of comma-separated values: read, and written so that they are read again."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Integers, Mask
from vibrissa.errors import FormatError, TooFewError
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.quantities import require
from vibrissa.tables.reader import read_table
from vibrissa.tables.table import Table
from vibrissa.tables.units import PURE, TEXT
from vibrissa.tables.writer import write_table

MOST_TRIALS = 1_000_000
ABOUT_UNITS = {"whisker": "unit_whisker", "quality": "unit_quality"}  # columns with one value for each unit
NUMBERS_OF_UNITS = {"snr": "unit_snr"}  # the same of numbers; an empty cell is not measured
NEEDED = {"spike_time": "s", "unit": TEXT}  # columns of a table of spikes, and their SI units
OPTIONAL = {"trial": PURE, **dict.fromkeys(ABOUT_UNITS, TEXT), **dict.fromkeys(NUMBERS_OF_UNITS, PURE)}


def read_spikes(path: str | Path, *, all_trials: bool = False) -> xr.Dataset:
    """Spikes from a file of comma-separated values, one line for each.

    Parameters
    ----------
    path : path
        UTF-8 text below a header with the columns ``spike_time`` [s] (or ``spike_time_ms``), ``unit`` (any name) and,
        if times count from the onset of a trial, ``trial`` (its number). ``whisker`` (the principal one),
        ``quality`` (SU, MU) and ``snr`` (signal to noise) may be there, with one value for each unit. A line without a
        time says that its unit was recorded, and its trial presented, without a spike; a file with such lines lists all
        of its trials. Below spikes of the unit in that trial it is refused: a time is missing. Other columns are
        left alone and named in ``columns_left_alone``.
    all_trials : bool
        Whether the largest trial is the last one in a file without such lines too.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`; units in the order of their names
        (:func:`units_by_name`), whatever that of the lines. ``n_trials`` reaches to the largest trial of a file that
        lists its trials, and is absent otherwise.

    Raises
    ------
    InputError
        Names file and line: no spike, a time that is not a number, a negative trial, a unit on two
        whiskers; a file that lists its trials but has no trial 0.
    """
    return spikes_of_table(read_table(path, NEEDED, OPTIONAL), Path(path).name, all_trials=all_trials)


def spikes_of_table(table: Table, source: str, *, all_trials: bool = False) -> xr.Dataset:
    """Spikes from a table with a row for each, as :func:`read_spikes` gives them.

    Parameters
    ----------
    table : Table
        With the columns of ``NEEDED``, maybe those of ``OPTIONAL``.
    source : str
        Where it is from.
    all_trials : bool
        As in :func:`read_spikes`.

    Returns
    -------
    Dataset
        As :func:`read_spikes`.

    Raises
    ------
    InputError
        As :func:`read_spikes`.
    """
    table.refuse_empty("must hold at least one spike", "a header alone")
    time = table.seconds("spike_time", blanks=True)
    fired = np.isfinite(time)
    listed = all_trials or not fired.all()
    names, unit = units_by_name(table.names("unit"))
    attrs: dict[str, Any] = {"source": source, "columns_left_alone": ",".join(table.others)}
    trial = _trials(table, listed) if "trial" in table else None
    if trial is not None and listed:
        attrs["n_trials"] = int(trial.max()) + 1
    _refuse_missing(table, fired, unit if trial is None else unit + trial * len(names))
    trial = None if trial is None else trial[fired]
    return spike_table(time[fired], unit[fired], names, trial=trial, attrs=attrs, **_about_units(table, unit))


def units_by_name(cells: list[str]) -> tuple[list[str], Integers]:
    """Names of the units, in an order that the lines of a file do not change, and the unit of each line.

    Parameters
    ----------
    cells : list of str
        Name of the unit on each line.

    Returns
    -------
    names : list of str
        Each name once; numbers in them are compared as numbers.
    unit : (N,) array of int
        Index of each line's unit among the names.

    Examples
    --------
    >>> names, unit = units_by_name(["u10", "u2", "u10"])
    >>> names, unit.tolist()
    (['u2', 'u10'], [1, 0, 1])
    """

    def key(name: str) -> tuple[list[tuple[int, str]], str]:
        parts = [part.lstrip("0") if part.isdecimal() else part for part in re.split(r"(\d+)", name)]
        return [(len(part) if k % 2 else 0, part) for k, part in enumerate(parts)], name

    names = sorted(set(cells), key=key)
    index = {name: k for k, name in enumerate(names)}
    return names, np.fromiter((index[cell] for cell in cells), int, len(cells))


def _refuse_missing(table: Table, fired: Mask, place: Integers) -> None:
    """Refuse a line without a time below one with a time of the same unit and trial: a time is missing there."""
    places, of = np.unique(place, return_inverse=True)
    first = np.full(places.size, place.size)
    np.minimum.at(first, of[fired], np.flatnonzero(fired))
    rule = "must be a time: the unit has spikes in this trial above, so this line is not one of a silent trial"
    missing = ~fired & (first[of] < np.arange(place.size))
    table.refuse_first(missing, "spike_time", rule, "leave the line out if there was none")


def _trials(table: Table, listed: bool) -> Integers:
    """Trials from 0; of a file that lists them all, the first is there."""
    trial = table.whole_numbers("trial", f"must be a whole number from 0 to {MOST_TRIALS - 1}", 0, MOST_TRIALS - 1)
    if listed and trial.min() > 0:
        remedy = "count trials from 0; if trial 0 was silent, give it a line without a time"
        table.refuse_first(trial == trial.min(), "trial", "must be 0 on a line", remedy)
    return trial


def _about_units(table: Table, unit: Integers) -> dict[str, Any]:
    """Values of the columns that describe units, for each unit; refused where one unit has two."""
    about: dict[str, Any] = {}
    for column, name in (ABOUT_UNITS | NUMBERS_OF_UNITS).items():
        if column not in table:
            continue
        cells = np.array(table.text(column), str)
        first = np.unique(unit, return_index=True)[1]
        table.refuse_first(cells != cells[first][unit], column, "must be the same on all lines of a unit")
        values = table.numbers(column, blanks=True, unknown=True) if column in NUMBERS_OF_UNITS else cells
        about[name] = values[first]
    return about


def write_csv(spikes: xr.Dataset, path: str | Path) -> None:
    """Write spikes so that :func:`read_spikes` gives them back to the last bit; whole or not at all.

    Units are read in the order of their names, not of the table.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`. Units without spikes, and the last trial where it
        has none, get a line without a time.
    path : path
        Name of the file; one that is there is replaced.

    Raises
    ------
    InputError
        If a name of a unit would not be read again: empty, with spaces around it, or of several lines; if a unit was
        not observed in all trials, which would be read as silence.
    """
    write_table(path, flat_columns(spikes))


def flat_columns(spikes: xr.Dataset) -> dict[str, list[Any]]:
    """Columns of a table with a row for each spike, from which :func:`spikes_of_table` makes the same dataset.

    Parameters
    ----------
    spikes : Dataset
        As in :func:`write_csv`.

    Returns
    -------
    dict of list
        Cells by the name of their column; rows that only name a unit, or the last trial, have an empty time.

    Raises
    ------
    InputError
        As :func:`write_csv`.
    """
    require(spikes, "spike_time", "spike_unit", "unit_name")
    _refuse_unobserved(spikes)
    about = {column: _text(spikes, name) for column, name in ABOUT_UNITS.items() if name in spikes}
    about |= {column: _numbers(spikes, name) for column, name in NUMBERS_OF_UNITS.items() if name in spikes}
    names = _text(spikes, "unit_name")
    if "" in names:
        raise TooFewError("names of units", "must not be empty")
    unit = [*range(len(names)), *spikes.spike_unit.values.tolist()]  # first all units in their order, without a time
    time: list[Any] = [*[""] * len(names), *spikes.spike_time.values.tolist()]
    columns: dict[str, list[Any]] = {"spike_time": time}
    if "spike_trial" in spikes:
        columns["trial"] = trial = [*[0] * len(names), *spikes.spike_trial.values.tolist()]
        if (last := spikes.attrs.get("n_trials", 0) - 1) > max(trial, default=0):
            for cells, cell in ((time, ""), (trial, last), (unit, 0)):
                cells.insert(len(names), cell)
    columns["unit"] = [names[k] for k in unit]
    return columns | {name: [cells[k] for k in unit] for name, cells in about.items()}


def _refuse_unobserved(spikes: xr.Dataset) -> None:
    """Refuse units that were not observed in all trials: a table of spikes cannot say so."""
    if "unit_observed" not in spikes:
        return
    seen = spikes.unit_observed.transpose("unit", "trial").values.astype(bool)
    if seen.all():
        return
    first = int(np.flatnonzero(~seen.all(1))[0])
    found = f"{seen[first].sum()} of {seen.shape[1]} for {str(spikes.unit_name.values[first])!r}"
    remedy = "the others would be read as silent: vb.save(spikes, 'spikes.nc') keeps them apart"
    raise TooFewError("units", "must be observed in all trials of a table", found, remedy)


def _numbers(spikes: xr.Dataset, name: str) -> list[str]:
    """Cells of numbers of units; empty where they are not measured."""
    return ["" if np.isnan(value) else repr(value) for value in spikes[name].values.astype(float).tolist()]


def _text(spikes: xr.Dataset, name: str) -> list[str]:
    """Cells of a variable of units, as they will be read again."""
    cells = [str(cell) for cell in spikes[name].values]
    for cell in cells:
        if cell != cell.strip() or not cell.isprintable():
            raise FormatError(f"{name} {cell!r}", "must be printable, without spaces around it")
    return cells
