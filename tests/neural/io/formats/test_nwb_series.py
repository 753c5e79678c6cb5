"""Archive files as others write them: a stimulus as a series, any table of intervals, columns of fixed length."""

from datetime import UTC, datetime

import h5py
import numpy as np
import pytest
from refusals import refusal

from vibrissa.neural.io.tables.stimuli import presented
from vibrissa.study.neurons.inputs import read_recording
from vibrissa.study.neurons.stimuli import read_stimulus
from vibrissa.study.spec.given import SpikesInput, StimulusInput

pynwb = pytest.importorskip("pynwb")

RATE, ONSETS, LENGTH = 1000.0, 5.0 + 4.0 * np.arange(6), 3.0
TIME = np.arange(round(LENGTH * RATE)) / RATE
WAVE = (1 + 0.5 * np.sin(2 * np.pi * 0.9 * TIME)) * np.sin(2 * np.pi * 65 * TIME)


def session():
    return pynwb.NWBFile(session_description="s", identifier="s", session_start_time=datetime(2020, 1, 1, tzinfo=UTC))


def write(file, path):
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    return path


def with_units(file):
    """Two units, three spikes in each trial, and an electrode of each."""
    device = file.create_device(name="d")
    group = file.create_electrode_group(name="g", description="g", location="l", device=device)
    for _ in range(4):
        file.add_electrode(group=group, location="l")
    for k in range(2):
        file.add_unit(spike_times=(ONSETS[:, None] + np.array([0.5, 1.0, 2.0 + 0.1 * k])).ravel(), electrodes=[k + 1])
    return file


def with_trials(file, name="trials"):
    table = pynwb.epoch.TimeIntervals(name=name, description="t")
    for onset in ONSETS:
        table.add_row(start_time=onset, stop_time=onset + LENGTH)
    file.add_time_intervals(table)
    return file


def on_session(waves, **about):
    """Series on the session's clock, silent between the trials."""
    whole = np.zeros(round((ONSETS[-1] + 5) * RATE))
    for onset, wave in zip(ONSETS, waves, strict=True):
        whole[round(onset * RATE) : round(onset * RATE) + wave.size] = wave
    return pynwb.TimeSeries(name="motion", data=whole, rate=RATE, starting_time=0.0, **about)


def test_a_fixed_column_of_electrodes_is_read(tmp_path):
    path = write(with_trials(with_units(session())), tmp_path / "s.nwb")
    with h5py.File(path, "r+") as stored:  # pynwb writes lists of electrodes alone
        del stored["units/electrodes_index"]
    file = session()
    file.add_stimulus_template(pynwb.TimeSeries(name="m", data=50 * WAVE, unit="um", rate=RATE, starting_time=0.0))
    stimulus = write(file, tmp_path / "m.nwb")
    found = read_recording(SpikesInput(spikes=str(path)), StimulusInput(stimulus=str(stimulus)))
    assert found.spikes.unit_electrode.values.tolist() == [1, 2]
    assert found.spikes.sizes["spike"] == 36
    np.testing.assert_allclose(presented(found.stimulus).values, 5e-5 * WAVE, rtol=1e-12)


def test_any_table_of_intervals_is_taken_by_its_name(tmp_path):
    path = write(with_trials(with_units(session()), "stimulation"), tmp_path / "s.nwb")
    np.savetxt(tmp_path / "m.csv", np.c_[TIME, 50 * WAVE], delimiter=",", header="time,displacement_um", comments="")
    given = StimulusInput(stimulus=str(tmp_path / "m.csv"))
    found = read_recording(SpikesInput(spikes=str(path), trial_table="stimulation"), given)
    assert found.n_trials == 6
    np.testing.assert_allclose(np.unique(found.spikes.spike_time.values.round(6)), [0.5, 1.0, 2.0, 2.1])
    with refusal("missing", str(path)):
        read_recording(SpikesInput(spikes=str(path)), given)


