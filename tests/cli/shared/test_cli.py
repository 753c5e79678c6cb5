"""The command line: what scripts rely on, and one line for bad input."""

import json
import os
import resource
import subprocess
import sys

import numpy as np
import pytest
from refusals import refusal

from vibrissa.cli.shared.display.output import OutputOptions
from vibrissa.netcdf import load
from vibrissa.video.io.movie import write_movie


@pytest.fixture
def movie(tmp_path):
    """Ten frames of one dark straight whisker."""
    row = np.arange(60)[:, None]
    line = 40 + 0.2 * np.arange(120)
    image = 180 - 100 * np.exp(-((row - (line - 20)) ** 2) / 1.5)
    noise = np.random.default_rng(0).normal(0, 2, (10, 60, 120))
    write_movie(tmp_path / "movie.mkv", [np.clip(image + noise, 0, 255).round().astype(np.uint8)])
    return tmp_path / "movie.mkv"


CALIBRATION = ("--frame-rate", "500", "--pixel-size", "1e-4")


def test_modes_prints_one_json_object(vibrissa):
    code, out, err = vibrissa("modes", "--contact", "0.3", "--n-modes", "3", "--json")
    assert (code, err) == (0, "")
    np.testing.assert_allclose(json.loads(out)["kappa"], [23.585537548, 66.823690763, 133.719738565], rtol=1e-10)


@pytest.mark.parametrize(("name", "code"), [("modes.csv", "format"), ("absent/modes.nc", "missing")])
def test_a_file_of_results_that_cannot_be_written_is_refused_before_any_work(tmp_path, name, code):
    with refusal(code, "--out", str(tmp_path / name)):
        OutputOptions(out=tmp_path / name)


def test_modes_of_a_free_tip(vibrissa):
    out = json.loads(vibrissa("modes", "--contact", "0.3", "--boundary", "free", "--json")[1])
    np.testing.assert_allclose(out["kappa"], [11.243389387, 38.043187585, 87.368171677], rtol=1e-10)
    whole = json.loads(vibrissa("modes", "--boundary", "free", "--n-modes", "2", "--json")[1])
    np.testing.assert_allclose(whole["kappa"], [8.7192588550799, 21.145662387869], rtol=1e-12)


def test_modes_of_one_whisker_in_hertz(vibrissa):
    cone = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3")
    out = json.loads(vibrissa("modes", "--contact", "0.29", *cone, "--json")[1])
    k = 2 * 0.04 / 1.5e-3 * np.sqrt(1140 / 3.74e9)
    np.testing.assert_allclose(out["resonant_frequency"], np.array(out["kappa"]) / (2 * np.pi * k))
    np.testing.assert_allclose(out["resonant_frequency"][0], 123, atol=0.5)  # MODEL: f₁ = 123 Hz
    atlas = json.loads(vibrissa("modes", "--contact", "0.29", "--atlas", "C2", "--json")[1])
    assert len(atlas["resonant_frequency"]) == 3


def test_modes_writes_its_shapes(vibrissa, tmp_path):
    assert vibrissa("modes", "--contact", "0.3", "--out", tmp_path / "modes.nc")[0] == 0
    data = load(tmp_path / "modes.nc")
    assert data.mode_shape.dims == ("mode", "s")
    assert data.mode_shape.attrs["units"] == "1"


def test_track_then_decompose_says_what_is_lost(vibrissa, movie, tmp_path):
    out = tmp_path / "p.nc"
    code, text, err = vibrissa("track", movie, *CALIBRATION, "--seed-point", "60,32", "--out", out, "--json")
    assert (code, json.loads(text)["frames_followed"]) == (0, [10])
    assert "\r" not in err  # no progress bar where nobody watches
    data = load(out)
    assert data.x.dims == ("whisker", "time", "node")
    np.testing.assert_allclose(data.time, np.arange(10) / 500)
    row = data.y.values[0] / 1e-4
    np.testing.assert_allclose(np.nanmean(row - (20 + 0.2 * data.x.values[0] / 1e-4)), 0, atol=0.02)
    code, _, err = vibrissa("decompose", out, "--contact", "0.3", "--atlas", "C2")
    assert code == 2  # a straight line does not tell where the substrate is
    assert "must turn by" in err


