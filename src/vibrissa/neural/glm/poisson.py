"""Poisson regression on trials that share their stimulus: Newton's method, a penalty, trials or blocks as the draws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import kl_div

from vibrissa.arrays import Array
from vibrissa.errors import (
    ConvergenceError,
    RangeError,
    ShapeError,
    TooFewError,
    require_not_negative,
    require_positive,
)
from vibrissa.neural.glm.trial_design import TrialDesign

_ITERATIONS = 100
_LOSSLESS = 1e-12  # decrease of the objective, over its size, below which a Newton step changes nothing
_STEEPEST = 15.0  # spread of ln(rate) that nothing penalises: e⁻¹⁵ of the mean rate is a coefficient running away


@dataclass(frozen=True, kw_only=True)
class PoissonFit:
    """Coefficients of ln(rate), and how sure they are.

    Attributes
    ----------
    coefficients : (P + Q,) array
        In the order shared, own.
    covariance : (P + Q, P + Q) array
        Inverse of information plus penalty: of Poisson counts.
    draw_covariance : (P + Q, P + Q) array
        With trials as the draws, so that good and bad trials and slow states count; or with blocks of the stimulus.
        NaN for one draw.
    deviance : float
        Twice the log-likelihood lost against the counts themselves, given the gains.
    expected : (N, K) array
        Counts expected, with the gain of each trial.
    """

    coefficients: Array
    covariance: Array
    draw_covariance: Array
    deviance: float
    expected: Array


class _Counted(NamedTuple):
    """What is fitted: design, counts, width of a bin, penalty, variance of the trials' gains."""

    design: TrialDesign
    counts: Array
    width: float
    lam: Array
    gain_variance: float

    def loss(self, b: Array) -> tuple[float, Array]:
        """Negative penalised log-likelihood, less what does not depend on b; expected counts."""
        log_rate, v = self.design.log_rate(b), self.gain_variance
        with np.errstate(over="ignore", invalid="ignore"):
            steady = self.width * np.exp(log_rate)
            whole = steady.sum(1)
            fired = self.counts.sum(1)
            expected = steady * ((1 + v * fired) / (1 + v * whole))[:, None]
            sure = whole if v == 0 else (fired + 1 / v) * np.log1p(v * whole)  # the gain integrated over its gamma
        return float(sure.sum() - (self.counts * log_rate).sum() + self.lam @ b**2 / 2), expected

    def middle(self, expected: Array) -> Array:
        """What the gain of each trial follows of its columns, (N, P + Q)."""
        v = self.gain_variance
        return self.design.trial_sums(expected) * (v / (1 + v * self.counts.sum(1)))[:, None]

    def slope(self, expected: Array, b: Array) -> Array:
        """Slope of the log-likelihood."""
        return np.asarray(self.design.trial_sums(self.counts - expected).sum(0) - self.lam * b)

    def curve(self, expected: Array) -> tuple[Array, bool]:
        """Curvature of the negative log-likelihood, factored."""
        known = self.design.information(expected) + np.diag(self.lam)
        if self.gain_variance:
            known -= self.design.trial_sums(expected).T @ self.middle(expected)
        return _factored(known)


