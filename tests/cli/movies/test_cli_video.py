"""The verbs of movies: whiskers found, turned, lit and shadowed; tracks in and out; one line for bad input."""

import json
import tomllib

import numpy as np
import pytest

from vibrissa.netcdf import load
from vibrissa.video.camera.camera import Camera
from vibrissa.video.camera.rendering import render
from vibrissa.video.camera.scenery import Led, Scenery
from vibrissa.video.io.movie import read_blocks, write_movie

PIXEL = 95e-6
CAMERA = Camera(width=240, height=120, noise=2.0, contrast=(90.0, 60.0))
CALIBRATION = ("--frame-rate", "2000", "--pixel-size", str(PIXEL))
N = 24
X = np.linspace(10, 225, 240)
BEND = 2e-3  # [1/px] the whisker rises by it from its base, and turns back


def rows(shift=0.0):
    return 70 + shift - 0.3 * (X - 10) + BEND / 2 * (X - 10) ** 2


@pytest.fixture(scope="module")
def movie(tmp_path_factory):
    """One curved whisker that moves up and down by half a pixel; a lamp lights in frame 10."""
    shift = 0.5 * np.sin(np.arange(N) / 3)
    y = np.array([rows(one) for one in shift])[None] * PIXEL
    x = np.broadcast_to(X * PIXEL, y.shape)
    lamp = Scenery(led=Led(position=(200 * PIXEL, 15 * PIXEL), start=10 / 2000 - 1e-4, radius=4 * PIXEL))
    path = tmp_path_factory.mktemp("movie") / "movie.mkv"
    write_movie(path, render(x, y, CAMERA, seed=3, scenery=lamp))
    return path


def tangent(column):
    """Two points of the line tangent to the whisker at a column, as the options take them."""
    slope = -0.3 + BEND * (column - 10)
    row = float(np.interp(column, X, rows()))
    return [part for c in (30, 230) for part in ("--substrate", f"{c},{row + slope * (c - column):.4f}")]


def test_whiskers_are_found_without_seeds(vibrissa, movie, tmp_path):
    code, out, err = vibrissa("track", movie, *CALIBRATION, "--out", tmp_path / "p.nc", "--json")
    assert code == 0, err
    assert "1 whisker found from the left" in err
    assert json.loads(out)["frames_followed"] == [N]
    found = load(tmp_path / "p.nc")
    off = found.y.values[0] / PIXEL - np.interp(found.x.values[0] / PIXEL, X, rows())
    assert np.nanstd(np.nanmean(off, axis=1)) == pytest.approx(0.5 / np.sqrt(2), rel=0.1)


def test_a_turned_movie_gives_the_turned_profile(vibrissa, movie, tmp_path):
    turned = tmp_path / "turned.mkv"
    write_movie(turned, (np.ascontiguousarray(block.transpose(0, 2, 1)) for block in read_blocks(movie)))
    assert vibrissa("track", movie, *CALIBRATION, "--seed-point", "60,56", "--out", tmp_path / "a.nc")[0] == 0
    options = ("--seed-point", "56,60", "--base", "top", "--out", tmp_path / "b.nc")
    assert vibrissa("track", turned, *CALIBRATION, *options)[0] == 0
    a, b = load(tmp_path / "a.nc"), load(tmp_path / "b.nc")
    np.testing.assert_array_equal(a.x, b.y)
    np.testing.assert_array_equal(a.y_sd, b.x_sd)


def test_the_lamp_the_contact_and_a_preview(vibrissa, movie, tmp_path):
    options = [*tangent(232), "--lamp", "find", "--preview", tmp_path / "sheet.png", "--out", tmp_path / "p.nc"]
    code, out, err = vibrissa("track", movie, *CALIBRATION, *options, "--json")
    assert code == 0, err
    assert "the lamp lights in frame 10" in err
    found = load(tmp_path / "p.nc")
    # a parabola is what the paper's polynomial is, here in the arc length of a shallow curve
    assert abs(found.contact_x.item() / PIXEL - 232) < 2 * found.contact_x_sd.item() / PIXEL + 3
    assert json.loads(out)["contact_accepted"] == [True]
    assert (tmp_path / "sheet.png").read_bytes().startswith(b"\x89PNG")


