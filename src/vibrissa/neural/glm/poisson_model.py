"""Poisson model of a unit: 24 whiskers × latency × its own past, fitted and tried on trials or blocks not seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.special import kl_div, stdtrit

from vibrissa.arrays import Array, Integers
from vibrissa.errors import ConvergenceError, TooFewError
from vibrissa.neural.coupling.response import UnitCounts
from vibrissa.neural.coupling.stimulus_blocks import guard_bins, independent_blocks
from vibrissa.neural.glm.bases import raised_cosines
from vibrissa.neural.glm.delayed_envelopes import condition_number
from vibrissa.neural.glm.kernel_columns import STRETCH, Columns, KernelAnalysis, unit_design
from vibrissa.neural.glm.poisson import PoissonFit, poisson_regression
from vibrissa.neural.glm.shift_null import shift_p_values
from vibrissa.neural.glm.trial_design import TrialDesign
from vibrissa.neural.glm.trial_gain import trial_gain_variance
from vibrissa.neural.io.tables.inputs import refuse_misplaced
from vibrissa.neural.io.tables.stimuli import in_unit_of, with_channels
from vibrissa.quantities import dataset, stacked
from vibrissa.quantities.quantity import SUFFIXES, estimate
from vibrissa.stats import adjusted_p_values, hotelling_p_value

FEWEST_TRIALS = 10  # with fewer, blocks of the stimulus are the draws
FEWEST_SPIKES = 3.0  # for each coefficient: with fewer the kernels are penalty rather than data
FOLDS = 5
PENALTIES = (1.0, 10.0, 100.0, 1000.0)  # tried on draws not seen; columns have a variance of 1
PAST_PENALTY = 0.1  # of the unit's own past: refractoriness would want minus infinity


def _penalty(design: TrialDesign, strength: float) -> Array:
    """Nothing on the constant, the strength on the whiskers, next to nothing on the past."""
    q = design.own.shape[2]
    return np.concatenate([[0.0], np.full(design.shared.shape[1] - 1, strength), np.full(q, PAST_PENALTY)])


class Foreseen(NamedTuple):
    """How well the fits to the other draws foresee each: trials, or blocks of the stimulus.

    Attributes
    ----------
    share : float
        Share of the deviance of a steady rate that is taken away.
    gain : float
        Likelihood over that of a steady rate, for each spike [bit].
    """

    share: float
    gain: float


def _unseen(design: TrialDesign, counts: Array, width: float, strength: float, gain_variance: float) -> Foreseen:
    fold = np.arange(design.n_draws) % FOLDS
    left, steady, start, lam = 0.0, 0.0, None, _penalty(design, strength)
    for k in range(FOLDS):
        seen, rest = design.places(fold != k), design.places(fold == k)
        asked: dict[str, Any] = {"penalty": lam, "start": start, "gain_variance": gain_variance}
        start = poisson_regression(design.part(seen), counts[seen], width, **asked).coefficients
        own = counts[rest]
        expected = width * np.exp(design.part(rest).log_rate(start))
        left += kl_div(own, expected).sum()  # half the deviance
        steady += kl_div(own, counts[seen].mean()).sum()
    return Foreseen(1 - left / steady, (steady - left) / (np.log(2) * counts.sum()))


class _Chosen(NamedTuple):
    """Fit to all draws, its penalty, how well unseen draws are foreseen, variance of the trials' gains."""

    fit: PoissonFit
    strength: float
    foreseen: Foreseen
    gain_variance: float


def _fitted(design: TrialDesign, counts: Array, how: KernelAnalysis) -> _Chosen:
    """Fit to all draws with the penalty that predicts unseen ones best."""
    strengths = PENALTIES if how.penalty is None else (how.penalty,)
    varies = trial_gain_variance(design, counts, how.bin_width, _penalty(design, strengths[0]))
    foreseen = [_unseen(design, counts, how.bin_width, strength, varies) for strength in strengths]
    best = int(np.argmax([one.share for one in foreseen]))
    asked: dict[str, Any] = {"penalty": _penalty(design, strengths[best]), "gain_variance": varies}
    return _Chosen(poisson_regression(design, counts, how.bin_width, **asked), strengths[best], foreseen[best], varies)


