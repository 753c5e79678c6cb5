"""No verb replaces a file that it reads."""

import os

import numpy as np
import pytest

from vibrissa.cli import app, mechanics, movies, spikes, studies
from vibrissa.cli.shared.display.output import named

HELD = ("--contact", "0.29", "--base-angle", "1.2", "--atlas", "C2", "--speed", "0.1")
UNITS = ("--simulate-units", "3")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A motion, a texture and units, in the current folder."""
    monkeypatch.chdir(tmp_path)
    motion = np.c_[np.arange(2000) / 1e3, np.random.default_rng(0).normal(0, 1e-5, 2000)]
    for name in ("c.csv", "me.csv"):
        np.savetxt(name, motion, delimiter=",", header="time,displacement", comments="")
    (tmp_path / "tex.csv").write_text("position,width\n0.001,0.0006\n")
    (tmp_path / "a-units.csv").write_text("unit,threshold,slope,baseline,latency\nu,1e-6,1e6,1,0.01\n")
    (tmp_path / "tex-stimulus.csv").write_text("position,width\n0.001,0.0006\n")
    (tmp_path / "linked.csv").symlink_to("c.csv")
    os.link("c.csv", "hard.csv")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        (("replay", "c.csv", "--out", "c.csv"), "--out must not be one of the inputs"),
        (("replay", "c.csv", "--out", "./linked.csv"), "--out must not be one of the inputs"),
        (("replay", "c.csv", "--out", "hard.csv"), "--out must not be one of the inputs"),
        (
            ("replay", "c.csv", "--measured", "me.csv", "--out", "me.csv"),
            "--out must not be the file of --measured, got me.csv",
        ),
        (("scan", "tex.csv", *HELD, *UNITS, "--spikes-out", "tex.csv"), "--spikes-out must not be the texture"),
        (
            ("scan", "tex-stimulus.csv", *HELD, *UNITS, "--spikes-out", "tex.csv"),
            "--spikes-out also writes tex-stimulus.csv, which must not be the texture, got tex.csv",
        ),
        (
            ("scan", "tex.csv", *HELD, "--simulate-units", "a-units.csv", "--spikes-out", "a-units.csv"),
            "--spikes-out must not be the file of --simulate-units",
        ),
        (
            ("scan", "tex.csv", *HELD, "--simulate-units", "a-units.csv", "--spikes-out", "a.nwb"),
            "--spikes-out also writes a-units.csv, which must not be the file of --simulate-units, got a.nwb",
        ),
    ],
)
def test_an_output_that_is_an_input_is_refused_before_any_work(vibrissa, folder, words, rule):
    (folder / "a.nwb").touch()
    before = {path: path.read_bytes() for path in folder.iterdir()}
    code, out, err = vibrissa(*words)
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    assert rule in err
    assert err.strip().endswith("; choose another name")
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    "words",
    [
        ("track", "x.nc", "--pixel-size", "1e-4", "--out"),
        ("track", "x.nc", "--pixel-size", "1e-4", "--out", "y.nc", "--segments"),
        ("track", "x.mp4", "--pixel-size", "1e-4", "--preview"),
        ("decompose", "x.svg", "--contact", "0.3", "--picture"),
        ("kinematics", "x.nc", "--out"),
        ("neural", "--spikes", "x.nc", "--stimulus", "me.csv", "--out"),
        ("figure", "7", "x.png", "--out"),
        ("import-tracks", "x.nc", "--out"),
    ],
)
def test_so_it_is_for_every_verb(vibrissa, folder, words):
    file = next(folder / word for word in words if word.startswith("x."))
    file.touch()
    code, _, err = vibrissa(*words, file)
    assert code == 2
    assert f"{words[-1]} must not be the " in err
    assert file.read_bytes() == b""


def test_every_option_that_writes_is_known_as_one():
    writing = {"--out", "--picture", "--spikes-out", "--preview", "--movie", "--segments"}
    for room in (mechanics, movies, spikes, studies):
        for verb in room.VERBS:
            name = verb.__name__.rstrip("_").replace("_", "-")
            for one in app[name].assemble_argument_collection():
                read = one.index is not None or (name, one.name) == ("correct", "--segments")
                if one.name in writing and not read:
                    assert one.parameter.converter is named, (name, one.name)


def test_a_name_beside_an_input_is_written(vibrissa, folder):
    words = ("--duration", "1.9", "--sampling-rate", "1000", "--separation", "5ms", "--out", "new.csv")
    code, _, err = vibrissa("replay", "c.csv", *words)
    assert code == 0, err
    assert (folder / "new.csv").exists()


def test_the_picture_of_a_picture_does_not_replace_it(vibrissa, folder):
    (folder / "s.png").write_bytes(b"\x89PNG")
    code, _, err = vibrissa("show", "s.png", "--plot")
    assert code == 2
    assert "--plot must not replace the file, got s.png; name another picture with --out" in err
