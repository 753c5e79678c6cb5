"""What the verbs of spikes refuse, or remark on, before and after their work."""

import numpy as np
import pandas as pd
import pytest
from refusals import refusal

import vibrissa as vb


@pytest.fixture
def recording(tmp_path):
    """A ringing stimulus of 4 s, and two steady units in 12 trials."""
    rng = np.random.default_rng(0)
    time = np.arange(8000) / 2000
    motion = 5e-5 * (1 + np.sin(2 * np.pi * 0.7 * time)) * np.sin(2 * np.pi * 65 * time)
    rows = np.c_[time, motion]
    np.savetxt(tmp_path / "stimulus.csv", rows, delimiter=",", header="time,displacement", comments="")
    lines = [f"{unit},{k},{t:.4f}" for unit in "ab" for k in range(12) for t in rng.uniform(0, 3.9, 40)]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *lines]))
    return tmp_path


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("neural", "--stimulus", "stimulus.csv", "--first-segment", "free-first"), "must go with --fit paper2014"),
        (("neural", "--stimulus", "command.wav"), "--whisker must be given with a command"),
        (("demodulation", "--stimulus", "command.wav"), "--whisker must be given with a command"),
        (("neural", "--stimulus", "command.nc"), "--whisker must be given with a command"),
        (("neural", "--stimulus", "absent.csv", "--out", "absent/x.nc"), "--out must lie in an existing folder"),
        (("demodulation", "--stimulus", "absent.csv", "--out", "x.csv"), "--out must end in .nc"),
        (("drives", "--stimulus", "absent.csv", "--out", "x.csv"), "--out must end in .nc"),
        (("surround", "--command", "absent.nc", "--out", "x.csv"), "--out must end in .nc"),
        (("glm", "--command", "absent.nc", "--out", "x.csv"), "--out must end in .nc"),
        (("information", "--window", 0, 3.9, "--out", "x.csv"), "--out must end in .nc"),
        (("information", "--window", 0, 3.9, "--bin-width", "inf"), "must divide the window"),
        (("information", "--window", 0, 1e9), "must hold at most 1,000,000 bins"),
        (("information", "--window", 1, 0.5), "--window must start before it stops, got 1 to 0.5 s"),
        (("information", "--window", "0s", "-1s"), "--window must start before it stops, got 0 to -1 s"),
        (("information",), "--window must be given, with its 2 values"),
        (("demodulation", "--stimulus", "stimulus.csv", "--band", 45), "--band must be given, with its 2 values"),
    ],
)
def test_what_makes_no_sense_is_refused_before_the_work(vibrissa, recording, monkeypatch, words, message):
    (recording / "command.nc.json").write_text("{}")
    monkeypatch.chdir(recording)
    code, out, err = vibrissa(words[0], "--spikes", "spikes.csv", "--trials", 12, *words[1:])
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_silence_that_may_be_the_end_of_the_recording_is_told(vibrissa, recording):
    spikes = ("--spikes", recording / "spikes.csv", "--trials", 12)
    code, _, err = vibrissa("information", *spikes, "--window", 0, 40)
    assert code == 0
    assert "to the end of the window, 40 s" in err
    assert vibrissa("information", *spikes, "--window", 0, 3.9)[2] == ""
    _, _, err = vibrissa("information", *spikes, "--window", 0, 1)
    assert "spikes are outside of the window of 0 to 1 s\n" in err
    _, _, err = vibrissa("information", *spikes, "--window", 0, 0.3, "--bin-width", 0.01)
    assert " s; times up to 3.8981 look" in err
    assert err.splitlines()[0].endswith("look like milliseconds or a session's clock")
    _, _, err = vibrissa("information", *spikes[:2], "--window", 0, 3.9, "--trials", 60)
    assert "the last 48 of 60 trials hold no spike of any unit: were they presented?" in err


def test_a_spontaneous_window_without_spikes_is_told(vibrissa, recording):
    words = ("neural", "--spikes", recording / "spikes.csv", "--stimulus", recording / "stimulus.csv", "--trials", 12)
    assert "no unit fired from -1 to 0 s" in vibrissa(*words, "--spontaneous", -1, 0)[2]
    told = vibrissa(*words, "--spontaneous", 0, 1)[2]
    assert "no unit fired" not in told
    assert "the stimulus moves from 0 to 1 s" in told


def test_trials_that_end_before_the_stimulus_are_refused(vibrissa, recording):
    rng, starts = np.random.default_rng(1), 5.0 * np.arange(12)
    lines = [f"{t:.4f},a" for start in starts for t in np.sort(start + rng.uniform(0, 3.5, 40))]
    (recording / "session.csv").write_text("\n".join(["spike_time,unit", *lines]))
    words = ("neural", "--spikes", recording / "session.csv", "--stimulus", recording / "stimulus.csv")
    for name, lasted in (("whole", 4.0), ("short", 3.6)):
        rows = [f"{start},{start + (lasted if k % 3 else 4.0)}" for k, start in enumerate(starts)]
        (recording / f"{name}.csv").write_text("\n".join(["start,stop", *rows]))
    code, out, err = vibrissa(*words, "--trial-table", recording / "short.csv")
    assert (code, out, err.count("\n")) == (2, "", 1)
    rule = "trials of the recording must last to the end of what is analysed, 4 s"
    found = f"{rule}, got 8 of 12 that stop before, the shortest after 3.6 s"
    assert f"{found}; end --window at 3.6 s" in err
    assert vibrissa(*words, "--trial-table", recording / "short.csv", "--window", 0, 3.6)[0] == 0
    assert vibrissa(*words, "--trial-table", recording / "whole.csv")[0] == 0
    bits = ("information", *words[1:3], "--trial-table", recording / "short.csv", "--window")
    assert "end --window at 3.6 s" in vibrissa(*bits, 0, 4)[2]
    assert vibrissa(*bits, 0, 3.6)[0] == 0


