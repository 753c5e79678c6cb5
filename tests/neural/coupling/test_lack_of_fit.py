"""Curves that are not hinges: the test of the residual by its null distribution, and what is named instead."""

import numpy as np
import pytest
from populations import WIDTH
from test_stimulus_blocks import presented

from vibrissa.neural.coupling.lack_of_fit import describe, response_curve, structure_p_value
from vibrissa.neural.coupling.repeatability import r_squared_ceiling
from vibrissa.neural.coupling.threshold_linear import HingeGrid
from vibrissa.neural.coupling.tuning import forward_fit, predicted


def test_p_values_of_residuals_without_structure_are_even():
    rng, n = np.random.default_rng(0), 600
    slopes, extra = np.vstack([np.ones(n), rng.normal(size=n)]), rng.normal(size=(3, n))
    starts, weights = 10 * np.arange(60), np.ones(n)
    base = np.linalg.qr(slopes.T)[0]
    found = []
    for _ in range(400):
        # what else drives the unit is alike within blocks
        residual = rng.normal(size=n) + np.repeat(rng.normal(size=60), 10)
        found.append(structure_p_value(extra, slopes, residual - base @ (base.T @ residual), weights, starts))
    assert np.mean(np.array(found) <= 0.05) == pytest.approx(0.05, abs=0.03)
    assert np.mean(found) == pytest.approx(0.5, abs=0.05)
    assert np.isnan(structure_p_value(extra, slopes, residual, weights, 120 * np.arange(5)))


def described(rate_of, seed=1, n_trials=60, adapting=False):
    rng = np.random.default_rng([9, seed])
    drive = presented(rng)
    rate = drive.seen(rate_of(drive.envelope), 0.012)
    if adapting:
        past = np.zeros(rate.size)
        for k in range(1, rate.size):
            past[k] = 0.9 * past[k - 1] + 0.1 * (rate[k - 1] - 5)
        rate = np.maximum(rate - 0.7 * past, 0)
    counts = rng.poisson(rate * WIDTH, (n_trials, rate.size)).astype(float)
    fit = forward_fit(HingeGrid.of(drive), counts.sum(0), n_trials * WIDTH)
    return describe(drive, counts.mean(0) / WIDTH, fit, r_squared_ceiling(counts)), (drive, counts / WIDTH, fit)


def hinge(a, threshold=42.3e-6):
    return np.maximum(a - threshold, 0)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_hinge_is_a_hinge(seed):
    found, (drive, rates, fit) = described(lambda a: 5 + 2.5e5 * hinge(a), seed)
    assert found.model == "threshold-linear"
    curve = response_curve(drive, rates, fit.latency, predicted(drive, fit))
    assert (np.diff(curve["response_envelope"]) > 0).all()
    z = (curve["response_rate"] - curve["response_rate_fitted"]) / curve["response_rate_se"]
    assert np.abs(z).max() < 4


@pytest.mark.parametrize(
    ("model", "rate"),
    [
        ("saturation", lambda a: 5 + 2.5e5 * (hinge(a) - hinge(a, 85e-6))),
        ("rectified square", lambda a: 2 + 1e10 * hinge(a, 30e-6) ** 2),
        ("smooth curve", lambda a: 30 * np.log1p(a / 20e-6)),
    ],
)
def test_another_curve_is_named(model, rate):
    found, _ = described(rate)
    assert found.p_value < 1e-3
    assert found.model == model
    if model == "saturation":
        assert found.at == pytest.approx(85e-6, rel=0.15)


def test_a_rate_that_adapts_is_named():
    found, _ = described(lambda a: 5 + 3.5e5 * hinge(a), adapting=True)
    assert found.model == "adaptation"
    assert found.at in (0.05, 0.3)


def test_columns_within_the_fit_have_no_p_value():
    """An envelope of two values, such as a pulse, leaves nothing for a curve to add."""
    pulse = np.tile(np.repeat([0.0, 1.0], 5), 60)
    slopes = np.vstack([np.ones(600), pulse])
    residual = np.random.default_rng(0).normal(size=600)
    assert np.isnan(
        structure_p_value(np.vstack([pulse**2, 3 * pulse]), slopes, residual, np.ones(600), 10 * np.arange(60))
    )
