"""Correlation over lags: which comes after which."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.signals.correlation import best_correlation, lagged_correlation


@settings(deadline=None, derandomize=True, max_examples=30)
@given(seed=st.integers(0, 10**6), delay=st.integers(-5, 5))
def test_positive_lag_means_the_signal_comes_after(seed, delay):
    noise = np.random.default_rng(seed).normal(size=120)
    reference, signal = noise[10:-10], noise[10 - delay : 110 - delay]  # signal(t) = reference(t − delay)
    lag, r = lagged_correlation(signal, reference, 5)
    assert lag[np.argmax(r)] == delay
    assert r.max() == pytest.approx(1, abs=1e-12)


@settings(deadline=None, derandomize=True, max_examples=30)
@given(seed=st.integers(0, 10**6), gain=st.floats(0.1, 10), offset=st.floats(-5, 5))
def test_correlation_is_pearsons_and_exchanging_the_two_mirrors_it(seed, gain, offset):
    a, b = np.random.default_rng(seed).normal(size=(2, 40))
    lag, r = lagged_correlation(a, b, 4)
    np.testing.assert_allclose(r[lag == 3], np.corrcoef(a[3:], b[:-3])[0, 1], atol=1e-12)
    np.testing.assert_allclose(lagged_correlation(b, a, 4)[1], r[::-1], atol=1e-12)
    np.testing.assert_allclose(lagged_correlation(gain * a + offset, b, 4)[1], r, atol=1e-10)
    np.testing.assert_allclose(lagged_correlation(-a, b, 4)[1], -r, atol=1e-12)


def test_correlation_by_hand():
    lag, r = lagged_correlation(np.array([0.0, 0, 1, 0, 0]), np.array([0.0, 1, 0, 0, 0]), 1)
    np.testing.assert_array_equal(lag, [-1, 0, 1])
    np.testing.assert_allclose(r, [-1 / 3, -0.25, 1])  # over 4, 5 and 4 shared samples


@pytest.mark.parametrize("value", [0.0, 0.1, 1e9 / 3])
def test_constant_signals_have_no_correlation(value):
    _, r = lagged_correlation(np.full(30, value), np.sin(np.arange(30.0)), 2)
    assert np.isnan(r).all()


@pytest.mark.parametrize(("a", "b", "lag"), [(np.zeros(5), np.zeros(6), 1), (np.zeros(5), np.zeros(5), 3)])
def test_signals_that_do_not_overlap_are_refused(a, b, lag):
    with refusal("shape", "signals"):
        lagged_correlation(a, b, lag)


def test_best_correlation_is_the_largest_of_the_lagged_ones():
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal(400), rng.standard_normal((3, 400))
    lag, rho = best_correlation(a, b, 20)
    for k in range(3):
        lags, each = lagged_correlation(a, b[k], 20)
        assert rho[k] == pytest.approx(each.max(), abs=1e-12)
        assert lag[k] == lags[each.argmax()]


@pytest.mark.parametrize("delay", [-1, 0, 1])
def test_positive_lag_means_the_rate_comes_after_the_envelope(delay):
    noise = np.random.default_rng(3).normal(size=80)
    envelope, rate = noise[2:-2], 3 + 2 * noise[2 - delay : 78 - delay]
    lag, r = best_correlation(rate, envelope, 1)
    assert lag == delay
    assert r == pytest.approx(1)


def test_only_the_shifts_allowed_are_tried():
    noise = np.random.default_rng(4).normal(size=80)
    envelope, rate = noise[3:], noise[:-3]  # three bins late
    assert best_correlation(rate, envelope, 1)[1] < 0.5
    assert best_correlation(rate, envelope, 3) == (3, pytest.approx(1))


def test_silent_unit_has_no_correlation():
    lag, r = best_correlation(np.zeros(20), np.arange(20.0), 1)
    assert lag == 0
    assert np.isnan(r)
