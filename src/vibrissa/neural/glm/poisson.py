"""Poisson regression on trials that share their stimulus: Newton's method, a penalty, trials or blocks as the draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import kl_div

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import ConvergenceError, RangeError, ShapeError, TooFewError, require_positive

_ITERATIONS = 100
_LOSSLESS = 1e-12  # decrease of the objective, over its size, below which a Newton step changes nothing
Places = tuple[Mask | slice, Mask | slice]  # trials and bins
_STEEPEST = 15.0  # spread of ln(rate) that nothing penalises: e⁻¹⁵ of the mean rate is a coefficient running away


@dataclass(frozen=True, kw_only=True)
class TrialDesign:
    """Columns that explain the counts of repeated trials.

    The stimulus is the same in every trial, so its columns are kept once; only a unit's own past differs.

    Attributes
    ----------
    shared : (K, P) array
        Columns equal in all trials, such as the constant and the stimulus; K bins.
    own : (N, K, Q) array
        Columns that differ from trial to trial, such as the unit's own spikes; Q may be 0.
    starts : (M,) array of int, optional
        First bin of each block of the stimulus, from 0, where blocks are the draws; by default trials are.
    """

    shared: Array
    own: Array
    starts: Integers | None = None

    def __post_init__(self) -> None:
        if self.shared.ndim != 2 or self.own.ndim != 3 or self.own.shape[1] != len(self.shared):
            raise ShapeError("columns", "must be (K, P) and (N, K, Q)", f"{self.shared.shape}, {self.own.shape}")
        if not (np.isfinite(self.shared).all() and np.isfinite(self.own).all()):
            raise RangeError("columns", "must be finite")

    @classmethod
    def repeated(cls, shared: Array, n_trials: int) -> TrialDesign:
        """Design of columns that are equal in all trials.

        Parameters
        ----------
        shared : (K, P) array
            Columns.
        n_trials : int
            Trials N.

        Returns
        -------
        TrialDesign
            Without columns of single trials.
        """
        return cls(shared=shared, own=np.empty((n_trials, len(shared), 0)))

    @property
    def size(self) -> int:
        """Number of columns."""
        return self.shared.shape[1] + self.own.shape[2]

    @property
    def n_draws(self) -> int:
        """Number of draws: trials, or blocks of the stimulus."""
        return len(self.own) if self.starts is None else self.starts.size

    def places(self, kept: Mask) -> Places:
        """Trials and bins of some of the draws.

        Parameters
        ----------
        kept : (draws,) array of bool
            Whether each is kept.

        Returns
        -------
        Places
            Index into counts (N, K).
        """
        if self.starts is None:
            return kept, slice(None)
        return slice(None), np.repeat(kept, np.diff(np.append(self.starts, len(self.shared))))

    def part(self, places: Places) -> TrialDesign:
        """Keep some of the trials and bins.

        Parameters
        ----------
        places : Places
            From :meth:`places`.

        Returns
        -------
        TrialDesign
            Of these, trials being its draws.
        """
        return TrialDesign(shared=self.shared[places[1]], own=self.own[places])

    def log_rate(self, coefficients: Array) -> Array:
        """Columns times coefficients, (N, K).

        Parameters
        ----------
        coefficients : (P + Q,) array
            In the order shared, own.

        Returns
        -------
        (N, K) array
            ln(rate).
        """
        p = self.shared.shape[1]
        common = self.shared @ coefficients[:p]
        return common + self.own @ coefficients[p:]

    def scores(self, excess: Array) -> Array:
        """Each draw's columnsᵀ · excess (N, K); (draws, P + Q).

        Parameters
        ----------
        excess : (N, K) array
            Counts less those expected.

        Returns
        -------
        (draws, P + Q) array
            Slope of the log-likelihood, by trial, or by block over all trials.
        """
        if self.starts is None:
            return np.hstack([excess @ self.shared, np.einsum("nk,nkq->nq", excess, self.own)])
        of_bins = np.hstack([excess.sum(0)[:, None] * self.shared, np.einsum("nk,nkq->kq", excess, self.own)])
        return np.asarray(np.add.reduceat(of_bins, self.starts))

    def information(self, weights: Array) -> Array:
        """Columnsᵀ · weights · columns over all trials, weights (N, K).

        Parameters
        ----------
        weights : (N, K) array
            Counts expected.

        Returns
        -------
        (P + Q, P + Q) array
            Sum over trials.
        """
        p, q = self.shared.shape[1], self.own.shape[2]
        found = np.empty((p + q, p + q))
        # the stimulus is equal in all trials: their weights add up before the product
        found[:p, :p] = self.shared.T @ (weights.sum(0)[:, None] * self.shared)
        if q:
            weighted = weights[..., None] * self.own
            found[:p, p:] = self.shared.T @ weighted.sum(0)
            found[p:, :p] = found[:p, p:].T
            found[p:, p:] = weighted.reshape(-1, q).T @ self.own.reshape(-1, q)
        return found


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
        Twice the log-likelihood lost against the counts themselves.
    """

    coefficients: Array
    covariance: Array
    draw_covariance: Array
    deviance: float


