"""One rule of significance, and what a rank among N random draws can reach."""

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from vibrissa.stats import LEVEL, fewest_draws, hotelling_p_value, least_p, reaches, significant


def test_nineteen_gratings_cannot_reach_the_level_and_twenty_can():
    """The largest of all is the first among 1 + N: p = (1 + 0)/(1 + N)."""
    assert LEVEL == 0.05
    assert least_p(19) == 0.05
    assert reaches([0, 3, 19, 20, 39]).tolist() == [False, False, False, True, True]
    assert significant([0.05, np.nextafter(0.05, 0), np.nan]).tolist() == [False, True, False]


@pytest.mark.parametrize("level", [0.1, 0.05, 0.01, 0.001, 0.07])
def test_fewest_draws_are_the_first_that_reach_the_level(level):
    fewest = fewest_draws(level)
    assert reaches(fewest, level)
    assert not reaches(fewest - 1, level)


def test_hotellings_test_of_one_number_is_students():
    values = np.random.default_rng(0).normal(0.3, 1.0, 12)
    statistic = values.mean() ** 2 / (values.var(ddof=1) / values.size)
    assert hotelling_p_value(statistic, 1, values.size) == pytest.approx(ttest_1samp(values, 0).pvalue, rel=1e-9)


def test_hotellings_test_of_nothing_passes_as_often_as_it_says():
    rng, size, draws = np.random.default_rng(1), 6, 10
    drawn = rng.normal(size=(4000, draws, size))
    mean, centred = drawn.mean(1), drawn - drawn.mean(1, keepdims=True)
    covariance = np.einsum("rdi,rdj->rij", centred, centred) / (draws - 1) / draws
    statistic = np.einsum("ri,ri->r", mean, np.linalg.solve(covariance, mean[..., None])[..., 0])
    for level in (0.05, 0.01):
        assert np.mean(hotelling_p_value(statistic, size, draws) <= level) == pytest.approx(level, rel=0.25)
    assert np.isnan(hotelling_p_value(statistic, size, size)).all()
