"""Profiles out to WHISK and in again; the files of WhiskiWrap and WhiskerTracker; kinds told by content."""

import json

import h5py
import numpy as np
import pytest
from line_movie import FIRST, LAST, movie, truth
from numpy.lib.recfunctions import append_fields
from refusals import refusal
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.io import savemat

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.quantities import dataset
from vibrissa.study.movie.backward import analyse
from vibrissa.video.foreign.tracks import kind_of, read_tracks
from vibrissa.video.foreign.whisk_files import read_measurements, read_whiskers
from vibrissa.video.foreign.whisk_profile import write_whiskers
from vibrissa.video.tracking import Calibration, track
from vibrissa.whisker import Whisker

PIXEL = 1e-4
CALIBRATION = Calibration(frame_rate=2000.0, pixel_size=PIXEL)
WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
CONTACT = 0.29


def vibrating(frames: int = 400, noise: float = 0.0, seed: int = 1):
    """Profile of a bent cone that vibrates in two modes without being stretched, and their amplitudes over L."""
    arc = np.arange(0, (1 - CONTACT) * 0.04, 5 * PIXEL)
    fine = np.linspace(0, (1 - CONTACT) * 0.04, 3000)
    t = np.arange(frames) / 2000
    q = np.array([1e-3 * np.sin(2 * np.pi * 80 * t), 3e-4 * np.sin(2 * np.pi * 210 * t + 1)])
    u = 0.04 * q.T @ cone_modes(cone_kappa(CONTACT, 2), CONTACT, 1 - fine / 0.04)
    angle = 0.3 + 0.8 * (fine / 0.04) ** 2 + np.gradient(u, fine, axis=1)
    scatter = noise * PIXEL * np.random.default_rng(seed).standard_normal((2, frames, arc.size))
    rows = [
        5e-3 + CubicSpline(fine, cumulative_trapezoid(f(angle), fine, axis=1, initial=0), axis=1)(arc) + one
        for f, one in zip((np.cos, np.sin), scatter, strict=True)
    ]
    profile = dataset(
        {"frame": "image", "frame_rate": 2000.0, "pixel_size": PIXEL},
        lead=("whisker",),
        whisker=[0],
        time=t,
        node=np.arange(arc.size),
        x=rows[0][None],
        y=rows[1][None],
        arc_length=arc[None],
    )
    return profile, q


def off(one, other) -> np.ndarray:
    """Distance of the nodes of two profiles [px]."""
    nodes = min(one.sizes["node"], other.sizes["node"])
    dx, dy = (one[name].values[..., :nodes] - other[name].values[..., :nodes] for name in "xy")
    return np.hypot(dx, dy) / PIXEL


# Out, and in again


def test_a_profile_comes_back_where_it_was(tmp_path):
    profile, _ = vibrating()
    write_whiskers(profile, tmp_path / "a.whiskers")
    back = read_tracks(tmp_path / "a.whiskers", CALIBRATION)
    assert back.attrs["source"] == "a.whiskers"
    assert (back.attrs["format"], back.attrs["frame"]) == ("WHISK", "image")
    assert back.sizes["time"] == profile.sizes["time"]
    assert back.sizes["node"] >= profile.sizes["node"] - 1  # chords are shorter than the arc
    assert "y_sd" not in back
    nodes = slice(0, back.sizes["node"])
    np.testing.assert_allclose(back.arc_length, profile.arc_length[:, nodes], atol=1e-12)
    # a chord of 5 px falls short of an arc of radius R by 5³/(24 R²); here R is above 250 px
    assert np.nanmax(off(profile, back)) < 0.05