def test_python_and_the_command_line_have_one_rule_for_the_stop_of_a_trial(recording):
    trials = np.array([(5.0 * k, 5.0 * k + 3.6) for k in range(12)])
    rng = np.random.default_rng(2)
    session = {"a": np.sort(np.concatenate([start + rng.uniform(0, 4.5, 60) for start, _ in trials]))}
    for how in ({}, {"window": (0.0, 4.0)}):
        spikes = vb.read_spikes(session, trials=trials, **how)
        with refusal("range", "trials of the recording"):
            vb.envelope_coupling(spikes, recording / "stimulus.csv", skip=0.5)
        units = vb.envelope_coupling(spikes, recording / "stimulus.csv", skip=0.5, window=(0.0, 3.6))
        rate = np.mean((spikes.spike_time.values >= 0.5) & (spikes.spike_time.values < 3.6)) * spikes.sizes["spike"]
        assert units.unit_rate.item() == pytest.approx(rate / (12 * 3.1), rel=1e-9)


def test_times_that_look_like_milliseconds_are_refused_by_information_too(vibrissa, recording, tmp_path):
    spikes = pd.read_csv(recording / "spikes.csv")
    spikes.assign(spike_time=1e3 * spikes.spike_time).to_csv(tmp_path / "ms.csv", index=False)
    code, out, err = vibrissa("information", "--spikes", tmp_path / "ms.csv", "--trials", 12, "--window", 0, 3.9)
    assert (code, out) == (2, "")
    assert err.startswith("vibrissa: spike_time must lie within the window, 0 to 3.9 s, got ")
    assert "look like milliseconds" in err


def test_what_information_says_of_long_trials_serves(vibrissa, recording, tmp_path):
    """Trials of 40 s; a window before the onset and a short one after it are no sign of milliseconds alone."""
    rng = np.random.default_rng(4)
    spikes = pd.DataFrame({"unit": "a", "trial": np.repeat(np.arange(12), 800)})
    spikes = spikes.assign(spike_time=rng.uniform(-2, 40, 9600))
    spikes.to_csv(tmp_path / "long.csv", index=False)
    words = ("information", "--spikes", tmp_path / "long.csv", "--trials", 12, "--window")
    for window in ((-1, -0.4), (0, 1)):
        code, _, err = vibrissa(*words, *window)
        assert code == 0
        assert "if trials last so long, these times are right" in err
    code, _, err = vibrissa(*words, 0, 0.3)
    assert (code, err.count("if they are right, leave out those beyond the window")) == (2, 1)
    spikes[spikes.spike_time < 0.3].to_csv(tmp_path / "long.csv", index=False)
    assert vibrissa(*words, 0, 0.3)[0] == 0


def test_counts_with_their_axes_in_another_order_are_refused(vibrissa, recording, tmp_path):
    counts = np.random.default_rng(0).poisson(1.0, (4, 12, 390))  # units, trials, bins
    np.save(tmp_path / "counts.npy", counts)
    stimulus = ("--stimulus", recording / "stimulus.csv", "--counted-bin", "10ms")
    code, _, err = vibrissa("neural", "--spikes", tmp_path / "counts.npy", *stimulus)
    assert code == 2
    assert "4 bins of 0.01 s; counts are bins x trials x units" in err


def test_a_stimulus_that_begins_long_after_the_onset_is_remarked_on(vibrissa, recording, tmp_path):
    stimulus = pd.read_csv(recording / "stimulus.csv")
    stimulus.assign(time=stimulus.time + 2.0).to_csv(tmp_path / "late.csv", index=False)
    spikes = ("--spikes", recording / "spikes.csv", "--trials", 12)
    _, _, err = vibrissa("neural", *spikes, "--stimulus", tmp_path / "late.csv")
    assert "the stimulus lasts from 2 to " in err
    assert "are its times of another clock?" in err


@pytest.mark.parametrize("name", ["own.wav", "own.npy"])
def test_sound_that_is_no_command_is_refused_with_what_is_read(vibrissa, recording, tmp_path, name):
    (tmp_path / name).write_bytes(b"whatever")
    code, _, err = vibrissa("neural", "--spikes", recording / "spikes.csv", "--stimulus", tmp_path / name)
    assert code == 2
    assert f"{name} must have the sidecar of a command of `vibrissa replay`; of another stimulus give a CSV" in err


def test_remedies_of_a_channel_of_a_table_and_of_times_in_samples(vibrissa, recording):
    words = ("neural", "--spikes", recording / "spikes.csv", "--trials", 12, "--stimulus", recording / "stimulus.csv")
    assert "leave it out" in vibrissa(*words, "--whisker", "C2")[2]
    (recording / "turned.csv").write_text("start,stop\n5,9\n0,4\n")
    (recording / "session.csv").write_text("spike_time,unit\n1,a\n6,a\n")
    turned = (*words[:2], recording / "session.csv", "--trial-table", recording / "turned.csv", *words[5:])
    assert "line 3, start must be after the trial before it, got '0'; sort the table" in vibrissa(*turned)[2]
    (recording / "samples.csv").write_text("unit,trial,spike_time\na,0,30000\na,1,90000\n")
    samples = (*words[:2], recording / "samples.csv", *words[3:])
    assert "these look like milliseconds, samples or a session's clock" in vibrissa(*samples)[2]
