"""The one way in for recordings: every verb, the studies and Python read spikes and stimuli through it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.arrays import Window
from vibrissa.errors import ConflictError, MissingError, RangeError
from vibrissa.files import existing
from vibrissa.neural.io.recording import recorded_spikes, session_spikes, trials_of_recording
from vibrissa.neural.io.tables.kept_units import of_kept_units
from vibrissa.neural.io.tables.trials import trials_at
from vibrissa.quantities.kinds import Progress
from vibrissa.study.neurons.session_stimuli import stimulus_in_trials
from vibrissa.study.neurons.silent_trials import silent_trials
from vibrissa.study.neurons.stimuli import SESSION, read_stimulus
from vibrissa.study.neurons.trial_stimuli import of_the_trials, refuse_other_trials, spikes_within
from vibrissa.study.spec.given import SpikesInput, StimulusInput

if TYPE_CHECKING:
    import xarray as xr

SILENT = 0.1  # share of what is analysed, without any spike at its end, from which on it is said
LATE = 0.1  # of its length after the onset, from which on the begin of a stimulus is remarked on
REMARKS = {  # attributes of a table of spikes, and what is said where they are not 0
    "spikes_unsorted": "{} unsorted spikes (unit 0) are left out; `unsorted` keeps them",
    "spikes_outside": "{} spikes lie {where} and are left out",
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


def read_recording(
    spikes: SpikesInput,
    stimulus: StimulusInput,
    folder: Path = Path(),
    *,
    bin_width: float | None = None,
    around: Window | None = None,
    window: Window | None = None,
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
    window : (float, float), optional
        Part of the stimulus that is analysed [s]; the whole of it by default.
    channels, band
        As in ``read_stimulus``.
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
    if cut := shown.attrs.get("clock") == SESSION:
        trials, source = _trials(spikes, folder), str(stimulus.stimulus)
        how: dict[str, Any] = {"channels": channels, "spontaneous": around}
        shown, more = stimulus_in_trials(shown, trials, source, band, **how)
        remarks = [*remarks, *more]
    time = shown.time.values
    end = float(time[-1] + (time[-1] - time[0]) / (time.size - 1))  # of the last sample
    kept = [float(time[0]), end, *(around or ())]
    if spikes.period is not None and spikes.period < (length := float(time[-1] - time[0]) * (1 - 1e-9)):
        raise RangeError("period", f"must not be shorter than the stimulus of {length:.6g} s", spikes.period)
    table, count, more = read_spikes(spikes, (min(kept), max(kept)), folder, bin_width=bin_width, progress=progress)
    shown = shown if cut else of_the_trials(shown, table, str(stimulus.stimulus))
    table, beyond = spikes_within(table, shown, around, window)
    silence = [*silent_trials(table, count), *silent_end(table, *(window or (float(time[0]), end)))]
    refuse_other_trials(shown, count, str(stimulus.stimulus))
    return Recording(table, shown, count, [*remarks, *_late(time[0], end), *more, *beyond, *silence])


def _late(first: float, end: float) -> list[str]:
    """Remark on a stimulus that begins long after the onset of a trial."""
    if first <= LATE * (end - first):
        return []
    return [f"the stimulus lasts from {first:g} to {end:g} s after an onset: are its times of another clock?"]


def silent_end(spikes: xr.Dataset, start: float, stop: float) -> list[str]:
    """Remark on silence at the end of what is analysed, which may not have been recorded.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    start, stop : float
        Part of each trial that is analysed [s].

    Returns
    -------
    list of str
        One sentence, or none.
    """
    time = spikes.spike_time.values
    last = float(time[time < stop].max(initial=start))
    if stop - last < SILENT * (stop - start):
        return []
    why = "if the recording ended there, silence was counted that was not recorded: end the window with it"
    return [f"no unit fires from {last:.4g} s to the end of the window, {stop:.6g} s: {why}"]


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
    if (table := given.trial_table_file(folder)) is not None:
        trials = existing(folder / table)
    if given.period is not None:
        trials = _trials(given, folder)
    spikes, counted = recorded_spikes(
        folder / given.spikes,
        window=window,
        event=given.event,
        trials=trials,
        only=given.only,
        groups=given.groups,
        unsorted=given.unsorted,
        counted_bin=given.counted_bin,
        progress=progress,
    )
    if given.kept is not None:
        spikes = of_kept_units(spikes, folder / given.kept)
    count = counted if given.trials is None else given.trials
    if count is None and needs_count:
        raise ConflictError("trials", "must be given with a CSV", remedy="count silent presentations too")
    _refuse_other_count(given, counted)
    if (width := spikes.attrs.get("counted_bin")) and bin_width is not None:
        bins = bin_width / width
        if round(bins) < 1 or abs(bins - round(bins)) > 1e-6:
            rule = f"must be whole bins of the counts, of {width:g} s"
            raise RangeError("bin width", rule, bin_width, "finer times are not in the file")
    return spikes, count or int(spikes.spike_trial.values.max()) + 1, remarks_on(spikes)


def read_session(
    given: SpikesInput, folder: Path = Path(), length: float | None = None
) -> tuple[xr.Dataset, xr.Dataset | None, list[str]]:
    """Read the spikes of a recording as its file has them, and its trials where they are known.

    Parameters
    ----------
    given : SpikesInput
        The file, and how it is read.
    folder : Path
        Where relative paths start.
    length : float, optional
        Of a presentation [s]: that of trials of which an event marks the onsets alone.

    Returns
    -------
    spikes : Dataset
        On the session's clock, or in trials.
    trials : Dataset or None
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.
    remarks : list of str
        As in :class:`Recording`.

    Raises
    ------
    InputError
        If the file is bad.
    """
    how: dict[str, Any] = {
        "event": given.event,
        "groups": given.groups,
        "unsorted": given.unsorted,
        "counted_bin": given.counted_bin,
    }
    spikes = session_spikes(folder / given.spikes, **how)
    if given.kept is not None:
        spikes = of_kept_units(spikes, folder / given.kept)
    remarks = remarks_on(spikes)
    if "spike_trial" in spikes:
        _refuse_other_count(given, spikes.attrs.get("n_trials"))
        if "n_trials" not in spikes.attrs:
            count = given.trials or int(spikes.spike_trial.values.max(initial=0)) + 1
            spikes = spikes.assign_attrs(n_trials=count)
        if given.trial_table is None:
            return spikes, None, remarks
    elif given.event is not None:
        onsets = spikes.marker_time.values
        if length is None:
            raise MissingError("trials", "must have a length, where an event marks their onsets", remedy="`stimulus`")
        return spikes.drop_dims("marker"), trials_at(onsets, length), remarks
    known = given.period is not None or given.trial_table is not None or _has_trials(folder / given.spikes)
    return spikes, _trials(given, folder) if known else None, remarks


def _refuse_other_count(given: SpikesInput, counted: int | None) -> None:
    """Refuse a number of trials that a recording contradicts; one that states none may have silent ones at its end."""
    if counted is not None and given.trials not in (None, counted):
        more = "a table that lists silent trials needs a line, without a time, for each of them"
        remedy = more if str(given.spikes).lower().endswith(".csv") else ""
        raise ConflictError("trials", f"must be left out: the recording has {counted}", given.trials, remedy)


def _has_trials(path: Path) -> bool:
    """Whether a file has trials of its own."""
    if path.suffix.lower() != ".nwb":
        return False
    from vibrissa.neural.io.formats.nwb import opened

    with opened(path) as file:
        return file.trials is not None


def _trials(given: SpikesInput, folder: Path) -> xr.Dataset:
    """Trials of a recording on the session's clock."""
    if given.period is not None and given.trials is not None:
        return trials_at(given.first_onset + given.period * np.arange(given.trials, dtype=np.float64), given.period)
    file = given.trial_table_file(folder)
    table = given.trial_table if file is None else folder / file
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
    about = spikes.attrs
    cut = "window_stop" in about
    where = f"outside {about['window_start']:g} to {about['window_stop']:g} s of every trial" if cut else "in no trial"
    lines = [text.format(about[name], where=where) for name, text in REMARKS.items() if about.get(name)]
    return [*lines, *_partly_observed(spikes), *filter(None, [about.get("remark")])]


def _partly_observed(spikes: xr.Dataset) -> list[str]:
    """Say in how many trials units were observed, and how many of their spikes lie in the others."""
    if "unit_observed" not in spikes:
        return []
    seen = spikes.unit_observed.transpose("unit", "trial").values.astype(bool)
    less = np.flatnonzero(~seen.all(1))
    if not less.size:
        return []
    unit, trial = spikes.spike_unit.values, spikes.spike_trial.values
    there = trial < seen.shape[1]
    lost = int((~seen[unit[there], trial[there]]).sum())
    least = less[np.argmin(seen[less].sum(1))]
    one = f"unit {spikes.unit_name.values[least]}"
    number = f"in {seen[least].sum()} of {seen.shape[1]} trials"
    several = f"{less.size} units were not observed in all trials, {one} {number}, the fewest"
    text = f"{one} was observed {number}" if less.size == 1 else several
    which = f"; {lost} of {'its' if less.size == 1 else 'their'} spikes lie in the others, which do not count"
    return [text + which * bool(lost)]
