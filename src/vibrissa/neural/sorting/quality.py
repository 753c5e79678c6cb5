"""Quality of sorted units: rate, refractoriness, and whether a unit passes for a single unit.

SpikeInterface has the same two metrics, but takes an interval as long as the refractory period for a violation, which
sorters with a dead time of that length leave by the hundred; here it is none, whatever the rounding of the times.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import require_positive
from vibrissa.neural.io.tables.inputs import require_session_clock
from vibrissa.neural.simulated.refractoriness import ROUNDING, below
from vibrissa.quantities import dataset

PERIOD = 1e-3  # [s] below which a single unit has no interval, as in the paper
MIN_RATE = 1.0  # [Hz] above which a unit is taken in, as in the paper


def unit_quality(spikes: xr.Dataset, duration: float, *, period: float = PERIOD) -> xr.Dataset:
    """Quality of each unit, and the reason why it is no single unit by the paper's rules.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, on the session's clock.
    duration : float
        Length of the session [s].
    period : float
        Refractory period [s].

    Returns
    -------
    Dataset
        ``unit_rate`` [Hz], ``refractory_violations`` (share of the intervals), ``contamination``, ``kept`` and
        ``reason`` (unit), which is empty for units that are kept.

    Raises
    ------
    InputError
        If the spikes are in trials, or a time is not positive.
    """
    require_session_clock(spikes)
    require_positive("duration", duration, "s")
    require_positive("refractory period", period, "s")
    trains = [np.sort(spikes.spike_time.values[spikes.spike_unit.values == k]) for k in range(spikes.sizes["unit"])]
    short = [np.mean(below(np.diff(one), period)) if one.size > 1 else np.nan for one in trains]
    rate = np.array([one.size / duration for one in trains])
    reason = [_reason(float(one), float(share), period) for one, share in zip(rate, short, strict=True)]
    return dataset(
        {"window": "session", "duration": duration, "refractory_period": period},
        unit_name=spikes.unit_name.values.astype(str),
        unit_rate=rate,
        refractory_violations=np.array(short, float),
        contamination=[contamination(one.size, _pairs(one, period), duration, period) for one in trains],
        kept=np.array([not one for one in reason], bool),
        reason=np.array(reason, str),
    )


def contamination(n_spikes: int, n_violations: int, duration: float, period: float = PERIOD) -> float:
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
    if n_spikes == 0:
        return np.nan
    share = n_violations * duration / (n_spikes**2 * period)
    return float(1 - np.sqrt(max(1 - share, 0.0)))


def _pairs(time: Array, period: float) -> int:
    """Pairs of spikes closer than the period, neighbours or not; times ascend [s]."""
    first = np.searchsorted(time, time - (period - ROUNDING), side="right")
    return int((np.arange(time.size) - first).sum())


def _reason(rate: float, violations: float, period: float) -> str:
    """All rules that a unit breaks; intervals that were not measured break none."""
    broken = []
    if not rate > MIN_RATE:
        broken.append(f"rate {rate:.3g} Hz is not above {MIN_RATE:g} Hz")
    if violations > 0:
        broken.append(f"{100 * violations:.3g} % of intervals below {1e3 * period:g} ms, more than 0 %")
    return "; ".join(broken)
