"""The window without stimulus, for the spontaneous rate: whether it holds none, of this trial or of another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import chi2

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.neural.io.tables.inputs import SHORT
from vibrissa.neural.io.tables.stimuli import Presented, presented
from vibrissa.study.spec.neurons import Window

if TYPE_CHECKING:
    import xarray as xr

STILL = 0.05  # of the SD of the stimuli of all trials, or of the rms of envelopes
NEAR = 1e-3  # of a whole step of time, by which ends of rest may differ by rounding
Meeting = tuple[int, int, Window]  # a trial, another one, and the part of this one's stimulus that lies in its window
QUIET = 0.1  # [s] of stretches of a session, of which the noise of the sensor is found
STRETCHES = 1000  # that are looked at
QUIETEST = 0.05  # share of them that are at rest, at least
LARGE = 1 / 3  # of the size of the stimuli, above which what moves on the session's clock is no noise and no drift
NOISY = 2.0  # times the noise of the sensor up to which it rests
ELSEWHERE = "let it lie where no stimulus moves, or leave it out"


def refuse_driven(spikes: xr.Dataset, stimulus: xr.Dataset, spontaneous: Window | None) -> None:
    """Refuse a window without stimulus that reaches into the stimulus of another trial, where it moves.

    Parameters
    ----------
    spikes : Dataset
        In trials, or the trials; the onsets are known where it has ``trial_start``.
    stimulus : Dataset
        By time from the onset; with the dimension ``trial`` where each trial had its own.
    spontaneous : (float, float), optional
        The window, from the onset [s].

    Raises
    ------
    InputError
        If it reaches into another stimulus by more than 10 ms; says how far, in how many trials, and where rest is.
    """
    if spontaneous is None:
        return
    onset, stimulus = _in_order(spikes, stimulus)
    each, size, reach = _each(stimulus, onset.size), _size(presented(stimulus)), np.zeros(onset.size)
    for trial, other, part in _meetings(onset, _shown(stimulus), spontaneous):
        if _size(each[other], part) > STILL * size:
            reach[trial] += part[1] - part[0]
    if not (reach > 0).any():
        return
    (begin, stop), (first, end), gap = spontaneous, _shown(stimulus), float(np.diff(onset).min())
    found = f"{begin:g} to {stop:g} s, by {reach.max():.4g} s in {(reach > 0).sum()} of {onset.size} trials"
    rest = _whole(end - gap, first + gap, 1000)  # from the end of the stimulus before to the onset of the next
    low, high = max(begin, rest[0]), min(stop, rest[1])
    ends = [f"start it at {low:g} s"] if low > begin else []
    remedy = " and ".join([*ends, f"stop it at {high:g} s"] if high < stop else ends)
    if not low < high:
        remedy = f"no stimulus is there from {rest[0]:g} to {_plain(first)} s" if rest[0] < first else ELSEWHERE
    raise RangeError("spontaneous", "must not reach into the stimulus of another trial", found, remedy)


def refuse_moving(session: xr.Dataset, trials: xr.Dataset, stimulus: xr.Dataset, spontaneous: Window | None) -> None:
    """Refuse a window without stimulus in which a stimulus moves that was recorded on the session's clock.

    It knows the stimuli of all trials, also of those that are left out, and what moved between them.

    Parameters
    ----------
    session : Dataset
        One channel of a stimulus by the session's ``time`` [s].
    trials : Dataset
        See :func:`vibrissa.neural.io.tables.trials.trial_table`.
    stimulus : Dataset
        That of these trials, cut from it: what moves in a trial itself is remarked on elsewhere.
    spontaneous : (float, float), optional
        The window, from the onset [s].

    Raises
    ------
    InputError
        If it moves outside of the trial itself, 10 ms from the ends; says in how many trials, and where it rests.
    """
    whole, known = presented(session), presented(stimulus)
    if spontaneous is None or known.unit == "dB":  # of which no level is known to be rest
        return
    (first, end), (begin, stop) = _shown(stimulus), spontaneous
    size, noise = _size(known), _noise(known._replace(time=whole.time, values=whole.values))
    noise = noise if 2 * noise < size else 0.0  # a stimulus that never rests shows none
    limit, still = max(LARGE * size, NOISY * noise), max(STILL * size, NOISY * noise)
    moves, rest = np.zeros(trials.sizes["trial"], bool), []
    for trial, onset in enumerate(trials.trial_start.values):
        low, high = np.searchsorted(whole.time, onset + np.array([min(begin, first), max(stop, end)]))
        own = known._replace(time=whole.time[low:high] - onset, values=whole.values[low:high])
        outside = (begin + SHORT, min(stop, first) - SHORT), (max(begin, end) + SHORT, stop - SHORT)
        moves[trial] = any(_moves(own, one, limit) for one in outside)
        rest.append(_rest(own, (first, end), still))
    if not moves.any():
        return
    before, after = _whole(max(one[0] for one in rest), min(one[1] for one in rest), round(1 / SHORT))
    rests = [(before, first)] * (begin < first) + [(end, after)] * (stop > end)
    there = " and ".join(f"from {_plain(low)} to {_plain(high)} s" for low, high in rests if high - low > 2 * SHORT)
    found = f"{begin:g} to {stop:g} s, where it moves in {moves.sum()} of {moves.size} trials"
    rule = "must lie where the stimulus on the session's clock rests"
    raise RangeError("spontaneous", rule, found, f"it rests {there}" if there else ELSEWHERE)


def _noise(session: Presented) -> float:
    """Size of a stimulus on the session's clock where it is quietest: the noise of its sensor, if it ever rests."""
    rate = (session.time.size - 1) / (session.time[-1] - session.time[0])
    count = min(max(round(QUIET * rate), 2), session.time.size)
    stretches = session.values[: session.values.size // count * count].reshape(-1, count)
    some = stretches[np.random.default_rng(0).permutation(len(stretches))[:STRETCHES]]
    some = some[np.isfinite(some).all(-1)]
    sizes = np.sqrt((some**2).mean(-1)) if session.is_envelope else some.std(-1)
    quietest = float(np.quantile(sizes, QUIETEST)) if sizes.size else 0.0
    return quietest / float(np.sqrt(chi2.ppf(QUIETEST, count - 1) / count))  # the least of short stretches is too small


def _moves(known: Presented, part: Window, limit: float) -> bool:
    """Whether a stimulus moves in a part of its time: in all of it, but for a drift, or in a short stretch."""
    stretches = [(low, min(low + QUIET, part[1])) for low in np.arange(*part, QUIET)]
    here = (known.time >= part[0]) & (known.time < part[1]) & np.isfinite(known.values)
    time, values = known.time[here], known.values[here]
    if not known.is_envelope and values.size > 2:
        values = values - np.polynomial.Polynomial.fit(time, values, 1)(time)
        return bool(values.std() > limit) or any(_size(known, one) > limit for one in stretches)
    return any(_size(known, one) > limit for one in (part, *stretches))


def _rest(known: Presented, shown: Window, limit: float) -> Window:
    """When a stimulus begins to rest before one that is ``shown``, and until when it rests after it [s]."""
    time, values = known.time, known.values
    earlier, later = np.flatnonzero(time < shown[0])[::-1], np.flatnonzero(time >= shown[1])
    ends = []
    for places, end in ((earlier, shown[0]), (later, shown[1])):
        own = np.nan_to_num(values[places] - (0 if known.is_envelope or not places.size else values[places[0]]))
        count = np.arange(1, own.size + 1)
        offset = 0 if known.is_envelope else np.cumsum(own) / count
        still = np.cumsum(own**2) / count - offset**2 <= limit**2
        ends.append(float(time[places[np.argmin(np.append(still, False)) - 1]]) if still[:1].any() else end)
    return ends[0], ends[1]


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
    known = presented(stimulus)
    if _size(known, spontaneous) > STILL * _size(known):
        lines.append(f"the stimulus moves from {start:g} to {stop:g} s: the rate there is not spontaneous")
    lines += _weak(spikes, stimulus, spontaneous)
    left = np.atleast_1d(spikes.attrs.get("onsets_left_out", []))
    if left.size and "trial_start" in spikes:
        onset, (first, end) = spikes.trial_start.values[:, None], _shown(stimulus)
        meets = (left + first < onset + stop - SHORT) & (left + end > onset + start + SHORT)
        if number := int(meets.any(1).sum()):
            which = f"in {number} of {len(onset)} trials {start:g} to {stop:g} s reaches into one that is left out"
            lines.append(f"{which}: the rate there is spontaneous only if that one had no stimulus")
    return lines


def _weak(spikes: xr.Dataset, stimulus: xr.Dataset, spontaneous: Window) -> list[str]:
    """Remark on stimuli of other trials in the window that are so small that they count as none."""
    onset, stimulus = _in_order(spikes, stimulus)
    each, size = _each(stimulus, onset.size), _size(presented(stimulus))
    sizes = np.array([_size(one) for one in each])
    weak = (sizes > 0) & (sizes <= STILL * size)
    met = [(trial, other) for trial, other, _ in _meetings(onset, _shown(stimulus), spontaneous) if weak[other]]
    if not met:
        return []
    share = 100 * max(sizes[other] for _, other in met) / size
    which = f"in {len({trial for trial, _ in met})} of {onset.size} trials {spontaneous[0]:g} to {spontaneous[1]:g} s"
    return [f"{which} reaches into a stimulus of {share:.2g} % of the size of all: it is taken as none"]


def _in_order(spikes: xr.Dataset, stimulus: xr.Dataset) -> tuple[Array, xr.Dataset]:
    """Onsets of the trials [s], ascending, and the stimulus in their order; none where they are not known, or alike."""
    onset = spikes.trial_start.values if "trial_start" in spikes else np.zeros(0)
    order = np.argsort(onset)
    if not (np.diff(onset[order]) > 0).all():
        order = order[:0]
    ordered = stimulus.isel(trial=order).transpose("trial", "time") if "trial" in stimulus.dims else stimulus
    return onset[order], ordered


def _each(stimulus: xr.Dataset, count: int) -> list[Presented]:
    """The stimulus of each trial."""
    known = presented(stimulus)
    return [known._replace(values=one) for one in known.values] if "trial" in stimulus.dims else [known] * count


def _meetings(onset: Array, shown: Window, spontaneous: Window) -> list[Meeting]:
    """Where the window of a trial meets stimuli of others, each ``shown`` from its onset, by more than 10 ms."""
    found = []
    for trial, low, high in zip(range(onset.size), onset + spontaneous[0], onset + spontaneous[1], strict=True):
        for other in range(np.searchsorted(onset + shown[1], low), np.searchsorted(onset + shown[0], high)):
            part = max(low - onset[other], shown[0]), min(high - onset[other], shown[1])
            if other != trial and part[1] - part[0] > SHORT:
                found.append((trial, other, part))
    return found


def _size(known: Presented, part: Window = (-np.inf, np.inf)) -> float:
    """Size of a stimulus in a part of its time: SD within trials of a motion, rms of an envelope where it is known."""
    within = np.ma.masked_invalid(known.values[..., (known.time >= part[0]) & (known.time < part[1])])
    if not within.count():
        return 0.0
    return float(np.sqrt((within**2 if known.is_envelope else within.var(-1)).mean()))


def _whole(start: float, stop: float, often: int) -> Window:
    """The part of a time that is whole steps, of which a second has so many [s]."""
    return float(np.ceil(often * start - NEAR) / often), float(np.floor(often * stop + NEAR) / often)


def _plain(time: float) -> str:
    """A time [s] to the millisecond, for a message."""
    return f"{round(time, 3) + 0:g}"


def _shown(stimulus: xr.Dataset) -> Window:
    """When a stimulus begins and ends, after the onset [s]."""
    time = stimulus.time.values
    return float(time[0]), float(time[-1] + (time[-1] - time[0]) / (time.size - 1))