@pytest.mark.parametrize(("noise", "worst"), [(0.0, 2e-3), (0.06, 0.03)])
def test_modal_amplitudes_survive_the_way_through_whisks_format(tmp_path, noise, worst):
    profile, q = vibrating(noise=noise)
    write_whiskers(profile, tmp_path / "a.whiskers")
    back = read_tracks(tmp_path / "a.whiskers", CALIBRATION)
    before, after = (
        analyse(one.isel(whisker=0), WHISKER, CONTACT, n_modes=2)["modal"].mode_displacement.values
        for one in (profile, back)
    )
    for mode in range(2):
        rms = np.std(q[mode])
        assert np.sqrt(np.mean((after[mode] - before[mode]) ** 2)) < worst * rms
        assert abs(np.corrcoef(after[mode], q[mode])[0, 1]) > 0.99


def test_a_tracked_movie_comes_back(tmp_path):
    row = truth(12)
    blocks = [movie(row, np.random.default_rng(3))]
    skin = [(float(FIRST - 10), float(row[0, FIRST] - 10 * 15 / (LAST - FIRST)))]
    tracked = track(blocks, seeds=[(200, float(row[0, 200]))], skin=skin, calibration=CALIBRATION)
    write_whiskers(tracked, tmp_path / "a.whiskers")
    back = read_tracks(tmp_path / "a.whiskers", CALIBRATION)
    nodes = min(tracked.sizes["node"], back.sizes["node"])
    measured = np.isfinite(tracked.y_sd.values[..., :nodes])
    found = np.isfinite(back.x.values[..., :nodes])
    assert not np.any(found & ~measured)  # what stood straight between skin and base end is not written
    assert found.sum() > 0.97 * measured.sum()
    assert np.nanmedian(off(tracked, back)) < 0.05
    # arc length is measured anew in every frame, so nodes slip a little along the line, and stay on it
    for frame in range(12):
        (x, y), (u, v) = ((one.x.values[0, frame] / PIXEL, one.y.values[0, frame] / PIXEL) for one in (tracked, back))
        at, on = np.isfinite(tracked.y_sd.values[0, frame]), np.isfinite(u)
        np.testing.assert_allclose(v[on], np.interp(u[on], x[at], y[at]), atol=1e-3)


def test_what_is_written_is_told_by_the_file(tmp_path):
    profile, _ = vibrating(frames=4)
    profile.x[0, 1, 5:8] = np.nan
    profile.x[0, 2, 1:] = np.nan
    profile.x[0, 3, 0] = np.nan
    measures = write_whiskers(profile, tmp_path / "a.whiskers")
    segments, table = read_whiskers(tmp_path / "a.whiskers"), read_measurements(measures)
    nodes = profile.sizes["node"]
    assert [(one.frame, one.wid, one.x.size) for one in segments] == [
        (0, 0, nodes),
        (1, 0, nodes - 3),
        (3, 0, nodes - 1),
    ]
    assert all(np.isnan([one.thick, one.score]).all() for one in segments)
    assert table["identity"].tolist() == [0, 0, 0]
    np.testing.assert_allclose(segments[0].x, profile.x[0, 0] / PIXEL, rtol=1e-7)
    # the follicle of the frame without node 0 lies where the line runs straight on
    np.testing.assert_allclose(table["data"][2, 4:6], [50.0, 50.0], atol=0.3)
    back = read_tracks(tmp_path / "a.whiskers", CALIBRATION)
    assert np.isnan(back.x.values[0, 1, 5:8]).all()
    assert np.isnan(back.x.values[0, 2]).all()
    assert json.loads(back.attrs["lost"]) == [[[2, 2, "not in the file"]]]


def test_both_files_or_none(tmp_path):
    profile, _ = vibrating(frames=2)
    (tmp_path / "a.measurements").mkdir()
    with refusal("machine", "a.measurements"):
        write_whiskers(profile, tmp_path / "a.whiskers")
    assert [path.name for path in tmp_path.iterdir()] == ["a.measurements"]


