"""The verbs of textures beyond gratings: any surface, and a posture that changes."""

import json

import numpy as np
import pytest

from vibrissa.netcdf import load
from vibrissa.texture.io import write_gaps
from vibrissa.texture.surface import random_grating

WHISKER = ("--whisker.length", "0.04", "--whisker.cone-angle", "1.5e-3")
HOLD = ("--contact", "0.29", "--base-angle", "1.2")
SPEED = ("--speed", "0.1")
COARSE = ("--sampling-rate", "2000")


@pytest.fixture
def gaps(tmp_path):
    texture = random_grating(0.02, rng=np.random.default_rng(4))
    write_gaps(texture, tmp_path / "gaps.csv")
    corners = np.stack([texture.position, texture.position, texture.end, texture.end], axis=1).ravel()
    heights = np.tile([0, -texture.depth, -texture.depth, 0], texture.position.size)
    ends = [(0.0, 0.0), *zip(corners, heights, strict=True), (0.021, 0.0)]
    rows = "\n".join(f"{x!r},{h!r}" for x, h in [(float(x), float(h)) for x, h in ends])
    (tmp_path / "relief.csv").write_text(f"position_m,height_m\n{rows}\n")
    return tmp_path


def test_a_relief_of_gaps_is_scanned_as_the_gaps(vibrissa, gaps):
    for name in ("gaps", "relief"):
        options = (*HOLD, *SPEED, *COARSE, *WHISKER, "--out", gaps / f"{name}.nc")
        code, _, err = vibrissa("scan", gaps / f"{name}.csv", *options)
        assert code == 0, err
        assert "about the curved profile the first resonance is off" in err
        assert err.startswith("vibrissa: outside the model: free end prevents ")
    assert "the contact sticks" in err
    one, other = load(gaps / "gaps.nc"), load(gaps / "relief.nc")
    n = min(one.sizes["time"], other.sizes["time"])
    a, b = one.mode_displacement.values[:, :n], other.mode_displacement.values[:, :n]
    np.testing.assert_allclose(b, a, atol=1e-6 * np.abs(a).max())


def test_the_direction_can_be_turned(vibrissa, gaps):
    words = ("scan", gaps / "relief.csv", *HOLD, *SPEED, *COARSE, *WHISKER)
    found = [vibrissa(*words, *turned, "--json")[1] for turned in ((), ("--reverse",))]
    assert found[0] != found[1]


@pytest.fixture
def path(tmp_path):
    t = np.arange(0, 0.301, 0.01)
    rows = [f"{a:.3f},{1.1 + 0.05 * np.sin(2 * np.pi * 3 * a):.6f},0.29" for a in t]
    (tmp_path / "path.csv").write_text("time,base_angle,contact\n" + "\n".join(rows) + "\n")
    return tmp_path / "path.csv"


def test_whisk_tells_how_slow_the_posture_changes(vibrissa, gaps, path):
    out = gaps / "slow.nc"
    code, text, err = vibrissa("whisking", gaps / "gaps.csv", path, *SPEED, *COARSE, *WHISKER, "--out", out, "--json")
    assert code == 0, err
    assert "where the base is steepest, about the curved profile the first resonance is off" in err
    assert 0 < json.loads(text)["gain_rate"] < 0.02
    assert err.startswith("vibrissa: outside the model: free end prevents ")
    assert json.loads(text)["jumps_allowed"] == 0 < json.loads(text)["jump_count"]
    angle = load(out).moment_base_angle.values
    assert angle.max() == pytest.approx(1.15, abs=2e-3)


