"""The verb replay: from a prediction to a command, and one line for bad input."""

import json

import numpy as np
import pytest
from cyclopts import App

from vibrissa import cli
from vibrissa.cli.spikes.replay import replay
from vibrissa.netcdf import load
from vibrissa.stimulus.export import read_command
from vibrissa.texture.io import write_gaps
from vibrissa.texture.surface import random_grating

RATE = 1000.0
QUICK = ("--duration", "6", "--sampling-rate", "1000")


@pytest.fixture
def call(vibrissa, monkeypatch):
    """Run the verb as the command line does, whether or not it is registered."""
    alone = App(name="vibrissa")
    alone.command(replay)

    def run(*words):
        with monkeypatch.context() as patch:
            patch.setattr(cli, "app", alone)
            return vibrissa("replay", *words)

    return run


@pytest.fixture
def textures(tmp_path):
    paths = [tmp_path / f"t{seed}.csv" for seed in range(2)]
    for seed, path in enumerate(paths):
        moved = np.random.default_rng(seed).normal(0, 1e-5, 4000)
        table = np.c_[np.arange(4000) / RATE, moved]
        np.savetxt(path, table, delimiter=",", header="time,displacement", comments="")
    return paths


def test_textures_become_a_command_with_its_sidecar(call, textures, tmp_path):
    code, out, err = call(*textures, *QUICK, "--out", tmp_path / "c.nc", "--json")
    told = json.loads(out)
    data = load(tmp_path / "c.nc")
    assert code == 0
    assert data.command.shape == (24, 6000)
    assert told["largest_correlation"] == float(data.largest_correlation)
    assert len(told["seam_step"]) == 2
    assert "the command is in" in err
    assert (tmp_path / "c.nc.json").is_file()


def test_the_options_reach_the_command(call, textures, tmp_path):
    out = tmp_path / "c.wav"
    words = (
        "--order",
        "2",
        "--norm",
        "phase",
        "--zero-phase",
        "--delays",
        "random",
        "--seed",
        "5",
        "--encoding",
        "int24",
    )
    assert call(*textures, *QUICK, *words, "--full-scale", "1e-3", "--factor", "2", "--out", out)[0] == 0
    facts = json.loads((tmp_path / "c.wav.json").read_text())
    assert (facts["encoding"], facts["full_scale"], facts["attributes"]["seed"]) == ("int24", 1e-3, 5)
    assert "order 2, norm phase, zero-phase" in facts["attributes"]["filter"]
    given = ",".join(map(str, facts["variables"]["delay"]["values"]))
    call(*textures, *QUICK, *words[:5], "--delays", given, "--factor", "2", "--out", tmp_path / "d.npy")
    a, b = read_command(out).command, read_command(tmp_path / "d.npy").command
    np.testing.assert_allclose(a, b, atol=1e-3 / 2**23)


def test_the_measured_motion_is_compared(call, textures, tmp_path):
    call(*textures, *QUICK, "--out", tmp_path / "c.nc")
    motion = 0.95 * np.roll(load(tmp_path / "c.nc").command.sel(whisker="C2").values, 1)
    table = np.c_[np.arange(6000) / RATE, motion]
    np.savetxt(tmp_path / "m.csv", table, delimiter=",", header="time,displacement", comments="")
    words = ("--measured", tmp_path / "m.csv", "--measured-whisker", "C2", "--json")
    told = json.loads(call(*textures, *QUICK, "--out", tmp_path / "d.nc", *words)[1])
    assert told["replay_lag"] == pytest.approx(1e-3, abs=1e-5)
    assert told["replay_gain"] == pytest.approx(0.95, rel=1e-3)
    assert load(tmp_path / "d.nc").attrs["measured_whisker"] == "C2"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--max-travel", "1e-6"), "travel of"),
        (("--delays", "some"), "--delays must be even, random, least, or times"),
        (("--fade", "3"), "fade must be positive and below 1.5 s"),
        (("--order", "0"), "order must be a whole number"),
        (("--measured-whisker", "Z1", "--measured", "T0"), "--measured-whisker must be one of"),
        (("--low", "83", "--high", "0.1"), "band must have corners 0 < --low < --high (Hz), got 83, 0.1"),
        (
            ("--high", "9kHz"),
            "must be at least four times --high, 36000 Hz, got 1000 Hz; lower --high to at most 250 Hz",
        ),
        (
            ("--separation", "2s"),
            "--separation must be at most 0.25 s, which leaves room for 24 copies in 6 s, got 2s; "
            "lower it, or lengthen --duration to more than 48 s",
        ),
    ],
)
def test_bad_input_is_one_line_and_no_file(call, textures, tmp_path, words, message):
    words = [textures[0] if word == "T0" else word for word in words]
    code, out, err = call(*textures, *QUICK, *words, "--out", tmp_path / "c.nc")
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "c.nc").exists()


@pytest.mark.parametrize(
    ("name", "rule"), [("c.mp3", "must end in .nc, .wav, .npy, .csv"), ("no/c.nc", "existing folder")]
)
def test_a_command_that_cannot_be_written_is_refused_before_any_work(call, textures, tmp_path, name, rule):
    code, _, err = call(tmp_path / "absent.csv", *QUICK, "--out", tmp_path / name)
    assert code == 2
    assert rule in err


def test_the_largest_separation_and_duration_that_a_refusal_names_are_taken(call, textures, tmp_path):
    words = ("--sampling-rate", "1000", "--out", tmp_path / "c.npy")
    assert call(*textures, *words, "--duration", "6", "--separation", "0.25")[0] == 0
    assert call(*textures, *words, "--duration", "7.898")[0] == 0


def test_inputs_that_are_too_short_are_refused_with_the_time_that_they_must_last(call, textures, tmp_path):
    words = ("--sampling-rate", "1000", "--out", tmp_path / "c.npy")
    err = call(*textures, *words, "--duration", "8")[2]
    assert "--inputs must last 8.1 s in all, one overlap of 0.05 s each included, got 7.998 s; scan a longer" in err
    assert "add one, or shorten --duration to at most 7.898 s" in err
    err = call(*textures, *words, "--duration", "12", "--fade", "2.5")[2]
    assert f"--inputs must each last longer than two overlaps, 5 s, got 3.999 s of {textures[0]}; scan" in err
    assert "or shorten --fade" in err


def test_from_surface_to_command(vibrissa, call, tmp_path):
    write_gaps(random_grating(0.12, rng=np.random.default_rng(1)), tmp_path / "t.csv")
    cone = ("--whisker.length", "0.05", "--whisker.cone-angle", "1.2e-3")
    posture = ("--contact", "0.29", "--base-angle", "1.2", "--speed", "0.1", "--sampling-rate", "4000")
    scan = (*posture, *cone, "--node", "0.005", "--out", tmp_path / "r.nc")
    assert vibrissa("scan", tmp_path / "t.csv", *scan)[0] == 0
    code, out, err = call(
        tmp_path / "r.nc", "--duration", "1", "--out", tmp_path / "c.npy", "--separation", "0", "--json"
    )
    assert code == 0, err
    told = json.loads(out)
    first = float(load(tmp_path / "r.nc").resonant_frequency[0])
    sidecar = json.loads((tmp_path / "c.npy.json").read_text())
    assert first in sidecar["variables"]["frequency"]["values"]
    assert 1e-7 < told["peak_travel"] < 1e-3
    assert "largest |r|" in err  # 1 s holds too little for 24 copies
