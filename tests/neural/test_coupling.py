"""Envelope and firing rate: bins in common, and which comes after which."""

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.neural.coupling import bin_means, maximal_correlation


def test_means_of_bins_by_hand():
    means = bin_means(
        np.array([0, 0.1, 0.2, 0.3, 0.5]), np.array([9.0, 1, 3, 5, 7]), start=0.1, n_bins=2, bin_width=0.2
    )
    np.testing.assert_allclose(means, [2, 5])  # [0.1, 0.3): 1, 3; [0.3, 0.5): 5


def test_samples_on_an_edge_belong_to_the_bin_that_starts_there():
    time = np.arange(0, 1000) * 0.001
    np.testing.assert_allclose(
        bin_means(time, time, start=0.0, n_bins=100, bin_width=0.01), 0.0045 + 0.01 * np.arange(100)
    )


def test_empty_bins_are_refused():
    with pytest.raises(InputError, match="bin width"):
        bin_means(np.array([0.0, 1.0]), np.zeros(2), start=0.0, n_bins=4, bin_width=0.25)


@pytest.mark.parametrize("delay", [-1, 0, 1])
def test_positive_lag_means_the_rate_comes_after_the_envelope(delay):
    noise = np.random.default_rng(3).normal(size=80)
    envelope, rate = noise[2:-2], 3 + 2 * noise[2 - delay : 78 - delay]
    r, lag = maximal_correlation(rate, envelope)
    assert lag == delay
    assert r == pytest.approx(1)


def test_only_the_shifts_allowed_are_tried():
    noise = np.random.default_rng(4).normal(size=80)
    envelope, rate = noise[3:], noise[:-3]  # three bins late
    assert maximal_correlation(rate, envelope, max_lag=1)[0] < 0.5
    assert maximal_correlation(rate, envelope, max_lag=3) == (pytest.approx(1), 3)


def test_silent_unit_has_no_correlation():
    r, _ = maximal_correlation(np.zeros(20), np.arange(20.0))
    assert np.isnan(r)