def whisker_kernels(
    spikes: xr.Dataset, command: xr.Dataset, n_trials: int, how: KernelAnalysis | None = None
) -> xr.Dataset:
    """Kernels over latency of all whiskers, and over the unit's own past, of every unit.

    The logarithm of the rate is a constant plus what the envelopes of all whiskers were at every latency up to the
    reach, plus what the unit itself fired before. Kernels are sums of raised cosines ([Pillow2008]_). Trials are the
    draws for all intervals, and good and bad trials count in them. Of fewer than 10 trials, one long presentation
    above all, blocks of the stimulus are the draws, twice as long as stimulus and rate stay like themselves; they do
    not show how the unit varies from one presentation to the next. With a penalty, intervals hold on average over a
    kernel, less at its sharpest turns.

    Parameters
    ----------
    spikes : Dataset
        Table of :func:`vibrissa.neural.io.tables.spikes.spike_table`, times from the stimulus' onset.
    command : Dataset
        ``command`` (whisker, time) [m], as :func:`vibrissa.stimulus.array.replay_command` gives it; or a stimulus of
        one channel, which is then called ``stimulus``.
    n_trials : int
        Trials presented, silent ones included.
    how : KernelAnalysis, optional
        Bins, lags, penalty.

    Returns
    -------
    Dataset
        ``whisker_kernel`` (unit, whisker, kernel_lag) [1/m]: rise of ln(rate) for each metre and bin of latency;
        ``whisker_effect`` (unit, whisker) [1/m]: its sum, both with 95 % intervals; ``whisker_p_value``, adjusted over
        whiskers, of the larger of ``whisker_trial_p_value`` (Hotelling's test, trials or blocks as draws) and
        ``whisker_shift_p_value`` (against circular shifts of the whisker's stimulus); ``whisker_matters``, and
        ``whiskers_that_matter`` (unit), their names; ``past_kernel`` (unit, past_lag): factor on the rate after a
        spike; ``deviance_explained`` and ``kernel_gain`` [bit], for each spike beyond a steady rate, in draws not seen;
        ``penalty``, ``kernel_rate`` [Hz], ``trial_gain_sd``, ``n_blocks`` (0: trials are the draws), ``reason``.
        ``kernel_condition`` is the condition number of the columns.

    Raises
    ------
    InputError
        If spikes and stimulus do not fit together, or trials are few and the stimulus is short.
    """
    how = how or KernelAnalysis()
    refuse_misplaced(spikes, command, n_trials, window=how.window, skip=how.skip)
    columns = Columns.of(with_channels(command), how)
    if n_trials < FEWEST_TRIALS:
        _blocks(list(columns.drives), how)
    counts = UnitCounts.of(spikes, n_trials, columns.edges, how.bin_width)
    rows = [_row(columns, own.astype(float), how) for own in counts]
    attrs = {"n_trials": n_trials, "bin_width": how.bin_width, "skip": how.skip, "level": how.level}
    lags, past = how.lags()
    found = dataset(
        attrs,
        unit_name=spikes.unit_name.values,
        whisker=np.array(columns.whiskers),
        kernel_lag=lags,
        past_lag=past,
        kernel_condition=condition_number(columns.shared[:, 1:].T),
        **stacked(rows),
    )
    return in_unit_of(found, command)


def _row(columns: Columns, counts: Array, how: KernelAnalysis) -> dict[str, Any]:
    n_whiskers, (lags, past) = len(columns.whiskers), how.lags()
    used = counts[:, columns.valid]
    needed = FEWEST_SPIKES * columns.shared.shape[1]
    if used.sum() < needed:
        text = f"too few spikes: {used.sum():.0f}, below {needed:.0f} for {columns.shared.shape[1]} coefficients"
        return {**_not_measured(n_whiskers, lags.size, past.size), "reason": text}
    try:
        design = _with_draws(unit_design(columns, counts, how), columns, used, how)
        fit, strength, foreseen, varies = _fitted(design, used, how)
    except (ConvergenceError, TooFewError) as error:
        return {**_not_measured(n_whiskers, lags.size, past.size), "reason": f"cannot tell: {error}"}
    shifted = _shift_p_values(columns, design, used, fit, how)
    row = _kernels(columns, fit, shifted, how, design.n_draws) | _past(columns, fit, how, design.n_draws)
    row |= {"deviance_explained": foreseen.share, "kernel_gain": foreseen.gain, "penalty": strength}
    row |= {"kernel_rate": float(used.mean() / how.bin_width)}
    surest = np.argsort(row["whisker_p_value"], kind="stable")
    names = np.array(columns.whiskers)[surest]
    row["whiskers_that_matter"] = ", ".join(names[row["whisker_matters"][surest]])
    sought = len(used) > 1 and design.own.size > 0
    row["trial_gain_sd"] = float(np.sqrt(varies)) if sought else np.nan
    row["n_blocks"] = 0 if design.starts is None else design.n_draws
    draws = "trials" if design.starts is None else "blocks"
    worse = f"cannot tell: unseen {draws} are predicted no better than by a steady rate"
    return {**row, "reason": "" if foreseen.share > 0 else worse}


