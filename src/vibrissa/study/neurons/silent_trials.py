"""Trials without a spike of any unit, which may not have been presented."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Integers

if TYPE_CHECKING:
    import xarray as xr

RARE = 0.01  # expected number of silent trials below which those that there are may not be chance
NAMED = 6  # runs of silent trials that are named


def silent_trials(spikes: xr.Dataset, n_trials: int) -> list[str]:
    """Remark on trials without a spike of any unit, which count as presented.

    The first and the last are always named where a unit was observed. Those between others are named where so few are
    expected by chance that they may be lost. Counts of all units in a trial are taken as negative binomial, with the
    mean m and the variance (1 + x) m of the trials that hold spikes, Poisson at the least: a trial is silent with
    probability (1 + x)^(−m/x), and n of them are expected to hold fewer than 0.01 silent ones.

    Parameters
    ----------
    spikes : Dataset
        In trials. Between others, trials in which not all units were observed are not looked at.
    n_trials : int
        Presentations.

    Returns
    -------
    list of str
        A sentence each.
    """
    lines, trial = [], spikes.spike_trial.values.astype(int)
    last = int(trial.max(initial=0))
    count = np.bincount(trial[trial >= 0], minlength=int(n_trials))
    seen = np.ones((1, count.size), bool)
    if "unit_observed" in spikes and spikes.sizes["trial"] == count.size:
        seen = spikes.unit_observed.transpose("unit", "trial").values.astype(bool)
    if seen[:, last + 1 :].any():
        lines.append(
            f"the last {n_trials - 1 - last} of {n_trials} trials hold no spike of any unit: were they presented?"
        )
    if 0 not in trial and n_trials > 1 and seen[:, 0].any():
        lines.append("trial 0 holds no spike of any unit; trials count from 0")
    whole, place = seen.all(0), np.arange(count.size)
    silent = np.flatnonzero(whole & (count == 0) & (place > trial.min(initial=last)) & (place < last))
    if silent.size and _expected(count[whole & (count > 0)], int(whole.sum())) < RARE:
        lines.append(
            f"{_named(silent)} no spike of any unit: {'was it' if silent.size == 1 else 'were they'} presented?"
        )
    return lines


def _expected(counts: Integers, n_trials: int) -> float:
    """Silent trials that are expected of so many, from the counts of those that hold spikes."""
    if counts.size < 2:
        return np.inf
    mean = counts.mean()
    more = max(float(counts.var(ddof=1) / mean) - 1, 1e-9)
    return float(n_trials * np.exp(-mean * np.log1p(more) / more))


def _named(trials: Integers) -> str:
    """Trials by their numbers, runs of three and more from the first to the last: ``trials 5, 6 and 11 to 13 hold``."""
    runs = np.split(trials, np.flatnonzero(np.diff(trials) > 1) + 1)
    parts = [
        part for run in runs for part in ([f"{run[0]} to {run[-1]}"] if run.size > 2 else [str(one) for one in run])
    ]
    if len(parts) > NAMED:
        return f"{trials.size} trials between others ({', '.join(parts[:NAMED])}, …) hold"
    if trials.size == 1:
        return f"trial {parts[0]} holds"
    return f"trials {' and '.join(filter(None, [', '.join(parts[:-1]), parts[-1]]))} hold"
