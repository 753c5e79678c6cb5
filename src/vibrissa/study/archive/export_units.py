"""Units, their trials, tuning and stimulus, for an archive: all on the session's clock."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import MissingError, RangeError, TooFewError
from vibrissa.neural.io.formats.nwb_writer import Session, add_stimulus, add_trials, add_units
from vibrissa.neural.io.tables.spikes import observed_trials, spike_table, with_intervals
from vibrissa.neural.io.tables.trials import recorded_windows, trial_table
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Results
from vibrissa.study.archive.export_series import Clock, add_table

if TYPE_CHECKING:
    import xarray as xr

PRESENTED = ("stimulus", "command", "motion")  # what was presented, the one that a file names before a study's own
TRUTH = ("driven_by", "true_threshold")  # of units that were simulated


def tables_of_units(parts: Results) -> dict[str, xr.Dataset]:
    """What was found of units: one table, or one for each recording.

    Parameters
    ----------
    parts : mapping of Datasets
        Of one animal.

    Returns
    -------
    dict of Datasets
        By name.
    """
    return {name: data for name, data in parts.items() if name == "units" or name.startswith("units_")}


def simulated(parts: Results) -> bool:
    """Whether no animal fired these: a study's own recording, or units whose truth is known.

    Parameters
    ----------
    parts : mapping of Datasets
        Of one animal.

    Returns
    -------
    bool
        True also where only some are simulated.
    """
    known = [*([parts["spikes"]] if "spikes" in parts else []), *tables_of_units(parts).values()]
    own = "spikes" in parts and "spike_unit" not in parts["spikes"]
    return own or any(name in data for data in known for name in TRUTH)


def without_spikes(parts: Results) -> dict[str, str]:
    """Units that were analysed and whose spikes are not among the results.

    Parameters
    ----------
    parts : mapping of Datasets
        As of :func:`add_neurons`.

    Returns
    -------
    dict
        In one line which, and why; empty if there are none, or no spikes at all.
    """
    if "spikes" not in parts:
        return {}
    there = set(_names(_named(parts["spikes"])))
    absent = [name for table in tables_of_units(parts).values() for name in _names(table) if name not in there]
    why = "a study keeps those of the unit that its figure shows, in whole bins; `spikes` and `trials` add all"
    return {f"spikes of {', '.join(absent)}": why} if absent else {}


def taken_until(parts: Results) -> float | None:
    """Until when spikes and trials that are on the session's clock already take it [s]; None if there are none.

    Parameters
    ----------
    parts : mapping of Datasets
        Of one animal.

    Returns
    -------
    float or None
        [s].
    """
    ends = []
    if "spikes" in parts and "spike_trial" not in parts["spikes"]:
        ends += [parts["spikes"].spike_time.values]
        ends += [parts["spikes"].interval_stop.values] if "interval_stop" in parts["spikes"] else []
    trials = _known_trials(parts)
    if trials is not None:
        ends += [trials.trial_stop.values]
    return max((float(end.max()) for end in ends if end.size), default=None)


def add_neurons(
    file: Any, module: Any, parts: Results, session: Session, clock: Clock, sampling_rate: float | None = None
) -> None:
    """Add units with spike times, quality and tuning; trials; the stimulus as their template.

    Spikes given in trials are placed on the clock at their trials' own times, or, where these are not known, one trial
    after the other. Where spikes are there of some of
    the units alone, as of the one that a study's figures show, a table ``tuning`` lists all.

    Parameters
    ----------
    file, module : NWBFile, ProcessingModule
        Of pynwb; the module takes the tables of tuning.
    parts : mapping of Datasets
        ``spikes``, ``trials``, ``units`` or ``units_N`` (what was found of them), ``command`` or ``motion`` (the
        stimulus); any may be absent.
    session : Session
        Of the file.
    clock : Clock
        Where trials are laid.
    sampling_rate : float, optional
        Of the recording that the spikes are from [Hz].

    Raises
    ------
    InputError
        If number or length of the trials, or the sampling rate of recorded spikes, is not known.
    """
    trials, found = _known_trials(parts), tables_of_units(parts)
    if "spikes" in parts:
        spikes = _named(parts["spikes"])
        if not spikes.sizes["unit"]:
            raise TooFewError(
                "spikes", "must be of at least one unit", "none", "leave them out, or choose another file"
            )
        if "spike_trial" in spikes:
            trials = laid_trials(parts, clock) if trials is None else trials
            spikes = _on_clock(spikes, trials)
        tuned = {name: table for name, table in found.items() if set(_names(spikes)) <= set(_names(table))}
        if len(tuned) == 1:
            (name,) = tuned
            spikes = _with_tuning(spikes, tuned[name])
            if spikes.sizes["unit"] == tuned[name].sizes["unit"]:
                del found[name]
        add_units(file, spikes, _about(parts, spikes, session, sampling_rate))
    for name, table in found.items():
        text = "what was found of each unit; spikes of those in the table units alone are in this file"
        add_table(module, f"tuning{name.removeprefix('units')}", text, table, "unit")
    stimulus = next((parts[name] for name in PRESENTED if name in parts), None)
    stimulus = stimulus_of(stimulus) if stimulus is not None and "point_displacement" in stimulus else stimulus
    template = None if stimulus is None else add_stimulus(file, stimulus, trials)
    if trials is not None:
        add_trials(file, trials, template)


def _known_trials(parts: Results) -> xr.Dataset | None:
    """Trials on the session's clock: those given, or those that the spikes were cut by; None if there are none."""
    if "trials" in parts or "trial_start" not in parts.get("spikes", ()):
        return parts.get("trials")
    spikes = parts["spikes"]
    start = spikes.trial_start.values
    stop = spikes.trial_stop.values if "trial_stop" in spikes else start + _presentation(parts)[1]
    return trial_table(start, stop, spikes.trial_stimulus.values if "trial_stimulus" in spikes else None)