def _with_draws(design: TrialDesign, columns: Columns, counts: Array, how: KernelAnalysis) -> TrialDesign:
    """The design, with blocks of the stimulus as draws where trials are few."""
    if len(counts) >= FEWEST_TRIALS:
        return design
    return replace(design, starts=_blocks([*columns.drives, counts.sum(0)], how))


def _blocks(series: Sequence[Array], how: KernelAnalysis) -> Integers:
    """First bin of each block of the stimulus, no shorter than a kernel reaches back."""
    asked: dict[str, Any] = {"width": how.bin_width, "fewest_trials": FEWEST_TRIALS}
    return independent_blocks(*series, **asked, least=max(how.reach, how.past))


def _not_measured(n_whiskers: int, n_lags: int, n_past: int) -> dict[str, Any]:
    sizes = {"whisker_kernel": (n_whiskers, n_lags), "whisker_effect": n_whiskers, "past_kernel": n_past}
    row: dict[str, Any] = {name + end: np.full(size, np.nan) for name, size in sizes.items() for end in SUFFIXES}
    p_values = ("whisker_p_value", "whisker_trial_p_value", "whisker_shift_p_value")
    row |= {name: np.full(n_whiskers, np.nan) for name in p_values} | {"whisker_matters": np.zeros(n_whiskers, bool)}
    unknown = ("deviance_explained", "kernel_gain", "penalty", "kernel_rate", "trial_gain_sd")
    return row | dict.fromkeys(unknown, np.nan) | {"n_blocks": 0, "whiskers_that_matter": ""}


def _shift_p_values(
    columns: Columns, design: TrialDesign, counts: Array, fit: PoissonFit, how: KernelAnalysis
) -> Array:
    """p-value of each whisker against shifts of its columns, the rest of the model as it is."""
    count, n_whiskers = columns.shapes.shape[1], len(columns.whiskers)
    expected = fit.expected.sum(0)
    own = columns.shared[:, 1:].T.reshape(n_whiskers, count, -1)
    b = fit.coefficients[1 : 1 + n_whiskers * count].reshape(n_whiskers, count)
    share = np.einsum("wc,wck->wk", b, own)
    # what is expected without each whisker, and the logarithm of the rate to first order about that
    weights = expected * np.exp(-share)
    response = (counts.sum(0) - weights) / weights + share.sum(0) - share
    return shift_p_values(own, response, weights, guard_bins(how.bin_width, counts.shape[1], design.starts))


def _kernels(columns: Columns, fit: PoissonFit, shifted: Array, how: KernelAnalysis, n_draws: int) -> dict[str, Any]:
    """Kernels of the whiskers [1/m], their sums, and the test of each: the larger p-value of draws and shifts."""
    count, n_whiskers = columns.shapes.shape[1], len(columns.whiskers)
    own, size = slice(1, 1 + n_whiskers * count), (n_whiskers, count)
    b = fit.coefficients[own].reshape(size)
    # of the covariance, the blocks of each whisker with itself
    covariance = np.einsum("kckd->kcd", fit.draw_covariance[own, own].reshape(size * 2))
    row: dict[str, Any] = {}
    for name, shapes in (("whisker_kernel", columns.shapes), ("whisker_effect", columns.shapes.sum(0))):
        error = np.sqrt(np.einsum("...c,kcd,...d->k...", shapes, covariance, shapes))
        row |= _ends(name, b @ shapes.T / columns.spread, _quantile(n_draws) * error / columns.spread)
    wald = np.einsum("kc,kc->k", b, np.linalg.solve(covariance, b[..., None])[..., 0])
    by_trials = hotelling_p_value(wald, count, n_draws)
    adjusted = adjusted_p_values(np.fmax(by_trials, shifted))
    row |= {"whisker_trial_p_value": by_trials, "whisker_shift_p_value": shifted}
    return row | {"whisker_p_value": adjusted, "whisker_matters": adjusted <= how.level}


def _quantile(n_draws: int) -> float:
    return float(stdtrit(n_draws - 1, 0.975))


def _past(columns: Columns, fit: PoissonFit, how: KernelAnalysis, n_draws: int) -> dict[str, Any]:
    """Factor on the rate at each lag after a spike; the interval is that of its logarithm."""
    lags = how.lags()[1]
    if not lags.size:
        return estimate("past_kernel", *np.empty((3, 0)))
    shapes, first = raised_cosines(lags, how.past_shapes, stretch=STRETCH), columns.shared.shape[1]
    covariance = fit.draw_covariance[first:, first:]
    value = shapes @ fit.coefficients[first:]
    error = np.sqrt(np.einsum("jc,cd,jd->j", shapes, covariance, shapes))
    return {name: np.exp(one) for name, one in _ends("past_kernel", value, _quantile(n_draws) * error).items()}


def _ends(name: str, value: Array, half: Array) -> dict[str, Array]:
    return estimate(name, value, value - half, value + half)
