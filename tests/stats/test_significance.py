"""One rule of significance, and what a rank among N random draws can reach."""

import numpy as np
import pytest

from vibrissa.stats import LEVEL, fewest_draws, least_p, reaches, significant


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
