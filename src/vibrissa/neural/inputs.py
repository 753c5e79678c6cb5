"""Spikes and stimulus of one protocol from two files, and whether they fit together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import InputError
from vibrissa.files import load, written_whole
from vibrissa.neural.spikes import ABOUT_UNITS, about_units, spike_table
from vibrissa.neural.table import read_table
from vibrissa.quantities import dataset, require

if TYPE_CHECKING:
    import xarray as xr

Window = tuple[float, float]


def read_stimulus(path: str | Path) -> xr.Dataset:
    """One presentation of the stimulus: a file with columns ``time`` [s] and ``displacement`` [m].

    Or a dataset (``.nc``) with ``point_displacement`` (time), as ``vibrissa scan --spikes`` writes it.

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
            raise InputError(str(path), "must tell what was presented", "a scan without spikes", "scan with --spikes")
        require(shown, "time", "point_displacement")
        return shown[["point_displacement"]]
    table = read_table(path, ("time", "displacement"))
    time, displacement = table.numbers("time"), table.numbers("displacement")
    if time.size < 100:
        raise InputError(str(path), "must hold at least 100 samples", time.size)
    step = np.diff(time)
    mean = (time[-1] - time[0]) / (time.size - 1)
    table.refuse_first(np.append(False, step <= 0), "time", "must be later than the one before")
    uneven = np.append(False, np.abs(step - mean) > 0.05 * mean)
    table.refuse_first(uneven, "time", f"must follow the one before evenly, by {mean:.6g} s", "interpolate it first")
    if mean > 0.01:
        raise InputError(str(path), "must be sampled at 100 Hz or above", f"{1 / mean:.4g} Hz", "times are in seconds")
    if np.ptp(displacement) == 0:
        raise InputError(str(path), "must move", "a constant displacement")
    if displacement.std() > 0.01:
        size = f"standard deviation {displacement.std():.3g}"
        raise InputError(str(path), "must move by less than 1 cm", size, "displacement is in metres")
    return dataset({"source": Path(path).name}, time=time, point_displacement=displacement)


def write_stimulus(stimulus: xr.Dataset, path: str | Path) -> None:
    """Write ``point_displacement`` (time) [m] so that :func:`read_stimulus` gives it back; whole or not at all."""
    require(stimulus, "time", "point_displacement")
    rows = zip(stimulus.time.values.tolist(), stimulus.point_displacement.values.tolist(), strict=True)
    text = "".join(f"{time!r},{moved!r}\n" for time, moved in rows)
    with written_whole(path) as temporary:
        temporary.write_text(f"time,displacement\n{text}", encoding="utf-8")


def read_spikes(path: str | Path) -> xr.Dataset:
    """Spikes in trials: a file with columns ``unit`` (any name), ``trial`` (from 0) and ``spike_time`` [s].

    ``whisker`` and ``quality`` (SU, MU) may be there, with one value for each unit.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.spikes.spike_table`; times count from the onset of the stimulus. The order of the
        lines does not matter.

    Raises
    ------
    InputError
        If the file holds no spike, a column is missing, or a cell is not what it should be.
    """
    table = read_table(path, ("unit", "trial", "spike_time"), tuple(ABOUT_UNITS))
    if not table.lines:
        raise InputError(str(path), "must hold at least one spike", "a header alone")
    trial = table.numbers("trial")
    table.refuse_first((trial != np.floor(trial)) | (trial < 0), "trial", "must be a whole number from 0")
    cells = np.array(table.columns["unit"], str)
    table.refuse_first(cells == "", "unit", "must name a unit")
    names, index = np.unique(cells, return_inverse=True)
    first = np.argsort(np.unique(index, return_index=True)[1])  # units in the order of their first spike
    rank = np.argsort(first)
    return spike_table(
        table.numbers("spike_time"),
        rank[index],
        names[first].tolist(),
        trial=trial.astype(int),
        attrs={"source": Path(path).name},
        **about_units(table, rank[index]),
    )


def refuse_misplaced(
    spikes: xr.Dataset,
    stimulus: xr.Dataset,
    n_trials: int,
    *,
    window: Window | None = None,
    spontaneous: Window | None = None,
) -> None:
    """Refuse spikes of trials that were not, and spikes outside the stimulus where no window is given.

    Parameters
    ----------
    spikes, stimulus, n_trials
        As in :func:`vibrissa.neural.analysis.analyse_units`.
    window, spontaneous
        As in :class:`vibrissa.neural.analysis.EnvelopeAnalysis`.

    Raises
    ------
    InputError
        Says what the spikes look like, such as times in milliseconds.
    """
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    if n_trials < 1:
        raise InputError("number of trials", "must be at least 1", n_trials)
    time, trial = spikes.spike_time.values, spikes.spike_trial.values
    if time.size == 0:
        raise InputError("spikes", "must be at least one", 0)
    if trial.max() >= n_trials:
        raise InputError(
            "trial", f"must lie below the number of trials, {n_trials}", trial.max(), "trials count from 0"
        )
    first, last = stimulus.time.values[[0, -1]]
    step = (last - first) / (stimulus.sizes["time"] - 1)
    outside = (time < first) | (time > last + step)
    if spontaneous is not None:
        outside &= (time < spontaneous[0]) | (time >= spontaneous[1])
    if not outside.any() or (window is not None and 2 * outside.sum() <= time.size):
        return
    farthest = time[np.argmax(np.abs(time - first))]
    remedy = "give --window START STOP to leave them out"
    if farthest > last + 10 * (last - first):
        remedy = "times are in seconds from the stimulus' onset; these look like milliseconds or a session's clock"
    found = f"{outside.sum()} of {time.size} outside, up to {farthest:g}"
    raise InputError("spike_time", f"must lie within the stimulus, {first:g} to {last:g} s", found, remedy)