def test_a_part_of_a_movie_keeps_the_movies_time(vibrissa, movie, tmp_path):
    options = (*CALIBRATION, "--seed-point", "60,56", "--skin", "10,70", "--lamp", "find")
    part = ("--start", "4", "--stop", "9.5ms")  # frame 19 begins at 9.5 ms, and is no part of it
    assert vibrissa("track", movie, *options, "--out", tmp_path / "whole.nc")[0] == 0
    code, _, err = vibrissa(
        "track", movie, *options, *part, "--preview", tmp_path / "s.png", "--out", tmp_path / "p.nc"
    )
    assert code == 0, err
    assert "the lamp lights in frame 10" in err
    whole, found = load(tmp_path / "whole.nc"), load(tmp_path / "p.nc")
    assert (found.attrs["first_frame"], found.attrs["last_frame"]) == (4, 18)
    assert "first_frame" not in whole.attrs
    same = whole.isel(time=slice(4, 19))
    np.testing.assert_allclose(found.time, same.time, rtol=1e-12)
    assert found.time.attrs == whole.time.attrs
    assert found.attrs["led_time"] == pytest.approx(whole.attrs["led_time"])
    nodes = min(same.sizes["node"], found.sizes["node"]) - 1
    off = found.y.values[..., 1:nodes] - same.y.values[..., 1:nodes]
    assert np.sqrt(np.mean(off**2)) < 0.03 * PIXEL  # a frame later it is 0.1 pixels elsewhere
    found_without_seeds = vibrissa("track", movie, *CALIBRATION, *part, "--out", tmp_path / "q.nc")
    assert found_without_seeds[0] == 0, found_without_seeds


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (("--start", "24"), "--start, --stop must lie within the 24 frames"),
        (("--stop", "25"), "--start, --stop must lie within the 24 frames"),
        (("--start", "9", "--stop", "9"), "--start, --stop must be frames from 0 on, the second after the first"),
        (("--start", "0.5"), "write --start 0.1s"),
        (("--start", "10mm"), "--start must be a time"),
    ],
)
def test_a_part_that_the_movie_does_not_have_is_refused(vibrissa, movie, tmp_path, part, message):
    words = ("--seed-point", "60,56", *part, "--out", tmp_path / "p.nc")
    code, _, err = vibrissa("track", movie, *CALIBRATION, *words)
    assert (code, err.count("\n")) == (2, 1)
    assert message in err
    assert not (tmp_path / "p.nc").exists()


def test_a_contact_off_the_substrate_is_rejected_with_the_reason(vibrissa, movie, tmp_path):
    off = ("--substrate", "30,10", "--substrate", "230,10")
    code, out, err = vibrissa("track", movie, *CALIBRATION, *off, "--out", tmp_path / "p.nc", "--json")
    assert code == 0, err
    assert "whisker 0 is rejected: " in err
    assert json.loads(out)["contact_accepted"] == [False]


def test_tracks_go_out_to_whisk_and_come_back(vibrissa, movie, tmp_path):
    skin = ("--skin", f"14,{np.interp(14, X, rows())}")
    assert vibrissa("track", movie, *CALIBRATION, *skin, "--out", tmp_path / "p.nc")[0] == 0
    assert vibrissa("import-tracks", tmp_path / "p.nc", "--out", tmp_path / "q.whiskers")[0] == 0
    assert vibrissa("import-tracks", tmp_path / "q.whiskers", *CALIBRATION, *skin, "--out", tmp_path / "r.nc")[0] == 0
    first, last = load(tmp_path / "p.nc"), load(tmp_path / "r.nc")
    nodes = min(first.sizes["node"], last.sizes["node"]) - 1
    off = (last.y.values - first.y.values)[0, :, 1:nodes] / PIXEL
    assert np.isfinite(off).mean() > 0.95
    assert np.nanmax(np.abs(off)) < 0.2


