"""The window without stimulus, for the spontaneous rate: whether it holds none, of this trial or of another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.neural.io.tables.inputs import SHORT
from vibrissa.neural.io.tables.stimuli import presented
from vibrissa.study.spec.neurons import Window

if TYPE_CHECKING:
    import xarray as xr

STILL = 0.05  # of the stimulus' own SD, or of an envelope's rms
NEAR = 1e-3  # [ms] by which ends of rest may differ by rounding


def refuse_driven(spikes: xr.Dataset, stimulus: xr.Dataset, spontaneous: Window | None) -> None:
    """Refuse a window without stimulus that reaches into the stimulus of another trial, where it moves.

    Parameters
    ----------
    spikes : Dataset
        In trials; the onsets of these are known where it has ``trial_start``.
    stimulus : Dataset
        By time from the onset; with the dimension ``trial`` where each trial had its own.
    spontaneous : (float, float), optional
        The window, from the onset [s].

    Raises
    ------
    InputError
        If it reaches into another stimulus by more than 10 ms; says how far, in how many trials, and where rest is.
    """
    if spontaneous is None or "trial_start" not in spikes:
        return
    order = np.argsort(spikes.trial_start.values)
    onset = spikes.trial_start.values[order]
    stimulus = stimulus.isel(trial=order) if "trial" in stimulus.dims else stimulus
    if onset.size < 2 or not (gap := float(np.diff(onset).min())) > 0:
        return
    first, end = _shown(stimulus)
    reach = np.array([_reach(k, onset, stimulus, (first, end), spontaneous) for k in range(onset.size)])
    if not (reach > 0).any():
        return
    begin, stop = spontaneous
    found = f"{begin:g} to {stop:g} s, by {reach.max():.4g} s in {(reach > 0).sum()} of {onset.size} trials"
    # from the end of the stimulus before to the onset of the next, in whole milliseconds
    rest = np.ceil(1e3 * (end - gap) - NEAR) / 1e3, np.floor(1e3 * (first + gap) + NEAR) / 1e3
    low, high = max(begin, rest[0]), min(stop, rest[1])
    ends = [f"start it at {low:g} s"] if low > begin else []
    remedy = " and ".join([*ends, f"stop it at {high:g} s"] if high < stop else ends)
    if not low < high:
        there = f"no stimulus is there from {rest[0]:g} to {first:g} s"
        remedy = there if rest[0] < first else "let it lie where no stimulus moves, or leave it out"
    raise RangeError("spontaneous", "must not reach into the stimulus of another trial", found, remedy)


def _reach(trial: int, onset: Array, stimulus: xr.Dataset, shown: Window, spontaneous: Window) -> float:
    """How long stimuli of others, each ``shown`` from its onset, move in the window of a trial [s]."""
    low, high = onset[trial] + spontaneous[0], onset[trial] + spontaneous[1]
    reach = 0.0
    for other in range(np.searchsorted(onset + shown[1], low), np.searchsorted(onset + shown[0], high)):
        part = max(low - onset[other], shown[0]), min(high - onset[other], shown[1])
        own = stimulus.isel(trial=other) if "trial" in stimulus.dims else stimulus
        if other != trial and part[1] - part[0] > SHORT and _moves(own, part):
            reach += part[1] - part[0]
    return reach


def _moves(stimulus: xr.Dataset, part: Window) -> bool:
    """Whether a stimulus moves in a part of its time."""
    time, values, _, is_envelope = presented(stimulus)
    within = values[..., (time >= part[0]) & (time < part[1])]
    within, values = within[np.isfinite(within)], values[np.isfinite(values)]  # an envelope may have holes
    size = (lambda of: np.sqrt(np.mean(of**2))) if is_envelope else np.std
    return bool(within.size) and not size(within) <= STILL * size(values)


def remarks_on_rest(spikes: xr.Dataset, stimulus: xr.Dataset, spontaneous: Window | None) -> list[str]:
    """Remark on a window without stimulus that may not have been recorded, and on one in which the stimulus moves.

    Parameters
    ----------
    spikes, stimulus, spontaneous
        As of :func:`refuse_driven`.

    Returns
    -------
    list of str
        A sentence each.
    """
    if spontaneous is None:
        return []
    (start, stop), when, lines = spontaneous, spikes.spike_time.values, []
    if not ((when >= start) & (when < stop)).any():
        why = "rates of 0, unless the spikes there are not in the file"
        lines.append(f"no unit fired from {start:g} to {stop:g} s: {why}")
    if _moves(stimulus, spontaneous):
        lines.append(f"the stimulus moves from {start:g} to {stop:g} s: the rate there is not spontaneous")
    left = np.atleast_1d(spikes.attrs.get("onsets_left_out", []))
    if left.size and "trial_start" in spikes:
        onset, (first, end) = spikes.trial_start.values[:, None], _shown(stimulus)
        meets = (left + first < onset + stop - SHORT) & (left + end > onset + start + SHORT)
        if number := int(meets.any(1).sum()):
            which = f"in {number} of {len(onset)} trials {start:g} to {stop:g} s reaches into one that is left out"
            lines.append(f"{which}: the rate there is spontaneous only if that one had no stimulus")
    return lines


def _shown(stimulus: xr.Dataset) -> Window:
    """When a stimulus begins and ends, after the onset [s]."""
    time = stimulus.time.values
    return float(time[0]), float(time[-1] + (time[-1] - time[0]) / (time.size - 1))
