"""Poisson regression: closed forms, statsmodels, a general optimiser, and trials as the draws."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal
from scipy.optimize import minimize

from vibrissa.errors import ConvergenceError
from vibrissa.neural.glm.bases import lagged, raised_cosines
from vibrissa.neural.glm.poisson import poisson_regression
from vibrissa.neural.glm.trial_design import TrialDesign

WIDTH = 0.01


def drawn(seed, n=20, k=200, p=4, q=2):
    """Design with a constant and counts that follow it."""
    rng = np.random.default_rng(seed)
    shared = np.column_stack([np.ones(k), rng.normal(size=(k, p - 1))])
    design = TrialDesign(shared=shared, own=rng.normal(size=(n, k, q)))
    b = np.concatenate([[np.log(40.0)], 0.3 * rng.normal(size=p - 1 + q)])
    return design, rng.poisson(WIDTH * np.exp(design.log_rate(b))).astype(float), b


def flat(design):
    """One row for each trial and bin."""
    n, k, q = design.own.shape
    return np.hstack([np.tile(design.shared, (n, 1)), design.own.reshape(n * k, q)])


@pytest.mark.parametrize("seed", range(3))
def test_unpenalised_fit_is_that_of_statsmodels(seed):
    sm = pytest.importorskip("statsmodels.api")
    design, counts, _ = drawn(seed)
    fit = poisson_regression(design, counts, WIDTH)
    theirs = sm.GLM(
        counts.ravel(), flat(design), family=sm.families.Poisson(), offset=np.full(counts.size, np.log(WIDTH))
    ).fit(tol=1e-13, maxiter=200)
    np.testing.assert_allclose(fit.coefficients, theirs.params, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(fit.covariance, theirs.cov_params(), rtol=1e-6, atol=1e-10)
    assert fit.deviance == pytest.approx(theirs.deviance, rel=1e-8)


def test_covariance_by_trials_is_the_clustered_one_of_statsmodels():
    sm = pytest.importorskip("statsmodels.api")
    design, counts, _ = drawn(5)
    n, k = counts.shape
    model = sm.GLM(counts.ravel(), flat(design), family=sm.families.Poisson(), offset=np.full(n * k, np.log(WIDTH)))
    theirs = model.fit(
        tol=1e-13,
        cov_type="cluster",
        cov_kwds={"groups": np.repeat(np.arange(n), k), "use_correction": False},
    )
    fit = poisson_regression(design, counts, WIDTH)
    np.testing.assert_allclose(fit.draw_covariance * (n - 1) / n, theirs.cov_params(), rtol=1e-6, atol=1e-9)


def test_covariance_by_blocks_of_few_trials_is_the_clustered_one_of_statsmodels():
    sm = pytest.importorskip("statsmodels.api")
    design, counts, _ = drawn(6, n=3, k=400)
    design = replace(design, starts=np.array([0, 30, 75, 110, 160, 200, 260, 290, 340]))
    blocks = np.tile(np.repeat(np.arange(9), np.diff([*design.starts, 400])), 3)
    model = sm.GLM(
        counts.ravel(), flat(design), family=sm.families.Poisson(), offset=np.full(counts.size, np.log(WIDTH))
    )
    theirs = model.fit(tol=1e-13, cov_type="cluster", cov_kwds={"groups": blocks, "use_correction": False})
    fit = poisson_regression(design, counts, WIDTH)
    np.testing.assert_allclose(fit.draw_covariance * 8 / 9, theirs.cov_params(), rtol=1e-6, atol=1e-9)


def test_one_column_on_or_off_gives_the_ratio_of_rates():
    on = np.repeat([0.0, 1.0], [60, 40])
    counts = np.random.default_rng(1).poisson(np.where(on, 0.6, 0.2), (30, 100)).astype(float)
    fit = poisson_regression(TrialDesign.repeated(np.column_stack([np.ones(100), on]), 30), counts, WIDTH)
    off_rate, on_rate = (counts[:, on == side].mean() / WIDTH for side in (0, 1))
    np.testing.assert_allclose(fit.coefficients, [np.log(off_rate), np.log(on_rate / off_rate)], rtol=1e-9)
    spikes = [counts[:, on == side].sum() for side in (0, 1)]
    np.testing.assert_allclose(fit.covariance[1, 1], 1 / spikes[0] + 1 / spikes[1], rtol=1e-9)


def test_penalised_fit_is_where_a_general_optimiser_ends():
    design, counts, _ = drawn(2)
    lam = np.array([0.0, 30, 30, 30, 5, 5])
    fit = poisson_regression(design, counts, WIDTH, penalty=lam)

    def loss(b):
        rate = design.log_rate(b)
        return WIDTH * np.exp(rate).sum() - (counts * rate).sum() + lam @ b**2 / 2

    other = minimize(loss, np.array([3.0, 0, 0, 0, 0, 0]), method="BFGS", options={"gtol": 1e-9})
    np.testing.assert_allclose(fit.coefficients, other.x, atol=2e-6)
    free = poisson_regression(design, counts, WIDTH)
    assert np.linalg.norm(fit.coefficients[1:]) < np.linalg.norm(free.coefficients[1:])


def test_gradient_vanishes_and_expected_spikes_are_those_counted():
    design, counts, _ = drawn(3)
    fit = poisson_regression(design, counts, WIDTH)
    expected = WIDTH * np.exp(design.log_rate(fit.coefficients))
    np.testing.assert_allclose(design.trial_sums(counts - expected).sum(0), 0, atol=1e-6 * counts.sum())
    assert expected.sum() == pytest.approx(counts.sum(), rel=1e-9)


def test_a_fit_begun_elsewhere_ends_at_the_same_place():
    design, counts, b = drawn(4)
    cold = poisson_regression(design, counts, WIDTH)
    far = poisson_regression(design, counts, WIDTH, start=b + 1.5)
    np.testing.assert_allclose(far.coefficients, cold.coefficients, atol=1e-8)


def test_intervals_by_trials_hold_the_truth_where_whole_trials_are_good_or_bad():
    held, poisson = [], []
    for seed in range(120):
        design, _, b = drawn(seed, n=40, k=60, p=2, q=0)
        rng = np.random.default_rng(1000 + seed)
        gain = rng.gamma(4.0, 1 / 4.0, (40, 1))  # a trial's own excitability, mean 1
        counts = rng.poisson(gain * WIDTH * np.exp(design.log_rate(b))).astype(float)
        fit = poisson_regression(design, counts, WIDTH)
        error = np.abs(fit.coefficients[0] - b[0])
        held.append(error < 1.96 * np.sqrt(fit.draw_covariance[0, 0]))
        poisson.append(error < 1.96 * np.sqrt(fit.covariance[0, 0]))
    assert 0.88 <= np.mean(held) <= 0.99
    assert np.mean(poisson) < 0.75  # counts alone do not know that trials differ


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda d, c: (TrialDesign.repeated(np.hstack([d.shared, d.shared[:, :1]]), 20), c), ("range", "columns")),
        (lambda d, c: (d, -c), ("range", "counts")),
        (lambda d, c: (d, 0 * c), ("too-few", "counts")),
        (lambda d, c: (d, c[:, :-1]), ("shape", "counts")),
    ],
)
def test_bad_input_is_told_in_one_line(change, match):
    design, counts, _ = drawn(0)
    with refusal(*match) as told:
        poisson_regression(*change(design, counts), WIDTH)
    assert "\n" not in str(told.value)


def test_columns_that_are_no_numbers_are_refused():
    with refusal("range", "columns"):
        TrialDesign.repeated(np.full((5, 1), np.nan), 3)
    with refusal("range", "penalty"):
        poisson_regression(*drawn(0)[:2], WIDTH, penalty=-1.0)


def test_a_coefficient_without_a_finite_estimate_is_said():
    on = np.repeat([0.0, 1.0], [60, 40])
    counts = np.zeros((5, 100))
    counts[:, :60] = 1
    with pytest.raises(ConvergenceError, match="penalty"):
        poisson_regression(TrialDesign.repeated(np.column_stack([np.ones(100), on]), 5), counts, WIDTH)


# Shapes over lags


@pytest.mark.parametrize("stretch", [None, 0.002, 0.02])
def test_raised_cosines_sum_to_two_inside(stretch):
    lags = np.linspace(0, 0.1, 400)
    shapes = raised_cosines(lags, 8, stretch=stretch)
    place = lags if stretch is None else np.log(lags + stretch)
    spacing = (place[-1] - place[0]) / 7
    inside = (place >= place[0] + spacing) & (place <= place[-1] - spacing)
    np.testing.assert_allclose(shapes[inside].sum(1), 2, rtol=1e-12)
    assert shapes.min() >= 0
    np.testing.assert_allclose(shapes.max(0), 1, atol=0.01)


def test_lagged_is_the_weighted_past():
    rng = np.random.default_rng(0)
    signal, shapes = rng.normal(size=(3, 50)), rng.normal(size=(7, 2))
    found = lagged(signal, shapes, first=2)
    for k in (0, 1, 5, 49):
        past = [signal[:, k - 2 - j] if k - 2 - j >= 0 else np.zeros(3) for j in range(7)]
        np.testing.assert_allclose(found[:, k], np.array(past).T @ shapes, atol=1e-12)


@pytest.mark.parametrize(
    ("lags", "count", "stretch", "match"),
    [
        ([0.0], 2, None, ("too-few", "lags")),
        ([0.0, 0.1, 0.05], 2, None, ("too-few", "lags")),
        ([0.0, 0.1], 3, None, ("range", "number of shapes")),
        ([0.0, 0.1, 0.2], 2, -1.0, ("range", "stretch")),
    ],
)
def test_shapes_that_cannot_be_are_refused(lags, count, stretch, match):
    with refusal(*match):
        raised_cosines(np.array(lags), count, stretch=stretch)


# NeMoS, where it is installed


@pytest.fixture
def nemos():
    """NeMoS in double precision: in single precision its shapes are off by 1e-7, its coefficients by 1e-3."""
    jax, found = pytest.importorskip("jax"), pytest.importorskip("nemos")
    jax.config.update("jax_enable_x64", True)
    return found


def test_shapes_are_those_of_nemos(nemos):
    lags = 0.005 * np.arange(1, 21)
    even = nemos.basis.RaisedCosineLinearEval(6, width=2.0, bounds=(lags[0], lags[-1])).compute_features(lags)
    np.testing.assert_allclose(raised_cosines(lags, 6), even, atol=1e-12)
    log = nemos.basis.RaisedCosineLogEval(
        4,
        width=2.0,
        time_scaling=(lags[-1] - lags[0]) / (lags[0] + 0.002),
        enforce_decay_to_zero=False,
        bounds=(lags[0], lags[-1]),
    )
    np.testing.assert_allclose(raised_cosines(lags, 4, stretch=0.002), log.compute_features(lags), atol=1e-12)


@pytest.mark.parametrize("penalty", [0.0, 50.0])
def test_nemos_ends_at_the_same_coefficients(nemos, penalty):
    design, counts, b = drawn(0)
    ridge = {"regularizer": "Ridge", "regularizer_strength": penalty / counts.size} if penalty else {}
    options = {"solver_name": "LBFGS", "solver_kwargs": {"tol": 1e-12, "maxiter": 5000}} | ridge
    model = nemos.glm.GLM(observation_model="Poisson", **options).fit(flat(design)[:, 1:], counts.ravel())
    found = np.r_[np.asarray(model.intercept_)[0] - np.log(WIDTH), np.asarray(model.coef_)]
    lam = np.r_[0.0, np.full(b.size - 1, penalty)]
    mine = poisson_regression(design, counts, WIDTH, penalty=lam).coefficients
    np.testing.assert_allclose(mine, found, rtol=1e-6, atol=1e-9)