BAD = {
    "option of a file that is none": (["scan", "gaps.csv", *HOLD, "--fill"], "--fill must not be given"),
    "no such part": (["scan", "relief.csv", *HOLD, "--part", "3"], "must be FIRST:LAST"),
    "no texture": (["scan", "path.csv", *HOLD], "position"),
    "long": (["scan", "long.csv", *HOLD], "must end within 50 whisker lengths of x = 0, 2 m, got a place at 5 m"),
    "long relief": (["scan", "level.csv", *HOLD], "must end within 50 whisker lengths"),
    "angle": (
        ["scan", "gaps.csv", "--contact", "0.29", "--base-angle", "1.7"],
        "--base-angle must lie between 0 and π/2",
    ),
    "contact": (["scan", "gaps.csv", "--contact=1.4", "--base-angle", "1"], "--contact must lie between 0 and 1"),
    "damping": (["scan", "gaps.csv", *HOLD, "--damping", "2"], "--damping must lie in [0, 1)"),
    "modes": (["scan", "gaps.csv", *HOLD, "--n-modes", "0"], "--n-modes must be at least 1"),
    "folder": (
        ["scan", "none.csv", *HOLD, "--out", "none/x.nc"],
        "--out must lie in an existing folder, got none/x.nc",
    ),
    "name": (["whisking", "none.csv", "none.csv", "--out", "x.csv"], "--out must end in .nc"),
    "folder itself": (["scan", "none.csv", *HOLD, "--out", "folder.nc"], "--out must name a file"),
    "no path": (
        ["whisking", "gaps.csv", "relief.csv"],
        "has an unknown column, got 'position_m'; columns are time",
    ),
    "no number": (["whisking", "gaps.csv", "bad.csv"], "line 3, base_angle must be a finite number, got 'x'"),
    "back": (["whisking", "gaps.csv", "fast.csv"], "scan faster or move the base more slowly"),
    "late gap": (["whisking", "late.csv", "path.csv"], "must be reached before the path ends"),
    "gap at 0": (["whisking", "zero.csv", "path.csv"], "where the path starts"),
    "beyond the fold": (
        ["scan", "relief.csv", "--contact", "0.05", "--base-angle", "1.5"],
        "must be before the fold",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(vibrissa, gaps, path, monkeypatch, case):
    monkeypatch.chdir(gaps)
    (gaps / "bad.csv").write_text("time,base_angle,contact\n0,1,0.3\n1,x,0.3\n")
    (gaps / "fast.csv").write_text("time,base_angle,contact\n0,1.1,0.29\n0.05,0.9,0.2\n0.1,1.1,0.29\n0.15,0.9,0.2\n")
    (gaps / "late.csv").write_text("position,width\n0.5,0.0004\n")
    (gaps / "zero.csv").write_text("position,width\n0,0.0004\n")
    (gaps / "long.csv").write_text("position,width\n0.001,0.0004\n5,0.0004\n")
    (gaps / "level.csv").write_text("position_m,height_um\n0,0\n2.5,1\n5,0\n")
    (gaps / "folder.nc").mkdir()
    words, message = BAD[case]
    code, out, err = vibrissa(*words, *SPEED, *WHISKER)
    assert (code, out) == (2, "")
    assert message in err.splitlines()[-1]  # what was noticed of a file may come before
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("", "got an empty file"),
        ("time,base_angle,contact\n0,1.2,0.3\n", "two lines or more below its header, got 1"),
        ("time,base_angle,contact\n0,1.2,0.3\n2,1.2,0.3\n1,1.2,0.3\n", "way.csv: PosturePath.time"),
        ("time,base_angle,contact\n0,60,0.3\n1,60,0.3\n", "way.csv: posture at 0 s"),
    ],
)
def test_a_path_that_is_none_is_refused_by_its_file(vibrissa, gaps, rows, words):
    (gaps / "way.csv").write_text(rows)
    code, _, err = vibrissa("whisking", gaps / "gaps.csv", gaps / "way.csv", *SPEED, *WHISKER)
    assert (code, err.count("\n")) == (2, 1)
    assert words in err


def test_a_surface_where_gaps_are_wanted_is_told_where_to_go(vibrissa, gaps, path):
    code, _, err = vibrissa("whisking", gaps / "relief.csv", path, *SPEED, *WHISKER)
    assert (code, err.count("\n")) == (2, 1)
    assert "goes into scan or run" in err


def test_too_few_samples_are_told(vibrissa, gaps):
    for rate, mode in (("200", 1), ("500", 2)):
        options = (*HOLD, *SPEED, *WHISKER, "--sampling-rate", rate)
        code, _, err = vibrissa("scan", gaps / "gaps.csv", *options)
        assert code == 0, err
        assert f"Hz of mode {mode}: its record does not show how it rings" in err
    assert "does not show" not in vibrissa("scan", gaps / "gaps.csv", *HOLD, *SPEED, *WHISKER, *COARSE)[2]
