"""Whether the spikes and the stimulus of one protocol fit together."""

from __future__ import annotations

import numpy as np
import xarray as xr

from vibrissa.arrays import Mask, Window
from vibrissa.errors import MissingError, RangeError, ShapeError, UnknownError
from vibrissa.quantities import require
from vibrissa.tables.stated import number

SHORT = 0.01  # [s] by which trials may end before what is analysed: a bin


def require_whole(quantity: str, value: object) -> None:
    """Refuse what is no whole number, such as 30.5 or a text.

    Parameters
    ----------
    quantity : str
        Its name in the message.
    value : object
        As given.

    Raises
    ------
    InputError
        Shows the right form.
    """
    if number(quantity, value, "1", "a whole number: 30") % 1 != 0:
        raise RangeError(quantity, "must be a whole number", value)


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
    skip: float = 0.0,
) -> None:
    """Refuse spikes of trials that were not presented, and spikes outside the stimulus where no window is given.

    Parameters
    ----------
    spikes, stimulus, n_trials
        As in :func:`vibrissa.neural.coupling.analysis.analyse_units`.
    window, spontaneous, skip
        As in :class:`vibrissa.neural.coupling.analysis.EnvelopeAnalysis`.

    Raises
    ------
    InputError
        Says what the spikes look like, such as times in milliseconds; or trials or counts do not hold what is analysed.
    """
    if "spike_time" in spikes and "spike_trial" not in spikes:
        raise MissingError("spikes", "must be in trials", "times on the session's clock", "give their trials")
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    require_whole("number of trials", n_trials)
    if n_trials < 1:
        raise RangeError("number of trials", "must be at least 1", n_trials)
    if spontaneous is not None and spontaneous[0] < 0 and "counted_bins" in spikes.attrs:
        remedy = "leave it out: what came before the onset was not counted"
        raise RangeError("spontaneous", "must not start before the onset, as counts do not", spontaneous, remedy)
    time, trial = spikes.spike_time.values, spikes.spike_trial.values
    if time.size == 0:
        outside = int(spikes.attrs.get("spikes_outside", 0))
        remedy = (
            f"{outside} lie in no trial: are times of spikes and trials in seconds, of one clock?" if outside else ""
        )
        raise RangeError("spikes", "must be at least one", 0, remedy)
    if trial.max() >= n_trials:
        rule = f"must lie below the number of trials, {n_trials}"
        raise RangeError("trial", rule, trial.max(), "trials count from 0")
    first, last = stimulus.time.values[[0, -1]]
    step = (last - first) / (stimulus.sizes["time"] - 1)
    start, stop = (first, last + step) if window is None else window
    refuse_beyond_recording(spikes, (start + skip, stop), step if window is None else 0.0)
    if spontaneous is not None:
        refuse_unrecorded(spikes, spontaneous, "spontaneous")
    _refuse_outside(spikes, stimulus, window, spontaneous)


def _refuse_outside(
    spikes: xr.Dataset, stimulus: xr.Dataset, window: Window | None, spontaneous: Window | None
) -> None:
    """Refuse spikes outside the stimulus where no window is given, and those of another scale or clock."""
    time, (first, last) = spikes.spike_time.values, stimulus.time.values[[0, -1]]
    outside = (time < first) | (time > last + (last - first) / (stimulus.sizes["time"] - 1))
    if spontaneous is not None:
        outside &= (time < spontaneous[0]) | (time >= spontaneous[1])
    if not outside.any() or (window is not None and not misplaced(spikes, outside, (first, last))):
        return
    each = "trial" in stimulus.dims  # of which no window is taken
    remedy = "leave them out" if each else "give `window`, its start and its stop, to leave them out"
    if outside.all():
        remedy = "let both count from the onset: subtract it from the times of the stimulus"
    if _far(spikes, (first, last)):
        right = "" if outside.all() else "; if these are seconds from it, leave out those beyond the stimulus"
        remedy = "times are in seconds from the stimulus' onset; these look like milliseconds, samples or a session's "
        remedy += f"clock{right}"
    found = f"{outside.sum()} of {time.size} outside, up to {time[np.argmax(np.abs(time - first))]:g}"
    raise RangeError("spike_time", f"must lie within the stimulus, {first:g} to {last:g} s", found, remedy)


def misplaced(spikes: xr.Dataset, outside: Mask, shown: Window) -> bool:
    """Whether times are not those of the stimulus: all are outside, or most are and some of another scale or clock.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    outside : (N,) array of bool
        Which lie outside the stimulus.
    shown : (float, float)
        First and last time of the stimulus, from the onset [s].

    Returns
    -------
    bool
    """
    return bool(outside.all() or (2 * outside.sum() > outside.size and _far(spikes, shown)))


