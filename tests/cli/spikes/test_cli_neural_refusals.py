"""What the verbs of spikes refuse, or remark on, before and after their work."""

import numpy as np
import pytest


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
        (("information", "--window", 0, 1e9), "must hold at most 1,000,000 bins"),
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
    assert "no unit fires in the last" in err
    assert "of 60 trials: if they were not recorded, give fewer" in err


def test_a_spontaneous_window_without_spikes_is_told(vibrissa, recording):
    words = ("neural", "--spikes", recording / "spikes.csv", "--stimulus", recording / "stimulus.csv", "--trials", 12)
    assert "no unit fired from -1 to 0 s" in vibrissa(*words, "--spontaneous", -1, 0)[2]
    assert "no unit fired" not in vibrissa(*words, "--spontaneous", 0, 1)[2]


def test_trials_that_end_before_the_stimulus_are_told(vibrissa, recording):
    rng, starts = np.random.default_rng(1), 5.0 * np.arange(12)
    lines = [f"{t:.4f},a" for start in starts for t in np.sort(start + rng.uniform(0, 3.5, 40))]
    (recording / "session.csv").write_text("\n".join(["spike_time,unit", *lines]))
    words = ("neural", "--spikes", recording / "session.csv", "--stimulus", recording / "stimulus.csv")
    for name, lasted in (("whole", 4.0), ("short", 3.6)):
        rows = [f"{start},{start + (lasted if k % 3 else 4.0)}" for k, start in enumerate(starts)]
        (recording / f"{name}.csv").write_text("\n".join(["start,stop", *rows]))
    code, _, err = vibrissa(*words, "--trial-table", recording / "short.csv")
    assert code == 0, err
    assert "8 of 12 trials end before the stimulus: the shortest lasts 3.6 s of 3.999 s" in err
    assert "end before" not in vibrissa(*words, "--trial-table", recording / "whole.csv")[2]
