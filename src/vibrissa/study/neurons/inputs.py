"""The one way in for spikes and stimuli: every verb, the studies and Python read through it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.arrays import Array, Window
from vibrissa.errors import ConflictError, MissingError, RangeError, ShapeError, UnknownError
from vibrissa.files import existing, load
from vibrissa.neural.coupling.presentation import banded
from vibrissa.neural.io.recording import recorded_spikes, trials_of_recording
from vibrissa.neural.io.tables.stimuli import has_no_carrier, labelled_stimulus, name_of, one_channel, presented
from vibrissa.neural.io.tables.stimulus_csv import checked_stimulus, in_stated_unit, read_stimulus_csv
from vibrissa.neural.io.tables.trials import trials_at
from vibrissa.quantities import require
from vibrissa.quantities.kinds import Progress
from vibrissa.stimulus.export import read_command
from vibrissa.study.neurons.trial_stimuli import cut_stimulus
from vibrissa.study.spec.given import SpikesInput, StimulusInput

if TYPE_CHECKING:
    import xarray as xr

SESSION = "session"
LEAST_SHARE = 1e-3  # of the variance of a motion that the band of its carrier holds
TOLD = {  # attributes of a table of spikes, and what is said where they are not 0
    "spikes_unsorted": "{} unsorted spikes (unit 0) are left out; `unsorted` keeps them",
    "spikes_outside": "{} spikes lie in no trial and are left out",
    "spikes_shared": "{} spikes lie in two trials, which overlap, and count in both",
    "spikes_repeated": "{} spikes have the very time of another of their unit; all are kept: was one counted twice?",
    "trials_left_out": "{} trials of other protocols are left out",
}


class Recording(NamedTuple):
    """Spikes in trials, what was presented, and what a reader should know of both.

    Attributes
    ----------
    spikes : Dataset
        In trials; see :func:`vibrissa.neural.io.tables.spikes.spike_table`.
    stimulus : Dataset
        See :func:`vibrissa.neural.io.tables.stimuli.labelled_stimulus`; with the dimension ``trial`` where each trial
        had its own.
    n_trials : int
        Presentations, silent ones included.
    remarks : list of str
        Counts of spikes that are left out or doubtful, and the like.
    """

    spikes: xr.Dataset
    stimulus: xr.Dataset
    n_trials: int
    remarks: list[str]


def read_stimulus(
    given: StimulusInput, folder: Path = Path(), *, channels: bool = False, band: Window | None = None
) -> tuple[xr.Dataset, list[str]]:
    """Read what was presented.

    Parameters
    ----------
    given : StimulusInput
        ``.csv``: see :func:`vibrissa.neural.io.tables.stimulus_csv.read_stimulus_csv`; with a sidecar, and ``.wav`` and
        ``.npy``, a command of ``vibrissa replay``. ``.nc``: a command, or what ``scan --simulate-units`` wrote.
        ``.nwb``: see :func:`vibrissa.neural.io.formats.nwb_series.read_nwb_stimulus`.
    folder : Path
        Where relative paths start.
    channels : bool
        Whether all channels are wanted; else one.
    band : (float, float), optional
        Band of the carrier whose envelope will be taken [Hz].

    Returns
    -------
    stimulus : Dataset
        See :func:`vibrissa.neural.io.tables.stimuli.labelled_stimulus`.
    remarks : list of str
        That it is taken for an envelope, where no one said so.

    Raises
    ------
    InputError
        If the file is bad, a unit or a channel is not known, or the motion has no carrier.
    """
    path = folder / given.stimulus
    if given.whisker is None and not channels and (path.suffix.lower() in (".wav", ".npy") or _sidecar(path).is_file()):
        raise ConflictError("whisker", "must be given with a command of vibrissa replay", str(path))
    stimulus = _read(path, given)
    if channels:
        if given.whisker is not None and path.suffix.lower() != ".nwb":
            raise ConflictError("whisker", "must be left out where all channels are taken", given.whisker)
        return stimulus, []
    one = one_channel(stimulus, None if path.suffix.lower() == ".nwb" else given.whisker, str(path))
    return _named(one, str(path), band)


def _read(path: Path, given: StimulusInput) -> xr.Dataset:
    """All channels of a file, or, of an NWB file, those of the series that is meant."""
    kind = path.suffix.lower()
    known: dict[str, Any] = {"unit": given.signal_unit, "envelope": given.envelope}
    if kind == ".nwb":
        from vibrissa.neural.io.formats.nwb_series import read_nwb_stimulus

        return read_nwb_stimulus(path, channel=given.whisker, **known)
    if kind in (".wav", ".npy") or _sidecar(path).is_file():
        return _of_command(read_command(path), given, path)
    if kind == ".nc":
        return _of_dataset(load(path), given, path)
    found = read_stimulus_csv(path, **known)
    names = [str(one) for one in found.whisker.values] if "whisker" in found.dims else []
    if given.whisker is not None and given.whisker not in names:
        raise UnknownError("whisker", f"must be one of {', '.join(names) or 'several channels'}", repr(given.whisker))
    return found


def _sidecar(path: Path) -> Path:
    """File that says what a command holds."""
    return Path(f"{path}.json")


def _of_command(command: xr.Dataset, given: StimulusInput, path: Path) -> xr.Dataset:
    """A command of the stimulator, in metres."""
    if given.signal_unit is not None or given.envelope:
        raise ConflictError("signal_unit, envelope", "must not go with a command: it is a motion in metres", str(path))
    require(command, "command", "time", "whisker")
    values, names = command.command.transpose("whisker", "time").values, [str(one) for one in command.whisker.values]
    if given.whisker is not None and given.whisker not in names:
        raise UnknownError("whisker", f"must be one of {', '.join(names)}", repr(given.whisker))
    return labelled_stimulus(command.time.values, values, lead={"whisker": names}, attrs={"source": path.name})


def _of_dataset(data: xr.Dataset, given: StimulusInput, path: Path) -> xr.Dataset:
    """A command, or the stimulus of a scan, from a dataset."""
    if "command" in data:
        return _of_command(data, given, path)
    if "mode_displacement" in data and "point_displacement" not in data:
        raise MissingError(str(path), "must hold what was presented", "a scan", "give `simulate_units`")
    if given.whisker is not None:
        raise ConflictError("whisker", "must go with a stimulus of several channels", str(path))
    name = name_of(data)
    if not (given.envelope or given.signal_unit) or name == "stimulus_envelope":
        return data[[name]]
    require(data, "time")
    values, unit = data[name].values, presented(data).unit
    if given.signal_unit is not None and in_stated_unit(np.ones(1), given.signal_unit)[1] != unit:
        raise ConflictError("signal_unit", f"must be left out: {path} states its own, {unit}", given.signal_unit)
    return labelled_stimulus(data.time.values, values, unit, envelope=given.envelope, attrs={"source": path.name})


def _named(stimulus: xr.Dataset, source: str, band: Window | None) -> tuple[xr.Dataset, list[str]]:
    """A stimulus that is an envelope, though no one said so, as one; a motion without a carrier is refused."""
    time, values, unit, is_envelope = presented(stimulus)
    if is_envelope or ("clock" in stimulus.attrs and stimulus.attrs["clock"] == SESSION):
        return stimulus, []
    checked_stimulus(stimulus, source)
    each = values.reshape(-1, time.size)
    step = float(time[-1] - time[0]) / (time.size - 1)
    if band is not None:
        share = max(float(banded(one, band, step).var() / one.var()) for one in each[:3])
        if share < LEAST_SHARE:
            rule = f"must hold a carrier: {source} has {100 * share:.2g} % of its variance there"
            raise RangeError("band", rule, band)
        return stimulus, []
    if not all(has_no_carrier(one, step) for one in each[:3]):
        return stimulus, []
    if each.min() < 0:
        rule = "must have a carrier, faster than the envelope of it varies"
        remedy = "give `envelope` if it is one already, or the `band` of the carrier, such as 50 Hz 200 Hz"
        raise RangeError(source, rule, "none", remedy)
    attrs, lead = stimulus.attrs, {str(dim): None for dim in stimulus[name_of(stimulus)].dims[:-1]}
    text = f"{Path(source).name} is never negative and has no carrier: it is taken as an envelope"
    return labelled_stimulus(time, values, unit, envelope=True, lead=lead, attrs=attrs), [text]


def read_recording(
    spikes: SpikesInput,
    stimulus: StimulusInput,
    folder: Path = Path(),
    *,
    bin_width: float | None = None,
    around: Window | None = None,
    channels: bool = False,
    band: Window | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Read the spikes of a recording and what was presented.

    Parameters
    ----------
    spikes, stimulus
        The files.
    folder : Path
        Where relative paths start.
    bin_width : float, optional
        Width of the analysis' bins [s], which must be whole bins of counts that are given in bins.
    around : (float, float), optional
        Window that is kept as well as the stimulus [s]: one without stimulus, for the spontaneous rate.
    channels, band
        As in :func:`read_stimulus`.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    Recording
        Spikes in trials, stimulus and remarks.

    Raises
    ------
    InputError
        If a file is bad, or spikes and stimulus do not fit together.
    """
    shown, remarks = read_stimulus(stimulus, folder, channels=channels, band=band)
    if shown.attrs.get("clock") == SESSION:
        shown, more = cut_stimulus(shown, _trials(spikes, folder), str(stimulus.stimulus))
        named, others = (shown, []) if channels else _named(shown, str(stimulus.stimulus), band)
        shown, remarks = named, [*remarks, *more, *others]
    time = shown.time.values
    kept = [float(time[0]), float(time[-1]), *(around or ())]
    if spikes.period is not None and spikes.period < (length := float(time[-1] - time[0]) * (1 - 1e-9)):
        raise RangeError("period", f"must not be shorter than the stimulus of {length:.6g} s", spikes.period)
    table, count, more = read_spikes(spikes, (min(kept), max(kept)), folder, bin_width=bin_width, progress=progress)
    table, beyond = _within(table, time, around)
    own = shown[name_of(shown)].sizes.get("trial", count)
    if own != count:
        raise ShapeError(str(stimulus.stimulus), f"must have {count} trials, as the spikes have", own)
    return Recording(table, shown, count, [*remarks, *more, *beyond])


