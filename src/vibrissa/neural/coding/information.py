"""Information of spikes about the stimulus: bits of a spike and of the count in a bin, corrected for few trials."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.special import xlogy

from vibrissa.arrays import Array, Integers
from vibrissa.errors import FormatError, RangeError, ShapeError, TooFewError, require_positive
from vibrissa.loops import njit
from vibrissa.neural.coupling.response import UnitCounts, bin_edges
from vibrissa.neural.io.tables.inputs import refuse_beyond_recording, require_whole
from vibrissa.neural.io.tables.spikes import NOT_OBSERVED
from vibrissa.quantities import dataset, require, stacked
from vibrissa.stats import jackknife_half_width

Estimator = Callable[[Integers, int], float]  # of cases added over trials, and their number

ENDS = ("_plain", "", "_extrapolated", "_low", "_high")  # in the order of Information
MEASURES = ("spike_information", "information_rate", "count_information")
FEWEST_TRIALS = 32  # below them both corrections of the count's information are too high, by a fifth at 16 trials
SHUFFLES = 4  # of the bins of every trial, whose information is that of none
FEWEST_SPIKES = 1.0  # for each bin, summed over trials: below, bits for each spike are a fifth too high


class Information(NamedTuple):
    """Information as counted, as corrected, and its interval.

    Attributes
    ----------
    plain : float
        As counted [bit]: too large, the more so the fewer the spikes.
    corrected : float
        By the analytical correction of Panzeri and Treves [bit]; may be below 0.
    extrapolated : float
        By a parabola in 1/trials through all trials, halves and quarters [bit]; NaN below 8 trials.
    low, high : float
        95 % interval [bit]: half its width is from leaving out one trial at a time, and it reaches that far beyond both
        of the corrected values, which differ where trials are too few for either, and beyond a third one of the count,
        of which the information of shuffled bins is taken off; NaN for one trial.
    """

    plain: float
    corrected: float
    extrapolated: float
    low: float
    high: float


def spike_information(counts: Integers) -> Information:
    """Information of the arrival of one spike about the time in the stimulus.

    The direct estimate of [Brenner2000]_: mean over time of (r/r̄) log₂(r/r̄), with r the firing rate of repeated
    presentations. It takes no model and no description of the stimulus; information in patterns of spikes beyond, or
    below, the sum of their spikes is left out. Modulation faster than a bin is not seen.

    Parameters
    ----------
    counts : (N, K) array of int
        Spikes of each trial and bin; bins of one width.

    Returns
    -------
    Information
        Bits for each spike.

    Raises
    ------
    InputError
        If there is no spike, or one bin alone.
    """
    _refuse(counts)
    return _estimated(counts, lambda cases, n: _plain_spike(cases), lambda cases, n: _corrected_spike(cases))


def information_rate(counts: Integers, width: float) -> Information:
    """Information rate about the time in the stimulus if spikes are independent: bits for each spike times rate.

    Parameters
    ----------
    counts : (N, K) array of int
        Spikes of each trial and bin.
    width : float
        Width of a bin [s].

    Returns
    -------
    Information
        [bit/s]; the rate enters the interval, as it differs between trials too.

    Raises
    ------
    InputError
        As :func:`spike_information`, or if the width is not positive.
    """
    _refuse(counts)
    require_positive("bin width", width, "s")

    def times_rate(estimate: Callable[[Integers], float]) -> Estimator:
        return lambda cases, n: estimate(cases) * float(cases.mean()) / (n * width)

    return _estimated(counts, times_rate(_plain_spike), times_rate(_corrected_spike))


def count_information(counts: Integers, classes: Integers | None = None) -> Information:
    """Mutual information of the count in a bin and the time in the stimulus, or the stimulus' class there.

    Plug-in entropies of the count, over all and within each class, with the correction of [Panzeri2007]_; the
    extrapolation is that of [Strong1998]_. Divided by the bin's width it is a rate if bins were independent: spikes
    that depend on each other give the whole train more or less.

    Parameters
    ----------
    counts : (N, K) array of int
        Spikes of each trial and bin.
    classes : (K,) array of int, optional
        Class of the stimulus in each bin, from 0, such as its envelope in eighths; every bin its own by default. Bins
        of one class count as independent, which their likeness in time makes too hopeful.

    Returns
    -------
    Information
        Bits for each bin.

    Raises
    ------
    InputError
        If there is no spike, a bin alone, or classes are not one for each bin.
    """
    _refuse(counts)
    of = np.arange(counts.shape[1]) if classes is None else np.asarray(classes)
    if of.shape != counts.shape[1:] or not np.issubdtype(of.dtype, np.integer) or of.min() < 0:
        raise ShapeError("classes", f"must be whole numbers from 0, one for each of the {counts.shape[1]} bins", of)
    tables, rng = _tables(counts, of), np.random.default_rng(0)
    none = [_plain_count(_tables(rng.permuted(counts, axis=1), of).sum(0)) for _ in range(SHUFFLES)]
    third = _plain_count(tables.sum(0)) - float(np.mean(none))
    return _estimated(tables, lambda cases, n: _plain_count(cases), lambda cases, n: _corrected_count(cases), third)


def _tables(counts: Integers, of: Integers) -> Integers:
    """How often each count occurs in each class, of every trial (N, classes, counts)."""
    tables = np.zeros((len(counts), (int(of.max()) + 1), int(counts.max()) + 1), int)
    np.add.at(tables, (np.arange(len(counts))[:, None], of, counts), 1)
    return tables[:, tables.any((0, 2))]


def unit_information(
    spikes: xr.Dataset, n_trials: int, *, window: tuple[float, float], bin_width: float = 0.01
) -> xr.Dataset:
    """Information of every unit: bits for each spike, for each second, and of the count in a bin.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, in trials; each unit counts in those in which it
        was observed.
    n_trials : int
        Trials presented, silent ones included.
    window : (float, float)
        Part of the stimulus [s] that is analysed; leave out the onset, where units adapt.
    bin_width : float
        Width of the bins [s], which must divide the window.

    Returns
    -------
    Dataset
        ``spike_information`` [bit], ``information_rate`` [bit/s] and ``count_information`` [bit] (unit), each also as
        ``_plain``, ``_extrapolated``, ``_low`` and ``_high`` (:class:`vibrissa.neural.coding.information.Information`);
        ``unit_rate``; ``informative``, where the interval of the bits of a spike lies above 0, and
        ``count_informative``, that of the count; ``spike_reason`` where bits of a spike cannot be estimated, ``reason``
        where any of them cannot.

    Raises
    ------
    InputError
        If there are no trials in the table, the bins do not fill the window or are more than a million.
    """
    require(spikes, "spike_time", "spike_trial", "spike_unit", "unit_name")
    require_whole("number of trials", n_trials)
    if n_trials < 2:
        remedy = "repeats are needed; of one presentation `glm`, and of a motion `drives`, give bits per spike"
        raise RangeError("number of trials", "must be at least 2", n_trials, remedy)
    refuse_beyond_recording(spikes, window)
    counts = UnitCounts.of(spikes, n_trials, bin_edges(*window, bin_width), bin_width, partial=True)
    if not counts.totals.any():
        time = spikes.spike_time.values
        found = f"{time.size} from {time.min():g} to {time.max():g} s" if time.size else "none"
        rule = f"must have one in the window at least, {window[0]:g} to {window[1]:g} s"
        raise RangeError("spikes", rule, found, "times are in seconds from the onset of each trial")
    rows = [_unit_row(own, bin_width) for own in counts]
    return dataset(
        {"n_trials": n_trials, "bin_width": bin_width, "window": np.array(window, float)},
        unit_name=spikes.unit_name.values,
        unit_rate=counts.rates().mean(1),
        **stacked(rows),
    )


def _unit_row(counts: Integers, width: float) -> dict[str, Any]:
    """Information of one unit; NaN where there are too few spikes or trials."""
    if counts.any():
        found = spike_information(counts), information_rate(counts, width), count_information(counts)
    else:
        found = (Information(*[np.nan] * 5),) * 3
    row: dict[str, Any] = {
        name + end: value
        for name, one in zip(MEASURES, found, strict=True)
        for end, value in zip(ENDS, one, strict=True)
    }
    row["spike_reason"] = _too_few_spikes(counts)
    row["reason"] = row["spike_reason"] or _too_few_trials(counts)
    row["informative"] = not row["spike_reason"] and row["spike_information_low"] > 0
    row["count_informative"] = not row["reason"] and row["count_information_low"] > 0
    return row


def _too_few_spikes(counts: Integers) -> str:
    """Reason against all measures; empty if there is none."""
    if not len(counts):
        return NOT_OBSERVED
    if counts.sum() / counts.shape[1] >= FEWEST_SPIKES:
        return ""
    return f"cannot tell: {counts.sum()} spikes in {counts.shape[1]} bins, fewer than one for each; wider bins"


def _too_few_trials(counts: Integers) -> str:
    """Reason against the bits of the count alone; empty if there is none."""
    if len(counts) >= FEWEST_TRIALS:
        return ""
    return f"cannot tell bits of the count: {len(counts)} trials, fewer than {FEWEST_TRIALS}"


def _refuse(counts: Integers) -> None:
    if counts.ndim != 2 or not np.issubdtype(counts.dtype, np.integer) or counts.min(initial=0) < 0:
        raise FormatError("counts", "must be whole numbers from 0, (trials, bins)", f"{counts.dtype} {counts.shape}")
    if counts.shape[1] < 2:
        raise RangeError("bins", "must be at least 2", counts.shape[1])
    if not counts.any():
        raise TooFewError("counts", "must hold a spike", 0)


def _estimated(cases: Integers, plain: Estimator, corrected: Estimator, third: float = np.nan) -> Information:
    """From the cases of each trial (N, ...)."""
    n, total = len(cases), cases.sum(0)
    found, further = corrected(total, n), _extrapolated(cases, plain)
    half, every = _half_width(cases, corrected), [found, further, third]
    return Information(plain(total, n), found, further, np.nanmin(every) - half, np.nanmax(every) + half)


def _half_width(cases: Integers, statistic: Estimator) -> float:
    """Of the 95 % interval, from leaving out one trial at a time; where that leaves no spike, 0 bit."""
    n, total = len(cases), cases.sum(0)
    if n < 2:
        return np.nan
    parts = np.array([statistic(total - one, n - 1) if (total - one).any() else 0.0 for one in cases])
    return float(jackknife_half_width(parts, parts.mean()))


def _extrapolated(cases: Integers, plain: Estimator) -> float:
    """Value at 1/trials = 0 of the parabola through all trials, their halves and their quarters."""
    if len(cases) < 8:
        return np.nan
    parts = {ways: [cases[k::ways] for k in range(ways)] for ways in (1, 2, 4)}
    if not all(some.any() for some in parts[4]):
        return np.nan
    means = [float(np.mean([plain(some.sum(0), len(some)) for some in parts[ways]])) for ways in (1, 2, 4)]
    return float(np.linalg.solve(np.vander([1.0, 2.0, 4.0], 3, increasing=True), np.array(means))[0])


def _entropy(weights: Array) -> float:
    """Entropy [bit] of counted weights over the last axis, averaged over the others by their weight."""
    total = weights.sum(-1)
    return float((xlogy(total, total).sum() - xlogy(weights, weights).sum()) / (np.log(2) * total.sum()))


def _plain_spike(in_bin: Integers) -> float:
    return float(np.log2(in_bin.size)) - _entropy(in_bin.astype(float))


def _corrected_spike(in_bin: Integers) -> float:
    return _plain_spike(in_bin) - (_relevant(in_bin) - 1) / (2 * np.log(2) * float(in_bin.sum()))


def _plain_count(table: Integers) -> float:
    """Information [bit] of a (classes, counts) table of cases."""
    return _entropy(table.sum(0).astype(float)) - _entropy(table.astype(float))


def _corrected_count(table: Integers) -> float:
    within = sum(_relevant(row) - 1 for row in table)
    surplus = within - (_relevant(table.sum(0)) - 1)
    return _plain_count(table) - surplus / (2 * np.log(2) * float(table.sum()))


@njit(cache=True)
def _relevant(cases: Integers) -> float:  # pragma: no cover - compiled
    """Outcomes that can occur, those not met in these cases included: Bayesian estimate of Panzeri and Treves (1996).

    Outcomes not met are added, each as likely as the others not met, until as many are expected to be met as were.
    """
    total, met = cases.sum(), (cases > 0).sum()
    expected = 0.0
    for n in cases:
        if n > 0:
            expected += 1 - (1 - n / total) ** total
    nearest, found, added = abs(met - expected), float(met), 0
    while met + added < cases.size:
        added += 1
        unmet = added * (1 - (total / (total + met)) ** (1 / total))  # probability of what was not met
        expected = added * (1 - (1 - unmet / added) ** total)
        for n in cases:
            if n > 0:
                expected += 1 - (1 - (1 - unmet) * (n + 1) / (total + met)) ** total
        if abs(met - expected) >= nearest:
            break
        nearest, found = abs(met - expected), float(met + added)
    return found
