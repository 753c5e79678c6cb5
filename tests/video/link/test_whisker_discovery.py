"""Medians of tracklets against NumPy's, one by one."""

import numpy as np

from vibrissa.video.link.starts.whisker_discovery import _medians


def test_medians_are_those_of_each_tracklet_and_of_an_empty_one_unknown():
    rng = np.random.default_rng(1)
    name, values = rng.integers(-1, 9, 300), rng.normal(size=300)
    name[name == 4] = -1
    expected = [np.median(values[name == k]) if (name == k).any() else np.nan for k in range(9)]
    np.testing.assert_array_equal(_medians(name, values, 9), expected)
