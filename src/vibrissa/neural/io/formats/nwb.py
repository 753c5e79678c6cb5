"""Spikes and trials from files of Neurodata Without Borders, through pynwb."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import FormatError, MissingError
from vibrissa.neural.io.formats.foreign import one_line, optional_module
from vibrissa.neural.io.tables.spikes import table_of_trains, with_intervals
from vibrissa.neural.io.tables.trials import rows_with, trial_table
from vibrissa.reader_process import refuse_endless
from vibrissa.tables.table import LONGEST

UNIT_COLUMNS = {  # of the file, and the variable of a unit each is
    "unit_name": ("unit_name", "name given at sorting"),
    "quality": ("unit_quality", "SU single unit, MU multi-unit"),
    "whisker": ("unit_whisker", "principal whisker"),
    "snr": ("snr_smallest", "peak-to-peak of the smallest waveform over the rms of the noise"),
}


def pynwb_module() -> Any:
    """Module pynwb, which is imported only here."""
    return optional_module("pynwb", "an NWB file", "neuro")


def read_nwb(path: str | Path, *, names: str | None = None) -> xr.Dataset:
    """Spikes of the units table of an NWB file, on the session's clock.

    Parameters
    ----------
    path : path
        The file.
    names : str, optional
        Column that names the units, or ``"id"``; default: ``unit_name`` where there is such a column, else their ids.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`. ``unit_id`` keeps the ids. ``unit_quality``,
        ``unit_whisker`` and ``snr_smallest`` where the file has the columns quality, whisker and snr;
        ``interval_start``, ``interval_stop`` and ``interval_unit`` where it says when each unit was observed;
        ``unit_waveform`` and ``unit_waveform_sd`` where it has mean waveforms and their deviations, of the electrode on
        which a unit is largest; ``unit_electrode`` where each unit has one electrode.

    Raises
    ------
    InputError
        If pynwb is not installed; if the file is not there, no NWB file, without units or without their spike times.
    """
    with opened(path) as file:
        return units_of(file, str(path), names=names)


def units_of(file: Any, source: str, *, names: str | None = None) -> xr.Dataset:
    """Spikes of the units table of an open NWB file, on the session's clock.

    Parameters
    ----------
    file : pynwb.NWBFile
        The open file.
    source : str
        Its name.
    names : str, optional
        As in :func:`read_nwb`.

    Returns
    -------
    Dataset
        As :func:`read_nwb`.

    Raises
    ------
    InputError
        If there are no units, or no spike times of them.
    """
    units = file.units
    if units is None or units.spike_times is None:
        what = "units" if units is None else "spike times in its units"
        raise MissingError(source, f"must have {what}", remedy="choose the file that holds the sorted spikes")
    ids = np.asarray(units.id[:], int)
    times = _cells(units["spike_times"])
    for one, time in zip(ids, times, strict=True):
        if not (np.abs(time) <= LONGEST).all():
            raise FormatError(f"{source}, unit {one}", "must have finite spike times in seconds", f"{np.max(time):.6g}")
    attrs = {"source": Path(source).name, "snr_source": "column snr"}
    named = _names(units, source, names)
    table = table_of_trains(times, named, attrs, unit_id=ids, **_about_units(units))
    if units.obs_intervals is None:
        return table
    return with_intervals(table, _cells(units["obs_intervals"]))


def _cells(column: Any) -> list[Array]:
    """Numbers of each row of a column, of as many as it has, or of as many as all others; the file is read once."""
    if not hasattr(column, "target"):
        return [np.atleast_1d(np.asarray(one, float)) for one in np.asarray(column.data[:])]
    ends = np.asarray(column.data[:], int)
    return np.split(np.asarray(column.target.data[:], float), ends[:-1]) if ends.size else []


def _names(units: Any, path: str, column: str | None) -> list[str]:
    """Names of the units; each once."""
    if column is None:
        column = "unit_name" if "unit_name" in units.colnames else "id"
    if column != "id" and column not in units.colnames:
        remedy = f"it has {', '.join(units.colnames)}"
        raise MissingError(f"{path}, units", f"must have a column {column}", remedy=remedy)
    names = [str(name) for name in (units.id if column == "id" else units[column])[:]]
    if len(set(names)) < len(names):
        remedy = "name them by their ids: names='id'"
        raise MissingError(f"{path}, {column}", "must name each unit differently", remedy=remedy)
    return names


def _about_units(units: Any) -> dict[str, Any]:
    """Columns with one value for each unit, by the variable each is."""
    about = {}
    for column, (name, _) in UNIT_COLUMNS.items():
        if column in units.colnames and name != "unit_name" and np.ndim(units[column][:]) == 1:
            values = np.asarray(units[column][:])
            if name == "snr_smallest" and values.dtype.kind not in "fiu":
                continue
            about[name] = values.astype(float) if name == "snr_smallest" else values.astype(str)
    about |= _waveforms(units)
    if "electrodes" in units.colnames:
        each = _cells(units["electrodes"])
        if all(one.size == 1 for one in each):
            about["unit_electrode"] = np.array([one.item() for one in each], int)
    return about


def _waveforms(units: Any) -> dict[str, Any]:
    """Mean waveforms and their deviations; of several electrodes that on which the unit is largest."""
    if "waveform_mean" not in units.colnames or np.ndim(units["waveform_mean"][:]) not in (2, 3):
        return {}
    mean = np.asarray(units["waveform_mean"][:], float)
    found = {"unit_waveform": mean}
    if "waveform_sd" in units.colnames and np.shape(units["waveform_sd"][:]) == mean.shape:
        found["unit_waveform_sd"] = np.asarray(units["waveform_sd"][:], float)
    if mean.ndim == 2:
        return found
    best = np.ptp(np.nan_to_num(mean), axis=1).argmax(axis=1)[:, None, None]
    return {name: np.take_along_axis(one, best, 2)[..., 0] for name, one in found.items()}


def read_nwb_trials(
    path: str | Path, *, table: str = "trials", only: tuple[str, str] | None = None, stimulus: str = "stimulus"
) -> xr.Dataset:
    """Trials of an NWB file.

    Parameters
    ----------
    path : path
        The file.
    table : str
        Name of the table of intervals: ``trials``, ``epochs`` or another.
    only : (column, value), optional
        Keep the trials with that value in that column: the protocol of interest among interleaved ones.
    stimulus : str
        Column of what was presented; need not be there.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.

    Raises
    ------
    InputError
        If there is no such table, and those there are are named; as
        :func:`vibrissa.neural.io.tables.trials.trial_table`.
    """
    with opened(path) as file:
        found = {str(name): one for name, one in (file.intervals or {}).items()}
        if file.trials is not None:
            found["trials"] = file.trials
        if table not in found:
            there = f"it has {', '.join(found)}" if found else "it has no intervals"
            remedy = f"{there}; or `trial_table`, a CSV with columns start,stop"
            raise MissingError(str(path), f"must have a table {table}", remedy=remedy)
        return trials_of(found[table], str(path), only=only, stimulus=stimulus)


def trials_of(rows: Any, source: str, *, only: tuple[str, str] | None = None, stimulus: str = "stimulus") -> xr.Dataset:
    """Trials of a table of intervals of an open NWB file.

    Parameters
    ----------
    rows : pynwb.epoch.TimeIntervals
        The table.
    source : str
        Name of the file.
    only, stimulus
        As in :func:`read_nwb_trials`.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.

    Raises
    ------
    InputError
        As :func:`vibrissa.neural.io.tables.trials.trial_table`.
    """
    start, stop = (np.asarray(rows[name][:], float) for name in ("start_time", "stop_time"))
    kept = np.ones(start.size, bool)
    if only is not None:
        cells = [str(cell) for cell in rows[only[0]][:]] if only[0] in rows.colnames else None
        kept = rows_with(cells, f"{source}, {rows.name}", *only, columns=rows.colnames)
    named = np.asarray(rows[stimulus][:]).astype(str)[kept] if stimulus in rows.colnames else None
    order = np.argsort(start[kept], kind="stable")
    attrs: dict[str, Any] = {"source": Path(source).name, "trials_left_out": int((~kept).sum())}
    if not kept.all():
        attrs["onsets_left_out"] = start[~kept]
    return trial_table(start[kept][order], stop[kept][order], None if named is None else named[order], attrs)


@contextmanager
def opened(path: str | Path) -> Iterator[Any]:
    """Open an NWB file for reading; whatever fails inside becomes one line.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    iterator of pynwb.NWBFile
        The open file.

    Raises
    ------
    InputError
        If pynwb is not installed, or the file is not there or not whole.
    """
    pynwb = pynwb_module()
    if not Path(path).is_file():
        raise MissingError(str(path), "must be an existing file")
    refuse_endless(Path(path))
    with one_line(str(path), "must be a whole NWB file"), pynwb.NWBHDF5IO(str(path), "r") as io:
        yield io.read()
