"""A stimulus recorded on the session's clock: cut into trials, on which all doors agree."""

from datetime import UTC, datetime

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

import vibrissa as vb
from vibrissa.api.remarks import Remark
from vibrissa.neural.io.tables.stimuli import labelled_stimulus
from vibrissa.neural.io.tables.trials import trial_table
from vibrissa.study.neurons.trial_stimuli import cut_stimulus

pynwb = pytest.importorskip("pynwb")

RATE, LENGTH, TRIALS = 1000.0, 3.0, 12
TIME = np.arange(int(LENGTH * RATE)) / RATE
SLOW = 1 + 0.9 * np.sin(2 * np.pi * 1.3 * TIME)
MOTION = 40e-6 * SLOW * np.sin(2 * np.pi * 65 * TIME)  # [m]
ONSETS = 3.0 + 4.0 * np.arange(TRIALS)


def spike_times(seed=1):
    """Times of a unit in each trial, driven by the envelope [s]."""
    rng = np.random.default_rng(seed)
    return [TIME[rng.uniform(size=TIME.size) < 25 * SLOW / RATE] for _ in range(TRIALS)]


def whole_session():
    """The motion on the session's clock, still between the trials [m]."""
    whole = np.zeros(round((ONSETS[-1] + LENGTH + 2) * RATE))
    for onset in ONSETS:
        whole[round(onset * RATE) :][: MOTION.size] = MOTION
    return whole


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """An archive file of one unit, its trials and what was recorded of its stimulus."""
    file = pynwb.NWBFile("s", "i", datetime(2020, 1, 1, tzinfo=UTC))
    file.add_unit(spike_times=np.concatenate([onset + own for onset, own in zip(ONSETS, spike_times(), strict=True)]))
    for onset in ONSETS:
        file.add_trial(start_time=onset, stop_time=onset + LENGTH)
    motion = {"data": 1e6 * whole_session(), "unit": "um", "rate": RATE, "starting_time": 0.0}
    file.add_stimulus(pynwb.TimeSeries(name="motion", **motion))
    path = tmp_path_factory.mktemp("session") / "session.nwb"
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    return path


def test_python_cuts_a_stimulus_on_the_clock_of_the_session_into_trials(session):
    shown = xr.DataArray(MOTION, {"time": TIME}, ["time"], attrs={"units": "m"})
    by_hand = vb.envelope_coupling(vb.read_spikes(session), shown, skip=0.5)
    with pytest.warns(Remark, match="the same in all 12 trials"):
        found = vb.envelope_coupling(session, session, skip=0.5)
    for name in ("envelope_correlation", "p_value", "threshold", "slope", "latency", "unit_rate"):
        np.testing.assert_allclose(found[name], by_hand[name], rtol=1e-6, err_msg=name)
    assert found.envelope_correlation.item() > 0.5


def test_a_stimulus_on_the_clock_of_the_session_needs_the_times_of_the_trials(session, tmp_path):
    rows = [f"u,{k},{t:.4f}" for k, own in enumerate(spike_times()) for t in own]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *rows]))
    with refusal("missing", "spikes", "a stimulus on the session's clock"):
        vb.envelope_coupling(tmp_path / "spikes.csv", session, n_trials=TRIALS)


def test_the_times_of_a_cut_stimulus_count_from_the_onset_itself():
    """An envelope at 100 Hz, 4 ms before whose samples the trials begin."""
    clock = np.arange(0, 60, 0.01)
    stimulus = labelled_stimulus(clock, 1 + np.sin(2 * np.pi * 0.7 * clock), "a.u.", envelope=True)
    onsets = 3.006 + 5 * np.arange(10)
    found, _ = cut_stimulus(stimulus, trial_table(onsets, onsets + 3), "s")
    assert found.time.values[0] == pytest.approx(0.004, abs=1e-9)


def test_samples_of_an_envelope_that_scatter_about_the_onsets_are_remarked_on():
    clock = np.arange(0, 60, 0.01)
    stimulus = labelled_stimulus(clock, np.ones(clock.size), "a.u.", envelope=True)
    onsets = 3.0 + 5 * np.arange(10) + np.where(np.arange(10) % 2, 0.004, 0.0)
    _, remarks = cut_stimulus(stimulus, trial_table(onsets, onsets + 3), "s")
    assert any("latencies are uncertain by 2 ms" in line for line in remarks)


@pytest.mark.parametrize("rate", [1000.0, 2000.0, 20000.0])
def test_one_motion_is_the_same_in_all_trials_wherever_its_samples_lie(rate):
    """A carrier of 100 Hz, played at onsets anywhere between two samples; its mean keeps its size."""
    onsets = 1.0 + 2 * np.arange(12) + np.random.default_rng(2).uniform(0, 0.5, 12)
    clock = np.arange(0, 27, 1 / rate)
    since = clock - onsets[np.clip(np.searchsorted(onsets, clock) - 1, 0, None)]

    def played(time):
        slow = 1 + 0.5 * np.sin(2 * np.pi * 3 * time)
        return np.where((time > -0.1) & (time < 1.4), 40e-6 * slow * np.sin(2 * np.pi * 100 * time), 0.0)

    trials = trial_table(onsets, onsets + 1)
    found, remarks = cut_stimulus(labelled_stimulus(clock, played(since)), trials, "s")
    assert "trial" not in found.dims, remarks
    time, inside = found.time.values, slice(20, -20)
    np.testing.assert_allclose(found.point_displacement[inside], played(time)[inside], atol=0.02 * 40e-6)


def test_stimuli_that_differ_are_said_to_with_their_correlation():
    clock = np.arange(0, 30, 1 / RATE)
    stimulus = labelled_stimulus(clock, 1e-5 * np.random.default_rng(1).normal(size=clock.size))
    found, remarks = cut_stimulus(stimulus, trial_table(ONSETS[:2], ONSETS[:2] + LENGTH), "s")
    each = found.point_displacement.values
    r = min(np.corrcoef(one, each.mean(0))[0, 1] for one in each)
    assert f"down to {r:.2f}" in remarks[0]
