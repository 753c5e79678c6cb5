"""What `show` says of each kind of file, and `info` of the machine."""

import json
import os
import re
import sys
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image

from vibrissa import __version__
from vibrissa.netcdf import save
from vibrissa.quantities import dataset
from vibrissa.study.run.contents import DATASETS, TABLES
from vibrissa.video.io.movie import write_movie

EXAMPLES = Path(__file__).parents[3] / "examples"
KINDS = {
    "diameters.csv": "table: diameters along a whisker",
    "gap.csv": "surface: gaps",
    "grating.csv": "surface: gaps",
    "ridges.csv": "surface: heights",
    "spikes.csv": "table: spikes",
    "replayed-spikes.csv": "table: spikes",
    "spikes-stimulus.csv": "table: motion of a point",
    "spikes-units.csv": "table: units to simulate",
    "sweeps.csv": "table: recorded sweeps",
    "robot.csv": "table: signals in time",
    "robot.toml": "study",
}


@pytest.mark.parametrize(("name", "kind"), KINDS.items())
def test_show_names_the_kind_of_every_example(vibrissa, name, kind):
    code, out, err = vibrissa("show", EXAMPLES / name)
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == f"{name}: {kind}"
    assert max(map(len, out.splitlines())) <= 80
    assert json.loads(vibrissa("show", EXAMPLES / name, "--json")[1])["kind"] == kind


def made(tmp_path):
    cone = ("--whisker.length", "40mm", "--whisker.cone-angle", "1.5mrad")
    posture = ("--contact", "0.29", "--base-angle", "70deg")
    where = ("--contact", "0.2,0.3", "--base-angle", "1", "--speed", "0.1", "--scheduler", "synchronous", *cone)
    words = ("map", "--texture", EXAMPLES / "gap.csv", *where, "--out", tmp_path / "map.nc")
    yield "map of the gain", "map.nc", words
    yield "modes of a whisker", "m.nc", ("modes", "--contact", "0.3", "--out", tmp_path / "m.nc")
    yield "a gap crossed", "g.nc", ("gap", *posture, "--gap-width", "0.015", "--out", tmp_path / "g.nc")
    yield "stationary profile", "p.nc", ("profile", *posture, "--out", tmp_path / "p.nc")
    scan = ("scan", EXAMPLES / "gap.csv", *posture, "--speed", "0.1", "--sampling-rate", "4000", *cone)
    yield "predicted scan", "s.nc", (*scan, "--out", tmp_path / "s.nc")
    spiking = ("--simulate-units", "2", "--trials", "2")
    yield "predicted scan with spikes", "f.nc", (*scan, *spiking, "--out", tmp_path / "f.nc")