def laid_trials(parts: Results, clock: Clock) -> xr.Dataset:
    """Trials laid on the session's clock, each as long as the presentation.

    Parameters
    ----------
    parts : mapping of Datasets
        Of one animal.
    clock : Clock
        Where they are laid.

    Returns
    -------
    Dataset
        ``trial_start``, ``trial_stop`` (trial) [s].

    Raises
    ------
    InputError
        If number or length of the trials is not known.
    """
    start, stop, count = _presentation(parts)
    spans = [clock.lay(np.array([start, stop])) for _ in range(count)]
    return trial_table(np.array([span[0] - start for span in spans]), np.array([span[1] for span in spans]))


def _presentation(parts: Results) -> tuple[float, float, int]:
    """Start of a presentation, 0 or before its onset, and its stop [s]; and number of them."""
    known = [parts[name].attrs for name in ("spikes", "response", "units") if name in parts]
    count = next((int(attrs["n_trials"]) for attrs in known if attrs.get("n_trials", 0) > 0), 0)
    attrs = known[0]
    played = next((parts[name].time.values for name in ("stimulus", "motion", "command") if name in parts), None)
    if "window_stop" in attrs:
        start, stop = float(attrs["window_start"]), float(attrs["window_stop"])
    elif "counted_bins" in attrs:
        start, stop = 0.0, float(attrs["counted_bins"]) * float(attrs["counted_bin"])
    elif played is not None and "duration" not in attrs:
        start, stop = float(played[0]), float(played[-1] + np.diff(played).mean())  # a sample lasts to the next
    else:
        start, stop = 0.0, float(attrs.get("duration", 0.0))
    if not count or not stop > 0:
        remedy = "attributes n_trials and duration [s] of their dataset, or `command` for the latter"
        raise MissingError("spikes in trials", "must hold the number of trials and the length of each", remedy=remedy)
    return min(start, 0.0), stop, count


def stimulus_of(motion: xr.Dataset) -> xr.Dataset:
    """A motion as the template of one whisker's stimulus.

    Parameters
    ----------
    motion : Dataset
        ``point_displacement`` (time) [m].

    Returns
    -------
    Dataset
        ``command`` (whisker, time) [m].
    """
    if motion.point_displacement.ndim > 1:
        return motion
    move = motion.point_displacement.values[None]
    return dataset(time=motion.time.values, whisker=np.array(["stimulated"]), command=move)


def _names(units: xr.Dataset) -> list[str]:
    return [str(name) for name in units.unit_name.values]


def _named(spikes: xr.Dataset) -> xr.Dataset:
    """Spikes with their unit's number and name, which a study's own recording of one unit leaves out."""
    if "spike_unit" in spikes:
        return spikes
    one = np.zeros(spikes.sizes["spike"], int)
    trial = spikes.spike_trial.values if "spike_trial" in spikes else None
    return spike_table(spikes.spike_time.values, one, ["simulated"], trial=trial, attrs=spikes.attrs)


def _on_clock(spikes: xr.Dataset, trials: xr.Dataset) -> xr.Dataset:
    """Spikes given in trials, on the session's clock, with the windows in which each unit was observed."""
    trial = spikes.spike_trial.values
    if trial.size and trial.max() >= trials.sizes["trial"]:
        raise RangeError("spikes", f"must lie in trials 0 to {trials.sizes['trial'] - 1}", int(trial.max()))
    known = {str(name): one.values for name, one in spikes.variables.items() if one.dims[:1] == ("unit",)}
    about: dict[str, Any] = {name: one for name, one in known.items() if name not in ("unit_name", "unit_observed")}
    time = trials.trial_start.values[trial] + spikes.spike_time.values
    placed = spike_table(time, spikes.spike_unit.values, _names(spikes), **about)
    if "unit_observed" not in spikes:
        return placed
    windows = np.column_stack(recorded_windows(spikes, trials))
    return with_intervals(placed, [windows[seen] for seen in observed_trials(spikes, len(windows))])


def _with_tuning(spikes: xr.Dataset, units: xr.Dataset) -> xr.Dataset:
    """Units with what was found of each as further columns; a column of the same name is that of the finding."""
    found = _names(units)
    order = units.isel(unit=[found.index(name) for name in _names(spikes)])
    columns = {name: one for name, one in order.data_vars.items() if one.dims == ("unit",) and name != "unit_name"}
    return spikes.assign(columns)


def _about(parts: Results, spikes: xr.Dataset, session: Session, sampling_rate: float | None) -> Session:
    """The session with what is known of the recording: its resolution, and one shank of as many electrodes as named."""
    rate = parts["spikes"].attrs.get("sampling_rate") if sampling_rate is None else sampling_rate
    virtual = session.virtual or simulated(parts)
    if rate is None and not virtual:
        raise MissingError("sampling_rate", "must be given", remedy="of the recording that the spikes are from, in Hz")
    if rate is not None and not 0 < float(rate) < np.inf:
        raise RangeError("sampling_rate", "must be positive (Hz)", rate)
    last = float(np.abs(spikes.spike_time.values).max(initial=1.0))
    known: dict[str, Any] = {"probe": "not known", "location": "not known", "virtual": virtual}
    known["resolution"] = float(np.spacing(last)) if rate is None else 1 / float(rate)
    if "unit_electrode" in spikes:
        known |= {"shanks": 1, "sites": int(spikes.unit_electrode.values.max(initial=0)) + 1}
    return replace(session, **known)
