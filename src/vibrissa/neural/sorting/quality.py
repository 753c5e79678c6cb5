"""Quality of units: class, rate, refractoriness, signal to noise, stability, and which are kept by which rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import RangeError, require_not_negative, require_positive
from vibrissa.neural.sorting.observed import Train, observed_for, trains_of
from vibrissa.neural.sorting.refractory import (
    Dead,
    clock_step,
    contamination,
    contamination_interval,
    dead_time,
    violating_pairs,
    violating_share,
)
from vibrissa.neural.sorting.stability import amplitude_change, presence_ratio, rate_change
from vibrissa.neural.sorting.waveform_snr import unit_snr
from vibrissa.quantities import dataset

PERIOD = 1e-3  # [s] below which a single unit has no interval, as in the paper
LEAST_RATE = 1.0  # [Hz] above which a unit is taken in, as in the paper
PAPER_SNR = 3.1  # least of the paper's units
MERGED = 0.1  # contamination above which, with 95 % confidence, a unit is a merged cluster
GOOD, MUA, UNLABELLED = "good", "mua", "unlabelled"
LABELS = {
    **dict.fromkeys(("good", "su", "single", "single unit"), GOOD),
    **dict.fromkeys(("mua", "mu", "multi", "multi-unit", "multiunit", "multi unit"), MUA),
    **dict.fromkeys(("", "unsorted", "unlabelled", "unlabeled", "unknown", "none", "nan", "n/a"), UNLABELLED),
}


@dataclass(frozen=True, kw_only=True)
class Inclusion:
    """Rules by which units are kept; multi-units are exempt from refractoriness.

    Attributes
    ----------
    refractory_period : float
        Refractory period [s].
    least_rate : float
        Rate above which a unit is kept [Hz].
    most_violations : float
        Largest share of intervals below the period.
    most_contamination : float, optional
        Largest share of foreign spikes.
    least_snr : float, optional
        Least signal to noise.
    least_presence : float, optional
        Least share of the recording in which a unit fires.
    most_change : float, optional
        Largest change of rate, and of amplitude where it is known, from start to end, over the mean, of either sign.
    need_measured : bool
        Whether a unit is left out for which one of these rules was given but not measured.
    """

    refractory_period: float = PERIOD
    least_rate: float = LEAST_RATE
    most_violations: float = 0.0
    most_contamination: float | None = None
    least_snr: float | None = None
    least_presence: float | None = None
    most_change: float | None = None
    need_measured: bool = False

    def __post_init__(self) -> None:
        require_positive("refractory_period", self.refractory_period, "s")
        if self.refractory_period > 0.1:
            raise RangeError("refractory_period", "must be at most 0.1 s", self.refractory_period, "give it in seconds")
        for name in ("least_rate", "least_snr", "most_change"):
            if (value := getattr(self, name)) is not None:
                require_not_negative(name, value)
        for name in ("most_violations", "most_contamination", "least_presence"):
            if (value := getattr(self, name)) is not None and not 0 <= value <= 1:
                raise RangeError(name, "must be from 0 to 1", value, "give a share: 0.05 for 5 %")


PAPER = Inclusion()


def unit_quality(spikes: xr.Dataset, duration: float | None = None, *, rules: Inclusion = PAPER) -> xr.Dataset:
    """Quality of each unit, and the reasons why it is left out, by the paper's rules or others.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, on the session's clock; those with intervals of
        observation are judged within them.
    duration : float, optional
        Length of the session [s]; see :func:`vibrissa.neural.sorting.observed.observed_for`.
    rules : Inclusion
        Rules by which units are kept; by default those of the paper.

    Returns
    -------
    Dataset
        On (unit): ``unit_name``, ``unit_class``, ``unit_rate`` [Hz], ``time_observed`` [s], ``unit_snr``,
        ``snr_source``, ``snr_smallest`` and ``snr_mean`` where either is known, ``refractory_violations`` (share of the
        intervals), ``contamination`` with ``_low`` and ``_high``, ``presence_ratio``, ``rate_change``,
        ``amplitude_change``, ``merged`` (several waveforms, or a contamination of more than a tenth with 95 %
        confidence; never of multi-units), ``kept``, and ``reason``, which
        is empty for units that are kept. NaN where something is not measured.

    Raises
    ------
    InputError
        If the spikes are in trials, or the duration does not fit them.
    """
    seen = observed_for(spikes, duration)
    trains = trains_of(seen)
    step = _step(seen, trains)
    dead = dead_time(rules.refractory_period, step)
    classes = classes_of(seen)
    snr = unit_snr(seen)
    measured: dict[str, Any] = {
        **_of_trains(trains, dead),
        **_stability(seen, trains),
        **snr.measured,
        "unit_snr": snr.snr,
    }
    groups = seen.waveform_groups.values if "waveform_groups" in seen else np.ones(len(trains))
    numbers = {**measured, "waveform_groups": groups}
    each = [{name: float(values[k]) for name, values in numbers.items()} for k in range(len(trains))]
    reasons = [_reason(kind, found, rules) for kind, found in zip(classes, each, strict=True)]
    merged = (groups > 1) | (measured["contamination_low"] > MERGED)
    length = max((train.duration for train in trains), default=0.0)
    attrs = {
        "window": seen.attrs["window"],
        "duration": length,
        "refractory_period": rules.refractory_period,
        "clock_step": step,
        "refractory_limit": dead.limit,
        **{name: seen.attrs[name] for name in ("snr_absent",) if name in seen.attrs},
    }
    return dataset(
        attrs | {f"rule_{name}": float(value) for name, value in vars(rules).items() if value is not None},
        unit_name=seen.unit_name.values.astype(str),
        unit_class=np.array(classes, str),
        snr_source=np.array(snr.source, str),
        **measured,
        merged=merged & (np.array(classes, str) != MUA),
        kept=np.array([not one for one in reasons], bool),
        reason=np.array(reasons, str),
    )


def remarks_on_quality(quality: xr.Dataset) -> list[str]:
    """What a reader should know of a table of quality: units kept in each class, and what was not asked for.

    Parameters
    ----------
    quality : Dataset
        From :func:`unit_quality`.

    Returns
    -------
    list of str
        A sentence each.
    """
    classes, kept = quality.unit_class.values.astype(str), quality.kept.values.astype(bool)
    order = sorted(set(classes.tolist()), key=lambda one: ([GOOD, MUA, UNLABELLED, one].index(one), one))
    shares = [f"{kept[classes == one].sum()} of {(classes == one).sum()} {one}" for one in order]
    lines = [f"kept: {', '.join(shares)} ({100 * kept.mean():.3g} % of all)"] if kept.size else []
    snr = quality.unit_snr.values
    low = int((snr[kept] < PAPER_SNR).sum())
    if low and "rule_least_snr" not in quality.attrs:
        lines.append(
            f"kept units with an SNR below {PAPER_SNR:g}, the least of the paper's: {low}; `least_snr` sets a limit"
        )
    if absent := int(np.isnan(snr).sum()):
        why = quality.attrs.get("snr_absent", "their file has neither it nor waveforms")
        lines.append(f"units whose SNR is not measured: {absent}; {why}")
    if (effective := quality.attrs["refractory_limit"]) == 0:
        lines.append("times are too coarse for the refractory period: violations are not measured")
    elif effective < quality.attrs["refractory_period"] * (1 - 1e-6):
        step = quality.attrs["clock_step"]
        lines.append(
            f"intervals below {1e3 * effective:.4g} ms count as violations: whole steps of {1e6 * step:.4g} µs"
        )
    return lines


def classes_of(spikes: xr.Dataset) -> list[str]:
    """Class of each unit: good, mua, unlabelled, or another label of its file.

    Parameters
    ----------
    spikes : Dataset
        With ``unit_label`` or ``unit_quality``, where its file states one.

    Returns
    -------
    list of str
        One for each unit.
    """
    name = next((one for one in ("unit_label", "unit_quality") if one in spikes), None)
    said = [""] * spikes.sizes["unit"] if name is None else [str(one).strip() for one in spikes[name].values]
    return [LABELS.get(one.lower(), one) for one in said]


def _step(spikes: xr.Dataset, trains: list[Train]) -> float:
    """Step of the clock on which the spikes are [s]; 0 where none is known or found."""
    if width := spikes.attrs.get("counted_bin"):
        return float(width)
    if rate := spikes.attrs.get("sampling_rate"):
        return 1 / float(rate)
    return clock_step(np.concatenate([*(np.diff(train.time) for train in trains), np.zeros(0)]))


def _of_trains(trains: list[Train], dead: Dead) -> dict[str, Array]:
    """Rates and refractoriness."""
    counts = [(one.time.size, violating_pairs(one.time, dead), one.duration, dead.effective) for one in trains]
    ends = np.array([contamination_interval(*count) for count in counts]).reshape(-1, 2)
    return {
        "unit_rate": np.array([one.time.size / one.duration if one.duration > 0 else np.nan for one in trains]),
        "time_observed": np.array([one.duration for one in trains]),
        "refractory_violations": np.array([violating_share(one.time, dead) for one in trains]),
        "contamination": np.array([contamination(*count) for count in counts]),
        "contamination_low": ends[:, 0],
        "contamination_high": ends[:, 1],
    }


def _stability(spikes: xr.Dataset, trains: list[Train]) -> dict[str, Array]:
    """Presence and drift."""
    known = spikes.spike_amplitude.values if "spike_amplitude" in spikes else np.full(spikes.sizes["spike"], np.nan)
    drift = [amplitude_change(one.elapsed, known[one.place], one.duration) for one in trains]
    return {
        "presence_ratio": np.array([presence_ratio(one.elapsed, one.duration) for one in trains]),
        "rate_change": np.array([rate_change(one.elapsed, one.duration) for one in trains]),
        "amplitude_change": np.array(drift),
    }


def _reason(kind: str, found: dict[str, float], rules: Inclusion) -> str:
    """All rules that a unit breaks."""
    if kind not in (GOOD, MUA, UNLABELLED):
        return f"labelled {kind}"
    broken = _broken(found, rules, refractory=kind != MUA)
    if rules.need_measured:
        broken += [f"{words} is not measured" for words, values in _asked(found, rules).items() if np.isnan(values)]
    return "; ".join(broken)


def _broken(found: dict[str, float], rules: Inclusion, *, refractory: bool) -> list[str]:
    """Rules that the numbers of a unit break; NaN, which is not measured, breaks none."""
    rate, share = found["unit_rate"], found["refractory_violations"]
    broken = [f"rate {rate:.3g} Hz is not above {rules.least_rate:g} Hz"] * bool(rate <= rules.least_rate)
    if refractory and share > rules.most_violations:
        most = f"more than {100 * rules.most_violations:g} %"
        broken.append(f"{100 * share:.3g} % of intervals below {1e3 * rules.refractory_period:g} ms, {most}")
    if refractory and found["waveform_groups"] > 1:
        broken.append(f"waveforms of {found['waveform_groups']:.0f} groups, a merged cluster")
    most_foreign = rules.most_contamination
    if refractory and most_foreign is not None and found["contamination"] > most_foreign:
        broken.append(f"contamination {100 * found['contamination']:.3g} % is above {100 * most_foreign:g} %")
    if rules.least_snr is not None and found["unit_snr"] < rules.least_snr:
        broken.append(f"SNR {found['unit_snr']:.3g} is below {rules.least_snr:g}")
    if rules.least_presence is not None and found["presence_ratio"] < rules.least_presence:
        broken.append(f"fires in {100 * found['presence_ratio']:.3g} % of the recording, less than "
                      f"{100 * rules.least_presence:g} %")  # fmt: skip
    for name in ("rate", "amplitude"):
        if rules.most_change is not None and abs(change := found[f"{name}_change"]) > rules.most_change:
            broken.append(f"{name} changes by {100 * change:+.3g} %, more than {100 * rules.most_change:g} %")
    return broken


def _asked(found: dict[str, float], rules: Inclusion) -> dict[str, Any]:
    """Values for which a rule was given."""
    pairs = (
        ("SNR", "unit_snr", rules.least_snr),
        ("contamination", "contamination", rules.most_contamination),
        ("presence", "presence_ratio", rules.least_presence),
        ("change of rate", "rate_change", rules.most_change),
        ("change of amplitude", "amplitude_change", rules.most_change),
    )
    return {words: found[name] for words, name, rule in pairs if rule is not None}
