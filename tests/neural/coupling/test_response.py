"""Counts of spikes, by hand."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.stats import sem

from vibrissa.neural.coupling.response import bin_edges, psth, spike_counts
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.trials import cut_into_trials, trial_table
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
        (
            lambda: spike_counts(spikes([0.1], [2]), n_trials=2, start=0, n_bins=1, bin_width=1),
            ("range", "spike_trial"),
        ),
        (
            lambda: spike_counts(spikes([0.1], [-1]), n_trials=2, start=0, n_bins=1, bin_width=1),
            ("range", "spike_trial"),
        ),
        (lambda: spike_counts(spikes([0.1], [0]), n_trials=1, start=0, n_bins=1, bin_width=0), ("range", "bin width")),
        (
            lambda: spike_counts(dataset(spike_time=[0.1]), n_trials=1, start=0, n_bins=1, bin_width=1),
            ("missing", "variable 'spike_trial'"),
        ),
    ],
)
def test_impossible_counts_are_refused(call, rule):
    with refusal(*rule):
        call()


# Histograms


def test_histogram_by_hand_with_bins_of_any_width():
    table = spikes([-0.5, 0.0, 0.1, 0.5, 1.9, 2.0], [0, 0, 1, 0, 1, 1])
    found = psth(table, [-1, 0, 0.5, 2], n_trials=2)
    np.testing.assert_array_equal(found.spike_count, [[1, 1, 1], [0, 1, 1]])  # 2.0 is the end, half-open
    np.testing.assert_allclose(found.firing_rate, [0.5, 2, 2 / 3])
    np.testing.assert_allclose(found.firing_rate_se, [0.5, 0, 0])
    assert found.bin.values.tolist() == [-1, 0, 0.5]
    assert found.bin_stop.values.tolist() == [0, 0.5, 2]


def test_standard_error_is_that_of_the_mean_over_trials():
    rng = np.random.default_rng(5)
    found = psth(spikes(rng.uniform(0, 1, 300), rng.integers(0, 7, 300)), bin_edges(0, 1, 0.1), n_trials=7)
    np.testing.assert_allclose(found.firing_rate_se, sem(found.spike_count.values / 0.1, axis=0))


def test_units_lead_the_histogram():
    table = spike_table(np.array([0.1, 0.2, 0.7]), np.array([1, 1, 0]), ["a", "b"], trial=np.array([0, 1, 1]))
    found = psth(table, [0, 0.5, 1], n_trials=2)
    assert found.firing_rate.dims == ("unit", "bin")
    np.testing.assert_allclose(found.firing_rate, [[0, 1], [2, 0]])
    assert found.unit_name.values.tolist() == ["a", "b"]


@settings(deadline=None, derandomize=True, max_examples=40)
@given(seed=st.integers(0, 10**6), start=st.sampled_from([0.0, -0.3, 0.1]), width=st.sampled_from([0.01, 0.1, 0.05]))
def test_even_bins_count_as_before(seed, start, width):
    rng = np.random.default_rng(seed)
    table = spikes(start + np.concatenate([rng.uniform(-1, 3, 50), width * np.arange(40)]), rng.integers(0, 3, 90))
    found = psth(table, bin_edges(start, start + 30 * width, width), n_trials=3).spike_count
    np.testing.assert_array_equal(found, spike_counts(table, n_trials=3, start=start, n_bins=30, bin_width=width))


@pytest.mark.parametrize("begin", [0.0, 2e4, 1e5, 1e6])
def test_a_spike_on_every_edge_is_one_in_every_bin_however_late_the_trial(begin):
    onset = begin + np.array([0.0, 10.0, 20.0])
    time = np.round(onset[:, None] + np.arange(1000) * 1e-3, 3).ravel()
    table = spike_table(time, np.zeros(time.size, int), ["a"])
    cut = cut_into_trials(table, trial_table(onset, onset + 1.0))
    assert (spike_counts(cut, n_trials=3, start=0.0, n_bins=1000, bin_width=1e-3) == 1).all()
    assert (psth(cut, bin_edges(0, 1, 1e-3), n_trials=3).spike_count == 1).all()


def test_histogram_agrees_with_elephant():
    statistics = pytest.importorskip("elephant.statistics")
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    rng = np.random.default_rng(6)
    time, trial = rng.uniform(0, 2, 500), rng.integers(0, 9, 500)
    trains = [neo.SpikeTrain(np.sort(time[trial == k]) * pq.s, t_stop=2.0) for k in range(9)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs = statistics.time_histogram(trains, bin_size=10 * pq.ms, output="rate").rescale("Hz").magnitude[:, 0]
    ours = psth(spikes(time, trial), bin_edges(0, 2, 0.01), n_trials=9).firing_rate
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


def test_counts_agree_with_pynapple():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        nap = pytest.importorskip("pynapple")
        rng = np.random.default_rng(7)
        time, trial = rng.uniform(0, 2, 500), rng.integers(0, 9, 500)
        support = nap.IntervalSet(0, 2)  # told, or it would begin at the first spike
        theirs = [nap.Ts(np.sort(time[trial == k]), time_support=support).count(0.01).values for k in range(9)]
    ours = psth(spikes(time, trial), bin_edges(0, 2, 0.01), n_trials=9).spike_count
    np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: psth(spikes([0.1], [0]), [0, 1]), ("range", "number of trials")),
        (lambda: psth(spikes([0.1], [3]), [0, 1], n_trials=3), ("range", "spike_trial")),
        (lambda: psth(spikes([0.1], [0]), [0, 0], n_trials=1), ("too-few", "edges of bins")),
        (lambda: psth(spikes([0.1], [0]), [0, np.nan], n_trials=1), ("too-few", "edges of bins")),
        (lambda: bin_edges(0, 1, 0.3), ("range", "bin width")),
        (lambda: bin_edges(0, 1, -0.1), ("range", "bin width")),
        (lambda: bin_edges(0, np.inf, 0.1), ("range", "window")),
    ],
)
def test_impossible_histograms_are_refused(call, rule):
    with refusal(*rule):
        call()