def test_pick_without_a_page_writes_a_study_that_runs(vibrissa, movie, tmp_path):
    study = tmp_path / "study.toml"
    scale = ("--scale-point", "10,10", "--scale-point", "20,10", "--scale-length", str(10 * PIXEL))
    code, _, err = vibrissa("pick", movie, "--no-page", "--frame-rate", "2000", *scale, "--out", study)
    assert code == 0, err
    assert tomllib.loads(study.read_text())["movie"]["pixel_size"] == pytest.approx(PIXEL)
    assert vibrissa("run", study, "--out", tmp_path / "out")[0] == 0
    assert (tmp_path / "out" / "report.html").is_file()
    assert vibrissa("pick", movie, "--no-page", "--frame-rate", "2000", *scale, "--out", study)[0] == 2


BAD = {
    "no rate": (["track", "MOVIE", "--pixel-size", "1e-4"], "--frame-rate must be given"),
    "mean": (["track", "MOVIE", *CALIBRATION, "--background", "mean"], "background"),
    "region": (["track", "MOVIE", *CALIBRATION, "--region", "1,2"], "must be C0,R0,C1,R1"),
    "empty region": (["track", "MOVIE", *CALIBRATION, "--region", "0,0,30,20"], "at least 32 pixels each way"),
    "region without whiskers": (["track", "MOVIE", *CALIBRATION, "--region", "0,80,50,119"], "no line in any frame"),
    "one point of a line": (["track", "MOVIE", *CALIBRATION, "--substrate", "1,2"], "must be given twice"),
    "no lamp there": (["track", "MOVIE", *CALIBRATION, "--lamp", "5,80,30,110"], "lamp"),
    "preview of what": (["track", "MOVIE", *CALIBRATION, "--preview", "a.gif"], ".mp4, .mkv or .png"),
    "not a dataset": (["track", "MOVIE", *CALIBRATION, "--out", "a.csv"], "must end in .nc"),
    "no tracks": (["import-tracks", "MOVIE", "--out", "a.nc"], "tracked whiskers"),
    "half a calibration": (["import-tracks", "MOVIE", "--out", "a.nc", "--frame-rate", "100"], "or neither"),
    "nothing to measure by": (
        ["pick", "MOVIE", "--no-page", "--frame-rate", "2000"],
        "--pixel-size must be given, or --scale-point",
    ),
    "no rate to pick with": (["pick", "MOVIE", "--no-page", "--pixel-size", "1e-4"], "--frame-rate must be given"),
    "a seed off the image": (
        ["pick", "MOVIE", "--no-page", *CALIBRATION, "--base", "left", "--seed-point", "9000,1"],
        "--seed-point must lie in the image",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_leaves_nothing(vibrissa, movie, tmp_path, monkeypatch, case):
    monkeypatch.chdir(tmp_path)
    words, message = BAD[case]
    code, out, err = vibrissa(*(movie if word == "MOVIE" else word for word in words))
    assert (code, out) == (2, "")
    lines = [line for line in err.splitlines() if "whisker found" not in line and "tracking '" not in line]
    assert len(lines) == 1
    assert message in lines[0]
    assert not list(tmp_path.iterdir())


TWICE = ("--seed-point", "60,56", "--seed-point", "60,56")


def test_a_seed_given_twice_and_a_whisker_that_is_not_there_are_told(vibrissa, movie, tmp_path):
    for options in (TWICE, ("--polarity", "bright"), ("--node-spacing", "1")):
        code, out, err = vibrissa("track", movie, *CALIBRATION, *options, "--out", tmp_path / "p.nc")
        assert (code, out) == (2, "")
        assert "Traceback" not in err
    assert not list(tmp_path.iterdir())


def test_a_contact_far_beyond_what_is_seen_is_rejected(vibrissa, movie, tmp_path):
    far = ("--substrate", "230,10", "--substrate", "236,100", "--out", tmp_path / "p.nc", "--json")
    code, out, err = vibrissa("track", movie, *CALIBRATION, *far)
    assert code == 0, err
    assert json.loads(out)["contact_accepted"] == [False]


def test_a_single_frame_has_no_displacement(vibrissa, movie, tmp_path):
    write_movie(tmp_path / "one.tif", (block[:1] for block in list(read_blocks(movie))[:1]))
    assert vibrissa("track", tmp_path / "one.tif", *CALIBRATION, "--out", tmp_path / "p.nc")[0] == 0
    code, out, err = vibrissa("decompose", tmp_path / "p.nc", "--contact", "0.3", "--atlas", "C2")
    assert (code, out) == (2, "")
    assert "two frames at least" in err
