"""The verb kinematics: files read back, one line for bad input, the same numbers as in Python."""

import csv
import json

import numpy as np
import pytest
import xarray as xr
from simulated_whiskers import PIXEL, RATE, circle_profile

import vibrissa as vb
from vibrissa.figures.others import kinematics as figure
from vibrissa.netcdf import load, save
from vibrissa.video.tracking import numbered_from

TIME = np.arange(1000) / RATE
ANGLE = np.radians(100 + 20 * np.cos(2 * np.pi * 8 * TIME))
FACE = ("--face", "0,0", "--face", "0,100")  # the nose points down
POLE = ("--pole", "60,18", "--pole-radius", "0.3mm")


@pytest.fixture
def tracks(tmp_path):
    """One whisker to the right of the face, seen but for frames 500 to 502."""
    profile = circle_profile(ANGLE - np.pi / 2, 30.0, sd=1e-5)
    for name in ("x", "y", "y_sd"):
        profile[name].values[0, 500:503] = np.nan
    path = tmp_path / "profile.nc"
    save(profile, path)
    return path


def columns(path):
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return rows, {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name != "label"}


def test_a_table_of_frames_and_one_of_touches(vibrissa, tracks, tmp_path):
    out = tmp_path / "k.csv"
    code, printed, err = vibrissa("kinematics", tracks, *FACE, *POLE, "--bridged", "5", "--out", out, "--json")
    assert code == 0, err
    rows, table = columns(out)
    assert len(rows) == TIME.size
    seen = np.isfinite(table["whisker_angle_deg"])
    assert np.flatnonzero(~seen).tolist() == [500, 501, 502]
    np.testing.assert_allclose(table["whisker_angle_deg"][seen], np.degrees(ANGLE)[seen], atol=1e-5)
    np.testing.assert_allclose(table["whisker_curvature_per_mm"][seen], 0.03, atol=1e-6)
    assert np.nanmedian(table["whisking_frequency_Hz"]) == pytest.approx(8, abs=0.05)
    assert np.nanmedian(table["set_point_deg"]) == pytest.approx(100, abs=0.1)
    assert np.nanmedian(table["whisking_amplitude_deg"]) == pytest.approx(20, abs=0.1)
    events, touches = columns(tmp_path / "k-touches.csv")
    summary = json.loads(printed)
    assert summary["touches"] == [len(events)]
    assert summary["frames_measured"] == [997]
    assert {(row["whisker"], row["label"]) for row in events} == {("0", "1")}
    assert vibrissa("show", out)[1].startswith("k.csv: table: kinematics of whiskers\n")
    assert vibrissa("show", tmp_path / "k-touches.csv")[1].startswith("k-touches.csv: table: touches of whiskers\n")
    assert (touches["touch_offset_s"] >= touches["touch_onset_s"]).all()


def test_names_of_marks_are_kept_and_numbers_are_those_of_the_tracks(vibrissa, tracks, tmp_path):
    profile = load(tracks)
    save(profile.assign_attrs(names=json.dumps(["C2"])), tmp_path / "named.nc")
    code, _, err = vibrissa("kinematics", tmp_path / "named.nc", *FACE, *POLE, "--out", tmp_path / "named.csv")
    assert code == 0, err
    with (tmp_path / "named.csv").open() as file:
        row = next(csv.DictReader(file))
    assert (row["whisker"], row["label"]) == ("0", "C2")
    events, _ = columns(tmp_path / "named-touches.csv")
    assert {row["label"] for row in events} == {"C2"}


def test_given_names_go_with_their_whiskers_and_automatic_ones_differ_from_them():
    one = circle_profile(ANGLE - np.pi / 2, 30.0, sd=1e-5)
    moved = [one.assign(y=one.y + 1e-3 * k).assign_coords(whisker=[k]) for k in range(4)]
    profile = xr.concat(moved, "whisker", data_vars="all")
    profile["arc_length"] = one.arc_length.isel(whisker=0, drop=True).expand_dims(whisker=4)
    profile.attrs["names"] = json.dumps(["whisker 0", "C2", "whisker 2", "1"])

    def labels(part):
        found = vb.kinematics(part, face=((0, 0), (0, 1)))
        return dict(zip(found.whisker.values.tolist(), found.whisker_label.values.tolist(), strict=True))

    assert labels(profile) == {0: "2", 1: "C2", 2: "3", 3: "1"}
    assert labels(profile.isel(whisker=[3, 1, 0])) == {0: "2", 1: "C2", 3: "1"}
    assert labels(profile.isel(whisker=3)) == {3: "1"}
    assert labels(profile.isel(whisker=[1, 2], drop=True).drop_vars("whisker")) == {0: "1", 1: "2"}
    profile.attrs["names"] = json.dumps(["whisker 0", "C2", "C2", "7"])  # no name of one whisker
    assert labels(profile) == {0: "1", 1: "2", 2: "3", 3: "7"}


