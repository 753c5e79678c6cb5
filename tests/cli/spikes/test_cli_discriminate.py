"""The verbs of coding: which texture it was, whether that holds elsewhere, how many trials it takes."""

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from vibrissa.netcdf import load
from vibrissa.neural.io.formats.nwb_writer import Session, write_nwb
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.trials import trial_table

EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.fixture
def recording(tmp_path):
    """Spikes of 5 units in 36 trials of three textures, one of which is louder and one later."""
    rng = np.random.default_rng(1)
    texture = np.array(["smooth", "rough", "ridged"])[rng.permutation(np.arange(36) % 3)]
    lines = ["unit,trial,spike_time"]
    for trial, name in enumerate(texture):
        for unit in range(5):
            times = rng.uniform(0, 1, rng.poisson(12 if name == "rough" else 6))
            times = np.where(times < 0.5, times + 0.5, times) if name == "ridged" else times
            lines += [f"u{unit},{trial},{time:.5f}" for time in times]
    (tmp_path / "spikes.csv").write_text("\n".join(lines))
    table = [f"{k},{name}" for k, name in enumerate(texture)]
    (tmp_path / "textures.csv").write_text("\n".join(["trial,texture", *table[::-1]]))
    return tmp_path


def test_discriminate_tells_by_rate_and_by_time(vibrissa, recording):
    code, out, err = vibrissa(
        *("discriminate", recording / "spikes.csv", "--textures", recording / "textures.csv", "--window", 0, 1),
        *("--bin-width", 0.1, "--permutations", 79, "--units", 1, "--units", 5),
        *("--out", recording / "found.nc", "--picture", recording / "found.png", "--json"),
    )
    assert (code, err) == (0, "")
    told, data = json.loads(out), load(recording / "found.nc")
    assert told["code"] == ["mean rate", "rate variance", "time course", "pattern"]
    assert told["accuracy"][2] > 0.9 > told["accuracy"][0]
    assert told["code_verdict"][0] == "tells the textures apart"
    assert data.accuracy_by_units.sel(code="time course", units_used=5) > 0.9
    rates = data.confusion.sel(code="mean rate")
    assert rates.sel(presented="rough", answered="rough") == 1
    assert rates.sel(presented="smooth", answered="ridged") > 0.2  # as many spikes
    assert (recording / "found.png").stat().st_size > 10_000


