"""`scan --simulate-units`: from a texture to files of spikes, and what is refused before any work."""

import json

import numpy as np
import pytest

from vibrissa.netcdf import load
from vibrissa.texture.io import write_gaps
from vibrissa.texture.surface import random_grating

WHISKER = ("--whisker.length", "0.055", "--whisker.cone-angle", "1.2e-3", "--whisker.tip", "0.05")
HOLD = ("--contact", "0.29", "--base-angle", "1.2", "--speed", "0.1", "--sampling-rate", "4000")
UNITS = "unit,threshold_um,slope_per_um,baseline,latency_ms,quality\na,30,0.5,5,12,MU\nb,20,0,9,8,SU\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_gaps(random_grating(0.3, rng=np.random.default_rng(1)), tmp_path / "gaps.csv")
    (tmp_path / "units.csv").write_text(UNITS)
    return tmp_path


def test_spikes_go_from_scan_to_neural(vibrissa, folder):
    words = ("--simulate-units", "units.csv", "--mean-envelope", "50e-6", "--trials", "60", "--json")
    code, text, err = vibrissa("scan", "gaps.csv", *HOLD, *WHISKER, *words, "--out", "f.nc", "--spikes-out", "s.csv")
    assert code == 0, err
    told = json.loads(text)
    assert told["unit_name"] == ["a", "b"]
    assert told["unit_rate"][0] > told["true_baseline"][0] + 3
    assert "5 mm from the base has a median of" in err
    data = load(folder / "f.nc")
    assert {"spike_time", "point_envelope", "mode_displacement", "true_slope"} <= set(data.data_vars)
    assert (data.attrs["n_trials"], data.attrs["scan_speed"]) == (60, 0.1)
    found = []
    for spikes, stimulus in (("s.csv", "s-stimulus.csv"), ("f.nc", "f.nc")):
        code, text, err = vibrissa("neural", "--spikes", spikes, "--stimulus", stimulus, "--skip", "0.1", "--json")
        assert code == 0, err
        found.append(json.loads(text)["units"])
    assert found[0] == found[1]
    a, b = found[0]
    assert a["significant"]
    assert a["identified"]
    assert a["threshold"] == pytest.approx(30e-6, abs=5e-6)
    assert a["slope"] == pytest.approx(0.5e6, rel=0.15)
    assert not b["significant"]


BAD = {
    "no units": (["--simulate-units", "0"], "number of units must be from 1"),
    "no file": (
        ["--simulate-units", "no.csv"],
        "--simulate-units must be a number of units or a CSV of them, got no.csv",
    ),
    "no number": (["--simulate-units", "1e3"], "--simulate-units must be a number of units"),
    "too many": (["--simulate-units", "100000", "--trials", "1000"], "must last at most 5e+06 s in all"),
    "no table": (["--simulate-units", "gaps.csv"], "must have a column unit"),
    "name": (["--simulate-units", "3", "--spikes-out", "s.mat"], "must end in .csv or .nwb"),
    "folder": (["--simulate-units", "3", "--spikes-out", "no/s.csv"], "no must be an existing folder"),
    "trials": (["--simulate-units", "3", "--trials", "0"], "trials must be at least 1"),
    "envelope": (["--simulate-units", "3", "--mean-envelope", "-1"], "must be above 0 and at most 0.01 m"),
    "alone": (["--spikes-out", "s.csv"], "--spikes-out must go with --simulate-units"),
    "trials alone": (["--trials", "5"], "--trials must go with --simulate-units, got 5"),
    "seed alone": (["--seed", "1"], "--seed must go with --simulate-units, got 1"),
    "distance alone": (["--distance", "3mm"], "--distance must go with --simulate-units, got 0.003"),
    "envelope alone": (["--mean-envelope", "1um"], "--mean-envelope must go with --simulate-units"),
    "seed": (["--simulate-units", "3", "--seed", "-1"], "--seed must be 0 or a positive whole number"),
    "distance": (["--simulate-units", "3", "--distance", "0.1"], "must lie on the whisker"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_is_one_line_and_writes_nothing(name, vibrissa, folder):
    words, message = BAD[name]
    before = set(folder.iterdir())
    code, out, err = vibrissa("scan", "gaps.csv", *HOLD, *WHISKER, *words, "--out", "x.nc")
    assert code == 2
    assert out == ""
    assert message in err
    assert set(folder.iterdir()) == before