def test_less_sure_names_are_left_out_where_asked(vibrissa, tracks, tmp_path):
    profile, out = load(tracks), tmp_path / "sure.nc"
    words = ("kinematics", tmp_path / "linked.nc", *FACE, "--out", out, "--least-probability")
    save(profile, tmp_path / "linked.nc")
    code, _, err = vibrissa(*words, "0.9")
    assert code == 2
    assert "--least-probability must be left out of a profile without `whisker_probability`" in err
    sure = np.where(np.arange(TIME.size) < 300, 0.8, 0.95)[None]
    save(profile.assign(whisker_probability=(("whisker", "time"), sure)), tmp_path / "linked.nc")
    code, _, err = vibrissa(*words, "0.9")
    assert code == 0, err
    seen = np.isfinite(load(out).whisker_angle.values[0])
    assert np.flatnonzero(~seen).tolist() == [*range(300), 500, 501, 502]
    assert load(out).attrs["least_probability"] == 0.9
    code, _, err = vibrissa(*words, "0.99")
    assert code == 2
    assert "--least-probability must leave some names, got 0.99; the largest is 0.950" in err
    code, _, err = vibrissa(*words, "1.5")
    assert code == 2
    assert "--least-probability must be from 0, from which on the tracking has kept names, to 1, got 1.5" in err


def test_face_base_part_and_labels_are_those_of_all_names():
    one = circle_profile(ANGLE - np.pi / 2, 30.0, sd=1e-5)
    bases = 1e-3 * np.array([(0, 0), (0.1, 1), (0, 2), (1, 4)])  # those of the first three are on another line
    moved = [one.assign(x=one.x + x, y=one.y + y).assign_coords(whisker=[k]) for k, (x, y) in enumerate(bases)]
    profile = xr.concat(moved, "whisker", data_vars="all")
    profile["arc_length"] = one.arc_length.isel(whisker=0, drop=True).expand_dims(whisker=4)
    profile.x.values[:3, :, 30:] = np.nan  # the last one, whose name is never sure, is the longest
    sure = np.full((4, TIME.size), 0.95)
    sure[2, :900] = sure[3] = 0.75
    profile = profile.assign(whisker_probability=(("whisker", "time"), sure))
    every, some = (vb.kinematics(profile, nose="bottom", least_probability=least) for least in (None, 0.9))
    assert some.attrs["base_part"] == every.attrs["base_part"]
    assert some.attrs["face_rostral"] == every.attrs["face_rostral"]
    assert some.whisker_label.values.tolist() == every.whisker_label.values.tolist()
    kept = np.isfinite(some.whisker_angle.values)
    assert kept.sum() == 2 * TIME.size + 100
    np.testing.assert_array_equal(some.whisker_angle.values[kept], every.whisker_angle.values[kept])


def test_the_dataset_is_that_of_python(vibrissa, tracks, tmp_path):
    out = tmp_path / "k.nc"
    code, _, err = vibrissa("kinematics", tracks, *FACE, *POLE, "--base-part", "0mm", "3mm", "--out", out)
    assert code == 0, err
    pole = {"pole": (60 * PIXEL, 18 * PIXEL), "pole_radius": 3e-4}
    here = vb.kinematics(load(tracks), face=((0, 0), (0, 100 * PIXEL)), base_part=(0, 3e-3), **pole)
    there = load(out)
    assert set(there.variables) == set(here.variables)
    for name in here.variables:
        np.testing.assert_array_equal(there[name], here[name])
    wall = vb.kinematics(load(tracks), nose="bottom", wall=((6e-3, 0), (6e-3, 1)))
    assert wall.touching.values[0, 0] == 1
    assert "whisker_angle_sd" in wall