def test_show_knows_what_the_verbs_write_and_draws_it(vibrissa, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for kind, name, words in made(tmp_path):
        assert vibrissa(*words)[0] == 0
        code, out, err = vibrissa("show", name, "--plot")
        assert (code, err) == (0, f"vibrissa: the picture is {Path(name).stem}.png\n")
        assert out.splitlines()[0] == f"{name}: {kind}"
        assert (tmp_path / name).with_suffix(".png").stat().st_size > 5000
    listed = vibrissa("show", tmp_path)[1]
    assert all(f"{name}  {kind}\n" in listed for kind, name, _ in made(tmp_path))


def test_show_describes_a_movie_and_its_first_frame(vibrissa, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frames = np.random.default_rng(0).integers(0, 255, (7, 40, 60)).astype(np.uint8)
    write_movie(tmp_path / "a.mkv", [frames], playback_rate=30.0)
    facts = json.loads(vibrissa("show", "a.mkv", "--json", "--plot", "--out", "first.png")[1])["facts"]
    assert (facts["width [px]"], facts["height [px]"], facts["codec"]) == (60, 40, "ffv1")
    assert facts["playback rate, not the camera's [Hz]"] == 30
    assert (tmp_path / "first.png").exists()


def test_show_knows_movies_by_other_names_too(vibrissa, tmp_path):
    frames = [Image.fromarray(np.full((40, 60), 30 * k, np.uint8)) for k in range(5)]
    frames[0].save(tmp_path / "a.GIF", save_all=True, append_images=frames[1:], duration=50)
    found = json.loads(vibrissa("show", tmp_path / "a.GIF", "--json")[1])
    assert (found["kind"], found["facts"]["width [px]"], found["facts"]["frames"]) == ("movie", 60, "5")
    code, _, err = vibrissa("import-tracks", tmp_path / "a.GIF", "--out", tmp_path / "a.nc")
    assert code == 2
    assert f"a movie; vibrissa track {tmp_path / 'a.GIF'} tracks it" in err


def test_show_lists_what_an_nwb_session_holds(vibrissa, tmp_path):
    with h5py.File(tmp_path / "a.nwb", "w") as file:
        file["session_description"] = "rat 7"
        file.create_group("acquisition/voltage")
        file["acquisition/compass/yaw/data"] = [0.0, 1.0]
        file["stimulus/templates/motion/data"] = [0.0, 1.0]
        file["units/id"] = [0, 1, 2]
    found = json.loads(vibrissa("show", tmp_path / "a.nwb", "--json")[1])
    assert (found["kind"], found["facts"]["units"]) == ("NWB session", 3)
    assert (found["facts"]["session"], found["facts"]["acquisition"]) == (
        "rat 7",
        "compass (yaw), voltage",
    )
    assert found["facts"]["stimulus/templates"] == "motion"


def test_a_dataset_of_no_known_kind_is_still_described(vibrissa, tmp_path):
    save(dataset(contact=0.3, base_angle=1.2), tmp_path / "x.nc")
    out = vibrissa("show", tmp_path / "x.nc")[1]
    assert out.startswith("x.nc: dataset\n")
    assert "base_angle" in out


def test_remarks_are_whole_and_lost_frames_are_counted(vibrissa, tmp_path):
    remarks = [f"remark {k} of a movie that has much to say about itself" for k in range(6)]
    lost = [[[0, 4, "no line there"], [7, 7, "unsure"]], [], [[2, 3, "unsure"]]]
    there = {"remarks": json.dumps(remarks), "lost": json.dumps(lost)}
    save(dataset(there, contact=0.3), tmp_path / "x.nc")
    out = " ".join(vibrissa("show", tmp_path / "x.nc")[1].split())
    assert "; ".join(remarks) in out
    assert "lost whisker 0 in 6 frames, mostly: no line there; whisker 2 in 2 frames, mostly: unsure" in out
    save(dataset({"remarks": "of another program", "lost": "[1]"}, contact=0.3), tmp_path / "y.nc")
    out = vibrissa("show", tmp_path / "y.nc")[1]
    assert "remarks  of another program" in out
    assert "lost  [1]" in out


def test_kinds_are_not_shadowed_by_those_before_them():
    for kinds in (DATASETS, TABLES):
        for k, (_, needed) in enumerate(kinds):
            assert not any(earlier <= needed for _, earlier in kinds[:k])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("absent.nc",), "absent.nc must be an existing file or folder"),
        ((".",), ". must hold PNG"),
        (("text.md",), "text.md must be a dataset, a table, a surface"),
        (("bare.txt",), "as a surface it must state its units, got none; to scan it: give `x_unit`, "),
        (("robot.toml", "--plot"), "--plot must be left out: nothing of a study can be drawn"),
        (("robot.toml", "--out", "a.png"), "--out must go with --plot"),
        (("robot.toml", "--plot", "--out", "a.txt"), "--out must end in"),
    ],
)
def test_what_cannot_be_shown_is_one_line(vibrissa, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.md").write_text("# A page\n")
    (tmp_path / "bare.txt").write_text("0 100\n10 80\n20 60\n30 30\n")
    (tmp_path / "robot.toml").write_text((EXAMPLES / "mouse-field.toml").read_text("utf-8"))
    code, _, err = vibrissa("show", *words)
    assert code == 2
    assert message in err
    assert err.count("\n") == 1


def test_info_has_the_versions_of_the_package_and_its_parts(vibrissa):
    found = json.loads(vibrissa("info", "--json")[1])
    assert found["vibrissa"].startswith(__version__)
    assert sys.executable in found["python"]
    assert found["packages"].get("numpy", version("numpy")) == version("numpy")
    assert "all" not in found["extras"]
    out = vibrissa("info")[1]
    assert all(word in out for word in (__version__, "caches", "threads cores", "report"))


def test_show_refuses_what_is_no_nwb_file_and_what_is_no_file(vibrissa, tmp_path):
    (tmp_path / "junk.nwb").write_bytes(b"hello" * 1000)
    os.mkfifo(tmp_path / "pipe.nwb")
    for name, rule in (("junk.nwb", "must be a whole NWB file"), ("pipe.nwb", "must be an existing file")):
        code, out, err = vibrissa("show", tmp_path / name)
        assert (code, out) == (2, "")
        assert err.startswith(f"vibrissa: {tmp_path / name} {rule}")
        assert len(err.splitlines()) == 1


def test_a_damaged_file_of_a_folder_is_named(vibrissa, tmp_path):
    save(dataset(time=[0.0, 1.0], point_displacement=[0.0, 1e-6]), tmp_path / "good.nc")
    (tmp_path / "half.nc").write_bytes((tmp_path / "good.nc").read_bytes()[:1000])
    code, out, err = vibrissa("show", tmp_path)
    assert (code, out) == (2, "")
    assert "half.nc must be a NetCDF file written by vibrissa" in err


@pytest.mark.parametrize(
    ("header", "kind"),
    [("time_us,base_angle_deg,contact", "posture in time"), ("time_ms,displacement_pm", "motion of")],
)
def test_lines_of_a_table_are_counted_without_comments_in_any_unit(vibrissa, tmp_path, header, kind):
    rows = "\n".join(["0,1,0.3", "1,2,0.3"] if "contact" in header else ["0,1", "1,2"])
    (tmp_path / "table.csv").write_text(f"# by hand\n{header}\n# a note\n{rows}\n")
    code, out, err = vibrissa("show", tmp_path / "table.csv")
    assert code == 0, err
    assert kind in out
    assert re.search(r"lines\W+2\b", out)


def test_two_columns_of_an_array_are_a_surface_without_units(vibrissa, tmp_path):
    np.save(tmp_path / "bare.npy", np.c_[np.arange(2000) * 1e-3, np.sin(np.arange(2000) / 20)])
    code, _, err = vibrissa("show", tmp_path / "bare.npy")
    assert code == 2
    assert "as a surface it must state its units, got none; to scan it: give `x_unit`, one of m" in err
