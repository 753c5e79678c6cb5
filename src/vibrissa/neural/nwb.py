"""Spikes and trials from files of Neurodata Without Borders, through pynwb."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from reprlib import repr as short
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import InputError, install
from vibrissa.neural.spikes import spike_table
from vibrissa.neural.table import LONGEST
from vibrissa.neural.trials import trial_table

if TYPE_CHECKING:
    import xarray as xr

UNIT_COLUMNS = {  # of the file, and the variable of a unit each is
    "unit_name": ("unit_name", "name given at sorting"),
    "quality": ("unit_quality", "SU single unit, MU multi-unit"),
    "whisker": ("unit_whisker", "principal whisker"),
    "snr": ("snr_smallest", "peak-to-peak of the smallest waveform over the rms of the noise"),
}


def pynwb_module() -> Any:
    """Give pynwb, which is imported only here."""
    try:
        return import_module("pynwb")
    except ImportError as error:
        raise InputError("NWB files", "need pynwb", remedy=install("neuro")) from error


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
        See :func:`vibrissa.neural.spikes.spike_table`. ``unit_id`` keeps the ids. ``unit_quality``, ``unit_whisker``
        and ``snr_smallest`` where the file has the columns quality, whisker and snr; ``interval_start``,
        ``interval_stop`` and ``interval_unit`` where it tells when each unit was observed; ``unit_waveform`` where it
        has mean waveforms of one electrode, ``unit_electrode`` where each unit has one electrode.

    Raises
    ------
    InputError
        If pynwb is not installed; if the file is not there, no NWB file, without units or without their spike times.
    """
    with _opened(path) as file:
        units = file.units
        if units is None or units.spike_times is None:
            what = "units" if units is None else "spike times in its units"
            raise InputError(str(path), f"must have {what}", remedy="choose the file that holds the sorted spikes")
        ids = np.asarray(units.id[:], int)
        times = [np.asarray(units.spike_times_index[k], float) for k in range(ids.size)]
        about = _about_units(units)
        named = _names(units, path, names)
        intervals = _intervals(units)
    for one, time in zip(ids, times, strict=True):
        if not (np.abs(time) <= LONGEST).all():
            raise InputError(f"{path}, unit {one}", "must have finite spike times in seconds", f"{np.max(time):.6g}")
    unit = np.repeat(np.arange(ids.size), [time.size for time in times])
    time = np.concatenate([*times, np.zeros(0)])
    table = spike_table(time, unit, named, attrs={"source": Path(path).name}, unit_id=ids, **about)
    return table.assign(intervals)


def _names(units: Any, path: str | Path, column: str | None) -> list[str]:
    """Names of the units; each once."""
    if column is None:
        column = "unit_name" if "unit_name" in units.colnames else "id"
    if column != "id" and column not in units.colnames:
        raise InputError(f"{path}, units", f"must have a column {column}", remedy=f"it has {', '.join(units.colnames)}")
    names = [str(name) for name in (units.id if column == "id" else units[column])[:]]
    if len(set(names)) < len(names):
        remedy = "name them by their ids: names='id'"
        raise InputError(f"{path}, {column}", "must tell each unit from the others", remedy=remedy)
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
    if "waveform_mean" in units.colnames and np.ndim(units["waveform_mean"][:]) == 2:
        about["unit_waveform"] = np.asarray(units["waveform_mean"][:], float)
    if units.electrodes is not None:
        ends = np.asarray(units.electrodes_index.data[:], int)
        if (np.diff(ends, prepend=0) == 1).all():
            about["unit_electrode"] = np.asarray(units.electrodes_index.target.data[:], int)
    return about


def _intervals(units: Any) -> dict[str, Any]:
    """Intervals in which units were observed, as one flat table."""
    if units.obs_intervals is None:
        return {}
    each = [np.asarray(units.obs_intervals_index[k], float).reshape(-1, 2) for k in range(len(units))]
    flat = np.concatenate([*each, np.zeros((0, 2))])
    return {
        "interval_start": ("interval", flat[:, 0], {"units": "s"}),
        "interval_stop": ("interval", flat[:, 1], {"units": "s"}),
        "interval_unit": ("interval", np.repeat(np.arange(len(each)), [len(one) for one in each])),
    }


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
        Column that tells what was presented; need not be there.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.trials.trial_table`.

    Raises
    ------
    InputError
        If there is no such table, and those there are are named; as :func:`vibrissa.neural.trials.trial_table`.
    """
    with _opened(path) as file:
        found = {str(name): one for name, one in (file.intervals or {}).items()}
        if file.trials is not None:
            found["trials"] = file.trials
        if table not in found:
            there = f"it has {', '.join(found)}" if found else "it has no intervals"
            remedy = f"{there}; --trial-table FILE, a CSV with columns start,stop"
            raise InputError(str(path), f"must have a table {table}", remedy=remedy)
        rows = found[table]
        start, stop = (np.asarray(rows[name][:], float) for name in ("start_time", "stop_time"))
        kept = np.ones(start.size, bool) if only is None else _with_value(rows, f"{path}, {table}", *only)
        named = np.asarray(rows[stimulus][:]).astype(str)[kept] if stimulus in rows.colnames else None
    order = np.argsort(start[kept], kind="stable")
    attrs = {"source": Path(path).name, "trials_left_out": int((~kept).sum())}
    return trial_table(start[kept][order], stop[kept][order], None if named is None else named[order], attrs)


def _with_value(rows: Any, here: str, column: str, value: str) -> Any:
    if column not in rows.colnames:
        raise InputError(here, f"must have a column {column}", remedy=f"it has {', '.join(rows.colnames)}")
    cells = [str(cell) for cell in rows[column][:]]
    if value not in cells:
        raise InputError(
            f"{here}, {column}", f"must be {value!r} on a row", remedy=f"it is {', '.join(sorted(set(cells))[:9])}"
        )
    return np.array([cell == value for cell in cells], bool)


@contextmanager
def _opened(path: str | Path) -> Iterator[Any]:
    """Open a file for reading; whatever fails inside becomes one line."""
    pynwb = pynwb_module()
    if not Path(path).is_file():
        raise InputError(str(path), "must be an existing file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of older layouts, cached schemas and the like
            with pynwb.NWBHDF5IO(str(path), "r") as io:
                yield io.read()
    except InputError:
        raise
    except Exception as error:
        raise InputError(str(path), f"must be a whole NWB file ({short(str(error))})") from error
