"""The verb track on a movie of whisking: nothing given, marks, files; what excludes each other."""

import json

import numpy as np
import pytest

from vibrissa import track
from vibrissa.cli.movies.track import remarks_on
from vibrissa.netcdf import load
from vibrissa.quantities import dataset
from vibrissa.video.camera.camera import Camera
from vibrissa.video.camera.pad.filming import film
from vibrissa.video.camera.pad.settings import Head, WhiskingScene
from vibrissa.video.io.colour import write_colour

SIDE = 0.2e-3
CALIBRATION = ("--frame-rate", "500", "--pixel-size", str(SIDE))
SCENE = WhiskingScene(
    camera=Camera(frame_rate=500.0, pixel_size=SIDE, width=320, height=240, exposure=3e-4, noise=2.0),
    head=Head(nose=(30 * SIDE, 120 * SIDE), fur=0.0),
    names=("C1", "C2", "C3"),
    sides=("left",),
    seed=5,
)


@pytest.fixture(scope="module")
def frames():
    return np.concatenate(list(film(SCENE, 100)))


@pytest.fixture(scope="module")
def movie(frames, tmp_path_factory):
    """The scene in light of one colour."""
    path = tmp_path_factory.mktemp("whisking") / "whisking.mkv"
    write_colour(path, ((frame[..., None] * np.array([1.0, 0.9, 0.6])).astype(np.uint8) for frame in frames))
    return path


@pytest.fixture(scope="module")
def seen(frames):
    return track(frames, frame_rate=500, pixel_size=SIDE)


def mark(profile, whisker, frame, name):
    x, y = (profile[axis].values[whisker, frame] / SIDE for axis in "xy")
    at = np.flatnonzero(np.isfinite(x))[6]
    return f"{frame},{x[at]:.1f},{y[at]:.1f},{name}"


def test_a_whisking_movie_alone_gives_all_whiskers(vibrissa, movie, tmp_path):
    files = ("--segments", tmp_path / "lines.nc", "--preview", tmp_path / "s.png", "--out", tmp_path / "p.nc")
    code, out, err = vibrissa("track", movie, *CALIBRATION, *files, "--json")
    assert code == 0, err
    assert "tracking 'link': 3 of 3 whiskers of frame 0 move away" in err.splitlines()[0]
    assert err.count("colour") == 1
    assert min(json.loads(out)["frames_followed"]) > 85
    profile, lines = load(tmp_path / "p.nc"), load(tmp_path / "lines.nc")
    assert profile.attrs["tracking"] == "link"
    assert profile.attrs["segments"] == "lines.nc"
    assert profile.attrs["movie"] == "whisking.mkv"  # by its name: a folder may move
    assert lines.attrs["frames"] == profile.sizes["time"] == 100
    assert {"column", "position_sd", "segment_whisker", "whisker_segment"} <= set(lines.data_vars)
    assert (tmp_path / "s.png").stat().st_size > 10_000


def test_marks_name_whiskers_from_the_command_line_and_from_a_file(vibrissa, movie, seen, tmp_path):
    table = tmp_path / "marks.csv"
    table.write_text(f"frame,column,row,whisker\n{mark(seen, 2, 30, 'C3')}\n")
    words = ("--mark", mark(seen, 1, 50, "C2"), "--mark-file", table, "--out", tmp_path / "p.nc")
    code, _, err = vibrissa("track", movie, *CALIBRATION, *words)
    assert code == 0, err
    assert "tracking 'link': marks given" in err
    assert json.loads(load(tmp_path / "p.nc").attrs["names"]) == ["C2", "C3", "whisker 2"]


def test_frames_in_memory_are_linked_as_a_file_is(seen):
    assert seen.attrs["tracking"] == "link"
    assert seen.sizes["whisker"] == 3
    assert np.isfinite(seen.y_sd.values).any(axis=2).mean() > 0.85
    assert seen.time.values[0] == 0


BAD = {
    "a frame beyond the end": (
        ["--mark", "100,60,60,C1"],
        "--mark must be in a frame from 0 to 99, got frame 100, column 60, row 60 (C1); frames count from 0",
    ),
    "a mark off the image": (["--mark", "0,400,60,C1"], "--mark must lie in the image of 320 × 240"),
    "a mark on nothing": (["--mark", "0,300,5,C1"], "the nearest line of frame 0 passes at column"),
    "no mark": (["--mark", "0,300,5"], "--mark must be FRAME,COLUMN,ROW,NAME"),
    "a mark without a name": (["--mark", "0,300,5, "], "--mark must have a frame from 0 on, a point and a name"),
    "skin off the image": (["--tracking", "link", "--skin", "999,60"], "--skin must lie in the image of 320 × 240"),
    "lines in the file of profiles": (["--out", "a.nc", "--segments", "a.nc"], "--segments must be another file than"),
    "no table": (["--mark-file", "none.csv"], "none.csv"),
    "seeds and marks": (["--mark", "0,60,60,C1", "--seed-point", "60,60"], "--mark must not be given together with"),
    "seeds and link": (["--tracking", "link", "--seed-point", "60,60"], "--seed-point must be left out"),
    "lines of the followed": (["--tracking", "follow", "--segments", "l.nc"], "--segments must be left out"),
    "an empty region": (["--region", "270,190,319,239"], "no line in any frame"),
    "a region from right to left": (["--region", "90,90,40,40"], "right and bottom are the larger ones"),
    "a region off the image": (["--region", "0,0,400,100"], "--region must lie within the image of 320 × 240"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_in_a_line(vibrissa, movie, tmp_path, monkeypatch, case):
    monkeypatch.chdir(tmp_path)
    words, message = BAD[case]
    code, out, err = vibrissa("track", movie, *CALIBRATION, *words)
    assert (code, out) == (2, "")
    lines = [line for line in err.splitlines() if "tracking '" not in line and "found from" not in line]
    assert len(lines) == 1
    assert message in lines[0]
    assert not list(tmp_path.iterdir())


def test_the_longest_runs_of_lost_frames_are_named_whatever_their_reasons(capsys):
    runs = [(2, 2, "a"), (5, 9, "a"), (10, 13, "b"), (14, 14, "a"), (20, 24, "b"), (30, 31, "a"), (40, 40, "b")]
    remarks_on(dataset({"lost": json.dumps([runs])}, time=np.arange(100.0)))
    assert "whisker 0 was lost in frames 5 to 14, 20 to 24, 30 to 31 and in 2 shorter runs" in capsys.readouterr().err
    remarks_on(dataset({"lost": json.dumps([[(40, 40, "b")]])}, time=np.arange(100.0)))
    assert "whisker 0 was lost in frame 40\n" in capsys.readouterr().err