def poisson_regression(
    design: TrialDesign,
    counts: Array,
    width: float,
    *,
    penalty: Array | float = 0.0,
    start: Array | None = None,
    gain_variance: float = 0.0,
) -> PoissonFit:
    """Coefficients of most (penalised) likelihood of counts with ln(rate) = columns · coefficients.

    Newton's method; the likelihood is concave, so that what it finds is the maximum. A step that does not gain is
    halved.

    Parameters
    ----------
    design : TrialDesign
        Columns, a constant among them.
    counts : (N, K) array
        Spikes of each trial and bin.
    width : float
        Width of a bin [s]; rates are in Hz.
    penalty : (P + Q,) array or float
        Half this times each squared coefficient is taken from the log-likelihood.
    start : (P + Q,) array, optional
        Where to begin, such as the fit to nearly the same trials.
    gain_variance : float
        Variance of a factor on the rate of each trial, gamma distributed about 1, over which the likelihood is
        integrated; see :func:`vibrissa.neural.glm.trial_gain.trial_gain_variance`.

    Returns
    -------
    PoissonFit
        ``draw_covariance`` is H⁻¹(J + Λ)H⁻¹ with H information plus penalty Λ and J from the scores of draws: of the
        estimate itself without a penalty, and with one that of the coefficients given their shrinkage.

    Raises
    ------
    InputError
        If counts are no counts or all 0, or columns follow from each other and no penalty separates them.
    ConvergenceError
        If a coefficient runs away, as where a column is on only in bins without a spike.
    """
    _refuse_counts(design, counts, width)
    lam = np.broadcast_to(np.asarray(penalty, float), design.size)
    if not (lam >= 0).all():
        raise RangeError("penalty", "must be zero or positive", lam.min())
    require_not_negative("variance of the gain", gain_variance)
    asked = _Counted(design, counts, width, lam, gain_variance)
    b = _constant(design, counts, width) if start is None else np.asarray(start, float)
    loss, expected = asked.loss(b)
    for iteration in range(1, _ITERATIONS + 1):
        slope = asked.slope(expected, b)
        step = cho_solve(asked.curve(expected), slope)
        gain = float(slope @ step) / 2
        if gain <= _LOSSLESS * (1 + abs(loss)):
            _refuse_runaway(design, lam, b + step, gain, iteration)
            return _fit_at(asked, b + step)
        b, loss, expected = _stepped(asked, b, step, loss, gain)
    raise ConvergenceError("Poisson regression", gain, iteration, "fewer columns, or a penalty")


def _refuse_counts(design: TrialDesign, counts: Array, width: float) -> None:
    if counts.shape != design.own.shape[:2]:
        raise ShapeError("counts", f"must be (trials, bins) = {design.own.shape[:2]}", counts.shape)
    if not (np.isfinite(counts).all() and (counts >= 0).all()):
        raise RangeError("counts", "must be zero or positive")
    if not counts.any():
        raise TooFewError("counts", "must hold a spike", 0)
    require_positive("bin width", width, "s")


def _constant(design: TrialDesign, counts: Array, width: float) -> Array:
    """Coefficients of the mean rate: least squares of the shared columns to its logarithm."""
    level = np.full(len(design.shared), np.log(counts.mean() / width))
    common = np.asarray(np.linalg.lstsq(design.shared, level, rcond=None)[0], float)
    return np.concatenate([common, np.zeros(design.own.shape[2])])


def _stepped(asked: _Counted, b: Array, step: Array, loss: float, gain: float) -> tuple[Array, float, Array]:
    """Go along the step, as far as the loss falls by a tenth of what its slope promises."""
    share = 1.0
    while share > 1e-10:
        found, expected = asked.loss(b + share * step)
        if found <= loss - 0.1 * share * gain:
            return b + share * step, found, expected
        share /= 2
    raise ConvergenceError("Poisson regression", gain, 0, "fewer columns, or a penalty")


def _factored(curve: Array) -> tuple[Array, bool]:
    try:
        scale = np.sqrt(np.diag(curve))
        if not (scale > 0).all() or np.linalg.cond(curve / np.outer(scale, scale)) > 1e13:
            raise np.linalg.LinAlgError
        return cho_factor(curve)
    except np.linalg.LinAlgError as error:
        remedy = "leave one out, or give a penalty"
        raise RangeError("columns", "must be linearly independent", remedy=remedy) from error


def _refuse_runaway(design: TrialDesign, lam: Array, b: Array, gain: float, iterations: int) -> None:
    """Refuse a likelihood without a maximum: of a column that is on only in bins without a spike it rises for ever."""
    free = design.log_rate(np.where(lam == 0, b, 0.0))
    if np.abs(free - np.median(free)).max() > _STEEPEST:
        raise ConvergenceError("Poisson regression", gain, iterations, "fewer columns, or a penalty")


def _fit_at(asked: _Counted, b: Array) -> PoissonFit:
    """Fit with these coefficients, its covariances and its deviance."""
    n, expected = asked.design.n_draws, asked.loss(b)[1]
    inverse = cho_solve(asked.curve(expected), np.eye(asked.design.size))
    scores = asked.design.scores(asked.counts - expected, asked.middle(expected))
    spread = scores - scores.mean(0)
    middle = spread.T @ spread * n / (n - 1) + np.diag(asked.lam) if n > 1 else np.full(inverse.shape, np.nan)
    return PoissonFit(
        coefficients=b,
        covariance=inverse,
        draw_covariance=inverse @ middle @ inverse,
        deviance=2 * float(kl_div(asked.counts, expected).sum()),
        expected=expected,
    )