def _within(spikes: xr.Dataset, time: Array, around: Window | None) -> tuple[xr.Dataset, list[str]]:
    """Spikes in trials without the few that lie beyond the stimulus; where they are most, all stay, to be refused."""
    first, last = float(time[0]), float(time[-1] + (time[-1] - time[0]) / (time.size - 1))
    when = spikes.spike_time.values
    beyond = (when < first) | (when > last)
    if around is not None:
        beyond &= (when < around[0]) | (when >= around[1])
    number = int(beyond.sum())
    if not number or 2 * number > when.size:
        return spikes, []
    text = f"{number} of {when.size} spikes lie beyond the stimulus, {first:g} to {last:g} s, and are left out"
    return spikes.isel(spike=np.flatnonzero(~beyond)), [text]


def read_spikes(
    given: SpikesInput,
    window: Window,
    folder: Path = Path(),
    *,
    bin_width: float | None = None,
    needs_count: bool = True,
    progress: Progress | None = None,
) -> tuple[xr.Dataset, int, list[str]]:
    """Read the spikes of a recording, in trials.

    Parameters
    ----------
    given : SpikesInput
        The file, and how it is read.
    window : (float, float)
        Part of each trial that is kept of spikes on the session's clock, about its onset [s].
    folder, bin_width, progress
        As in :func:`read_recording`.
    needs_count : bool
        Whether the number of trials must be known; else it reaches to the last that has a spike.

    Returns
    -------
    spikes : Dataset
        In trials.
    n_trials : int
        Presentations.
    remarks : list of str
        As in :class:`Recording`.

    Raises
    ------
    InputError
        If the file is bad, or the number of trials is not known.
    """
    trials: xr.Dataset | Path | str | None = given.trial_table
    if trials is not None and (folder / str(trials)).is_file():
        trials = folder / str(trials)
    elif trials is not None and Path(given.spikes).suffix.lower() != ".nwb":
        existing(folder / str(trials))
    if given.period is not None:
        trials = _trials(given, folder)
    spikes, counted = recorded_spikes(
        folder / given.spikes,
        window=window,
        event=given.event,
        trials=trials,
        only=given.only,
        groups=given.group,
        unsorted=given.unsorted,
        counted_bin=given.counted_bin,
        progress=progress,
    )
    count = counted if given.trials is None else given.trials
    if count is None and needs_count:
        raise ConflictError("trials", "must be given with a CSV", remedy="count silent presentations too")
    if counted is not None and "trial_start" in spikes and count != counted:
        raise ConflictError("trials", f"must be left out: the recording has {counted}", count)
    if (width := spikes.attrs.get("counted_bin")) and bin_width is not None:
        bins = bin_width / width
        if round(bins) < 1 or abs(bins - round(bins)) > 1e-6:
            rule = f"must be whole bins of the counts, of {width:g} s"
            raise RangeError("bin width", rule, bin_width, "finer times are not in the file")
    return spikes, count or int(spikes.spike_trial.values.max()) + 1, remarks_on(spikes)


def _trials(given: SpikesInput, folder: Path) -> xr.Dataset:
    """Trials of a recording on the session's clock."""
    if given.period is not None and given.trials is not None:
        return trials_at(given.first_onset + given.period * np.arange(given.trials, dtype=np.float64), given.period)
    table = given.trial_table
    if table is not None and (folder / table).is_file():
        table = str(folder / table)
    return trials_of_recording(folder / given.spikes, None, given.event, table, given.only)


def remarks_on(spikes: xr.Dataset) -> list[str]:
    """What a reader should know of spikes: how many are left out, doubled, out of order.

    Parameters
    ----------
    spikes : Dataset
        As a reader gave them.

    Returns
    -------
    list of str
        A sentence each, with its count.
    """
    lines = [text.format(spikes.attrs[name]) for name, text in TOLD.items() if spikes.attrs.get(name)]
    return [*lines, *filter(None, [spikes.attrs.get("remark")])]
