"""Simulated units: their rate by hand, their spikes by the laws of Poisson."""

import numpy as np
import pytest
from scipy.stats import kstest

from vibrissa.errors import InputError
from vibrissa.neural.response import spike_counts
from vibrissa.neural.virtual import HingeUnit, simulate_spikes

UNIT = HingeUnit(threshold=40e-6, slope=2.5e5, baseline=5.0, latency=0.0)


def test_rate_is_a_hinge_of_the_envelope():
    time = np.arange(4.0)
    rate = UNIT.rate(time, np.array([0, 40e-6, 60e-6, 140e-6]))
    np.testing.assert_allclose(rate, [5, 5, 10, 30])  # 0.25 AP/s per µm above 40 µm


def test_rate_follows_the_envelope_after_the_latency():
    unit = HingeUnit(threshold=0.0, slope=1e6, baseline=2.0, latency=0.01)
    time = np.arange(6) * 0.005
    rate = unit.rate(time, np.array([1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6]))
    np.testing.assert_allclose(rate, [2, 2, 3, 4, 5, 6])


def test_counts_have_the_mean_and_the_variance_of_poisson():
    time = np.linspace(0, 1, 2001)
    envelope = 80e-6 * (1 + np.sin(2 * np.pi * 3 * time))
    n_trials, n_bins = 4000, 20
    spikes = simulate_spikes(UNIT, time, envelope, n_trials, rng=np.random.default_rng(1))
    counts = spike_counts(spikes, n_trials=n_trials, start=0.0, n_bins=n_bins, bin_width=0.05)
    rate = UNIT.rate(time, envelope)
    area = np.concatenate([[0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(time))])
    expected = np.diff(area[::100])
    np.testing.assert_allclose((counts.mean(0) - expected) / np.sqrt(expected / n_trials), 0, atol=4)
    np.testing.assert_allclose(counts.var(0) / counts.mean(0), 1, atol=4 * np.sqrt(2 / n_trials) * 2)
    between = np.corrcoef(counts.T)[np.triu_indices(n_bins, 1)]
    assert np.abs(between).max() < 4.5 / np.sqrt(n_trials)  # bins know nothing of each other


def test_steady_rate_gives_exponential_intervals():
    time = np.linspace(0, 400, 5)
    spikes = simulate_spikes(UNIT, time, np.full(5, 100e-6), 1, rng=np.random.default_rng(2))
    assert kstest(np.diff(spikes.spike_time), "expon", (0, 1 / 20)).pvalue > 1e-3


def test_spikes_are_sorted_by_trial_then_time_and_repeat_with_the_seed():
    time = np.linspace(2.0, 3.0, 100)
    one, same = (simulate_spikes(UNIT, time, np.full(100, 1e-4), 7, rng=np.random.default_rng(3)) for _ in range(2))
    assert one.identical(same)
    trial, when = one.spike_trial.values, one.spike_time.values
    assert np.all(np.diff(trial + (when - 2) / 2) > 0)
    assert 2.0 <= when.min() <= when.max() <= 3.0
    assert one.spike_time.attrs["units"] == "s"


def test_silent_unit_fires_nothing():
    unit = HingeUnit(baseline=0.0)
    spikes = simulate_spikes(unit, np.arange(3.0), np.zeros(3), 5, rng=np.random.default_rng(0))
    assert spikes.spike_time.size == 0


@pytest.mark.parametrize("name", ["threshold", "slope", "baseline", "latency"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_impossible_units_are_refused(name, value):
    with pytest.raises(InputError, match=f"HingeUnit.{name}"):
        HingeUnit(**{name: value})


def test_at_least_one_trial_is_needed():
    with pytest.raises(InputError, match="number of trials"):
        simulate_spikes(UNIT, np.arange(3.0), np.zeros(3), 0, rng=np.random.default_rng(0))