def test_no_touches_are_sought_unasked(vibrissa, tracks, tmp_path):
    out = tmp_path / "k.csv"
    code, _, err = vibrissa("kinematics", tracks, "--nose", "bottom", "--out", out)
    assert code == 0, err
    assert "no touches are sought" in err
    assert "the image's axis to the bottom" in err
    assert "touching" not in columns(out)[1]
    assert not (tmp_path / "k-touches.csv").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "--nose must be given where the face is not"),
        (("--nose", "top", "--out", "k.txt"), "--out must end in .nc, a NetCDF dataset, or .csv, a table"),
        (("--face", "0,0"), "--face must be given twice"),
        ((*FACE, "--nose", "top"), "--nose must be left out where the face is given"),
        (("--face", "0,0", "--face", "0,0"), "--face must be two points"),
        (("--nose", "top", "--base-part", "0mm", "0.1mm"), "--base-part must hold 3 nodes"),
        (("--nose", "top", "--whisking-band", "4Hz", "300Hz"), "--whisking-band must be two frequencies"),
        (("--nose", "top", *POLE, "--wall", "0,1", "--wall", "1,1"), "--wall must be left out"),
        (("--nose", "top", "--pole", "nan,18"), "--pole must be two finite numbers"),
        (("--nose", "top", "--pole-radius", "1mm"), "--pole-radius must go with --pole"),
        (("--nose", "top", *POLE, "--find-touches"), "--find-touches must be left out where the object is given"),
        (("--nose", "top", "--base-part", "90mm", "95mm"), "within the nodes, got 90 to 95 mm; the nodes reach to "),
        (("--nose", "top", "--bridged", "-1"), "--bridged must"),
        (("--nose", "top", "--whisking-band", "30Hz", "4Hz"), ", got 30 to 4 Hz; choose a band"),
        (("--nose", "top", "--find-touches", "--least-frames", "0"), "--least-frames must be positive"),
    ],
)
def test_bad_input_is_one_line(vibrissa, tracks, options, message):
    code, out, err = vibrissa("kinematics", tracks, *options)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_the_picture_has_a_column_for_each_whisker_and_its_touches_shaded(vibrissa, tracks, tmp_path):
    code, _, err = vibrissa("kinematics", tracks, *FACE, *POLE, "--picture", tmp_path / "k.png")
    assert code == 0, err
    assert (tmp_path / "k.png").read_bytes().startswith(b"\x89PNG")
    data = vb.kinematics(load(tracks), nose="bottom", pole=(60 * PIXEL, 18 * PIXEL), pole_radius=3e-4)
    shown = figure.compute(data)
    assert "1 of 1 whiskers" in shown.attrs["caption"]
    drawn = figure.draw(shown)
    top = drawn.axes[0]
    shades = [one for one in top.patches if one.get_alpha() == 0.3]
    assert len(shades) == data.sizes["touch"] > 0
    assert shades[0].get_x() == pytest.approx(data.touch_onset[0].item())


def test_tracks_of_other_programs_are_to_be_imported_first(vibrissa, tmp_path):
    path = tmp_path / "test.whiskers"
    path.write_bytes(b"bwhiskbin1")
    code, _, err = vibrissa("kinematics", path, "--nose", "top")
    assert code == 2
    assert f"vibrissa import-tracks {path}" in err


def test_frames_of_the_table_are_those_of_the_movie(vibrissa, tracks, tmp_path):
    save(numbered_from(load(tracks), 300).isel(time=slice(35, 900)), tracks)
    out = tmp_path / "k.csv"
    assert vibrissa("kinematics", tracks, *FACE, "--out", out)[0] == 0
    assert columns(out)[1]["frame"].tolist() == list(range(335, 1200))


def test_an_object_in_a_wrong_place_is_said(vibrissa, tracks):
    _, _, far = vibrissa("kinematics", tracks, *FACE, "--pole", "3100,18")
    assert "no whisker touches the object: the nearest line passes " in far
    _, _, inside = vibrissa("kinematics", tracks, *FACE, "--pole", "60,18", "--pole-radius", "5mm")
    assert "touching frames a line runs more than 0.2 mm inside the object" in inside
    assert "inside" not in vibrissa("kinematics", tracks, *FACE, *POLE[:2])[2]


def test_the_picture_shows_whiskers_that_touch_though_others_are_seen_in_more_frames():
    """Of six, the last alone meets the pole, and it is not seen in some frames."""
    one = circle_profile(ANGLE - np.pi / 2, 30.0, sd=1e-5)
    moved = [one.assign(y=one.y + 30e-3 * k).assign_coords(whisker=[k]) for k in range(6)]
    profile = xr.concat(moved, "whisker", data_vars="all")
    profile["arc_length"] = one.arc_length.isel(whisker=0, drop=True).expand_dims(whisker=6)
    profile.x.values[5, :40] = np.nan
    middle = float(profile.x[5, 50, 40]), float(profile.y[5, 50, 40])
    found = vb.kinematics(profile, nose="bottom", pole=middle, touch_distance=1e-3)
    assert (found.touching.sum("time") > 0).values.tolist() == [False] * 5 + [True]
    shown = figure.compute(found)
    assert shown.whisker.values.tolist() == [0, 1, 2, 5]
    said = "4 of 6 whiskers, first those that touch, then those seen in most frames"
    assert figure.draw(shown).get_supxlabel() == said
    assert figure.draw(figure.compute(found.isel(whisker=slice(2, 6)))).get_supxlabel() == ""
