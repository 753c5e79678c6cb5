"""Areas under the ROC curve and d′ against closed forms; intervals that hold as often as they say."""

import numpy as np
import pytest
from refusals import refusal
from scipy.special import ndtr
from scipy.stats import mannwhitneyu, poisson

from vibrissa.neural.coding.sensitivity import d_prime, roc_area, roc_area_interval, roc_curve


def test_area_is_that_of_mann_and_whitney_and_by_hand():
    assert roc_area(np.array([2.0, 3.0]), np.array([1.0, 2.0])) == 0.875  # three wins and a tie of four
    rng = np.random.default_rng(1)
    a, b = rng.poisson(4, 60), rng.poisson(5, 40)
    assert roc_area(a, b) == pytest.approx(mannwhitneyu(a, b).statistic / 2400)
    with refusal("format", "trials"):
        roc_area(np.array([]), b)


def test_normal_values_give_back_their_distance():
    rng = np.random.default_rng(2)
    found = d_prime(roc_area(rng.normal(1.3, 1, 40_000), rng.normal(0, 1, 40_000)))
    assert found == pytest.approx(1.3, abs=0.03)
    assert d_prime(0.5) == 0
    assert d_prime(1.0) == np.inf
    assert np.isnan(d_prime(np.nan))


def test_interval_of_a_perfect_area_has_a_lower_end():
    low, high = roc_area_interval(1.0, 20, 20)
    assert 0.8 < low < 1
    assert high == 1
    assert roc_area_interval(0.0, 20, 20) == pytest.approx((1 - high, 1 - low))
    with refusal("format", "area under the ROC curve"):
        roc_area_interval(np.nan, 20, 20)


@pytest.mark.parametrize("distance", [0.0, 1.0, 2.5])
def test_interval_holds_the_area_as_often_as_it_says(distance):
    rng, area, held = np.random.default_rng(3), ndtr(distance / np.sqrt(2)), 0
    for _ in range(300):
        low, high = roc_area_interval(roc_area(rng.normal(distance, 1, 25), rng.normal(0, 1, 40)), 25, 40)
        held += low <= area <= high
    assert 0.91 <= held / 300 <= 0.99


def test_curve_of_poisson_counts_is_the_exact_one():
    rng = np.random.default_rng(4)
    false = poisson.sf(np.arange(-1, 15), 4.0)[::-1]
    found = roc_curve(rng.poisson(7.0, 50_000), rng.poisson(4.0, 50_000), false)
    np.testing.assert_allclose(found, poisson.sf(np.arange(-1, 15), 7.0)[::-1], atol=0.01)