def _far(spikes: xr.Dataset, shown: Window) -> bool:
    """Whether some times lie so far from a stimulus that they are likely of another scale or clock."""
    first, last = shown
    far = np.abs(spikes.spike_time.values - first).max(initial=0.0) > 11 * (last - first)
    return bool(far and not _within_their_trials(spikes))


def _within_their_trials(spikes: xr.Dataset) -> bool:
    """Whether all times lie in what was recorded of their trials, by the session's clock: seconds from the onset."""
    if not {"trial_start", "trial_stop"} <= set(spikes.variables):
        return False
    time, trial, known = spikes.spike_time.values, spikes.spike_trial.values.astype(int), spikes.attrs
    lasted = (spikes.trial_stop.values - spikes.trial_start.values)[np.minimum(trial, spikes.sizes["trial"] - 1)]
    start, stop = known.get("window_start", 0.0), known.get("window_stop", lasted)
    return bool(((time >= start - SHORT) & (time <= stop + SHORT)).all())


def refuse_beyond_recording(spikes: xr.Dataset, part: Window, step: float = 0.0) -> None:
    """Refuse trials and counts that do not hold what is analysed: the rest would count as silence.

    Parameters
    ----------
    spikes : Dataset
        In trials. Their end is known of counts in bins, and of trials with ``trial_start`` and ``trial_stop``; both
        ends of those that were cut by a window.
    part : (float, float)
        What is analysed, from the onset [s].
    step : float
        Between samples of the stimulus [s], if it ends with the last of them.

    Raises
    ------
    InputError
        If a whole bin of the counts is missing, or a trial ends more than 10 ms and a step before, or begins so much
        after it; names both ends.
    """
    _refuse_short_counts(spikes, part[1])
    _refuse_short_trials(spikes, part[1], max(SHORT, step))
    refuse_unrecorded(spikes, part, "what is analysed", max(SHORT, step))


def recorded_part(spikes: xr.Dataset) -> Window:
    """Part of every trial in which its spikes were taken.

    Parameters
    ----------
    spikes : Dataset
        In trials; ``window_start`` and ``window_stop`` if they were cut by a window about the onset, else from
        ``trial_start`` to ``trial_stop``.

    Returns
    -------
    (float, float)
        From the onset [s]; infinite where it is not known.
    """
    start, stop = -np.inf, np.inf
    if "trial_start" in spikes:
        start = 0.0 if spikes.spike_time.values.min(initial=0.0) >= 0 else -np.inf
        if "trial_stop" in spikes:
            stop = float((spikes.trial_stop.values - spikes.trial_start.values).min(initial=np.inf))
    return float(spikes.attrs.get("window_start", start)), float(spikes.attrs.get("window_stop", stop))


def refuse_unrecorded(spikes: xr.Dataset, part: Window, quantity: str, most: float = 1e-6) -> None:
    """Refuse a part of the trials that reaches beyond that in which spikes were taken.

    Parameters
    ----------
    spikes : Dataset
        In trials.
    part : (float, float)
        From the onset [s].
    quantity : str
        Its name in the message.
    most : float
        By which it may reach beyond [s].

    Raises
    ------
    InputError
        Names what was recorded.
    """
    start, stop = recorded_part(spikes)
    if part[0] >= start - most and part[1] <= stop + most:
        return
    rule = f"must lie in what the table holds of each trial, {start:.6g} to {stop:.6g} s"
    longer = f"({min(part[0], start):.6g}, {max(part[1], stop):.6g})"
    remedy = f"read the spikes of more of it: vb.read_spikes(…, window={longer})"
    raise RangeError(quantity, rule, f"{part[0]:.6g} to {part[1]:.6g} s", remedy)


def _refuse_short_counts(spikes: xr.Dataset, stop: float) -> None:
    if "counted_bins" not in spikes.attrs:
        return
    bins, width = spikes.attrs["counted_bins"], spikes.attrs["counted_bin"]
    end = bins * width
    if end > stop - width * (1 - 1e-6):
        return
    axes = "counts are bins x trials x units; " if 2 * end < stop else ""
    remedy = f"{axes}they end at {end:.6g} s: give the right `counted_bin`, or end `window` or stimulus there"
    rule = f"must last to the end of what is analysed, {stop:.6g} s"
    raise ShapeError("counts", rule, f"{bins} bins of {width:g} s", remedy)


def _refuse_short_trials(spikes: xr.Dataset, stop: float, most: float) -> None:
    if "trial_stop" not in spikes or "trial_start" not in spikes:
        return
    lasted = spikes.trial_stop.values - spikes.trial_start.values
    short, shortest = int((lasted < stop - most).sum()), float(lasted.min(initial=np.inf))
    if short:
        rule = f"must last to the end of what is analysed, {stop:.6g} s"
        found = f"{short} of {lasted.size} that stop before, the shortest after {shortest:.6g} s"
        remedy = f"end `window` at {shortest:.6g} s, if this stimulus was shown, or correct their stop"
        raise RangeError("trials of the recording", rule, found, remedy)