def test_profiles_that_are_no_image_are_not_written(tmp_path):
    profile, _ = vibrating(frames=2)
    with refusal("format", "a.txt"):
        write_whiskers(profile, tmp_path / "a.txt")
    with refusal("too-few", "profile"):
        write_whiskers(profile.assign(x=profile.x.where(False)), tmp_path / "a.whiskers")
    profile.attrs["frame"] = "substrate"
    with refusal("missing", "profile"):
        write_whiskers(profile, tmp_path / "a.whiskers")
    assert not list(tmp_path.iterdir())


# WhiskiWrap

SUMMARY = [("fid", "<u4"), ("wid", "<u2"), ("label", "<u2"), ("follicle_x", "<f4"), ("follicle_y", "<f4")]


def whiskiwrap(path, *, label: bool = True, frames: int = 5) -> None:
    """Two whiskers, the second traced from its tip; laid out as PyTables lays out tables and lists."""
    summary = np.zeros(2 * frames, SUMMARY if label else [column for column in SUMMARY if column[0] != "label"])
    with h5py.File(path, "w") as file:
        lists = {n: file.create_dataset(n, (2 * frames,), h5py.vlen_dtype("<f4")) for n in ("pixels_x", "pixels_y")}
        for i in range(2 * frames):
            frame, wid = divmod(i, 2)
            x = np.arange(100.0, 200.0)
            y = 50 + 40 * wid + 0.1 * (x - 100) + frame
            way = slice(None, None, -1 if wid else 1)
            lists["pixels_x"][i], lists["pixels_y"][i] = x[way].astype("f4"), y[way].astype("f4")
            summary["fid"][i], summary["wid"][i], summary["follicle_x"][i], summary["follicle_y"][i] = (
                frame,
                wid,
                x[0],
                y[0],
            )
            if label:
                summary["label"][i] = 1 - wid
        file["summary"] = summary


def test_whiskers_of_whiskiwrap(tmp_path):
    whiskiwrap(tmp_path / "a.hdf5")
    assert kind_of(tmp_path / "a.hdf5") == "WhiskiWrap"
    profile = read_tracks(tmp_path / "a.hdf5", CALIBRATION)
    assert (profile.sizes["whisker"], profile.sizes["time"]) == (2, 5)
    x, y = profile.x.values / PIXEL, profile.y.values / PIXEL
    # nodes lie on the straight line, and the same piece of it has the same arc length from the median follicle
    for whisker, height in ((0, 90), (1, 50)):
        for frame in range(5):
            seen = np.isfinite(x[whisker, frame])
            np.testing.assert_allclose(
                y[whisker, frame, seen], height + 0.1 * (x[whisker, frame, seen] - 100) + frame, atol=1e-4
            )
    steps = np.hypot(np.diff(x, axis=2), np.diff(y, axis=2))
    np.testing.assert_allclose(steps[np.isfinite(steps)], 5, atol=1e-3)


def test_the_first_versions_of_whiskiwrap_had_other_names_for_the_same(tmp_path):
    whiskiwrap(tmp_path / "now.hdf5", label=False)
    with h5py.File(tmp_path / "now.hdf5") as now, h5py.File(tmp_path / "then.hdf5", "w") as then:
        for name in ("pixels_x", "pixels_y"):
            now.copy(name, then)
        summary = now["summary"][:]
        summary.dtype.names = ("time", "id", "fol_x", "fol_y")
        then["summary"] = summary
    now, then = (
        read_tracks(tmp_path / name, CALIBRATION, identity="number", whiskers=[0, 1])
        for name in ("now.hdf5", "then.hdf5")
    )
    np.testing.assert_array_equal(now.x, then.x)
    np.testing.assert_array_equal(now.arc_length, then.arc_length)
    with h5py.File(tmp_path / "then.hdf5", "r+") as both:  # a column that was added under its present name
        both["summary"] = append_fields(both.pop("summary")[:], "fid", summary["time"], usemask=False)
    both = read_tracks(tmp_path / "then.hdf5", CALIBRATION, identity="number", whiskers=[0, 1])
    np.testing.assert_array_equal(now.x, both.x)


