"""Poisson model of a unit: 24 whiskers × latency × its own past, fitted trial by trial and tried on trials not seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, stdtrit

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.neural.bases import raised_cosines
from vibrissa.neural.copies import condition_number
from vibrissa.neural.inputs import refuse_misplaced
from vibrissa.neural.kernel_columns import STRETCH, Columns, KernelAnalysis, unit_design
from vibrissa.neural.poisson import PoissonFit, TrialDesign, log_likelihood, poisson_regression
from vibrissa.neural.response import spike_counts
from vibrissa.quantities import dataset
from vibrissa.stats import adjusted_p_values

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

FEWEST_TRIALS = 10
FEWEST_SPIKES = 3.0  # for each coefficient: with fewer the kernels are penalty rather than data
FOLDS = 5
PENALTIES = (1.0, 10.0, 100.0, 1000.0)  # tried on trials not seen; columns have a variance of 1
PAST_PENALTY = 0.1  # of the unit's own past: refractoriness would want minus infinity


def _penalty(design: TrialDesign, strength: float) -> Array:
    """Nothing on the constant, the strength on the whiskers, next to nothing on the past."""
    q = design.own.shape[2]
    return np.concatenate([[0.0], np.full(design.shared.shape[1] - 1, strength), np.full(q, PAST_PENALTY)])


def unseen(design: TrialDesign, counts: Array, width: float, strength: float) -> float:
    """Share of the deviance of a steady rate that the fit to the other trials takes away, in trials it has not seen.

    Parameters
    ----------
    design, counts, width
        As in :func:`vibrissa.neural.poisson.poisson_regression`.
    strength : float
        Penalty on the whiskers' coefficients.
    """
    fold = np.arange(len(counts)) % FOLDS
    left, steady, start = 0.0, 0.0, None
    for k in range(FOLDS):
        seen = fold != k
        lam = _penalty(design, strength)
        fit = poisson_regression(design.trials(seen), counts[seen], width, penalty=lam, start=start)
        start = fit.coefficients
        own = counts[~seen]
        expected = width * np.exp(design.trials(~seen).log_rate(fit.coefficients))
        perfect = log_likelihood(own, own)
        left += perfect - log_likelihood(own, expected)
        steady += perfect - log_likelihood(own, np.full(own.shape, counts[seen].mean()))
    return 1 - left / steady


def fit_kernels(design: TrialDesign, counts: Array, how: KernelAnalysis) -> tuple[PoissonFit, float, float]:
    """Fit all trials with the penalty that foresees unseen trials best.

    Returns
    -------
    fit : PoissonFit
        Constant, whiskers, own past.
    strength : float
        The penalty.
    told : float
        Share of the deviance explained in trials not seen.
    """
    strengths = PENALTIES if how.penalty is None else (how.penalty,)
    shares = [unseen(design, counts, how.bin_width, strength) for strength in strengths]
    best = int(np.argmax(shares))
    fit = poisson_regression(design, counts, how.bin_width, penalty=_penalty(design, strengths[best]))
    return fit, strengths[best], shares[best]


def whisker_kernels(
    spikes: xr.Dataset, command: xr.Dataset, n_trials: int, how: KernelAnalysis | None = None
) -> xr.Dataset:
    """Kernels over latency of all whiskers, and over the unit's own past, of every unit.

    The logarithm of the rate is a constant plus what the envelopes of all whiskers were at every latency up to the
    reach, plus what the unit itself fired before. Kernels are sums of raised cosines ([Pillow2008]_). Trials are the
    draws for all intervals, and good and bad trials count in them. With a penalty, intervals hold on average over a
    kernel, less at its sharpest turns.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.spikes.spike_table`, times from the stimulus' onset.
    command : Dataset
        ``command`` (whisker, time) [m], as :func:`vibrissa.stimulus.array.replay_command` gives it.
    n_trials : int
        Trials presented, silent ones included.
    how : KernelAnalysis, optional
        Bins, lags, penalty.

    Returns
    -------
    Dataset
        ``whisker_kernel`` (unit, whisker, kernel_lag) [1/m]: rise of ln(rate) for each metre and bin of latency;
        ``whisker_effect`` (unit, whisker) [1/m]: its sum, both with 95 % intervals; ``whisker_p_value`` (adjusted over
        whiskers) and ``whisker_matters``; ``past_kernel`` (unit, past_lag): factor on the rate after a spike;
        ``deviance_explained`` in trials not seen, ``penalty``, ``kernel_rate`` [Hz]; ``reason``. ``kernel_condition``
        is the condition number of the columns.

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together, or there are too few trials.
    """
    how = how or KernelAnalysis()
    one = dataset(time=command.time.values, point_displacement=command.command.isel(whisker=0).values)
    refuse_misplaced(spikes, one, n_trials, window=how.window)
    if n_trials < FEWEST_TRIALS:
        raise InputError(
            "number of trials", f"must be at least {FEWEST_TRIALS}", n_trials, "trials are left out in turn"
        )
    columns = Columns.of(command, how)
    rows = [_row(columns, _counts(spikes, unit, n_trials, columns, how), how) for unit in range(spikes.sizes["unit"])]
    found: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    attrs = {"n_trials": n_trials, "bin_width": how.bin_width, "skip": how.skip, "level": how.level}
    lags, past = how.lags()
    return dataset(
        attrs,
        unit_name=spikes.unit_name.values,
        whisker=np.array(columns.whiskers),
        kernel_lag=lags,
        past_lag=past,
        kernel_condition=condition_number(columns.shared[:, 1:].T),
        **found,
    )


def _counts(spikes: xr.Dataset, unit: int, n_trials: int, columns: Columns, how: KernelAnalysis) -> Array:
    own = spikes.isel(spike=np.flatnonzero(spikes.spike_unit.values == unit))
    n_bins = len(columns.valid)
    counts = spike_counts(own, n_trials=n_trials, start=columns.start, n_bins=n_bins, bin_width=how.bin_width)
    return counts.astype(float)


def _row(columns: Columns, counts: Array, how: KernelAnalysis) -> dict[str, Any]:
    n_whiskers, (lags, past) = len(columns.whiskers), how.lags()
    used = counts[:, columns.valid]
    needed = FEWEST_SPIKES * columns.shared.shape[1]
    if used.sum() < needed:
        text = f"too few spikes: {used.sum():.0f}, below {needed:.0f} for {columns.shared.shape[1]} coefficients"
        return {**_not_measured(n_whiskers, lags.size, past.size), "reason": text}
    design = unit_design(columns, counts, how)
    try:
        fit, strength, told = fit_kernels(design, used, how)
    except ConvergenceError as error:
        return {**_not_measured(n_whiskers, lags.size, past.size), "reason": f"cannot tell: {error}"}
    quantile = float(stdtrit(len(counts) - 1, 0.975))
    row = _kernels(columns, fit, how, quantile) | _past(columns, fit, how, quantile)
    row |= {"deviance_explained": told, "penalty": strength, "kernel_rate": float(used.mean() / how.bin_width)}
    return {
        **row,
        "reason": "" if told > 0 else "cannot tell: unseen trials are foreseen no better than by a steady rate",
    }


def _not_measured(n_whiskers: int, n_lags: int, n_past: int) -> dict[str, Any]:
    ends = ("", "_low", "_high")
    row: dict[str, Any] = {f"whisker_kernel{end}": np.full((n_whiskers, n_lags), np.nan) for end in ends}
    row |= {f"whisker_effect{end}": np.full(n_whiskers, np.nan) for end in ends}
    row |= {"whisker_p_value": np.full(n_whiskers, np.nan), "whisker_matters": np.zeros(n_whiskers, bool)}
    row |= {f"past_kernel{end}": np.full(n_past, np.nan) for end in ends}
    return row | dict.fromkeys(("deviance_explained", "penalty", "kernel_rate"), np.nan)


def _kernels(columns: Columns, fit: PoissonFit, how: KernelAnalysis, quantile: float) -> dict[str, Any]:
    """Kernels of the whiskers [1/m], their sums, and Wald's test of each."""
    count, n_whiskers = columns.shapes.shape[1], len(columns.whiskers)
    sums = columns.shapes.sum(0)
    kernel, error, effect, effect_error, p = [], [], [], [], []
    for k in range(n_whiskers):
        own = slice(1 + k * count, 1 + (k + 1) * count)
        b, covariance = fit.coefficients[own], fit.trial_covariance[own, own]
        kernel.append(columns.shapes @ b)
        error.append(np.sqrt(np.einsum("jc,cd,jd->j", columns.shapes, covariance, columns.shapes)))
        effect.append(sums @ b)
        effect_error.append(np.sqrt(sums @ covariance @ sums))
        p.append(float(chdtrc(count, b @ np.linalg.solve(covariance, b))))
    adjusted = adjusted_p_values(np.array(p))
    row = _ends("whisker_kernel", np.array(kernel) / columns.spread, quantile * np.array(error) / columns.spread)
    row |= _ends(
        "whisker_effect", np.array(effect) / columns.spread, quantile * np.array(effect_error) / columns.spread
    )
    return row | {"whisker_p_value": adjusted, "whisker_matters": adjusted <= how.level}


def _past(columns: Columns, fit: PoissonFit, how: KernelAnalysis, quantile: float) -> dict[str, Any]:
    """Factor on the rate at each lag after a spike; the interval is that of its logarithm."""
    lags = how.lags()[1]
    if not lags.size:
        return {f"past_kernel{end}": np.empty(0) for end in ("", "_low", "_high")}
    shapes, first = raised_cosines(lags, how.past_shapes, stretch=STRETCH), columns.shared.shape[1]
    covariance = fit.trial_covariance[first:, first:]
    value = shapes @ fit.coefficients[first:]
    error = np.sqrt(np.einsum("jc,cd,jd->j", shapes, covariance, shapes))
    return {name: np.exp(one) for name, one in _ends("past_kernel", value, quantile * error).items()}


def _ends(name: str, value: Array, half: Array) -> dict[str, Array]:
    return {name: value, f"{name}_low": value - half, f"{name}_high": value + half}
