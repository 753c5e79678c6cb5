"""Spikes and stimulus of one protocol from two files, and whether they fit together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from vibrissa.arrays import Window
from vibrissa.errors import MissingError, RangeError, TooFewError, UnknownError
from vibrissa.files import load
from vibrissa.quantities import dataset, require
from vibrissa.tables.reader import read_table
from vibrissa.tables.writer import write_table


def read_stimulus(path: str | Path) -> xr.Dataset:
    """One presentation of the stimulus: a file with columns ``time`` [s] and ``displacement`` [m].

    Or a dataset (``.nc``) with ``point_displacement`` (time), as ``vibrissa scan --simulate-units`` writes it.

    Parameters
    ----------
    path : path
        The table or the dataset.

    Returns
    -------
    Dataset
        ``point_displacement`` (time).

    Raises
    ------
    InputError
        If a column is missing, a cell is no number, times do not ascend evenly, or the units are not s and m.
    """
    if Path(path).suffix == ".nc":
        shown = load(path)
        if "mode_displacement" in shown and "point_displacement" not in shown:
            raise MissingError(str(path), "must hold what was presented", "a scan", "give `simulate_units`")
        require(shown, "time", "point_displacement")
        return shown[["point_displacement"]]
    table = read_table(path, {"time": "s", "displacement": "m"})
    time, displacement = table.numbers("time"), table.numbers("displacement")
    if time.size < 100:
        raise TooFewError(str(path), "must hold at least 100 samples", time.size)
    step = np.diff(time)
    mean = (time[-1] - time[0]) / (time.size - 1)
    table.refuse_first(np.append(False, step <= 0), "time", "must be later than the one before")
    uneven = np.append(False, np.abs(step - mean) > 0.05 * mean)
    table.refuse_first(uneven, "time", f"must follow the one before evenly, by {mean:.6g} s", "interpolate it first")
    if mean > 0.01:
        raise RangeError(str(path), "must be sampled at 100 Hz or above", f"{1 / mean:.4g} Hz", "times are in seconds")
    if np.ptp(displacement) == 0:
        raise RangeError(str(path), "must move", "a constant displacement")
    if displacement.std() > 0.01:
        size = f"standard deviation {displacement.std():.3g}"
        raise RangeError(str(path), "must move by less than 1 cm", size, "displacement is in metres")
    return dataset({"source": Path(path).name}, time=time, point_displacement=displacement)


def write_stimulus(stimulus: xr.Dataset, path: str | Path) -> None:
    """Write ``point_displacement`` (time) [m] so that :func:`read_stimulus` gives it back; whole or not at all.

    Parameters
    ----------
    stimulus : Dataset
        With ``point_displacement`` (time).
    path : path
        Name of the file; one that is there is replaced.
    """
    require(stimulus, "time", "point_displacement")
    write_table(path, {"time": stimulus.time.values, "displacement": stimulus.point_displacement.values})


def require_session_clock(spikes: xr.Dataset, remedy: str = "") -> None:
    """Check that a table of spikes is on the session's clock, not cut into trials.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`.
    remedy : str
        What to do about spikes in trials.

    Raises
    ------
    InputError
        If the spikes are in trials, or a variable is missing.
    """
    require(spikes, "spike_time", "spike_unit", "unit_name")
    if "spike_trial" in spikes:
        raise UnknownError("spikes", "must be on the session's clock", "spikes in trials", remedy)


def refuse_misplaced(
    spikes: xr.Dataset,
    stimulus: xr.Dataset,
    n_trials: int,
    *,
    window: Window | None = None,
    spontaneous: Window | None = None,
    fewest: int = 1,
) -> None:
    """Refuse spikes of trials that were not presented, and spikes outside the stimulus where no window is given.

    Parameters
    ----------
    spikes, stimulus, n_trials
        As in :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    window, spontaneous
        As in :class:`vibrissa.neural.coupling.analysis.EnvelopeAnalysis`.
    fewest : int
        Trials that the analysis needs.

    Raises
    ------
    InputError
        Says what the spikes look like, such as times in milliseconds.
    """
    if "spike_time" in spikes and "spike_trial" not in spikes:
        raise MissingError("spikes", "must be in trials", "times on the session's clock", "give their trials")
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    if n_trials < fewest:
        remedy = "intervals come from trials" if fewest > 1 else ""
        raise RangeError("number of trials", f"must be at least {fewest}", n_trials, remedy)
    time, trial = spikes.spike_time.values, spikes.spike_trial.values
    if time.size == 0:
        raise RangeError("spikes", "must be at least one", 0)
    if trial.max() >= n_trials:
        rule = f"must lie below the number of trials, {n_trials}"
        raise RangeError("trial", rule, trial.max(), "trials count from 0")
    first, last = stimulus.time.values[[0, -1]]
    step = (last - first) / (stimulus.sizes["time"] - 1)
    outside = (time < first) | (time > last + step)
    if spontaneous is not None:
        outside &= (time < spontaneous[0]) | (time >= spontaneous[1])
    if not outside.any() or (window is not None and 2 * outside.sum() <= time.size):
        return
    farthest = time[np.argmax(np.abs(time - first))]
    remedy = "give `window`, its start and its stop, to leave them out"
    if outside.all():
        remedy = "let both count from the onset: subtract it from the times of the stimulus"
    if farthest > last + 10 * (last - first):
        remedy = "times are in seconds from the stimulus' onset; these look like milliseconds or a session's clock"
    found = f"{outside.sum()} of {time.size} outside, up to {farthest:g}"
    raise RangeError("spike_time", f"must lie within the stimulus, {first:g} to {last:g} s", found, remedy)
