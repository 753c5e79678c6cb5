"""Stimuli that differ between trials: those of the trials that the spikes are of, and laid end to end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array, Window
from vibrissa.errors import ConflictError, RangeError, ShapeError
from vibrissa.neural.coupling.presentation import JOINED, LONGEST, BinnedAnalysis
from vibrissa.neural.io.tables.inputs import misplaced, refuse_beyond_recording
from vibrissa.neural.io.tables.selection import of_same_trials
from vibrissa.neural.io.tables.spikes import observed_trials, refuse_partly_observed, spike_table
from vibrissa.neural.io.tables.stimuli import labelled_stimulus, name_of, presented

if TYPE_CHECKING:
    import xarray as xr

UNEVEN = 0.05  # of a step, by which all bins of a trial may miss its samples
OF_EACH = ("counted_bins", "window_start", "window_stop")  # attributes that hold of each trial alone


def spikes_within(
    spikes: xr.Dataset, stimulus: xr.Dataset, around: Window | None, window: Window | None = None
) -> tuple[xr.Dataset, list[str]]:
    """Spikes without those that lie beyond the stimulus; all stay where they are to be refused.

    They are where most lie beyond it and no window is given, or if they look like times of another scale or clock.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    stimulus : Dataset
        By ``time`` from the onset [s].
    around : (float, float), optional
        Window that is kept as well [s].
    window : (float, float), optional
        Part of the stimulus that is analysed [s].

    Returns
    -------
    spikes : Dataset
        In trials.
    remarks : list of str
        How many are left out.
    """
    time = stimulus.time.values
    first, last = float(time[0]), float(time[-1] + (time[-1] - time[0]) / (time.size - 1))
    when = spikes.spike_time.values
    beyond = (when < first) | (when > last)
    if around is not None:
        beyond &= (when < around[0]) | (when >= around[1])
    number = int(beyond.sum())
    few = 2 * number <= when.size if window is None else not misplaced(spikes, beyond, (first, float(time[-1])))
    if not number or not few:
        return spikes, []
    text = f"{number} of {when.size} spikes lie beyond the stimulus, {first:g} to {last:g} s, and are left out"
    return spikes.isel(spike=np.flatnonzero(~beyond)), [text]


def of_the_trials(stimulus: xr.Dataset, spikes: xr.Dataset, source: str) -> xr.Dataset:
    """Stimuli of the trials that the spikes are of, in their order, of a file that numbers its trials.

    Parameters
    ----------
    stimulus : Dataset
        With the dimension ``trial`` where each trial had its own.
    spikes : Dataset
        In trials, of which some may have been selected; see :func:`vibrissa.neural.io.tables.selection.at_places`.
    source : str
        The file, for the message.

    Returns
    -------
    Dataset
        The same where trials were not selected.

    Raises
    ------
    InputError
        If a trial that was selected has no stimulus.
    """
    if "trial" not in stimulus.dims:
        return stimulus
    return stimulus.isel(trial=of_same_trials(spikes, stimulus.sizes["trial"], source))


def refuse_other_trials(stimulus: xr.Dataset, n_trials: int, source: str) -> None:
    """Refuse stimuli of another number of trials than the spikes have.

    Parameters
    ----------
    stimulus : Dataset
        With the dimension ``trial`` where each trial had its own.
    n_trials : int
        Presentations.
    source : str
        For the message.

    Raises
    ------
    InputError
        Names both numbers.
    """
    if (own := stimulus.sizes.get("trial", n_trials)) != n_trials:
        raise ShapeError(source, f"must have {n_trials} trials, as the spikes have", own)


def each_trial(spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int) -> list[tuple[xr.Dataset, xr.Dataset, int]]:
    """Spikes, stimulus and number of trials of each stimulus: one, or one for each trial.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    stimulus : Dataset
        With the dimension ``trial`` where each trial had its own.
    n_trials : int
        Presentations.

    Returns
    -------
    list of (Dataset, Dataset, int)
        Of each stimulus.
    """
    if "trial" not in stimulus.dims:
        return [(spikes, stimulus, n_trials)]
    parts = []
    for k in range(n_trials):
        own = spikes.isel(
            {"spike": np.flatnonzero(spikes.spike_trial.values == k), "trial": [k]}, missing_dims="ignore"
        )
        own = own.assign(spike_trial=own.spike_trial - k).assign_attrs(n_trials=1)
        parts.append((own, stimulus.isel(trial=k), 1))
    return parts


def end_to_end(
    spikes: xr.Dataset, stimulus: xr.Dataset, how: BinnedAnalysis
) -> tuple[xr.Dataset, xr.Dataset, list[str]]:
    """Trials that each had their own stimulus, one after the other as a single presentation.

    The envelope is that of each trial; it counts as unknown three periods of the carrier at its ends, and in its last
    30 ms, so that no response is compared with the stimulus of another trial. The skip is left out of every trial.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    stimulus : Dataset
        With the dimension ``trial``.
    how : BinnedAnalysis
        Bins and band; a window is refused.

    Returns
    -------
    spikes : Dataset
        In one trial.
    stimulus : Dataset
        Its envelope.
    remarks : list of str
        That this was done.

    Raises
    ------
    InputError
        If a window is given, bins do not divide the trials, or a unit was not observed in all trials: what is joined
        has one presentation of all units.
    """
    refuse_partly_observed(spikes, observed_trials(spikes, stimulus.sizes["trial"]))
    if how.window is not None:
        raise ConflictError("window", "must be left out where each trial has its own stimulus", how.window)
    time, _, unit, _ = presented(stimulus)
    step = float(time[-1] - time[0]) / (time.size - 1)
    n_trials = stimulus.sizes["trial"]
    each = stimulus[name_of(stimulus)].transpose("trial", "time")
    near = max(1e-6 * how.bin_width, UNEVEN * step)  # times may be rounded
    bins = int(np.floor((time.size * step + near) / how.bin_width))
    count = round(bins * how.bin_width / step)  # samples of whole bins
    if abs(count * step - bins * how.bin_width) > near or not bins:
        raise RangeError("bin width", f"must be whole samples of the stimulus, of {step:g} s", how.bin_width)
    step = bins * how.bin_width / count
    whole = np.concatenate([_envelope(stimulus, one.values, how, step)[:count] for one in each])
    length = bins * how.bin_width
    attrs = {"source": stimulus.attrs.get("source", ""), JOINED: n_trials}
    joined = labelled_stimulus(time[0] + step * np.arange(whole.size), whole, unit, envelope=True, attrs=attrs)
    refuse_beyond_recording(spikes, (time[0] + how.skip, time[0] + length), step)
    when = spikes.spike_time.values
    inside = np.flatnonzero((when >= time[0]) & (when < time[0] + length))
    some = spikes.isel(spike=inside)
    about = {str(n): v.values for n, v in spikes.variables.items() if v.dims == ("unit",) and n != "unit_name"}
    table = spike_table(
        some.spike_time.values + length * some.spike_trial.values,
        some.spike_unit.values,
        [str(name) for name in spikes.unit_name.values],
        trial=np.zeros(inside.size, int),
        attrs={name: one for name, one in spikes.attrs.items() if name not in OF_EACH} | {"n_trials": 1},
        **about,
    )
    return table, joined, [f"{n_trials} trials, each with its own stimulus, are analysed as one presentation"]


def _envelope(stimulus: xr.Dataset, values: Array, how: BinnedAnalysis, step: float) -> Array:
    """Envelope of one trial, NaN where it is not to be compared."""
    from vibrissa.neural.coupling.presentation import edge_of, enveloped

    time, _, unit, is_envelope = presented(stimulus)
    one = presented(labelled_stimulus(time, values, unit, envelope=is_envelope))
    envelope, _, frequency, holes = enveloped(one, how.band, step)
    edge = edge_of(frequency)
    since, left = time - time[0], time[-1] + step - time
    known = (since >= edge - 1e-9) & (left >= max(edge, LONGEST) - 1e-9) & ~holes
    return np.where(known, envelope, np.nan)
