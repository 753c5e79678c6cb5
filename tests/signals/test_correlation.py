"""Correlation over lags: which comes after which."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibrissa.errors import InputError
from vibrissa.signals.correlation import lagged_correlation


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
    with pytest.raises(InputError, match="equal length"):
        lagged_correlation(a, b, lag)
