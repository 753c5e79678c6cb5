"""Drift and presence of units whose course is known."""

import numpy as np
import pytest

from vibrissa.neural.sorting.stability import amplitude_change, presence_ratio, rate_change

RNG = np.random.default_rng


def fading(change, n, duration, seed=0):
    """Spikes of a rate that changes evenly, by this share of its mean."""
    rng = RNG(seed)
    time = rng.uniform(0, 1, 4 * n)
    return np.sort(duration * time[rng.uniform(0, 2, 4 * n) < 1 + change * (time - 0.5)])


@pytest.mark.parametrize("change", [-2.0, -0.5, 0.0, 1.0])
def test_a_change_of_rate_is_found_within_its_error(change):
    found = [rate_change(fading(change, 2000, 900.0, seed), 900.0) for seed in range(20)]
    assert np.mean(found) == pytest.approx(change, abs=4 * np.sqrt(12 / 4000 / 20))
    assert np.std(found) < 1.5 * np.sqrt(12 / 4000)


def test_a_unit_that_is_lost_half_way_is_there_half_of_the_time():
    assert presence_ratio(np.linspace(0, 1799, 5000), 3600.0) == 0.5
    assert presence_ratio(np.linspace(0, 3599, 5000), 3600.0) == 1
    assert presence_ratio(np.array([5.0]), 20.0) == 0.1  # tenths of a short recording
    assert presence_ratio(np.array([125.0]), 930.0) == pytest.approx(1 / 15)  # the last half minute is no whole bin
    assert presence_ratio(np.zeros(0), 100.0) == 0
    assert np.isnan(presence_ratio(np.zeros(0), 0.0))


def test_a_drifting_amplitude_is_found():
    time = np.sort(RNG(1).uniform(0, 600.0, 3000))
    amplitude = 100 - 40 * time / 600 + RNG(2).normal(0, 10, 3000)
    assert amplitude_change(time, amplitude, 600.0) == pytest.approx(-0.5, abs=0.03)
    assert amplitude_change(time, -amplitude, 600.0) == pytest.approx(0.5, abs=0.03)
    assert np.isnan(amplitude_change(time, np.full(3000, np.nan), 600.0))
    assert np.isnan(amplitude_change(time[:5], amplitude[:5], 600.0))
