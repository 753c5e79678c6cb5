"""A stimulus that was recorded on the session's clock, cut into trials: found to be one, or of each its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import numpy as np

from vibrissa.arrays import Array, Window
from vibrissa.errors import RangeError, TooFewError
from vibrissa.neural.io.tables.stimuli import labelled_stimulus, presented
from vibrissa.signals.even_times import misfit_of, plain_rate
from vibrissa.study.neurons.rest import refuse_driven, refuse_moving
from vibrissa.study.neurons.stimuli import named_stimulus

if TYPE_CHECKING:
    import xarray as xr

ONE = 0.99  # correlation of each trial's stimulus with their mean, above which they are one
APART = np.sqrt(ONE**-2 - 1)  # rms of the noise that lowers it so, of that of their mean: a trial may be as far from it
ROUNDING = 1e-9  # of the largest of its values, below which a stimulus rests
UNEVEN = 0.05  # of a step, by which times and lengths of trials may be off
NONE = 1e-3  # of a step, below which samples fall alike on all onsets
SCATTER = 1e-3  # [s] of samples about the onsets, above which latencies suffer


def cut_stimulus(stimulus: xr.Dataset, trials: xr.Dataset, source: str) -> tuple[xr.Dataset, list[str]]:
    """The stimulus of each trial, from one that was recorded on the session's clock.

    Parameters
    ----------
    stimulus : Dataset
        By the session's ``time`` [s].
    trials : Dataset
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.
    source : str
        For messages.

    Returns
    -------
    stimulus : Dataset
        By time from the onset, as long as the shortest trial; of one presentation where all trials had the same. Its
        first sample is as late as those of the trials in the mean; motions are interpolated to these times.
    remarks : list of str
        Whether they had, and how far the samples of an envelope scatter about the onsets.

    Raises
    ------
    InputError
        If a trial was not recorded, or times are uneven within one.
    """
    time, values, unit, is_envelope = presented(stimulus)
    start, stop = trials.trial_start.values, trials.trial_stop.values
    if not start.size:
        raise TooFewError("trials", "must be at least one", 0, "select some")
    step = _step_within(time, start, stop)
    first = np.searchsorted(time, start - step / 2)
    late = time[np.minimum(first, time.size - 1)] - start  # from each onset to its first sample
    count = int(np.floor((stop - start).min() / step + UNEVEN))
    # a recording may end within a step of the end of a trial
    count -= bool(((first + count > time.size) & (late > NONE * step)).any())
    if count < 2:
        raise TooFewError(source, "must be sampled within its trials", f"a step of {step:.4g} s")
    lost = (first + count > time.size) | (np.abs(late) > step)
    if lost.any():
        _refuse_lost(int(np.argmax(lost)), start, stop, time, source)
    rows = first[:, None] + np.arange(count)
    uneven = (np.abs(np.diff(time[rows]) - step) > UNEVEN * step).any(1)
    off = np.ptp(time[rows] - step * np.arange(count), axis=-1).max()  # of trials at another rate it grows
    if off > max(step, SCATTER) or any(misfit_of(one) for one in time[rows[uneven]]):  # rounded times are even
        raise RangeError(f"{source}: time", f"must be even within trials, by {step:.6g} s", "uneven", "interpolate it")
    late = (time[rows] - step * np.arange(count)).mean(-1) - start  # however each time was rounded
    begin = round(float(late.mean()), 9) if abs(late.mean()) > NONE * step else 0.0
    own: Array = begin + np.arange(count, dtype=np.float64) * step
    shift = (late - late.mean()) / step
    cut: Array = values[..., rows] if is_envelope else _shifted(values[..., rows], shift)
    lead = {"whisker": stimulus.whisker.values} if "whisker" in stimulus.dims else {}
    attrs = {name: value for name, value in stimulus.attrs.items() if name != "clock"}
    remarks, r = _scattered(late) if is_envelope else [], float(np.min(_likeness(cut)))
    apart = float(np.max(_apart(cut, is_envelope)))
    if len(start) > 1 and not (r >= ONE and apart <= APART):
        known = labelled_stimulus(own, cut, unit, envelope=is_envelope, lead={**lead, "trial": None}, attrs=attrs)
        differs = f"the stimulus differs between trials (correlation with their mean down to {r:.3f})"
        if r >= ONE:
            differs = f"the stimulus differs between trials in size (by up to {100 * apart:.0f} % of their mean)"
        if np.isnan(r):
            holes = (~np.isfinite(cut)).sum()
            differs = f"trials cannot be compared, as {holes} of {cut.size} samples of the stimulus are NaN"
        return known, [f"{differs}: each of {len(start)} trials has its own", *remarks]
    known = labelled_stimulus(own, cut.mean(-2), unit, envelope=is_envelope, lead=lead, attrs=attrs)
    same = [f"the stimulus is the same in all {len(start)} trials: their mean is taken"] * (len(start) > 1)
    return known, [*same, *remarks]


def _step_within(time: Array, start: Array, stop: Array) -> float:
    """Step of the samples within trials [s], however times are rounded: the median of lines through those of each."""
    ends = zip(np.searchsorted(time, start), np.searchsorted(time, stop), strict=True)
    within = [time[first:last] - time[first] for first, last in ends if last - first > 1]
    if not within:
        return float(np.median(np.diff(time))) if time.size > 1 else np.inf
    lines = [np.polynomial.Polynomial.fit(np.arange(one.size), one, 1) for one in within]
    step = float(np.median([line.deriv()(0) for line in lines]))
    off = [np.ptp(one - line(np.arange(one.size))) / one[-1] for one, line in zip(within, lines, strict=True)]
    return 1 / plain_rate(1 / step, float(np.median(off)) / step)


def _scattered(late: Array) -> list[str]:
    """Remark on an envelope whose samples do not fall alike on the onsets, from which they lie ``late`` [s]."""
    if (most := float(np.abs(late - late.mean()).max())) <= SCATTER:
        return []
    why = "its samples do not fall alike on the onsets"
    return [f"latencies are uncertain by {1e3 * most:.2g} ms: {why}; sample the envelope more often"]


def _shifted(cut: Array, shift: Array) -> Array:
    """Motions (..., trial, time) moved later by parts of a sample, by quintic splines through known samples."""
    from scipy.ndimage import shift as moved

    if (np.abs(shift) < NONE).all():
        return cut
    found = cut.copy()
    for place in np.ndindex(cut.shape[:-1]):
        one, by = cut[place], float(shift[place[-1]])
        whole = np.isfinite(one).all()
        found[place] = moved(one, by, order=5, mode="nearest") if whole else _moved_with_holes(one, by)
    return found


def _moved_with_holes(one: Array, by: float) -> Array:
    """A motion (time) moved later by part of a sample; NaN where a sample beside is, and of fewer than 6 known."""
    from scipy.interpolate import make_interp_spline

    place, known = np.arange(one.size), np.isfinite(one)
    if known.sum() < 6:
        return np.full(one.size, np.nan)
    when = np.clip(place - by, *place[known][[0, -1]])
    between = np.interp(place - by, place, known.astype(float)) < 1
    return np.where(between, np.nan, make_interp_spline(place[known], one[known], k=5)(when))


def _refuse_lost(trial: int, start: Array, stop: Array, time: Array, source: str) -> NoReturn:
    """Refuse a recording that does not hold all of a trial."""
    rule = f"must last throughout trial {trial}, {start[trial]:.4g} to {stop[trial]:.4g} s"
    raise RangeError(source, rule, f"{time[0]:.4g} to {time[-1]:.4g} s")


def channels_that_differ(stimulus: xr.Dataset) -> dict[str, float]:
    """Channels whose stimulus is not the same in all trials, and how large they are, if others are the same.

    Parameters
    ----------
    stimulus : Dataset
        Of each trial, of one channel or several.

    Returns
    -------
    dict of float
        By the name of the channel, its standard deviation over that of the largest; none where all channels differ.
    """
    if "whisker" not in stimulus.dims:
        return {}
    known = presented(stimulus.transpose("whisker", "trial", "time", missing_dims="ignore"))
    differ = ~((_likeness(known.values) >= ONE) & (_apart(known.values, known.is_envelope) <= APART))
    size = np.ma.masked_invalid(known.values).std((-2, -1)).filled(0.0)
    names, shares = stimulus.whisker.values.astype(str), size / (size.max() or 1.0)
    return {} if differ.all() else dict(zip(names[differ].tolist(), shares[differ].tolist(), strict=True))


def _likeness(cut: Array) -> Array:
    """Smallest correlation of the stimulus (..., trial, time) of a trial with their mean; 1 of those that rest."""
    each = cut - cut.mean(-1, keepdims=True)
    mean = each.mean(-2, keepdims=True)
    size = np.sqrt((each**2).sum(-1) * (mean**2).sum(-1))
    r: Array = np.divide((each * mean).sum(-1), size, out=np.ones(size.shape), where=size != 0)
    return r.min(-1)


def _apart(cut: Array, is_envelope: bool) -> Array:
    """Largest rms difference of the stimulus (..., trial, time) of a trial from their mean, over the SD of the mean.

    It counts what a correlation does not see: other sizes, trials at rest and, of envelopes, other levels.
    """
    mean = cut.mean(-2, keepdims=True)
    differs = np.sqrt(((cut - mean) ** 2).mean(-1)) if is_envelope else (cut - mean).std(-1)
    size, least = np.broadcast_to(mean.std(-1), differs.shape), ROUNDING * np.abs(cut).max(initial=0.0)
    apart: Array = np.divide(differs, size, out=np.where(differs > least, np.inf, 0.0), where=size > least)
    return apart.max(-1)


def stimulus_in_trials(
    stimulus: xr.Dataset,
    trials: xr.Dataset,
    source: str,
    band: Window | None = None,
    *,
    channels: bool = False,
    spontaneous: Window | None = None,
) -> tuple[xr.Dataset, list[str]]:
    """The stimulus of each trial, as :func:`cut_stimulus` gives it, and as an envelope where it is one.

    Parameters
    ----------
    stimulus, trials, source
        As of :func:`cut_stimulus`.
    band : (float, float), optional
        Band of the carrier [Hz].
    channels : bool
        Whether all channels are wanted, which are taken as they are.
    spontaneous : (float, float), optional
        Window without stimulus, from the onset [s].

    Returns
    -------
    stimulus, remarks
        As of :func:`cut_stimulus`.

    Raises
    ------
    InputError
        As :func:`cut_stimulus` and :func:`vibrissa.study.neurons.stimuli.named_stimulus`; or if the stimulus moves in
        that window.
    """
    cut, remarks = cut_stimulus(stimulus, trials, source)
    known, more = (cut, []) if channels else named_stimulus(cut, source, band)
    refuse_driven(trials, known, spontaneous)
    refuse_moving(stimulus, trials, known, spontaneous)
    return known, [*remarks, *more]
