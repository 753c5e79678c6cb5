"""Spikes, trials and stimulus in Neurodata Without Borders files, through pynwb."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from importlib import import_module
from pathlib import Path
from reprlib import repr as short
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import InputError
from vibrissa.files import written_whole
from vibrissa.neural.spikes import LONGEST, spike_table
from vibrissa.neural.table import Array
from vibrissa.neural.trials import trial_table
from vibrissa.quantities import require

if TYPE_CHECKING:
    import xarray as xr

AGE = re.compile(r"P(\d+Y)?(\d+M)?(\d+W)?(\d+D)?")
UNIT_COLUMNS = {  # of the file, and the variable of a unit each is
    "unit_name": ("unit_name", "name given at sorting"),
    "quality": ("unit_quality", "SU single unit, MU multi-unit"),
    "whisker": ("unit_whisker", "principal whisker"),
    "snr": ("snr_smallest", "peak-to-peak of the smallest waveform over the rms of the noise"),
}


@dataclass(frozen=True, kw_only=True)
class Session:
    """What a file tells of a recording session.

    Attributes
    ----------
    identifier : str
        Unique name of the session.
    description : str
        What was done.
    start : datetime
        When the session's clock was 0, with its time zone.
    subject : str
        Name of the animal.
    age : str
        Age in the notation of ISO 8601: ``P90D`` is 90 days.
    sex : str
        M, F, O (other) or U (unknown).
    species : str
        Latin binomial.
    resolution : float
        Least step between spike times, and between samples of waveforms [s].
    probe : str
        What the electrodes are on.
    location : str
        Where they were.
    shanks, sites : int
        Shanks of the probe, and electrodes on each.
    """

    identifier: str
    description: str
    start: datetime
    subject: str
    age: str
    sex: str = "M"
    species: str = "Rattus norvegicus"
    resolution: float = 2.5e-5
    probe: str = "silicon probe"
    location: str = "barrel cortex"
    shanks: int = 8
    sites: int = 4

    def __post_init__(self) -> None:
        for name in ("identifier", "description", "subject"):
            if not getattr(self, name).strip():
                raise InputError(f"Session.{name}", "must not be empty")
        if self.start.tzinfo is None:
            raise InputError("Session.start", "must have a time zone", self.start, "datetime(…, tzinfo=timezone.utc)")
        if self.age == "P" or not AGE.fullmatch(self.age):
            raise InputError("Session.age", "must be a duration of ISO 8601", repr(self.age), "P90D is 90 days")
        if self.sex not in ("M", "F", "O", "U"):
            raise InputError("Session.sex", "must be M, F, O or U", repr(self.sex))
        if self.shanks < 1 or self.sites < 1:
            raise InputError("Session.shanks and sites", "must be at least 1", (self.shanks, self.sites))
        if not 0 < self.resolution < np.inf:
            raise InputError("Session.resolution", "must be positive (s)", self.resolution)

    @property
    def filename(self) -> str:
        """Name of the file as archives want it."""
        subject, session = (re.sub(r"[^A-Za-z0-9-]", "-", name) for name in (self.subject, self.identifier))
        return f"sub-{subject}_ses-{session}_ecephys.nwb"


def _pynwb() -> Any:
    try:
        return import_module("pynwb")
    except ImportError as error:
        raise InputError("NWB files", "need pynwb", remedy="pip install 'vibrissa[neuro]'") from error


# Reading


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
            there = f"it has {', '.join(found)}: choose that table, or" if found else "it has no intervals:"
            raise InputError(str(path), f"must have a table {table}", remedy=f"{there} read trials from a CSV file")
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
    pynwb = _pynwb()
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


# Writing


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
        Spikes on the session's clock; see :func:`vibrissa.neural.spikes.spike_table`. What is known of the units, and
        when they were observed, goes with them.
    path : path
        Name of the file; ``session.filename`` is the one that archives want.
    session : Session
        What the file tells of the session.
    trials : Dataset, optional
        See :func:`vibrissa.neural.trials.trial_table`.
    command : Dataset, optional
        ``command`` (whisker, time) [m], presented in every trial: a template to which the trials refer. With
        ``delay`` (whisker) [s], a table of whiskers and their delays; with ``replayed_envelope`` (whisker, time) [m],
        a processing module of that name.

    Raises
    ------
    InputError
        If pynwb is not installed; if the spikes are cut into trials, or one unit fires twice at one time.
    """
    pynwb = _pynwb()
    require(spikes, "spike_time", "spike_unit", "unit_name")
    if "spike_trial" in spikes:
        raise InputError(
            "spikes", "must be on the session's clock", "spikes in trials", "write them uncut, with trials="
        )
    file = _file(pynwb, session)
    if "unit_electrode" in spikes:
        _add_probe(file, session)
    _add_units(pynwb, file, spikes, session)
    template = None if command is None else _add_command(pynwb, file, command)
    if trials is not None:
        _add_trials(pynwb, file, trials, template)
    with written_whole(path) as temporary, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pynwb.NWBHDF5IO(str(temporary), "w") as io:
            io.write(file)