def test_whisker_gives_the_cone_behind_its_diameters(vibrissa, tmp_path):
    path = tmp_path / "diameters.csv"
    lines = [f"{x},{120e-6 * (1 - x / 0.04)!r}" for x in (0.0, 0.01, 0.02, 0.03)]
    path.write_text("distance,diameter\n" + "\n".join(lines) + "\n")
    out = json.loads(vibrissa("whisker", path, "--json")[1])
    np.testing.assert_allclose([out["length"], out["cone_angle"], out["tip"]], [0.04, 1.5e-3, 0.25], rtol=1e-9)


def test_atlas_prints_every_position(vibrissa):
    out = json.loads(vibrissa("atlas", "--json")[1])
    assert {"alpha", "C2", "E8"} <= set(out["position"])
    one = json.loads(vibrissa("atlas", "β", "--json")[1])
    assert one["position"] == ["beta"]
    assert out["mean_length"][out["position"].index("E8")] is None  # not measured


def half(movie, tmp_path):
    content = movie.read_bytes()
    (tmp_path / "half.mkv").write_bytes(content[: len(content) // 2])
    return tmp_path / "half.mkv"


BAD = {
    "no such file": lambda movie, tmp: (
        ["track", tmp / "no.mkv", *CALIBRATION, "--seed-point", "1,1"],
        "must be an existing file",
    ),
    "no movie": lambda movie, tmp: (["track", __file__, *CALIBRATION, "--seed-point", "1,1"], "test_cli.py"),
    "truncated movie": lambda movie, tmp: (
        ["track", half(movie, tmp), *CALIBRATION, "--seed-point", "60,32"],
        "half.mkv",
    ),
    "no pixel size": lambda movie, tmp: (
        ["track", movie, "--frame-rate", "500", "--seed-point", "1,1"],
        "--pixel-size",
    ),
    "bad pixel size": lambda movie, tmp: (
        ["track", movie, "--frame-rate", "500", "--pixel-size", "-1", "--seed-point", "60,32"],
        "--pixel-size must be positive",
    ),
    "seed outside": lambda movie, tmp: (["track", movie, *CALIBRATION, "--seed-point", "900,3"], "120 × 60"),
    "seed that is none": lambda movie, tmp: (["track", movie, *CALIBRATION, "--seed-point", "here"], "COLUMN,ROW"),
    "no study": lambda movie, tmp: (["run", tmp / "no.toml"], "must be an existing study file"),
    "no folder": lambda movie, tmp: (["run", "--out", tmp / "a" / "b"], "must be an existing folder"),
    "unknown whisker": lambda movie, tmp: (["modes", "--contact", "0.3", "--atlas", "C9"], "did you mean"),
    "whisker twice": lambda movie, tmp: (
        ["modes", "--contact", "0.3", "--atlas", "C2", "--whisker.length", "0.04", "--whisker.cone-angle", "2e-3"],
        "must be given once",
    ),
    "contact": lambda movie, tmp: (["modes", "--contact", "1.2"], "contact must lie between"),
    "no contact": lambda movie, tmp: (["modes"], "--contact must be given"),
    "unknown option": lambda movie, tmp: (["modes", "--contac", "0.3"], "--contact"),
    "unknown verb": lambda movie, tmp: (["mode"], "mode"),
    "no profile": lambda movie, tmp: (
        ["decompose", movie, "--contact", "0.3", "--atlas", "C2"],
        "must be a NetCDF file",
    ),
    "millimetres as micrometres": lambda movie, tmp: (["whisker", wrong_unit(tmp)], "diameter_um take"),
    "skin off the whisker": lambda movie, tmp: (
        ["track", movie, *CALIBRATION, "--seed-point", "60,32", "--skin", "10,50"],
        "skin must lie where the whisker leaves the skin",
    ),
    "pixels in millimetres": lambda movie, tmp: (
        ["track", movie, "--frame-rate", "500", "--pixel-size", "0.1", "--seed-point", "60,32"],
        "write --pixel-size 0.1mm, if",
    ),
    "pixels in micrometres, before whiskers are looked for": lambda movie, tmp: (
        ["track", tmp / "no.mkv", "--pixel-size", "95"],
        "--pixel-size must be at most",
    ),
    "a point in two words": lambda movie, tmp: (
        ["track", movie, *CALIBRATION, "--seed-point", "60,32", "--skin", "50.5", "57"],
        "--skin must be COLUMN,ROW in one word, got '50.5' and '57'\n",
    ),
    "an unexpected word": lambda movie, tmp: (["modes", "foo"], "'foo' is unexpected; see --help"),
    "a verb that is none": lambda movie, tmp: (["frobnicate"], 'Unknown command "frobnicate"; see --help\n'),
    "scan in millimetres": lambda movie, tmp: (
        ["scan", "built-in", "--contact", "0.3", "--base-angle", "1.2", "--speed", "100", "--atlas", "C2"],
        "--speed must be at most 10 m/s, got 100; write --speed 100mm/s, if that is meant\n",
    ),
    "whisker in millimetres": lambda movie, tmp: (
        ["modes", "--contact", "0.3", "--whisker.length", "40", "--whisker.cone-angle", "1.5e-3"],
        "--whisker.length must be at most 1 m, got 40; write --whisker.length 40mm, if that is meant\n",
    ),
    "cylinder": lambda movie, tmp: (["whisker", cylinder(tmp)], "cone only"),
}


def wrong_unit(tmp):
    (tmp / "unit.csv").write_text("distance_mm,diameter_um\n0,0.12\n10,0.09\n20,0.06\n30,0.03\n")
    return tmp / "unit.csv"


def cylinder(tmp):
    (tmp / "cylinder.csv").write_text("distance,diameter\n0,1e-4\n0.01,1.0001e-4\n0.02,1e-4\n0.03,1.0001e-4\n")
    return tmp / "cylinder.csv"


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_exit_code_2_and_leaves_no_file(vibrissa, movie, tmp_path, monkeypatch, case):
    monkeypatch.chdir(tmp_path)
    words, message = BAD[case](movie, tmp_path)
    before = set(tmp_path.iterdir())
    code, out, err = vibrissa(*words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert message in err
    assert set(tmp_path.iterdir()) == before


def test_a_full_disk_leaves_no_partial_file(movie, tmp_path):
    def small_files():  # what a full disk looks like to a program, on any machine
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    words = ["track", str(movie), *CALIBRATION, "--seed-point", "60,32", "--out", str(tmp_path / "p.nc")]
    command = [sys.executable, "-m", "vibrissa", *words]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=small_files)
    assert done.returncode == 2, done.stderr
    *stages, refusal = done.stderr.splitlines()
    assert "could not be written" in refusal
    assert all(line.startswith("vibrissa: 0:0") for line in stages)  # where the machine is slow
    assert [path.name for path in tmp_path.iterdir()] == ["movie.mkv"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("sweep", "map"),
        ("sweeps", "recordings"),
        ("tracks", "import-tracks"),
        ("whisk", "whisking"),
        ("base", "sensor"),
    ],
)
def test_the_old_name_of_a_verb_names_the_new_one(vibrissa, old, new):
    code, out, err = vibrissa(old, "--contact", "0.3")
    assert (code, out) == (2, "")
    assert err == f"vibrissa: the verb {old} is now {new}; see vibrissa {new} --help\n"
    assert vibrissa(new, "--help")[0] == 0


def test_help_shows_the_verbs_in_their_groups(vibrissa):
    words = vibrissa("--help")[1].split()
    order = [words.index(word) for word in ("mechanics", "whisking", "Movies", "track", "Spikes", "sort", "Studies")]
    assert order == sorted(order)


def test_help_names_no_option_that_empties_a_list(vibrissa):
    for verb in ("track", "pick", "neural", "scan"):
        code, out, _ = vibrissa(verb, "--help")
        assert code == 0
        assert "--empty" not in out


@pytest.mark.parametrize("names", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "POSIX", "PYTHONUTF8": "0"}])
def test_a_terminal_without_greek_letters_gets_the_whole_table(names):
    command = [sys.executable, "-m", "vibrissa", "gap", "--contact", "0.29", "--base-angle", "1.2"]
    words = ["--gap-width", "0.6mm", "--whisker.length", "40mm", "--whisker.cone-angle", "1.5mrad"]
    env = {**os.environ, "PYTHONCOERCECLOCALE": "0", **names}
    done = subprocess.run([*command, *words], capture_output=True, env=env, check=False)
    assert done.returncode == 0, done.stderr
    assert b"?" in done.stdout
    assert done.stdout.count(b"\n") > 10
