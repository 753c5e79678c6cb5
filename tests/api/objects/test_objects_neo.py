"""Trains, segments and blocks of neo: trials and units are those that neo has."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from recorded_trains import PERIOD, TRIAL, assert_same, few, names_of, onsets_of, recordings, session_trains
from refusals import refusal

from vibrissa.api.objects.spikes import as_spikes
from vibrissa.neural.io.tables.spikes import table_of_trains
from vibrissa.neural.io.tables.trials import cut_into_trials, trial_table


def block_of(recording, starts):
    """Block with a segment for each trial, whose times begin at its start [ms]."""
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    block = neo.Block()
    for trial, start in enumerate(starts):
        segment = neo.Segment()
        for name, unit in zip(names_of(recording), recording, strict=True):
            ends = {"t_start": 1e3 * start * pq.ms, "t_stop": 1e3 * (start + TRIAL) * pq.ms}
            segment.spiketrains.append(neo.SpikeTrain(1e3 * (unit[trial] + start) * pq.ms, name=name, **ends))
        block.segments.append(segment)
    return block


@few
@given(recordings())
def test_segments_of_neo_are_trials(recording):
    block = block_of(recording, onsets_of(recording))
    spikes = as_spikes(block)
    assert_same(spikes, recording)
    np.testing.assert_allclose(spikes.trial_start, onsets_of(recording))
    assert_same(as_spikes(list(block.segments)), recording)
    aligned = as_spikes(block_of(recording, np.zeros(len(recording[0]))))
    assert_same(aligned, recording)
    assert "trial_start" not in aligned
    assert (aligned.attrs["window_start"], aligned.attrs["window_stop"]) == (0.0, TRIAL)


@few
@given(recordings())
def test_trains_of_neo_are_cut_by_an_epoch(recording):
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    stop = onsets_of(recording)[-1] + PERIOD
    trains = [neo.SpikeTrain(time * pq.s, t_stop=stop * pq.s) for time in session_trains(recording)]
    for k, train in enumerate(trains):
        train.name = f"u{k}"
    onset = onsets_of(recording) * 1e3 * pq.ms
    epoch = neo.Epoch(onset, durations=np.full(onset.size, TRIAL) * pq.s)
    assert_same(as_spikes(trains, trials=epoch), recording)
    assert_same(as_spikes(trains, trials=neo.Event(onset), window=(0.0, TRIAL)), recording)


@pytest.mark.parametrize("reset", [False, True])
def test_trials_are_those_into_which_neo_cuts_a_block(reset):
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    utils = pytest.importorskip("neo.utils")
    rng, block, segment = np.random.default_rng(6), neo.Block(), neo.Segment()
    for name in "ab":
        train = neo.SpikeTrain(np.sort(rng.random(300)) * 60 * pq.s, t_stop=60 * pq.s, name=name)
        segment.spiketrains.append(train)
    epoch = neo.Epoch(np.arange(1.0, 55.0, 6.0) * pq.s, durations=2.5 * np.ones(9) * pq.s)
    segment.epochs.append(epoch)
    block.segments.append(segment)
    ours = as_spikes(block, trials=epoch)
    theirs = as_spikes(utils.cut_block_by_epochs(block, reset_time=reset))
    assert ours.attrs["n_trials"] == theirs.attrs["n_trials"] == 9
    np.testing.assert_allclose(ours.spike_time, theirs.spike_time, atol=1e-12)
    for name in ("spike_trial", "spike_unit"):
        np.testing.assert_array_equal(ours[name], theirs[name])
    assert ("trial_start" in theirs) is not reset


def test_a_train_of_neo_keeps_when_it_was_recorded():
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    spikes = as_spikes(neo.SpikeTrain([1500.0] * pq.ms, t_start=1 * pq.s, t_stop=3 * pq.s))
    assert (spikes.interval_start.item(), spikes.interval_stop.item()) == (1.0, 3.0)
    assert spikes.spike_time.values.tolist() == [1.5]
    cut = as_spikes(spikes, trials=[(0.5, 1.0), (1.5, 2.5)])
    assert cut.unit_observed.values.tolist() == [[False, True]]
    assert cut.spike_time.values.tolist() == [0.0]


def test_times_with_a_unit_keep_their_meaning():
    pq = pytest.importorskip("quantities")
    spikes = as_spikes({"a": [1100.0, 2200.0] * pq.ms}, trials=[[1.0, 2.0], [2.0, 3.0]] * pq.s)
    np.testing.assert_allclose(spikes.spike_time, [0.1, 0.2])
    with refusal("unknown", "unit a"):
        as_spikes({"a": [1.0] * pq.m})


def test_a_unit_that_is_absent_from_a_segment_was_not_observed_there():
    block = block_of([[np.array([0.5]), np.array([0.25])], [np.array([1.0]), np.array([])]], [0.0, 5.0])
    block.segments[1].spiketrains = list(block.segments[1].spiketrains)[:1]
    spikes = as_spikes(block)
    assert spikes.unit_observed.values.tolist() == [[True, True], [True, False]]
    assert spikes.unit_name.values.tolist() == ["u0", "u1"]


def test_objects_of_neo_that_do_not_say_which_unit_or_when_are_refused():
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    recording = [[np.array([0.5]), np.array([0.25])]]
    with refusal("conflict", "segments") as caught:
        as_spikes(block_of(recording, [0.0, 1.0]))
    assert "t_start" in str(caught.value)
    train = neo.SpikeTrain([0.5] * pq.s, t_stop=1.0, name="a")
    with refusal("format", "SpikeTrains of a segment", "['a', 'a']"):
        as_spikes([train, train])
    with refusal("format", "SpikeTrains of a segment", "['a', '']"):
        as_spikes([train, neo.SpikeTrain([0.5] * pq.s, t_stop=1.0)])
    block = block_of(recording, [0.0, 5.0])
    block.segments.append(neo.Segment())
    with refusal("too-few", "segment 2"):
        as_spikes(block)
    with refusal("unknown", "spikes", "neo Epoch"):
        as_spikes([train, neo.Epoch([0] * pq.s, durations=[1] * pq.s)])


def test_a_block_that_neo_itself_makes():
    neo = pytest.importorskip("neo")
    block = neo.io.ExampleIO("fake").read_block()
    spikes = as_spikes(block)
    expected = sum(train.size for segment in block.segments for train in segment.spiketrains)
    assert spikes.sizes["spike"] == expected > 0
    assert spikes.attrs["n_trials"] == len(block.segments) > 1
    assert spikes.sizes["unit"] == len(block.segments[0].spiketrains)
    lazy = neo.io.ExampleIO("fake").read_block(lazy=True)
    assert as_spikes(lazy).identical(spikes)


def test_a_real_receptor_is_the_same_through_neo_and_pynapple():
    """A locust's auditory receptor, of the package nitime."""
    nitime, neo, pq = (pytest.importorskip(name) for name in ("nitime", "neo", "quantities"))
    nap = pytest.importorskip("pynapple")
    ticks = np.loadtxt(Path(nitime.__file__).parent / "data" / "grasshopper_spike_times1.txt")  # [µs]
    through_neo = as_spikes(neo.SpikeTrain(ticks * pq.us, t_stop=10 * pq.s), trials=[(0.0, 5.0), (5.0, 10.0)])
    through_pynapple = as_spikes(nap.Ts(ticks, time_units="us"), trials=[(0.0, 5.0), (5.0, 10.0)])
    plain = cut_into_trials(table_of_trains([1e-6 * ticks], ["0"], {}), trial_table([0.0, 5.0], [5.0, 10.0]))
    for spikes in (through_neo, through_pynapple):
        np.testing.assert_allclose(spikes.spike_time, plain.spike_time, atol=1e-9)
        np.testing.assert_array_equal(spikes.spike_trial, plain.spike_trial)
    assert np.bincount(plain.spike_trial).sum() == 929


