"""A user's recorded spikes and their stimulus: from the files to whether the envelope drives each unit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.signal import periodogram

from vibrissa.errors import ConflictError, InputError, RangeError, UnknownError
from vibrissa.neural.coupling.analysis import analyse_units
from vibrissa.neural.coupling.carrier import share_remark
from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.neural.io.tables.inputs import read_stimulus
from vibrissa.neural.io.tables.trials import trials_at
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.stimulus.export import read_command
from vibrissa.study.neurons.shown_unit import best_unit, shown_unit
from vibrissa.study.spec.neurons import Neurons, Window

if TYPE_CHECKING:
    import xarray as xr

SHORT = 0.01  # [s] by which trials may end before the stimulus unremarked: a bin
SAMPLES_PER_CYCLE = 6  # of the stimulus: with fewer its envelope may be wrong


class Analysed(NamedTuple):
    """Units as analysed, what they were analysed of, and what a reader should know of it."""

    units: xr.Dataset
    spikes: xr.Dataset
    stimulus: xr.Dataset
    n_trials: int
    remarks: list[str]


def analyse_neurons(neurons: Neurons, folder: Path = Path(), progress: Progress | None = None) -> Analysed:
    """Read spikes and stimulus, and analyse the units.

    Parameters
    ----------
    neurons : Neurons
        The files, and how they are read and analysed.
    folder : Path
        Where relative paths start.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    Analysed
        Units and remarks.

    Raises
    ------
    InputError
        If a file is bad, or spikes and stimulus do not fit together; options go by the names of the verb ``neural``.
    """
    stimulus = one_stimulus(folder / neurons.stimulus, neurons.whisker)
    spikes, n_trials = _read(neurons, stimulus, folder, progress)
    if progress is not None:
        progress("units", 0, 0)
    units = analyse_units(spikes, stimulus, n_trials, neurons.analysis())
    remarks = [*_remarks(spikes, stimulus, n_trials), *_unheard(spikes, neurons.spontaneous)]
    remarks += [*_early(units), *filter(None, [share_remark(units)])]
    if neurons.event is None:  # else the trials' ends are not known
        remarks += _cut_short(spikes, stimulus)
    return Analysed(units, spikes, stimulus, n_trials, remarks)


def neuron_results(neurons: Neurons, folder: Path = Path(), progress: Progress | None = None) -> dict[str, xr.Dataset]:
    """Datasets of one recording.

    Parameters
    ----------
    neurons, folder, progress
        As in :func:`analyse_neurons`.

    Returns
    -------
    dict of Datasets
        ``units``, with the attributes ``label``, ``source``, ``remarks`` (JSON); for Figure 8 ``spikes``, ``response``,
        ``motion`` and, if it is driven, ``unit`` of the unit whose fit explains most.

    Raises
    ------
    InputError
        As :func:`analyse_neurons`; names the recording.
    """
    try:
        found = analyse_neurons(neurons, folder, progress)
    except InputError as error:
        raise error.renamed(f"[[neural]] {neurons.label}: {error.quantity}") from error
    attrs = {"label": neurons.label, "source": Path(neurons.spikes).name, "remarks": json.dumps(found.remarks)}
    place = best_unit(found.units)
    unit = found.units.isel(unit=place)
    shown = shown_unit(found.spikes, unit, found.stimulus, found.n_trials, neurons.analysis())
    shown["spikes"].attrs.setdefault("source", Path(neurons.spikes).name)
    shown["response"].attrs["note"] = f" Of {found.units.sizes['unit']} units, {_chosen(unit)}."
    return {"units": found.units.assign_attrs(attrs), **shown}


def _chosen(unit: xr.Dataset) -> str:
    """Why this unit is shown."""
    name = str(unit.unit_name.values)
    if not bool(unit.significant):
        return f"none of which passes the test, {name}, whose rate is most like the envelope"
    return f"{name}, whose fit explains most" if bool(unit.identified) else f"{name}, the most like the envelope"


def one_stimulus(path: Path, whisker: str | None) -> xr.Dataset:
    """The stimulus of a file: of one presentation, or of one whisker of a stimulator's command.

    Parameters
    ----------
    path : Path
        The file.
    whisker : str or None
        Of a command, the whisker that is meant.

    Returns
    -------
    Dataset
        ``point_displacement`` (time) [m].

    Raises
    ------
    InputError
        If the file is bad, or is a command and no whisker is given.
    """
    if whisker is None and (path.suffix.lower() == ".wav" or Path(f"{path}.json").is_file()):  # a command's sidecar
        raise ConflictError("whisker", "must be given with a command of vibrissa replay", str(path))
    return read_stimulus(path) if whisker is None else played(path, whisker)


def played(path: Path, whisker: str) -> xr.Dataset:
    """Motion of one whisker of a stimulator's command, as a stimulus.

    Parameters
    ----------
    path : Path
        The command.
    whisker : str
        Its name.

    Returns
    -------
    Dataset
        ``point_displacement`` (time) [m].

    Raises
    ------
    InputError
        If the file is bad, or the whisker is none of those moved.
    """
    command = read_command(path)
    names = command.whisker.values.tolist()
    if whisker not in names:
        raise UnknownError("whisker", f"must be one of {', '.join(names)}", repr(whisker))
    motion = command.command.sel(whisker=whisker).values
    return dataset({"source": path.name, "whisker": whisker}, time=command.time.values, point_displacement=motion)


def _read(neurons: Neurons, stimulus: xr.Dataset, folder: Path, progress: Progress | None) -> tuple[xr.Dataset, int]:
    """Spikes in trials, and how many trials there were."""
    kept = [*(float(t) for t in stimulus.time.values[[0, -1]]), *(neurons.spontaneous or ())]
    trials: xr.Dataset | Path | None = None if neurons.trial_table is None else folder / neurons.trial_table
    if neurons.period is not None and neurons.trials is not None:
        trials = _repeated(neurons.first_onset, neurons.period, neurons.trials, stimulus)
    spikes, counted = recorded_spikes(
        folder / neurons.spikes,
        window=(min(kept), max(kept)),
        event=neurons.event,
        trials=trials,
        only=neurons.only,
        groups=neurons.group,
        progress=progress,
    )
    if (count := counted if neurons.trials is None else neurons.trials) is None:
        raise ConflictError("trials", "must be given with a CSV", remedy="count silent presentations too")
    return spikes, count


def _repeated(first: float, period: float, n_trials: int, stimulus: xr.Dataset) -> xr.Dataset:
    """Trials one after the other at even times."""
    time = stimulus.time.values
    length = float(time[-1] - time[0]) * (1 - 1e-9)
    if period < length:
        raise RangeError("period", f"must not be shorter than the stimulus of {length:.6g} s", period)
    return trials_at(first + period * np.arange(n_trials, dtype=np.float64), period)


def _remarks(spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int) -> list[str]:
    """What a reader should know of the input: silent trials, a carrier near half the sampling rate."""
    words = {
        "spikes_unsorted": "are unsorted (unit 0) and left out",
        "spikes_outside": "lie in no trial and are left out",
    }
    lines = [f"{spikes.attrs[name]} spikes {text}" for name, text in words.items() if spikes.attrs.get(name)]
    lines += filter(None, [spikes.attrs.get("remark")])
    last = int(spikes.spike_trial.values.max())
    if last < n_trials - 1:
        lines.append(f"the last {n_trials - 1 - last} of {n_trials} trials hold no spike of any unit; check `trials`")
    if 0 not in spikes.spike_trial.values and n_trials > 1:
        lines.append("trial 0 holds no spike of any unit; trials count from 0")
    time = stimulus.time.values
    rate = (len(time) - 1) / (time[-1] - time[0])
    frequency, power = periodogram(stimulus.point_displacement.values, rate)
    carrier = float(np.sum(frequency * power) / np.sum(power))
    if rate < SAMPLES_PER_CYCLE * carrier:
        lines.append(f"the stimulus, about {carrier:.0f} Hz, is sampled at {rate:.0f} Hz: its envelope may be wrong")
    return lines


def _cut_short(spikes: xr.Dataset, stimulus: xr.Dataset) -> list[str]:
    """Say that trials end before the stimulus does: another stimulus may have been shown."""
    if "trial_stop" not in spikes:
        return []
    lasted = spikes.trial_stop.values - spikes.trial_start.values
    time = stimulus.time.values
    length = float(time[-1] - time[0])
    short = int((lasted < length - SHORT).sum())
    if not short:
        return []
    least = f"the shortest lasts {lasted.min():.4g} s of {length:.4g} s"
    return [f"{short} of {lasted.size} trials end before the stimulus: {least}; check that it was the one shown"]


def _early(units: xr.Dataset) -> list[str]:
    """Say how many units pass the test at a negative lag, which the paper's form tries."""
    passed = units.significant.values
    early = int((passed & (units.envelope_lag.values < 0)).sum())
    if not early:
        return []
    why = "their rate leads the envelope, and no response comes before its stimulus"
    return [f"{early} of {passed.sum()} units that pass the test do so at a negative lag: {why}; see reason"]


def _unheard(spikes: xr.Dataset, spontaneous: Window | None) -> list[str]:
    """Say that a window without any spike of any unit may be one that was not recorded."""
    if spontaneous is None:
        return []
    start, stop = spontaneous
    if ((spikes.spike_time.values >= start) & (spikes.spike_time.values < stop)).any():
        return []
    return [f"no unit fired from {start:g} to {stop:g} s: rates of 0, unless the spikes there are not in the file"]