def _file(pynwb: Any, session: Session) -> Any:
    subject = pynwb.file.Subject(
        subject_id=session.subject,
        age=session.age,
        sex=session.sex,
        species=session.species,
        description=f"subject {session.subject}",
    )
    return pynwb.NWBFile(
        session_description=session.description,
        identifier=session.identifier,
        session_id=session.identifier,
        session_start_time=session.start,
        subject=subject,
    )


def _add_probe(file: Any, session: Session) -> None:
    """Electrodes in order along the shanks, from 0."""
    probe = file.create_device(name="probe", description=session.probe)
    for shank in range(session.shanks):
        group = file.create_electrode_group(
            name=f"shank{shank}", description=f"shank {shank} of the probe", location=session.location, device=probe
        )
        for _ in range(session.sites):
            file.add_electrode(group=group, location=session.location)


def _add_units(pynwb: Any, file: Any, spikes: xr.Dataset, session: Session) -> None:
    """Units with their spike times, and what is known of them."""
    placed = "unit_electrode" in spikes
    units = pynwb.misc.Units(
        name="units",
        description="sorted units",
        resolution=session.resolution,
        waveform_rate=1 / session.resolution,
        electrode_table=file.electrodes if placed else None,
    )
    known = {column: (name, text) for column, (name, text) in UNIT_COLUMNS.items() if name in spikes}
    for column, (_, text) in known.items():
        units.add_column(name=column, description=text)
    observed = "interval_unit" in spikes
    ids = spikes.unit_id.values if "unit_id" in spikes else np.arange(spikes.sizes["unit"])
    for k, one in enumerate(ids):
        time = np.sort(spikes.spike_time.values[spikes.spike_unit.values == k])
        _refuse_repeated(time, str(spikes.unit_name.values[k]))
        row = {column: spikes[name].values[k].item() for column, (name, _) in known.items()}
        if observed:
            row["obs_intervals"] = _intervals_of(spikes, k)
        if placed:
            row["electrodes"] = [_electrode(spikes, k, session)]
        if "unit_waveform" in spikes:
            row["waveform_mean"] = spikes.unit_waveform.values[k]
        units.add_unit(id=int(one), spike_times=time, **row)
    file.units = units


def _electrode(spikes: xr.Dataset, unit: int, session: Session) -> int:
    number, last = int(spikes.unit_electrode.values[unit]), session.shanks * session.sites - 1
    if not 0 <= number <= last:
        raise InputError("unit_electrode", f"must be from 0 to {last}", number, "give Session.shanks and Session.sites")
    return number


def _refuse_repeated(time: Array, name: str) -> None:
    same = np.flatnonzero(np.diff(time) == 0)
    if same.size:
        remedy = "archives want ascending times: look whether the sorter counted spikes twice"
        raise InputError(f"unit {name}", "must not fire twice at one time", f"{time[same[0]]:.6f} s", remedy)


def _intervals_of(spikes: xr.Dataset, unit: int) -> Array:
    mine = spikes.interval_unit.values == unit
    return np.stack([spikes.interval_start.values[mine], spikes.interval_stop.values[mine]], axis=1)


def _add_trials(pynwb: Any, file: Any, trials: xr.Dataset, template: Any) -> None:
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


def _add_command(pynwb: Any, file: Any, command: xr.Dataset) -> Any:
    """Template of the stimulus, one column for each whisker; the whiskers' delays; the envelope."""
    require(command, "command", "time", "whisker")
    template = _series(pynwb, "command", "displacement commanded, one column for each whisker", command)
    file.add_stimulus_template(template)
    rows = pynwb.core.DynamicTable(name="whiskers", description="columns of the command")
    rows.add_column("whisker", "whisker of a column")
    rows.add_column("delay_s", "delay of the copy, circular, in seconds; not a number where unknown")
    delays = command["delay"].values if "delay" in command else np.full(command.sizes["whisker"], np.nan)
    for whisker, delay in zip(command.whisker.values, delays, strict=True):
        rows.add_row(whisker=str(whisker), delay_s=float(delay))
    file.create_processing_module("stimulus", "how the command is dealt out to whiskers").add(rows)
    if "replayed_envelope" in command:
        module = file.create_processing_module("envelope", "envelope of the command")
        module.add(_series(pynwb, "replayed_envelope", "envelope of the command, one column for each whisker", command))
    return template


def _series(pynwb: Any, name: str, text: str, data: xr.Dataset) -> Any:
    time = data.time.values
    rate = (time.size - 1) / (time[-1] - time[0]) if time.size > 1 else 0.0
    if not rate > 0 or np.abs(np.diff(time) * rate - 1).max() > 1e-6:
        raise InputError(name, "must be sampled evenly, at two times at least", f"{time.size} samples")
    values = data[name].transpose("time", "whisker").values
    return pynwb.TimeSeries(
        name=name, description=text, data=values, unit="meters", rate=float(rate), starting_time=float(time[0])
    )
