"""The verbs surround, glm, demodulation, drives, information: tables, JSON, files, pictures, bad input."""

import json
import re

import numpy as np
import pytest
from test_demodulation import Mix
from test_surround import copies

from vibrissa.netcdf import load
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.stimulus.export import write_command

TRIALS = 20


def written(path, units):
    table = join_units(units)
    names = table.unit_name.values[table.spike_unit.values]
    rows = zip(names, table.spike_trial.values, table.spike_time.values, strict=True)
    path.write_text("unit,trial,spike_time\n" + "".join(f"{u},{n},{t:.6f}\n" for u, n, t in rows))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A command of eight whiskers, its first whisker as a stimulus, and two units."""
    where = tmp_path_factory.mktemp("coding")
    command, envelopes = copies(0)
    write_command(command, where / "command.nc")
    time, motion = command.time.values, command.command.values[0]
    rows = "".join(f"{t:.6f},{x:.9g}\n" for t, x in zip(time, motion, strict=True))
    (where / "stimulus.csv").write_text("time,displacement\n" + rows)
    rng = np.random.default_rng(0)
    units = {
        "hinge": simulate_spikes(ThresholdLinearUnit(baseline=8.0), time, envelopes[0], TRIALS, rng=rng),
        "phase": simulate_spikes(Mix(np.pi / 2), time, motion, TRIALS, rng=rng),
    }
    written(where / "spikes.csv", units)
    written(where / "one.csv", {"hinge": units["hinge"]})
    return where


def of_spikes(folder, name="spikes.csv"):
    return ("--spikes", folder / name, "--trials", TRIALS)


def test_surround_tells_draws_and_writes_the_map(vibrissa, folder, tmp_path):
    words = ("surround", *of_spikes(folder), "--command", folder / "command.nc")
    code, out, err = vibrissa(*words, "--picture", tmp_path / "map.png", "--out", tmp_path / "map.nc")
    assert (code, err) == (0, "")
    assert "driving_whiskers" in out
    assert "C1" in out
    assert (tmp_path / "map.png").stat().st_size > 10_000
    assert load(tmp_path / "map.nc").surround_weight.attrs["units"] == "1/(s m)"
    told = json.loads(vibrissa(*words, "--unit", "hinge", "--json")[1])
    assert told["strongest_whisker"] == ["C1"]
    assert told["surround_verdict"][0][0] == "drives"
    table = vibrissa(*words, "--unit", "hinge")[1]
    assert len(table.splitlines()) > 10  # a line for each whisker


def drawn(path):
    """Caption of a picture that is a page; its picture is there."""
    page = path.read_text()
    assert page.count("<svg") == 1
    return re.search("</svg>\\s*</div>\\s*<p>(.*?)</p>", page, re.DOTALL)[1]


def test_glm_tells_the_whisker_that_matters(vibrissa, folder, tmp_path):
    words = ("glm", *of_spikes(folder, "one.csv"), "--command", folder / "command.nc", "--past", "0.05")
    code, out, err = vibrissa(*words, "--picture", tmp_path / "glm.html")
    assert (code, err) == (0, "")
    assert "whisker_matters" in out
    assert drawn(tmp_path / "glm.html").startswith(f"Unit hinge, {TRIALS} presentations")
    assert "left out" not in out  # nothing to tell of a unit that is not
    told = json.loads(vibrissa(*words, "--json")[1])
    assert told["whisker_matters"][0][0] is True
    assert len(told["past_lag"]) == 10


def test_demodulation_tells_envelope_from_phase(vibrissa, folder, tmp_path):
    words = ("demodulation", *of_spikes(folder), "--stimulus", folder / "stimulus.csv")
    code, out, err = vibrissa(*words, "--picture", tmp_path / "index.png")
    assert (code, err) == (0, "")
    assert "demodulation_index" in out
    assert (tmp_path / "index.png").stat().st_size > 10_000
    told = json.loads(vibrissa(*words, "--json")[1])
    assert told["demodulated"] == ["envelope", "phase"]
    same = ("demodulation", *of_spikes(folder), "--stimulus", folder / "command.nc", "--whisker", "C1", "--json")
    again = json.loads(vibrissa(*same)[1])
    np.testing.assert_allclose(again["demodulation_index"], told["demodulation_index"], atol=1e-3)


def test_drives_of_one_carrier_cannot_tell_envelope_from_speed(vibrissa, folder, tmp_path):
    words = ("drives", *of_spikes(folder), "--stimulus", folder / "stimulus.csv")
    told = json.loads(vibrissa(*words, "--json", "--picture", tmp_path / "drives.html")[1])
    assert drawn(tmp_path / "drives.html").startswith("2 units, stimuli")
    assert told["best_drive"][0] == "cannot tell"
    assert "cannot tell envelope from speed" in told["reason"][0]
    code, out, _ = vibrissa("drives", *of_spikes(folder, "one.csv"), "--stimulus", folder / "stimulus.csv")
    assert code == 0
    assert "smoothed" in out


def test_information_tells_bits(vibrissa, folder, tmp_path):
    words = ("information", *of_spikes(folder), "--window", "1", "6")
    code, out, err = vibrissa(*words, "--picture", tmp_path / "bits.html")
    assert (code, err) == (0, "")
    assert "[bit/s]" in out
    assert drawn(tmp_path / "bits.html").startswith(f"2 units, {TRIALS} trials, 1 to 6 s")
    told = json.loads(vibrissa(*words, "--json")[1])
    assert told["spike_information_plain"][0] > told["spike_information"][0] > 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("surround", "--command", "command.nc", "--unit", "x"), "--unit must be one of hinge, phase"),
        (("glm", "--stimulus", "command.nc", "--unit", "x"), "--unit must be one of hinge, phase"),
        (("surround", "--command", "stimulus.csv"), "must have a channel for each whisker"),
        (("surround", "--command", "command.nc", "--picture", "a.gif"), "--picture must end in"),
        (("glm", "--command", "command.nc", "--reach", "0.001"), "reach must be"),
        (("demodulation", "--stimulus", "stimulus.csv", "--bin-width", "0.01"), "bin-width must be at most"),
        (("demodulation", "--stimulus", "command.nc", "--whisker", "Z9"), "--whisker must be one of"),
        (
            ("drives", "--stimulus", "stimulus.csv", "--stimulus", "stimulus.csv"),
            "must be given equally often",
        ),
        (("information", "--window", "1", "6", "--bin-width", "0.03"), "must divide the window"),
        (("information", "--window", "6", "1"), "--window must start before it stops, got 6 to 1 s"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(vibrissa, folder, monkeypatch, words, said):
    monkeypatch.chdir(folder)
    code, out, err = vibrissa(words[0], *of_spikes(folder), *words[1:])
    assert code == 2
    assert out == ""
    assert said in err
    assert err.count("\n") == 1


def test_trials_of_a_csv_must_be_told(vibrissa, folder):
    code, _, err = vibrissa("information", "--spikes", folder / "spikes.csv", "--window", "1", "6")
    assert code == 2
    assert "--trials must be given" in err
