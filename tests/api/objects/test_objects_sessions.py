"""Sortings of SpikeInterface and open files of NWB: units in their trials."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import assume, given
from recorded_trains import PERIOD, TRIAL, assert_same, few, names_of, onsets_of, recordings, session_trains, trials_of
from refusals import refusal

import vibrissa as vb
from vibrissa.api.objects.spikes import as_spikes


@few
@given(recordings())
def test_segments_of_a_sorting_are_trials(recording):
    core = pytest.importorskip("spikeinterface.core")
    assume(any(unit[-1].size for unit in recording))  # its sorting in memory has no segment after its last spike
    segments = [
        {
            name: np.round(unit[trial] * 1e6).astype(np.int64)
            for name, unit in zip(names_of(recording), recording, strict=True)
        }
        for trial in range(len(recording[0]))
    ]
    sorting = core.NumpySorting.from_unit_dict(segments, 1e6)
    assert_same(as_spikes(sorting), recording)
    sorting.set_property("quality", np.array(["good"] * len(recording)))
    assert as_spikes(sorting).unit_quality.values.tolist() == ["SU"] * len(recording)
    one = {
        k: np.round(time * 1e6).astype(np.int64)
        for k, time in zip(names_of(recording), session_trains(recording), strict=True)
    }
    assert_same(as_spikes(core.NumpySorting.from_unit_dict([one], 1e6), trials=trials_of(recording)), recording)


def test_times_of_a_sorting_are_those_of_its_recording():
    core = pytest.importorskip("spikeinterface.core")
    traces = [np.zeros((2000, 1), np.float32)] * 2
    recording = core.NumpyRecording(traces, 1000.0, t_starts=[10.0, 20.0])
    sorting = core.NumpySorting.from_unit_dict([{"a": np.array([500])}, {"a": np.array([250])}], 1000.0)
    sorting.register_recording(recording)
    spikes = as_spikes(sorting)
    assert spikes.trial_start.values.tolist() == [10.0, 20.0]
    assert spikes.trial_stop.values.tolist() == [12.0, 22.0]
    np.testing.assert_allclose(spikes.spike_time, [0.5, 0.25])


@few
@given(recordings())
def test_an_open_nwb_file_gives_its_units_in_its_trials(recording):
    pynwb = pytest.importorskip("pynwb")
    file = pynwb.NWBFile("test", "a", datetime(2014, 5, 7, 9, 30, tzinfo=UTC))
    file.add_unit_column("unit_name", "name")
    stop = onsets_of(recording)[-1] + PERIOD
    for name, time in zip(names_of(recording), session_trains(recording), strict=True):
        file.add_unit(spike_times=time, unit_name=name, obs_intervals=[[0.0, stop]])
    session = as_spikes(file)
    assert "spike_trial" not in session
    assert_same(as_spikes(file, trials=trials_of(recording)), recording)
    for onset in onsets_of(recording):
        file.add_trial(start_time=onset, stop_time=onset + TRIAL)
    assert_same(as_spikes(file), recording)
    assert_same(as_spikes(file, trials=file.trials), recording)
    assert_same(as_spikes(session, trials=file.trials.to_dataframe()), recording)
    assert as_spikes(file).unit_observed.values.all()


def test_a_file_of_nwb_without_units_is_refused():
    pynwb = pytest.importorskip("pynwb")
    with refusal("missing", "NWBFile"):
        as_spikes(pynwb.NWBFile("test", "a", datetime(2014, 5, 7, 9, 30, tzinfo=UTC)))


def test_an_open_nwb_file_is_judged_in_the_whole_session_unless_trials_are_given(tmp_path):
    """As its path is; by hand, of 100 spikes over 99 s, 10 of them in each of two trials."""
    pynwb = pytest.importorskip("pynwb")
    file = pynwb.NWBFile("test", "a", datetime(2014, 5, 7, 9, 30, tzinfo=UTC))
    file.add_unit(spike_times=np.arange(100.0))
    for start in (10.0, 40.0):
        file.add_trial(start_time=start, stop_time=start + 20)
    path = tmp_path / "s.nwb"
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    for one in (file, path):
        assert vb.unit_quality(one).unit_rate.item() == pytest.approx(100 / 99)
        within = vb.unit_quality(one, trials=[(10.0, 20.0), (40.0, 50.0)], least_rate=0.5)
        assert within.unit_rate.item() == pytest.approx(1.0)
        assert within.time_observed.item() == pytest.approx(20.0)