def test_a_series_on_the_sessions_clock_is_cut_by_the_trials(tmp_path):
    rng = np.random.default_rng(0)
    file = with_trials(with_units(session()))
    file.add_acquisition(on_session([50 * WAVE + 0.5 * rng.normal(size=WAVE.size) for _ in ONSETS], unit="um"))
    path = str(write(file, tmp_path / "s.nwb"))
    found = read_recording(SpikesInput(spikes=path), StimulusInput(stimulus=path, whisker="motion"))
    assert found.stimulus.point_displacement.dims == ("time",)
    np.testing.assert_allclose(found.stimulus.point_displacement, 5e-5 * WAVE, atol=1.5e-6)
    assert any("the same in all 6 trials" in line for line in found.remarks)


@pytest.mark.parametrize("wrong", [np.nan, 5.0])
def test_timestamps_that_do_not_ascend_are_refused(tmp_path, wrong):
    file, clock = session(), np.arange(200) / RATE
    clock[120] = wrong
    file.add_stimulus(pynwb.TimeSeries(name="motion", data=np.sin(np.arange(200)), unit="um", timestamps=clock))
    with refusal(
        "range",
    ):
        read_stimulus(StimulusInput(stimulus=str(write(file, tmp_path / "s.nwb"))))


@pytest.mark.parametrize("rate", [1050.0, 2000.0])
def test_timestamps_that_are_rounded_are_not_said_to_be_doubled(tmp_path, rate):
    """Samples of every trial alone, to the millisecond: leaving out those of one time would change the motion."""
    file = session()
    clock = np.round(np.concatenate([onset + np.arange(int(LENGTH * rate)) / rate for onset in ONSETS]), 3)
    file.add_stimulus(pynwb.TimeSeries(name="motion", data=np.sin(np.arange(clock.size)), unit="um", timestamps=clock))
    with refusal("range", "s.nwb, motion: time") as caught:
        read_stimulus(StimulusInput(stimulus=str(write(file, tmp_path / "s.nwb"))))
    assert caught.value.remedy.startswith("write times with more decimals")
    assert "times are rounded to 0.001 s" in str(caught.value)


def test_trials_with_their_own_stimuli_keep_them(tmp_path):
    file = with_trials(with_units(session()))
    waves = [np.roll(50 * WAVE, 300 * k) for k in range(6)]
    file.add_stimulus(on_session(waves, unit="um"))
    path = str(write(file, tmp_path / "s.nwb"))
    found = read_recording(SpikesInput(spikes=path), StimulusInput(stimulus=path))
    np.testing.assert_allclose(found.stimulus.point_displacement, 1e-6 * np.array(waves), rtol=1e-12)


def test_a_unit_that_is_none_is_asked_for(tmp_path):
    file = session()
    file.add_stimulus_template(pynwb.TimeSeries(name="m", data=50 * WAVE, unit="n.a.", rate=RATE, starting_time=0.0))
    path = str(write(file, tmp_path / "m.nwb"))
    with refusal("missing", "signal_unit"):
        read_stimulus(StimulusInput(stimulus=path))
    found, _ = read_stimulus(StimulusInput(stimulus=path, signal_unit="um"))
    np.testing.assert_allclose(presented(found).values, 5e-5 * WAVE, rtol=1e-12)
    with refusal("missing", "whisker"):
        read_stimulus(StimulusInput(stimulus=path, signal_unit="um", whisker="other"))


def test_series_within_a_position_or_a_compass_are_found(tmp_path):
    file = with_trials(with_units(session()))
    waves = [np.roll(WAVE, 300 * k) for k in range(6)]
    turned = on_session(waves, unit="radian")
    compass = pynwb.behavior.CompassDirection(name="CompassDirection")
    compass.create_spatial_series(name="yaw", data=turned.data, unit="radian", rate=RATE, reference_frame="room")
    file.add_acquisition(compass)
    path = str(write(file, tmp_path / "s.nwb"))
    found = read_recording(SpikesInput(spikes=path), StimulusInput(stimulus=path, whisker="yaw"))
    assert presented(found.stimulus).unit == "rad"
    np.testing.assert_allclose(presented(found.stimulus).values, waves, rtol=1e-12)
