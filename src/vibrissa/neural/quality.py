"""How good a unit is: signal to noise, refractoriness, rate, and whether it is taken in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import dataset, require

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

Array = NDArray[np.float64]

MAD_TO_SD = 0.6745  # median absolute deviation of a normal distribution over its standard deviation


def snr_smallest(waveforms: ArrayLike, noise: ArrayLike) -> float:
    """Signal to noise as the paper has it: peak-to-peak of the smallest waveform over the rms of the noise.

    Parameters
    ----------
    waveforms : (spike, sample) array
        Waveforms of one unit [V].
    noise : (M,) array
        The filtered trace of the same electrode, without spikes [V].

    Returns
    -------
    float
        The ratio; NaN without a waveform or without noise.
    """
    shapes, trace = _waveforms(waveforms), _noise(noise)
    if not shapes.size or not trace.size:
        return np.nan
    return _over(float(np.ptp(shapes, axis=1).min()), float(np.sqrt(np.mean(trace**2))))


def snr_mean(waveforms: ArrayLike, noise: ArrayLike) -> float:
    """Signal to noise as spike sorters have it: peak-to-peak of the mean waveform over the noise's MAD/0.6745.

    Parameters
    ----------
    waveforms : (spike, sample) array
        Waveforms of one unit [V].
    noise : (M,) array
        The filtered trace of the same electrode [V]; spikes in it hardly change the median.

    Returns
    -------
    float
        The ratio; NaN without a waveform or without noise.
    """
    shapes, trace = _waveforms(waveforms), _noise(noise)
    if not shapes.size or not trace.size:
        return np.nan
    spread = float(np.median(np.abs(trace - np.median(trace)))) / MAD_TO_SD
    return _over(float(np.ptp(shapes.mean(0))), spread)


def _waveforms(waveforms: ArrayLike) -> Array:
    found = np.asarray(waveforms, float)
    if found.ndim != 2 or not np.isfinite(found).all():
        raise InputError("waveforms", "must be finite, one row for each spike", f"shape {found.shape}")
    return found


def _noise(noise: ArrayLike) -> Array:
    found = np.asarray(noise, float)
    if found.ndim != 1 or not np.isfinite(found).all():
        raise InputError("noise", "must be one finite trace", f"shape {found.shape}")
    return found


def _over(signal: float, noise: float) -> float:
    if noise == 0:
        raise InputError("noise", "must not be flat", 0)
    return signal / noise


def refractory_violations(intervals: ArrayLike, period: float = 1e-3) -> float:
    """Share of intervals between spikes below the refractory period; NaN without an interval.

    Parameters
    ----------
    intervals : (N,) array
        Intervals between successive spikes [s].
    period : float
        Refractory period [s].
    """
    found = np.asarray(intervals, float)
    return float(np.mean(found < period)) if found.size else np.nan


def contamination(n_spikes: int, n_violations: int, duration: float, period: float = 1e-3) -> float:
    """Share of a unit's spikes that belong to other neurons, from its refractory violations.

    Foreign spikes that know nothing of each other or of the unit, a share f of all N, give 2 f (1 − f/2) N² τ/T
    violations when each of them may violate with any other spike: f = 1 − √(1 − n T/(N² τ)) (Llobet et al. 2022).

    Parameters
    ----------
    n_spikes, n_violations : int
        Spikes N and pairs n of them closer than the period.
    duration : float
        Time T observed [s].
    period : float
        Refractory period τ [s].

    Returns
    -------
    float
        Between 0 and 1; 1 where there are as many violations as in a Poisson train or more; NaN without a spike.
    """
    if not (duration > 0 and period > 0):
        raise InputError("duration and refractory period", "must be positive (s)", (duration, period))
    if n_spikes == 0:
        return np.nan
    share = n_violations * duration / (n_spikes**2 * period)
    return float(1 - np.sqrt(max(1 - share, 0.0)))


@dataclass(frozen=True, kw_only=True)
class Inclusion:
    """Rules by which units are taken in; the default are the paper's.

    Attributes
    ----------
    min_rate : float
        A unit's rate must be above this [Hz].
    min_snr : float
        A single unit's signal to noise, smallest waveform over rms, must reach this. The paper states no limit; the
        least of its units had 3.1.
    refractory_period : float
        Single units have no intervals below this [s].
    max_violations : float
        Share of intervals below the refractory period that is allowed in a single unit.
    """

    min_rate: float = 1.0
    min_snr: float = 0.0
    refractory_period: float = 1e-3
    max_violations: float = 0.0

    def __post_init__(self) -> None:
        for name in ("min_rate", "min_snr", "refractory_period", "max_violations"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"Inclusion.{name}", "must be zero or positive", getattr(self, name))


def unit_quality(
    spikes: xr.Dataset,
    duration: float,
    *,
    window: str,
    rules: Inclusion | None = None,
    waveforms: Mapping[str, tuple[ArrayLike, ArrayLike]] | None = None,
) -> xr.Dataset:
    """Quality of each unit, and the reason why it is left out.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.spikes.spike_table`. On the session's clock all spikes count; cut into trials,
        those in the trials' windows, and intervals are taken within trials. ``unit_quality`` SU or MU tells single
        from multi-units; multi-units are not judged by refractoriness or signal to noise. Without it, all are single.
    duration : float
        Length of the session or, with trials, of one trial's window [s].
    window : str
        What the rate is taken over, for the record: ``"session"`` or ``"stimulus"``.
    rules : Inclusion, optional
        Default: the paper's.
    waveforms : mapping, optional
        Waveforms (spike, sample) and noise (M,) [V] of units by their name. Values that need them are NaN without.

    Returns
    -------
    Dataset
        ``unit_rate`` [Hz], ``snr_smallest``, ``snr_mean``, ``refractory_violations``, ``contamination``, ``kept`` and
        ``reason`` (unit), empty for units that are kept.

    Raises
    ------
    InputError
        If the window is not one of the two, or the duration is not positive.
    """
    require(spikes, "spike_time", "spike_unit", "unit_name")
    if window not in ("session", "stimulus"):
        raise InputError("window", "must be 'session' or 'stimulus'", repr(window))
    rules = rules or Inclusion()
    names = [str(name) for name in spikes.unit_name.values]
    observed = _observed(spikes, duration)
    rows = [
        _unit(*_intervals(spikes, unit, rules.refractory_period), observed[unit], rules.refractory_period)
        | _snrs((waveforms or {}).get(name))
        for unit, name in enumerate(names)
    ]
    single = _single(spikes)
    reasons = [_reason(row, rules, bool(one)) for row, one in zip(rows, single, strict=True)]
    columns: dict[str, Any] = {key: [row[key] for row in rows] for key in (rows[0] if rows else ())}
    attrs = {"window": window, "duration": duration, "refractory_period": rules.refractory_period}
    kept, reason = np.array([not one for one in reasons], bool), np.array(reasons, str)
    return dataset(attrs, unit_name=np.array(names, str), kept=kept, reason=reason, **columns)


def _single(spikes: xr.Dataset) -> NDArray[np.bool_]:
    """Whether each unit is a single one."""
    if "unit_quality" not in spikes:
        return np.ones(spikes.sizes["unit"], bool)
    quality = spikes.unit_quality.values
    for name, one in zip(spikes.unit_name.values, quality, strict=True):
        if one not in ("SU", "MU"):
            raise InputError(f"quality of unit {name}", "must be SU or MU", repr(str(one)), "rename the labels")
    return np.asarray(quality == "SU")


def _observed(spikes: xr.Dataset, duration: float) -> Array:
    """Time for which each unit was observed [s]."""
    if not 0 < duration < np.inf:
        raise InputError("duration", "must be positive (s)", duration)
    trials = np.full(spikes.sizes["unit"], spikes.attrs.get("n_trials", np.nan) if "spike_trial" in spikes else 1.0)
    if "unit_observed" in spikes:
        trials = spikes.unit_observed.sum("trial").values.astype(float)
    if np.isnan(trials).any():
        raise InputError("spikes in trials", "must tell n_trials", remedy="silent trials count for the rate")
    return trials * duration


def _intervals(spikes: xr.Dataset, unit: int, period: float) -> tuple[int, Array, int]:
    """Spikes of a unit, their intervals within trials [s], and pairs of them closer than the period."""
    mine = spikes.spike_unit.values == unit
    time = spikes.spike_time.values[mine]
    trial = spikes.spike_trial.values[mine] if "spike_trial" in spikes else np.zeros(time.size, int)
    order = np.lexsort([time, trial])
    time, trial = time[order], trial[order]
    intervals = np.diff(time)[np.diff(trial) == 0]
    pairs = sum(
        int((np.arange(one.size) - np.searchsorted(one, one - period, side="right")).sum())
        for one in np.split(time, np.flatnonzero(np.diff(trial)) + 1)
    )
    return time.size, intervals, pairs


def _unit(n_spikes: int, intervals: Array, pairs: int, observed: float, period: float) -> dict[str, float]:
    return {
        "unit_rate": n_spikes / observed if observed > 0 else np.nan,
        "refractory_violations": refractory_violations(intervals, period),
        "contamination": contamination(n_spikes, pairs, observed, period) if observed > 0 and period > 0 else np.nan,
    }


def _snrs(shapes: tuple[ArrayLike, ArrayLike] | None) -> dict[str, float]:
    if shapes is None:
        return {"snr_smallest": np.nan, "snr_mean": np.nan}
    return {"snr_smallest": snr_smallest(*shapes), "snr_mean": snr_mean(*shapes)}


def _reason(row: dict[str, float], rules: Inclusion, single: bool) -> str:
    """All rules that a unit breaks; what was not measured breaks none, but the rate must be known."""
    broken = []
    if not row["unit_rate"] > rules.min_rate:
        broken.append(f"rate {row['unit_rate']:.3g} Hz is not above {rules.min_rate:g} Hz")
    if single and row["refractory_violations"] > rules.max_violations:
        share = f"{100 * row['refractory_violations']:.3g} % of intervals below {1e3 * rules.refractory_period:g} ms"
        broken.append(f"{share}, more than {100 * rules.max_violations:g} %")
    if single and row["snr_smallest"] < rules.min_snr:
        broken.append(f"signal to noise {row['snr_smallest']:.3g} is below {rules.min_snr:g}")
    return "; ".join(broken)
