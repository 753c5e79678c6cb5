"""Gains of whole trials: integrated over their gamma as by quadrature, and not taken for the unit's own past."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import roots_genlaguerre
from scipy.stats import poisson

from vibrissa.neural.glm.bases import lagged
from vibrissa.neural.glm.poisson import poisson_regression
from vibrissa.neural.glm.trial_design import TrialDesign
from vibrissa.neural.glm.trial_gain import trial_gain_variance

WIDTH = 0.01
STARTS = np.array([0, 30, 75, 110, 160, 200, 260, 290, 340])


def drawn(seed, n, k, variance, rate=40.0):
    """Design of two shared columns and one of single trials, and counts with a gain of each trial."""
    rng = np.random.default_rng(seed)
    shared = np.column_stack([np.ones(k), rng.normal(size=(k, 2))])
    design = TrialDesign(shared=shared, own=rng.normal(size=(n, k, 1)))
    b = np.array([np.log(rate), 0.3, -0.2, 0.2])
    gain = rng.gamma(1 / variance, variance, (n, 1)) if variance else np.ones((n, 1))
    return design, rng.poisson(gain * WIDTH * np.exp(design.log_rate(b))).astype(float), b


def test_likelihood_is_that_integrated_over_the_gain():
    design, counts, _ = drawn(0, 4, 25, 0.2)
    fit = poisson_regression(design, counts, WIDTH, gain_variance=0.2)

    gains, weights = roots_genlaguerre(60, 4)  # of a gamma density of shape 5 and variance 0.2

    def loss(b):
        expected = gains[:, None, None] / 5 * WIDTH * np.exp(design.log_rate(b))
        return -np.log(weights @ poisson.pmf(counts, expected).prod(2)).sum()

    other = minimize(loss, fit.coefficients + 0.05, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9})
    np.testing.assert_allclose(fit.coefficients, other.x, atol=1e-4)
    step, at = 1e-3, fit.coefficients
    sides = [loss(at + sign * step * np.eye(4)[1]) for sign in (1, -1)]
    curvature = (sum(sides) - 2 * loss(at)) / step**2
    assert np.linalg.inv(fit.covariance)[1, 1] == pytest.approx(curvature, rel=1e-3)


def test_wide_gains_are_constants_of_each_trial_in_statsmodels():
    sm = pytest.importorskip("statsmodels.api")
    n, k = 3, 400
    design, counts, _ = drawn(1, n, k, 0.1)
    design = replace(design, starts=STARTS)
    fit = poisson_regression(design, counts, WIDTH, gain_variance=1e7)
    trials = np.repeat(np.eye(n), k, axis=0)
    rows = np.hstack([np.tile(design.shared[:, 1:], (n, 1)), design.own.reshape(n * k, 1), trials])
    model = sm.GLM(counts.ravel(), rows, family=sm.families.Poisson(), offset=np.full(n * k, np.log(WIDTH)))
    blocks = np.tile(np.repeat(np.arange(9), np.diff([*STARTS, k])), n)
    theirs = model.fit(tol=1e-13, cov_type="cluster", cov_kwds={"groups": blocks, "use_correction": False})
    np.testing.assert_allclose(fit.coefficients[1:], theirs.params[:3], rtol=1e-5)
    np.testing.assert_allclose(fit.draw_covariance[1:, 1:] * 8 / 9, theirs.cov_params()[:3, :3], rtol=1e-4, atol=1e-8)


@pytest.mark.parametrize("truth", [0.0, 0.09, 0.25])
def test_variance_of_the_gain_is_recovered(truth):
    found = []
    for seed in range(20):
        design, counts, _ = drawn(100 + seed, 40, 60, truth)
        found.append(trial_gain_variance(design, counts, WIDTH, np.zeros(4)))
    error = np.std(found, ddof=1) / np.sqrt(len(found))
    assert np.mean(found) == pytest.approx(truth, abs=4 * error + 0.004)
    assert truth == 0 or np.mean(found) > 0.7 * truth


def past_fit(seed, n, variance):
    """Effect and past of a unit without a past of its own, whose trials differ in gain; fitted with and without it."""
    rng = np.random.default_rng(seed)
    k = 400
    drive = rng.normal(size=k)
    gain = rng.gamma(1 / variance, variance, (n, 1))
    counts = rng.poisson(gain * 0.3 * np.exp(0.3 * drive)).astype(float)
    own = lagged(counts, np.eye(5), first=1)
    design = TrialDesign(shared=np.column_stack([np.ones(k - 5), drive[5:]]), own=own[:, 5:])
    used = counts[:, 5:]
    varies = trial_gain_variance(design, used, WIDTH, np.zeros(7))
    with_gain, without = (poisson_regression(design, used, WIDTH, gain_variance=one) for one in (varies, 0.0))
    return with_gain.coefficients[1:], without.coefficients[1:]


@pytest.mark.parametrize("trials", [5, 40])
def test_a_gain_of_trials_is_not_taken_for_the_units_own_past(trials):
    found, without = (np.array(one) for one in zip(*(past_fit(seed, trials, 0.15) for seed in range(20)), strict=True))
    error = found.std(0, ddof=1) / np.sqrt(len(found))
    np.testing.assert_array_less(abs(found.mean(0) - np.array([0.3, 0, 0, 0, 0, 0])), 4 * error)
    assert (without[:, 1:].mean() > 4 * error[1:]).all()  # a spike says that the trial is a good one
    assert found[:, 1:].mean() < 0.2 * without[:, 1:].mean()


def test_one_trial_and_columns_without_a_past_have_no_gain():
    design, counts, _ = drawn(3, 10, 60, 0.3)
    assert trial_gain_variance(replace(design, own=design.own[:1]), counts[:1], WIDTH, np.zeros(4)) == 0
    alone = TrialDesign.repeated(design.shared, 10)
    assert trial_gain_variance(alone, counts, WIDTH, np.zeros(3)) == 0