def test_a_movie_is_no_file_of_tracks(tmp_path):
    np.save(tmp_path / "movie.npy", np.zeros((3, 8, 8), np.uint8))
    with refusal("format", "movie.npy", "a movie"):
        kind_of(tmp_path / "movie.npy")


def test_whiskiwrap_without_labels_needs_a_rule(tmp_path):
    whiskiwrap(tmp_path / "a.hdf5", label=False)
    with refusal("missing", "a.hdf5"):
        read_tracks(tmp_path / "a.hdf5", CALIBRATION)
    profile = read_tracks(tmp_path / "a.hdf5", CALIBRATION, identity="number", whiskers=[1])
    assert profile.sizes["whisker"] == 1
    assert profile.y.values[0, 2, 0] == pytest.approx(92 * PIXEL, abs=1e-8)


# Knutsen's WhiskerTracker


def knutsen(path, splines, **more) -> None:
    savemat(path, {"g_tMovieInfo": {"SplinePoints": splines, **more}})


@pytest.mark.parametrize("whiskers", [1, 3])
def test_splines_of_whiskertracker(tmp_path, whiskers):
    rng = np.random.default_rng(2)
    splines = 1 + 300 * rng.random((3, 2, 7, whiskers))
    splines[:, :, 4, 0] = 0
    knutsen(tmp_path / "a.mat", splines[..., 0] if whiskers == 1 else splines, FramesPerSecond=500.0, PixelsPerMM=20.0)
    profile = read_tracks(tmp_path / "a.mat")
    assert dict(profile.sizes) == {"whisker": whiskers, "time": 7, "node": 3}
    assert profile.attrs["frame_rate"] == 500
    assert profile.attrs["pixel_size"] == pytest.approx(50e-6)
    expected = (splines - 1) * 50e-6
    expected[:, :, 4, 0] = np.nan
    np.testing.assert_allclose(profile.x.values, expected[:, 0].transpose(2, 1, 0))
    np.testing.assert_allclose(profile.y.values, expected[:, 1].transpose(2, 1, 0))
    assert json.loads(profile.attrs["lost"])[0] == [[4, 4, "not in the file"]]


def test_whiskertracker_without_its_scale_needs_a_calibration(tmp_path):
    splines = np.random.default_rng(3).random((3, 2, 4)) * 100
    knutsen(tmp_path / "a.mat", splines, FramesPerSecond=500.0)
    with refusal("missing", "frame_rate, pixel_size"):
        read_tracks(tmp_path / "a.mat")
    assert read_tracks(tmp_path / "a.mat", CALIBRATION).attrs["pixel_size"] == PIXEL


# Options


def test_options_that_a_kind_of_file_has_no_use_for_are_refused(tmp_path):
    whiskiwrap(tmp_path / "a.hdf5")
    knutsen(tmp_path / "a.mat", np.ones((3, 2, 4)))
    with refusal("conflict", "keypoints"):
        read_tracks(tmp_path / "a.hdf5", CALIBRATION, keypoints=[["a", "b"]])
    with refusal("conflict", "base"):
        read_tracks(tmp_path / "a.mat", CALIBRATION, base="left")
    with refusal("conflict", "measurements"):
        read_tracks(tmp_path / "a.hdf5", CALIBRATION, measurements=tmp_path / "m")
    with refusal("missing", "frame_rate, pixel_size"):
        read_tracks(tmp_path / "a.hdf5")
    with refusal("unknown", "base"):
        read_tracks(tmp_path / "a.hdf5", CALIBRATION, base="up")
    with refusal("unknown", "whiskers", value="[7]"):
        read_tracks(tmp_path / "a.hdf5", CALIBRATION, whiskers=[7])
    with refusal("shape", "skin"):
        read_tracks(tmp_path / "a.hdf5", CALIBRATION, skin=[(1.0, 2.0)])