def poisson_regression(
    design: TrialDesign, counts: Array, width: float, *, penalty: Array | float = 0.0, start: Array | None = None
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
    b = _constant(design, counts, width) if start is None else np.asarray(start, float)
    loss, expected = _loss(design, counts, width, lam, b)
    for iteration in range(1, _ITERATIONS + 1):
        slope = design.scores(counts - expected).sum(0) - lam * b
        curve = _factored(design.information(expected) + np.diag(lam))
        step = cho_solve(curve, slope)
        gain = float(slope @ step) / 2
        if gain <= _LOSSLESS * (1 + abs(loss)):
            _refuse_runaway(design, lam, b + step, gain, iteration)
            return _fit_at(design, counts, width, lam, b + step)
        b, loss, expected = _stepped(design, counts, width, lam, b, step, loss, gain)
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


def _loss(design: TrialDesign, counts: Array, width: float, lam: Array, b: Array) -> tuple[float, Array]:
    """Negative penalised log-likelihood, less what does not depend on b; expected counts."""
    log_rate = design.log_rate(b)
    with np.errstate(over="ignore"):
        expected = width * np.exp(log_rate)
    return float(expected.sum() - (counts * log_rate).sum() + lam @ b**2 / 2), expected


def _stepped(
    design: TrialDesign, counts: Array, width: float, lam: Array, b: Array, step: Array, loss: float, gain: float
) -> tuple[Array, float, Array]:
    """Go along the step, as far as the loss falls by a tenth of what its slope promises."""
    share = 1.0
    while share > 1e-10:
        found, expected = _loss(design, counts, width, lam, b + share * step)
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
        raise RangeError("columns", "must not follow from one another", remedy=remedy) from error


def _refuse_runaway(design: TrialDesign, lam: Array, b: Array, gain: float, iterations: int) -> None:
    """Refuse a likelihood without a maximum: of a column that is on only in bins without a spike it rises for ever."""
    free = design.log_rate(np.where(lam == 0, b, 0.0))
    if np.abs(free - np.median(free)).max() > _STEEPEST:
        raise ConvergenceError("Poisson regression", gain, iterations, "fewer columns, or a penalty")


def _fit_at(design: TrialDesign, counts: Array, width: float, lam: Array, b: Array) -> PoissonFit:
    """Fit with these coefficients, its covariances and its deviance."""
    n, expected = design.n_draws, width * np.exp(design.log_rate(b))
    inverse = cho_solve(_factored(design.information(expected) + np.diag(lam)), np.eye(design.size))
    scores = design.scores(counts - expected)
    spread = scores - scores.mean(0)
    middle = spread.T @ spread * n / (n - 1) + np.diag(lam) if n > 1 else np.full(inverse.shape, np.nan)
    return PoissonFit(
        coefficients=b,
        covariance=inverse,
        draw_covariance=inverse @ middle @ inverse,
        deviance=2 * float(kl_div(counts, expected).sum()),
    )
