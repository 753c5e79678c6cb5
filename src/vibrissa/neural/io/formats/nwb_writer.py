"""A session as a file of Neurodata Without Borders that archives accept: units, trials, stimulus."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import MissingError, RangeError
from vibrissa.neural.io.formats.nwb import UNIT_COLUMNS, pynwb_module
from vibrissa.neural.io.formats.nwb_session import Session as Session
from vibrissa.neural.io.formats.nwb_session import save_nwb, session_file
from vibrissa.neural.io.tables.inputs import require_session_clock
from vibrissa.neural.io.tables.stimuli import name_of, presented
from vibrissa.quantities import require
from vibrissa.signals.even_times import even_rate


def write_nwb(
    spikes: xr.Dataset,
    path: str | Path,
    session: Session,
    *,
    trials: xr.Dataset | None = None,
    command: xr.Dataset | None = None,
) -> None:
    """Write spikes, trials and the stimulus so that archives accept them; whole or not at all.

    Parameters
    ----------
    spikes : Dataset
        Spikes on the session's clock; see :func:`vibrissa.neural.io.tables.spikes.spike_table`. What is known of the
        units, and when they were observed, goes with them.
    path : path
        Name of the file; ``session.filename`` is the one that archives want.
    session : Session
        Session and animal.
    trials : Dataset, optional
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.
    command : Dataset, optional
        ``command`` (whisker, time) [m], presented in every trial: a template to which the trials refer. With
        ``delay`` (whisker) [s], a table of whiskers and their delays; with ``replayed_envelope`` (whisker, time) [m],
        a series of that name beside it.

    Raises
    ------
    InputError
        If pynwb is not installed; if the spikes are cut into trials.
    """
    file = session_file(session)
    add_units(file, spikes, session)
    template = None if command is None else add_command(file, command)
    if trials is not None:
        add_trials(file, trials, template)
    save_nwb(file, path)


def add_units(file: Any, spikes: xr.Dataset, session: Session) -> None:
    """Add units with their spike times on the session's clock, and a column for all that is known of each.

    Parameters
    ----------
    file : NWBFile
        From ``session_file``.
    spikes : Dataset
        As in :func:`write_nwb`. Variables (unit) that the reader knows no other name for keep theirs.
    session : Session
        Whose resolution, shanks and sites count.

    Raises
    ------
    InputError
        If the spikes are cut into trials.
    """
    pynwb = pynwb_module()
    require_session_clock(spikes, "write them uncut, with trials=")
    placed = "unit_electrode" in spikes
    if placed:
        _add_probe(file, session)
    units = pynwb.misc.Units(
        name="units",
        description="simulated units" if session.virtual else "sorted units",
        resolution=session.resolution,
        waveform_rate=1 / session.resolution,
        electrode_table=file.electrodes if placed else None,
    )
    columns = _columns(spikes)
    for column, (_, text) in columns.items():
        units.add_column(name=column, description=text)
    observed = "interval_unit" in spikes
    trains = _trains(spikes)
    ids = spikes.unit_id.values if "unit_id" in spikes else np.arange(spikes.sizes["unit"])
    for k, one in enumerate(ids):
        row = {column: spikes[name].values[k].item() for column, (name, _) in columns.items()}
        if observed:
            row["obs_intervals"] = _intervals_of(spikes, k)
        if placed:
            row["electrodes"] = [_electrode(spikes, k, session)]
        if "unit_waveform" in spikes:
            row["waveform_mean"] = spikes.unit_waveform.values[k]
        units.add_unit(id=int(one), spike_times=trains[k], **row)
    file.units = units


def _columns(spikes: xr.Dataset) -> dict[str, tuple[str, str]]:
    """Columns of units: the variable that each is, and its description."""
    known = {column: (name, text) for column, (name, text) in UNIT_COLUMNS.items() if name in spikes}
    taken = {"unit_id", "unit_electrode", *(name for name, _ in known.values())}
    others = [
        str(name)
        for name, one in spikes.variables.items()
        if one.dims == ("unit",) and name not in taken and measured(one)
    ]
    known = {column: one for column, one in known.items() if measured(spikes[one[0]])}
    return known | {name: (name, described(spikes[name])) for name in others}


def _trains(spikes: xr.Dataset) -> list[Array]:
    """Times of each unit, ascending [s]."""
    unit, time = spikes.spike_unit.values, spikes.spike_time.values
    order = np.lexsort([time, unit])
    return np.split(time[order], np.searchsorted(unit[order], np.arange(1, spikes.sizes["unit"])))


def measured(variable: xr.DataArray | xr.Variable) -> bool:
    """Whether a variable has a value anywhere: NaN means not measured.

    Parameters
    ----------
    variable : DataArray or Variable
        Any.

    Returns
    -------
    bool
        True of what is not a float.
    """
    return variable.dtype.kind != "f" or bool(np.isfinite(variable.values).any())


def described(variable: xr.DataArray) -> str:
    """Long name of a variable, with its unit.

    Parameters
    ----------
    variable : DataArray
        With ``long_name`` and ``units``.

    Returns
    -------
    str
        For a description.
    """
    text, unit = str(variable.attrs.get("long_name", variable.name)), str(variable.attrs.get("units", "1"))
    return text if unit == "1" else f"{text} [{unit}]"


def _add_probe(file: Any, session: Session) -> None:
    """Electrodes in order along the shanks, from 0."""
    probe = file.create_device(name="probe", description=session.probe)
    for shank in range(session.shanks):
        group = file.create_electrode_group(
            name=f"shank{shank}", description=f"shank {shank} of the probe", location=session.location, device=probe
        )
        for _ in range(session.sites):
            file.add_electrode(group=group, location=session.location)


def _electrode(spikes: xr.Dataset, unit: int, session: Session) -> int:
    number, last = int(spikes.unit_electrode.values[unit]), session.shanks * session.sites - 1
    if not 0 <= number <= last:
        raise RangeError("unit_electrode", f"must be from 0 to {last}", number, "give Session.shanks and Session.sites")
    return number


def _intervals_of(spikes: xr.Dataset, unit: int) -> Array:
    mine = spikes.interval_unit.values == unit
    return np.stack([spikes.interval_start.values[mine], spikes.interval_stop.values[mine]], axis=1)


def add_trials(file: Any, trials: xr.Dataset, template: Any = None) -> None:
    """Add trials, each referring to the template of the stimulus from :func:`add_command` if there is one.

    Parameters
    ----------
    file : pynwb.NWBFile
        The file.
    trials : Dataset
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.
    template : TimeSeries, optional
        Of the stimulus.
    """
    pynwb = pynwb_module()
    require(trials, "trial_start", "trial_stop")
    table = pynwb.epoch.TimeIntervals(name="trials", description="presentations of the stimulus")
    if "trial_stimulus" in trials:
        table.add_column("stimulus", "what was presented")
    for k in range(trials.sizes["trial"]):
        row: dict[str, Any] = {
            name: float(trials[f"trial_{name[:-5]}"].values[k]) for name in ("start_time", "stop_time")
        }
        if "trial_stimulus" in trials:
            row["stimulus"] = str(trials.trial_stimulus.values[k])
        if template is not None:  # add_interval would look for the trial's own time in the template
            row["timeseries"] = [pynwb.base.TimeSeriesReference(0, len(template.data), template)]
        table.add_row(**row)
    file.trials = table


def add_command(file: Any, command: xr.Dataset) -> Any:
    """Add the template of the stimulus, one column for each whisker; the whiskers' delays; the envelope.

    Parameters
    ----------
    file : pynwb.NWBFile
        The file.
    command : Dataset
        With ``command`` (whisker, time) [m].

    Returns
    -------
    TimeSeries
        The template.

    Raises
    ------
    InputError
        If times are uneven.
    """
    pynwb = pynwb_module()
    require(command, "command", "time", "whisker")
    template = _series(pynwb, "command", "displacement commanded, one column for each whisker", command)
    file.add_stimulus_template(template)
    rows = pynwb.core.DynamicTable(name="whiskers", description="columns of the command")
    rows.add_column("whisker", "whisker of a column")
    delayed = "delay" in command and measured(command["delay"])
    if delayed:
        rows.add_column("delay_s", "delay of the copy, circular, in seconds; not a number where unknown")
    for k, whisker in enumerate(command.whisker.values):
        rows.add_row(whisker=str(whisker), **({"delay_s": float(command["delay"].values[k])} if delayed else {}))
    module = file.create_processing_module(OTHERS, "how the command is dealt out to whiskers, and its envelope")
    module.add(rows)
    if "replayed_envelope" in command:
        module.add(_series(pynwb, "replayed_envelope", "envelope of the command, one column for each whisker", command))
    return template


OTHERS = "misc"  # one of the names that NWB has for processing modules
UNITS = {"m": "meters", "rad": "radians", "Hz": "hertz", "s": "seconds", "N": "newtons", "V": "volts"}  # NWB's words


def add_stimulus(file: Any, stimulus: xr.Dataset, trials: xr.Dataset | None) -> Any:
    """Add a stimulus of any kind: one presentation as a template, or one for each trial on the session's clock.

    Parameters
    ----------
    file : pynwb.NWBFile
        The file.
    stimulus : Dataset
        A command, or what :func:`vibrissa.neural.io.tables.stimuli.presented` takes.
    trials : Dataset, optional
        See :func:`vibrissa.neural.io.tables.trials.trial_table`; needed where each trial had its own stimulus.

    Returns
    -------
    TimeSeries or None
        The template; None where each trial had its own stimulus.

    Raises
    ------
    InputError
        If times are uneven, or the trials of a stimulus for each are not known.
    """
    if "command" in stimulus:
        return add_command(file, stimulus)
    pynwb, name = pynwb_module(), name_of(stimulus)
    one, shown = presented(stimulus), stimulus[name]
    lead = [dim for dim in ("trial", "time", "whisker") if dim in shown.dims]
    values, text = shown.transpose(*lead).values, "envelope presented" if one.is_envelope else "motion presented"
    words = {"name": name, "unit": UNITS.get(one.unit, one.unit)}
    if "whisker" in shown.dims:
        names = [str(whisker) for whisker in stimulus.whisker.values]
        rows = pynwb.core.DynamicTable(name="whiskers", description="columns of the stimulus")
        rows.add_column("whisker", "whisker, or channel, of a column")
        for whisker in names:
            rows.add_row(whisker=whisker)
        file.create_processing_module(OTHERS, "channels of the stimulus").add(rows)
    if "trial" not in shown.dims:
        template = pynwb.TimeSeries(data=values, description=text, **_even(one.time, name), **words)
        file.add_stimulus_template(template)
        return template
    if trials is None or trials.sizes["trial"] != shown.sizes["trial"]:
        raise MissingError("trials", f"must be known: {shown.sizes['trial']}, each with a stimulus of its own")
    when = (trials.trial_start.values[:, None] + one.time).ravel()
    joined = values.reshape(-1, *values.shape[2:])
    file.add_stimulus(pynwb.TimeSeries(data=joined, timestamps=when, description=f"{text} in each trial", **words))
    return None


def _series(pynwb: Any, name: str, text: str, data: xr.Dataset) -> Any:
    values = data[name].transpose("time", "whisker").values
    return pynwb.TimeSeries(name=name, description=text, data=values, unit="meters", **_even(data.time.values, name))


def _even(time: Array, name: str) -> dict[str, float]:
    """Rate and start of times that must be even."""
    return {"rate": even_rate(time, name, least=2), "starting_time": float(time[0])}
