"""Counts of spikes, by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibrissa.errors import InputError
from vibrissa.neural.response import spike_counts
from vibrissa.quantities import dataset


def spikes(times, trials):
    return dataset(spike_time=np.array(times, float), spike_trial=np.array(trials, int))


def test_counts_by_hand_in_half_open_bins():
    table = spikes([0.9, 1.0, 1.24, 1.25, 1.49, 1.5, 1.0], [0, 0, 0, 0, 0, 0, 2])
    counts = spike_counts(table, n_trials=3, start=1.0, n_bins=2, bin_width=0.25)
    np.testing.assert_array_equal(counts, [[2, 2], [0, 0], [1, 0]])  # 0.9 and 1.5 lie outside; trial 1 is silent


@settings(deadline=None, derandomize=True, max_examples=40)
@given(k=st.integers(0, 499), start=st.sampled_from([0.0, 0.1, -0.3]), width=st.sampled_from([0.01, 0.005, 0.1]))
def test_spike_on_an_edge_belongs_to_the_bin_that_starts_there(k, start, width):
    counts = spike_counts(spikes([start + k * width], [0]), n_trials=1, start=start, n_bins=500, bin_width=width)
    assert counts[0, k] == 1


@settings(deadline=None, derandomize=True, max_examples=30)
@given(seed=st.integers(0, 10**6), merge=st.integers(2, 5))
def test_wider_bins_hold_the_sum_of_the_narrow_ones(seed, merge):
    rng = np.random.default_rng(seed)
    table = spikes(rng.uniform(0, 1, 200), rng.integers(0, 4, 200))
    fine = spike_counts(table, n_trials=4, start=0.0, n_bins=10 * merge, bin_width=0.1 / merge)
    coarse = spike_counts(table, n_trials=4, start=0.0, n_bins=10, bin_width=0.1)
    np.testing.assert_array_equal(fine.reshape(4, 10, merge).sum(-1), coarse)
    assert coarse.sum() == 200


def test_no_spikes_are_counted_as_none():
    assert spike_counts(spikes([], []), n_trials=2, start=0.0, n_bins=3, bin_width=0.1).sum() == 0


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: spike_counts(spikes([0.1], [2]), n_trials=2, start=0, n_bins=1, bin_width=1), "spike_trial"),
        (lambda: spike_counts(spikes([0.1], [-1]), n_trials=2, start=0, n_bins=1, bin_width=1), "spike_trial"),
        (lambda: spike_counts(spikes([0.1], [0]), n_trials=1, start=0, n_bins=1, bin_width=0), "bin width"),
        (lambda: spike_counts(dataset(spike_time=[0.1]), n_trials=1, start=0, n_bins=1, bin_width=1), "spike_trial"),
    ],
)
def test_impossible_counts_are_refused(call, rule):
    with pytest.raises(InputError, match=rule):
        call()
