"""The time in which units were observed: overlapping intervals count once, gaps not at all."""

import numpy as np
import pandas as pd
import pytest
from refusals import refusal

import vibrissa as vb
from vibrissa.neural.io.tables.spikes import spike_table, with_intervals
from vibrissa.neural.sorting.observed import observed_for, trains_of, trials_laid_out, within_trials


def session(times):
    index = np.repeat(np.arange(len(times)), [len(one) for one in times])
    return spike_table(np.concatenate(times), index, [f"u{k}" for k in range(len(times))])


def test_overlapping_intervals_count_once_and_spikes_between_them_not():
    spikes = with_intervals(session([[0.5, 2.5, 3.5, 9.0]]), [np.array([[2.0, 4.0], [0.0, 1.0], [3.0, 5.0]])])
    (train,) = trains_of(observed_for(spikes))
    assert train.duration == 4
    assert train.time.tolist() == [0.5, 2.5, 3.5]
    assert train.elapsed.tolist() == [0.5, 1.5, 2.5]


def test_a_session_lasts_as_long_as_is_said_or_as_its_spikes_do():
    spikes = session([[1.0, 3.0], [7.0]])
    assert [one.duration for one in trains_of(observed_for(spikes))] == [6.0, 6.0]
    assert [one.duration for one in trains_of(observed_for(spikes, 10.0))] == [10.0, 10.0]
    late = session([[86_401.0, 86_403.0]])  # a clock that starts at midnight of the day before
    (train,) = trains_of(observed_for(late, 10.0))
    assert (train.duration, train.elapsed.tolist()) == (10.0, [0.0, 2.0])
    with refusal("range", "duration", "5.0"):
        observed_for(spikes, 5.0)


def test_trials_lie_one_after_the_other_and_no_interval_reaches_over():
    spikes = spike_table([0.0, 0.9999, 0.0001, 5.0], [0, 0, 0, 0], ["a"], trial=[0, 0, 1, 1])
    seen = trials_laid_out(spikes, (0.0, 1.0), 3)
    (train,) = trains_of(seen)
    assert train.duration == 3
    np.testing.assert_allclose(train.elapsed, [0.0, 0.9999, 1.0001])
    assert np.diff(train.time).min() > 0.9
    with refusal("range", "trial", "1"):
        trials_laid_out(spikes, (0.0, 1.0), 1)


def test_units_are_judged_in_the_trials_alone_and_there_only_while_observed():
    spikes = session([[0.5, 5.5, 11.0], [5.5]])
    seen = within_trials(spikes, np.array([0.0, 10.0]), np.array([1.0, 12.0]))
    first, second = trains_of(seen)
    assert (first.duration, first.time.tolist()) == (3.0, [0.5, 11.0])
    assert (second.duration, second.time.size) == (3.0, 0)
    part = with_intervals(spikes, [np.array([[0.25, 10.5]]), np.zeros((0, 2))])
    first, second = trains_of(within_trials(part, np.array([0.0, 10.0]), np.array([1.0, 12.0])))
    assert (first.duration, first.time.tolist()) == (pytest.approx(1.25), [0.5])
    assert second.duration == 0


@pytest.mark.parametrize(
    ("times", "trials", "rate"),
    [
        (np.arange(1000) * 0.01, [(1, 2), (5, 6)], 100.0),
        ([1.0, 2.0, 3.0], [(1, 2), (2, 3)], 1.0),
        ([10 * k + 0.1 for k in range(8)], [(10 * k, 10 * k + 1.0) for k in range(20)], 0.4),
        ([0.1, 0.2, 10.1, 12.9], [(0, 1), (10, 13)], 1.0),
    ],
)
def test_spikes_cut_into_trials_have_the_rate_of_a_session_judged_in_them(times, trials, rate):
    spikes = vb.read_spikes({"a": times})
    for quality in (vb.unit_quality(spikes, trials=trials), vb.unit_quality(vb.read_spikes(spikes, trials=trials))):
        assert quality.unit_rate.item() == pytest.approx(rate, rel=1e-9)


def test_trials_that_were_cut_by_a_window_last_as_long_as_it():
    spikes = vb.read_spikes({"a": [9.75, 10.25, 20.5]}, trials=[(10, 11), (20, 21)], window=(-0.5, 1.0))
    assert vb.unit_quality(spikes).unit_rate.item() == pytest.approx(1.0)


def test_the_window_of_a_trial_is_half_open():
    spikes = spike_table([0.0, 0.5, 1.0], [0, 0, 0], ["a"], trial=[0, 0, 1])
    (train,) = trains_of(trials_laid_out(spikes, (0.0, 1.0), 2))
    assert train.time.size == 2


def test_trials_without_a_time_to_last_are_refused():
    silent = pd.DataFrame({"spike_time": [np.nan], "unit": ["a"], "trial": [0]})
    with refusal("range", "window"):
        vb.unit_quality(silent)
