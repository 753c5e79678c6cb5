"""The window without stimulus: how it is typed, and that it holds none."""

import json

import numpy as np
import pytest

TRIALS, LENGTH, PERIOD, REST = 12, 4.0, 7.0, 2.0  # of a rate of 2 Hz at rest and of 20 Hz under the stimulus


@pytest.fixture
def session(tmp_path):
    """A ringing stimulus of 4 s every 7 s, and a unit of 2 Hz that fires at 20 Hz under it, on the session's clock."""
    rng = np.random.default_rng(0)
    time = np.arange(8000) / 2000
    motion = 5e-5 * (1 + np.sin(2 * np.pi * 0.7 * time)) * np.sin(2 * np.pi * 65 * time)
    np.savetxt(tmp_path / "stimulus.csv", np.c_[time, motion], delimiter=",", header="time,displacement", comments="")
    onset = 10 + PERIOD * np.arange(TRIALS)
    rest = rng.uniform(0, 100, rng.poisson(REST * 100))
    driven = [start + rng.uniform(0, LENGTH, rng.poisson(18 * LENGTH)) for start in onset]
    lines = [f"a,{t:.5f}" for t in np.sort(np.concatenate([rest, *driven]))]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,spike_time", *lines]))
    (tmp_path / "trials.csv").write_text("\n".join(["start,stop", *(f"{s},{s + LENGTH}" for s in onset)]))
    return tmp_path


def neural(folder, *window):
    files = ("--spikes", folder / "spikes.csv", "--stimulus", folder / "stimulus.csv")
    return ("neural", *files, "--trial-table", folder / "trials.csv", "--json", "--spontaneous", *window)


@pytest.mark.parametrize("window", [("-2s", "-0.5s"), ("-2", "-500ms"), ("-2000ms", "-0.5"), ("-2e0s", "-.5s")])
def test_both_values_of_a_window_may_be_negative_with_a_unit(vibrissa, session, window):
    (code, out, _), (_, bare, _) = (vibrissa(*neural(session, *one)) for one in (window, (-2, -0.5)))
    assert code == 0
    assert json.loads(out) == json.loads(bare)
    code, _, err = vibrissa(*neural(session, "-0.5s", "-2s"))
    assert (code, err) == (2, "vibrissa: --spontaneous must start before it stops, got (-0.5, -2.0)\n")


def test_one_negative_value_of_two_is_too_few(vibrissa, session):
    code, _, err = vibrissa(*neural(session, "-2s"))
    assert code == 2
    assert "must be given, with its 2 values. Only got 1; for example --spontaneous" in err