def test_a_train_that_stops_early_in_a_segment_was_not_observed_there():
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    block = block_of([[np.array([0.5]), np.array([0.25])], [np.array([1.0]), np.array([0.2])]], [0.0, 5.0])
    trains = list(block.segments[1].spiketrains)
    start = trains[0].t_start
    short = neo.SpikeTrain(trains[1].times, t_start=start, t_stop=start + 0.5 * pq.s, name=trains[1].name)
    block.segments[1].spiketrains = [trains[0], short]
    spikes = as_spikes(block)
    assert spikes.unit_observed.values.tolist() == [[True, True], [True, False]]
    assert spikes.attrs["remark"].startswith("1 of 4 trials in which a unit was not recorded")


@pytest.mark.parametrize("stop", [0.2, 1.0 - 1 / 30000])
def test_a_train_that_ends_with_its_last_spike_or_a_sample_early_was_observed_throughout(stop):
    neo, pq = pytest.importorskip("neo"), pytest.importorskip("quantities")
    block = block_of([[np.array([0.5]), np.array([0.25])], [np.array([1.0]), np.array([0.2])]], [0.0, 5.0])
    trains = list(block.segments[1].spiketrains)
    start = trains[0].t_start
    early = start + (stop * TRIAL if stop > 0.5 else stop) * pq.s
    block.segments[1].spiketrains = [
        trains[0],
        neo.SpikeTrain(trains[1].times, t_start=start, t_stop=early, name=trains[1].name),
    ]
    spikes = as_spikes(block)
    assert "unit_observed" not in spikes
    assert "remark" not in spikes.attrs
