"""Spikes from any object that holds them: one flat table of events."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.api.objects.neo_spikes import NEO, neo_spikes
from vibrissa.api.objects.pynapple_spikes import pynapple_spikes
from vibrissa.api.objects.sortings import sorted_spikes
from vibrissa.api.objects.trials import as_trials
from vibrissa.api.shared.arguments import listed
from vibrissa.arrays import Window
from vibrissa.errors import ConflictError, FormatError, InputError, ShapeError, UnknownError
from vibrissa.neural.io.formats.foreign import one_line
from vibrissa.neural.io.recording import PLEXON, session_spikes
from vibrissa.neural.io.tables.selection import at_places
from vibrissa.neural.io.tables.spike_csv import NEEDED, OPTIONAL, spikes_of_table
from vibrissa.neural.io.tables.spikes import table_of_trains
from vibrissa.neural.io.tables.trials import cut_into_trials
from vibrissa.tables.frame import table_of_frame
from vibrissa.tables.kinds import described, is_a
from vibrissa.tables.stated import bare
from vibrissa.tables.table import LONGEST

Read = tuple[xr.Dataset, xr.Dataset | None]  # spikes, and the trials that the object states itself

SPELLINGS = {
    "spike_time": ("spike_times", "time", "times"),
    "unit": ("unit_name", "unit_id", "units", "neuron", "neuron_id", "cluster", "cluster_id"),
    "trial": ("trial_index", "trial_id"),
}
RIGHT = (
    "give a DataFrame with columns spike_time,unit,trial, a dict of arrays of times [s], a pynapple TsGroup, neo "
    "SpikeTrains, a SpikeInterface sorting, an open NWBFile, or the name of a file"
)


def as_spikes(
    thing: Any,
    *,
    trials: Any = None,
    window: Window | None = None,
    event: str | None = None,
    groups: Collection[str] | None = None,
    unsorted: bool = False,
    counted_bin: float | None = None,
) -> xr.Dataset:
    """Spikes of any object, in the trials of one protocol or on the session's clock.

    Parameters
    ----------
    thing : object
        A dataset of spikes, or units and trials selected from one of :func:`vibrissa.read_spikes`. The name of a file
        or folder, as :func:`vibrissa.neural.io.recording.recorded_spikes` reads them. A pandas ``DataFrame``, one row
        for each spike: ``spike_time`` [s] (or ``spike_time_ms``), ``unit`` and, where times count from the onset of a
        trial, ``trial`` from 0; a row without a time names a unit or a trial without spikes. A mapping from the name of
        each unit to its times [s]. A pynapple ``TsGroup`` or ``Ts``. A neo ``SpikeTrain``, a list of them, a
        ``Segment`` or a ``Block``; a SpikeInterface sorting: several segments are trials. An open pynwb ``NWBFile``,
        whose table ``trials`` is taken where it has one.
    trials : object, optional
        Trials into which spikes on a session's clock are cut: see :func:`vibrissa.api.objects.trials.as_trials`.
    window : (start, stop), optional
        Part of each trial that is kept, about its onset [s]; default: from the start to the stop of each trial.
    event : str, optional
        Event channel of a Plexon or NeuroExplorer file whose marks are the onsets of trials; needs a window.
    groups, unsorted, counted_bin
        Of a file or folder, see :func:`vibrissa.neural.io.recording.recorded_spikes`.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.spikes.spike_table`. In trials, ``spike_time`` counts from the onset,
        ``spike_trial`` is there, and ``spikes_outside`` counts the spikes that fall into no trial. Units without spikes
        are kept. Where the object says when each unit was observed (time support, t_start and t_stop), so does the
        table: ``interval_start``, ``interval_stop``, ``interval_unit``, or ``unit_observed`` (unit, trial).

    Raises
    ------
    InputError
        If the object is of no such kind, or its units, times or trials are ambiguous; says how to write it.

    Examples
    --------
    >>> spikes = as_spikes({"a": [0.1, 1.2, 1.3], "b": []}, trials=[(0.0, 1.0), (1.0, 2.0)])
    >>> spikes.spike_trial.values.tolist(), spikes.unit_name.values.tolist()
    ([0, 1, 1], ['a', 'b'])
    >>> spikes.spike_time.values.round(6).tolist()
    [0.1, 0.2, 0.3]
    """
    if window is not None:
        start, stop = listed("window", window, "Window", "s")
        window = float(start), float(stop)
    files = {"groups": groups, "unsorted": unsorted, "counted_bin": counted_bin}
    if event is not None and not isinstance(thing, str | PathLike):
        raise ConflictError("event", "must go with a Plexon or NeuroExplorer file", described(thing))
    spikes, own = (
        _of_path(Path(thing), event, window, files) if isinstance(thing, str | PathLike) else object_spikes(thing)
    )
    if "spike_trial" in spikes:
        if trials is not None or window is not None:
            raise ConflictError("trials, window", "must go with spikes on a session's clock", "spikes in trials")
        return spikes
    table = own if trials is None else as_trials(trials, window=window)
    if table is not None:
        return cut_into_trials(spikes, table, window)
    if window is not None:
        raise without_trials(window)
    return spikes


def without_trials(window: Window) -> ConflictError:
    """The refusal of a window about onsets that are not known.

    Parameters
    ----------
    window : (float, float)
        From the onset [s].

    Returns
    -------
    ConflictError
        With the argument that gives them.
    """
    return ConflictError("window", "must go with trials", window, "give trials=[(start, stop), …] or their onsets")


def _in_order(frame: Any) -> Any:
    """A data frame whose index numbers its rows, in that order: rows that name units come before their spikes again."""
    numbers = frame.index.to_numpy()
    numbered = numbers.dtype.kind in "iu" and np.array_equal(np.sort(numbers), np.arange(numbers.size))
    return frame.sort_index() if numbered else frame


def object_spikes(thing: Any) -> Read:
    """Spikes of an object as it has them, and its own trials.

    Parameters
    ----------
    thing : object
        As :func:`as_spikes` takes it, but no name of a file.

    Returns
    -------
    spikes : Dataset
        On the session's clock, or in trials where the object has them so.
    trials : Dataset or None
        Those that it states beside its spikes.

    Raises
    ------
    InputError
        As :func:`as_spikes`.
    """
    if isinstance(thing, xr.Dataset):
        return at_places(thing), None
    if is_a(thing, "pandas", "DataFrame"):
        table = table_of_frame(_in_order(thing), NEEDED, OPTIONAL, SPELLINGS)
        return spikes_of_table(table, described(thing)), None
    if is_a(thing, "pynapple", "TsGroup", "Ts"):
        return pynapple_spikes(thing), None
    if is_a(thing, "spikeinterface", "BaseSorting"):
        return sorted_spikes(thing), None
    if is_a(thing, "pynwb", "NWBFile"):
        with one_line("NWBFile", "must be whole and open", "open it: NWBHDF5IO(path, 'r').read()"):
            return _of_nwb(thing, "NWBFile")
    several = isinstance(thing, list | tuple) or is_a(thing, "neo", "SpikeTrainList")
    if is_a(next(iter(thing), None) if several else thing, "neo", *NEO):
        return neo_spikes(thing), None
    if isinstance(thing, Mapping):
        return _of_trains(thing), None
    raise UnknownError("spikes", "must be an object that holds spike times of units", described(thing), RIGHT)


def _of_path(path: Path, event: str | None, window: Window | None, how: Mapping[str, Any]) -> Read:
    if event is not None and path.suffix.lower() not in PLEXON:
        raise ConflictError("event", "must go with a Plexon or NeuroExplorer file", str(path))
    spikes = session_spikes(path, event=event, **how)
    if path.suffix.lower() == ".nwb":
        from vibrissa.neural.io.formats.nwb import opened, trials_of

        with opened(path) as file:
            return spikes, None if file.trials is None else trials_of(file.trials, str(path))
    return spikes, None if event is None else as_trials(spikes.marker_time.values, window=window)


def _of_nwb(file: Any, source: str) -> Read:
    from vibrissa.neural.io.formats.nwb import trials_of, units_of

    return units_of(file, source), None if file.trials is None else trials_of(file.trials, source)


def _of_trains(trains: Mapping[Any, Any]) -> xr.Dataset:
    """Spikes from the times of each unit by its name."""
    found = []
    for name, times in trains.items():
        if is_a(times, "pynapple", "TsGroup"):
            pynapple_spikes(times)  # says why trials of a unit are refused
            raise ShapeError(f"unit {name}", "must be an array of spike times, (N,)", described(times))
        try:
            time = np.asarray(times.t if is_a(times, "pynapple", "Ts") else bare(times, "s"), float)
        except InputError as error:
            raise error.renamed(f"unit {name}") from None
        except (TypeError, ValueError) as error:
            raise FormatError(f"unit {name}", "must be an array of spike times [s]", described(times)) from error
        if time.ndim != 1:
            raise ShapeError(f"unit {name}", "must be an array of spike times, (N,)", time.shape)
        if not (np.abs(time) <= LONGEST).all():
            raise FormatError(f"unit {name}", "must have finite spike times in seconds", f"{np.max(np.abs(time)):.6g}")
        found.append(time)
    return table_of_trains(found, [str(name) for name in trains], {"source": described(trains)})