def test_textures_come_from_a_table_of_trials_as_well(vibrissa, tmp_path):
    pytest.importorskip("pynwb")
    rng = np.random.default_rng(2)
    start = 2.0 * np.arange(24)
    kind = np.array(["a", "b"])[rng.permutation(np.arange(24) % 2)]
    counts = rng.poisson(np.where(kind == "a", 3, 12))
    when = np.repeat(start, counts) + rng.uniform(0, 1, counts.sum())
    spikes, trials = spike_table(when, np.zeros(when.size, int), ["u"]), trial_table(start, start + 1, kind)
    begun = datetime(2026, 1, 1, tzinfo=UTC)
    session = Session(
        identifier="x",
        description="two textures",
        start=begun,
        subject="r",
        age="P90D",
        sex="F",
        species="Mus musculus",
    )
    write_nwb(spikes, tmp_path / "two.nwb", session, trials=trials)
    code, out, _ = vibrissa(
        "discriminate", tmp_path / "two.nwb", "--window", 0, 1, "--permutations", 19, "--code", "mean rate", "--json"
    )
    assert code == 0
    assert json.loads(out)["accuracy"][0] > 0.9


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("trial,texture\n0,a\n0,b\n", "must be there once"),
        ("trial,texture\n0,a\n7,b\n", "whole number from 0 to 1"),
        ("trial,texture\n0,a\n1,\n", "must name a texture"),
        ("trial,texture\n", "must have a line for each trial"),
        ("trial\n0\n", "texture"),
        ("trial,texture\n0,a\n1,b\n", "must name every trial"),
    ],
)
def test_tables_of_textures_that_do_not_fit_are_refused_in_one_line(vibrissa, recording, text, message):
    (recording / "wrong.csv").write_text(text)
    code, out, err = vibrissa(
        "discriminate", recording / "spikes.csv", "--textures", recording / "wrong.csv", "--window", 0, 1
    )
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_textures_of_more_trials_than_the_spikes_list_are_refused(vibrissa, recording):
    spikes = "unit,trial,spike_time\nu,0,0.5\nu,1,0.6\nu,2,\n"  # the last is silent
    (recording / "listed.csv").write_text(spikes)
    (recording / "more.csv").write_text("trial,texture\n" + "".join(f"{k},{'ab'[k % 2]}\n" for k in range(150)))
    words = ("discriminate", recording / "listed.csv", "--textures", recording / "more.csv", "--window", 0, 1)
    code, _, err = vibrissa(*words)
    assert code == 2
    assert "must name 3 trials, as the spikes do, got 150" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--window", 0, 1), "textures must be given"),
        (("--window", 0, 1, "--bin-width", 0.3), "must divide the window"),
        (("--window", 1, 0), "must start before it stops"),
        (("--window", 7, 8), "must hold a spike"),
        (("--window", 0, 1, "--picture", "x.gif"), "must end in .png"),
        (("--window", 0, 1, "--permutations", 9), "at least 79"),
        (("--window", 0, 1, "--units", 9), "must lie between 1 and 5"),
    ],
)
def test_discriminate_refuses_what_makes_no_sense(vibrissa, recording, words, message):
    textures = () if "textures" in message else ("--textures", recording / "textures.csv", "--folds", 3)
    quick = () if "--permutations" in words else ("--permutations", 79)
    code, out, err = vibrissa("discriminate", recording / "spikes.csv", *textures, *quick, *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_robustness_says_what_holds_or_that_it_cannot_tell(vibrissa, tmp_path):
    code, out, err = vibrissa(
        *("robustness", "--contact", 0.29, "--base-angle", 1.2, "--speed", 0.1, "--atlas", "C2"),
        *(
            "--speed-ratio",
            2,
            "--height-ratio",
            0.9,
            "--angle-ratio",
            1.1,
            "--sets",
            2,
            "--trials",
            4,
            "--mean-period",
            6e-4,
        ),
        *("--mean-period", 6e-4, "--out", tmp_path / "held.nc"),
    )
    assert code == 0
    assert "speed: " in err  # of two sets it may not be able to tell
    assert "mean rate" in out
    data = xr.load_dataset(tmp_path / "held.nc", engine="h5netcdf")
    assert data.tested_speed.values.tolist() == [0.1, 0.2, 0.1, 0.1]
    code, _, err = vibrissa(
        *("robustness", "--contact", 0.29, "--base-angle", 1.2, "--speed", 0.1, "--atlas", "C2", "--speed-ratio", 1)
    )
    assert code == 2
    assert "other than the one that teaches" in err


@pytest.fixture
def stimulus(tmp_path):
    """A tone of 70 Hz whose size wanders, as a file."""
    time = np.arange(8000) / 2000
    size = 60e-6 * (1 + np.sin(2 * np.pi * 1.3 * time) * np.cos(2 * np.pi * 3.1 * time))
    rows = np.stack([time, size * np.sin(2 * np.pi * 70 * time)], axis=1)
    np.savetxt(tmp_path / "stimulus.csv", rows, delimiter=",", header="time,displacement", comments="", fmt="%.9g")
    return tmp_path / "stimulus.csv"


def test_trials_needed_for_every_combination(vibrissa, stimulus):
    code, out, err = vibrissa(
        *("trials-needed", "--stimulus", stimulus, "--threshold", 40e-6, "--threshold", 300e-6, "--slope", 2.5e5),
        *("--slope", 1e5, "--baseline", 5, "--threshold-within", 5e-6, "--json"),
    )
    assert (code, err) == (0, "")
    told = json.loads(out)
    assert told["slope"] == [2.5e5, 1e5, 2.5e5, 1e5]
    assert 8 <= told["trials_needed"][0] < told["trials_needed"][1]
    assert told["trials_needed"][2:] == [None, None]
    assert told["reason"][2].startswith("threshold above")


def test_trials_needed_draws_and_refuses(vibrissa, stimulus):
    words = ("trials-needed", "--stimulus", stimulus, "--threshold", 40e-6, "--slope", 2.5e5, "--baseline", 5)
    picture = stimulus.with_name("plan.png")
    code, out, _ = vibrissa(*words, "--slope-within", 0.1, "--picture", picture)
    assert code == 0
    assert "trials_needed" in out
    assert picture.stat().st_size > 10_000
    code, out, err = vibrissa(*words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "must be given for threshold, slope or latency" in err
    assert vibrissa(*words, "--slope", 0.25, "--slope-within", 0.1)[2].endswith("write --slope 0.25/s/um\n")
    assert vibrissa(*words, "--threshold", 42, "--slope-within", 0.1)[2].endswith("write --threshold 42um\n")


def test_a_plan_of_fitted_units_names_those_that_were_not_identified(vibrissa, tmp_path):
    shown = ("--stimulus", EXAMPLES / "spikes-stimulus.csv")
    code, _, err = vibrissa("neural", "--spikes", EXAMPLES / "spikes.csv", *shown, "--out", tmp_path / "units.nc")
    assert code == 0, err
    units = load(tmp_path / "units.nc")
    found = dict(zip(units.unit_name.values.tolist(), units.identified.values.tolist(), strict=True))
    assert set(found.values()) == {0, 1}
    words = ("trials-needed", *shown, "--fitted-units", tmp_path / "units.nc", "--slope-within", 0.1)
    code, _, err = vibrissa(*words)
    assert code == 0
    [line] = err.splitlines()
    said = line.removeprefix("vibrissa: ").partition(": not identified by the recording")[0].split(", ")
    assert said == [name for name, identified in found.items() if not identified]
    for more in (("--baseline", 5), ("--latency", "20ms"), ("--gain-sd", 0), ("--fano-factor", 2)):
        code, _, err = vibrissa(*words, *more)
        assert (code, f"--fitted-units must not be given with {more[0]};" in err) == (2, True), err


def test_trials_needed_in_decibels_are_those_in_any_other_unit(vibrissa, tmp_path):
    time = np.arange(16000) / 2000
    level = 20 + 6 * np.sin(2 * np.pi * 1.3 * time) + 4 * np.cos(2 * np.pi * 3.1 * time)
    for name, scale in (("dB", 1.0), ("au", 0.01)):
        rows = np.stack([time, scale * level], axis=1)
        np.savetxt(
            tmp_path / f"{name}.csv", rows, delimiter=",", header=f"time,envelope_{name}", comments="", fmt="%.9g"
        )
    decibels = ("trials-needed", "--stimulus", tmp_path / "dB.csv", "--baseline", 5, "--slope-within", 0.1)
    code, out, err = vibrissa(*decibels, "--threshold", "20dB", "--slope", "5/s/dB", "--threshold-within", 0.5)
    assert (code, err) == (0, "")
    assert "[dB]" in out
    assert "[1/(s dB)]" in out
    other = ("trials-needed", "--stimulus", tmp_path / "au.csv", "--baseline", 5, "--slope-within", 0.1)
    plans = [
        json.loads(vibrissa(*words, "--json")[1])
        for words in (
            (*decibels, "--threshold", 20, "--slope", 5, "--threshold-within", 0.5),
            (*other, "--threshold", "0.2au", "--slope", "500/s/au", "--threshold-within", "0.005au"),
        )
    ]
    assert plans[0]["trials_needed"] == plans[1]["trials_needed"]
    assert vibrissa(*decibels, "--threshold", "42um", "--slope", 5)[2].startswith(
        "vibrissa: --threshold must be of the stimulus, which is in dB"
    )
    code, _, err = vibrissa(*decibels, "--threshold", 80, "--slope", 5)
    assert code == 0
