"""The printed table of `neural` has the lag of the largest correlation where it is none of the lags tested."""

import json

import numpy as np
import pytest
from populations import ringing

from vibrissa.signals.envelope import analytic_envelope

TRIALS = 20


@pytest.fixture
def recording(tmp_path):
    """A ringing stimulus of 6 s; unit a answers after 10 ms, unit b after 45 ms, and somewhat after 20 ms."""
    rng = np.random.default_rng(5)
    time, motion = ringing(rng, duration=6.0)
    np.savetxt(tmp_path / "stimulus.csv", np.c_[time, motion], delimiter=",", header="time,displacement", comments="")
    envelope = analytic_envelope(motion)[0]
    strong, weak = ({0.01: 0.6e6, 0.045: 0.6e6}[lag] * np.roll(envelope, round(2000 * lag)) for lag in (0.01, 0.045))
    rates = {"a": strong, "b": weak + 0.2e6 * np.roll(envelope, 40)}
    lines = []
    for unit, rate in rates.items():
        fired = rng.random((TRIALS, time.size)) < rate / 2000
        lines += [f"{unit},{trial},{time[at]:.4f}" for trial, at in zip(*np.nonzero(fired), strict=True)]
    (tmp_path / "spikes.csv").write_text("\n".join(["unit,trial,spike_time", *lines]))
    return tmp_path


def test_the_lag_is_printed_where_it_was_not_tested(vibrissa, recording, monkeypatch):
    monkeypatch.setenv("COLUMNS", "250")
    words = ("neural", "--spikes", recording / "spikes.csv", "--stimulus", recording / "stimulus.csv")
    code, out, err = vibrissa(*words, "--trials", TRIALS)
    assert code == 0, err
    head, below, *rows = out.splitlines()
    end = head.index("peak_lag") + len("peak_lag")  # columns of numbers are to the right
    assert below[:end].endswith("[ms]")
    assert [row[:end].split()[-1] for row in rows if row[:6].strip()] == ["–", "40"]
    found = json.loads(vibrissa(*words, "--trials", TRIALS, "--json")[1])["units"]
    assert found[0]["peak_lag"] == pytest.approx(0.01)  # files and JSON hold that of every unit
    assert found[1]["peak_lag"] == pytest.approx(0.04)
