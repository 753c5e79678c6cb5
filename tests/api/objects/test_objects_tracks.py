"""Tracks as datasets of movement: positions, times, names and uncertainties survive both ways."""

import importlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.api.movies import read_tracks
from vibrissa.api.objects.dataframes import to_dataframe
from vibrissa.api.objects.tracks import _plural, as_tracks, to_movement
from vibrissa.quantities import dataset
from vibrissa.video.foreign.keypoints import Keypoints, profile_from_keypoints
from vibrissa.video.foreign.tracks import read_tracks as read_file
from vibrissa.video.foreign.whisk_profile import write_whiskers
from vibrissa.video.tracking import Calibration

PIXEL, RATE = 95e-6, 500.0
CALIBRATION = Calibration(frame_rate=RATE, pixel_size=PIXEL)


def profile_of(whiskers=2, frames=6, nodes=4, seed=0, start=0):
    """Whiskers that sway, with a frame lost and a node that was not measured."""
    rng = np.random.default_rng(seed)
    arc = np.tile(5 * PIXEL * np.arange(nodes), (whiskers, 1))
    y = 0.01 + 1e-3 * rng.random((whiskers, frames, nodes))
    sd = np.full(y.shape, 1e-6)
    y[0, 1], sd[0, 1], sd[:, :, 0] = np.nan, np.nan, np.nan
    attrs = {"frame": "image", "frame_rate": RATE, "pixel_size": PIXEL, "lost": '[[[1, 1, "dark"]], []]'}
    return dataset(
        attrs,
        lead=("whisker",),
        whisker=np.arange(whiskers) + 3,
        time=(start + np.arange(frames)) / RATE,
        node=np.arange(nodes),
        x=np.broadcast_to(arc[:, None], y.shape) + 0.002 + 0 * y,
        y=y,
        y_sd=sd,
        arc_length=arc,
    )


@pytest.fixture
def load_poses():
    """Readers and makers of movement, without what it says on the way."""
    pytest.importorskip("movement")
    return importlib.import_module("movement.io.load_poses")


def poses_of(load_poses, fps=RATE, software=None):
    """Poses of two mice with three keypoints each, 5 frames, made by movement itself."""
    rng = np.random.default_rng(3)
    position = 100 * rng.random((5, 2, 3, 2))
    confidence = np.where(rng.random((5, 3, 2)) < 0.2, 0.1, 0.9)
    given_names = {"individual_names": ["left", "right"], "keypoint_names": ["base", "middle", "tip"]}
    return load_poses.from_numpy(position, confidence, fps=fps, source_software=software, **given_names), position


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 3), st.integers(4, 9), st.integers(2, 5), st.integers(0, 9), st.sampled_from(["px", "m"]))
def test_a_profile_goes_to_movement_and_back(whiskers, frames, nodes, start, unit):
    profile = profile_of(whiskers, frames, nodes, start=start)
    again = as_tracks(to_movement(profile, unit=unit))
    assert set(again.variables) == set(profile.variables)
    assert again.attrs == profile.attrs
    for name in profile.variables:
        np.testing.assert_allclose(again[name], profile[name], rtol=1e-14)
        assert again[name].dims == profile[name].dims


def test_base_and_tip_are_the_ends_of_what_was_seen():
    profile = profile_of(2, 6, 5)
    profile.x.values[1, 2, :2] = profile.y.values[1, 2, :2] = np.nan
    profile.x.values[0, 3, 4] = profile.y.values[0, 3, 4] = np.nan
    data = _plural(to_movement(profile, ends=True, unit="m"))
    assert data.keypoints.values.tolist() == ["base", *(f"node_{k}" for k in range(5)), "tip"]
    place = data.position.transpose("individuals", "time", "keypoints", "space").values
    np.testing.assert_array_equal(place[1, 2, 0, 0], profile.x.values[1, 2, 2])
    np.testing.assert_array_equal(place[0, 2, 0, 1], profile.y.values[0, 2, 0])
    np.testing.assert_array_equal(place[0, 3, -1, 1], profile.y.values[0, 3, 3])
    np.testing.assert_array_equal(place[0, 2, -1, 0], profile.x.values[0, 2, 4])
    again = as_tracks(data)
    for name in profile.variables:
        np.testing.assert_allclose(again[name], profile[name], rtol=1e-14)
    assert again.attrs == profile.attrs


@pytest.mark.filterwarnings("ignore")  # of movement's own imports
def test_movement_takes_the_dataset_for_its_own(load_poses, tmp_path):
    profile = profile_of()
    data = to_movement(profile)
    native = poses_of(load_poses)[0]
    assert data.position.dims == native.position.dims
    assert data.confidence.dims == native.confidence.dims
    assert {"fps", "time_unit", "source_software", "ds_type"} <= set(data.attrs)
    validators = importlib.import_module("movement.validators.datasets")
    if hasattr(validators, "ValidPosesInputs"):
        validators.ValidPosesInputs.validate(data)
    velocity = importlib.import_module("movement.kinematics").compute_velocity(data.position)
    expected = np.gradient(profile.y.values / PIXEL, 1 / RATE, axis=1)
    np.testing.assert_allclose(np.moveaxis(velocity.sel(space="y").values, -1, 0), expected, rtol=1e-6)
    save = importlib.import_module("movement.io.save_poses")
    save.to_dlc_file(data, tmp_path / "a.csv", split_individuals=False)
    read = as_tracks(tmp_path / "a.csv", frame_rate=RATE, pixel_size=PIXEL, least_likelihood=0.0)
    np.testing.assert_allclose(read.y, profile.y, rtol=1e-9)


@pytest.mark.filterwarnings("ignore")
def test_positions_scaled_by_movement_keep_their_unit(load_poses):
    transforms = pytest.importorskip("movement.transforms")
    profile = profile_of()
    data = to_movement(profile)
    scaled = data.assign(
        position=transforms.scale(data.position, factor=PIXEL * 1e3, space_unit="mm"), y_sd=data.y_sd * PIXEL * 1e3
    )
    np.testing.assert_allclose(as_tracks(scaled).y, profile.y, rtol=1e-12)
    native, position = poses_of(load_poses)
    native["position"] = transforms.scale(native.position, factor=0.1, space_unit="mm")
    found = as_tracks(native, pixel_size=PIXEL, least_likelihood=0.0)
    np.testing.assert_allclose(found.x[1, :, 2], 1e-4 * position[:, 0, 2, 1], rtol=1e-12)


@pytest.mark.filterwarnings("ignore")
def test_poses_of_movement_are_keypoints_of_whiskers(load_poses):
    data, position = poses_of(load_poses, software="DeepLabCut")
    found = as_tracks(data, pixel_size=PIXEL)
    points = Keypoints(
        ["base", "middle", "tip"],
        *position.transpose(1, 3, 0, 2),
        np.moveaxis(data.confidence.values, -1, 0),  # of (time, keypoints, individuals), whatever their names
    )
    expected = profile_from_keypoints(points, calibration=CALIBRATION, least_likelihood=0.6)
    for name in ("x", "y", "arc_length", "time"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-12)
    assert found.attrs["individuals"] == '["left", "right"]'
    assert found.attrs["keypoints_left_out"] == int((data.confidence < 0.6).sum()) > 0
    later = as_tracks(
        data.isel(time=slice(1, None)), pixel_size=PIXEL, least_likelihood=0.0, keypoints=[["base", "tip"]]
    )
    np.testing.assert_allclose(later.time, np.arange(1, 5) / RATE)
    assert later.sizes["node"] == 2


@pytest.mark.filterwarnings("ignore")
def test_poses_in_frames_need_the_cameras_rate(load_poses):
    data, _ = poses_of(load_poses, fps=None)
    with refusal("missing", "frame_rate"):
        as_tracks(data, pixel_size=PIXEL)
    found = as_tracks(data.isel(time=slice(2, None)), frame_rate=250.0, pixel_size=PIXEL)
    np.testing.assert_allclose(found.time, np.arange(2, 5) / 250)
    with refusal("shape", "movement dataset"):
        as_tracks(data.isel(time=[0, 2, 3]), frame_rate=250.0, pixel_size=PIXEL)


@pytest.mark.filterwarnings("ignore")
def test_contradictions_and_other_datasets_of_movement_are_refused(load_poses):
    data, _ = poses_of(load_poses)
    with refusal("missing", "pixel_size"):
        as_tracks(data)
    with refusal("conflict", "frame_rate", "30.0"):
        as_tracks(data, frame_rate=30.0, pixel_size=PIXEL)
    with refusal("conflict", "pixel_size"):
        as_tracks(to_movement(profile_of()), pixel_size=1e-4)
    with refusal("range", "movement dataset: time"):
        as_tracks(data.isel(time=[0, 1, 3, 4]), pixel_size=PIXEL)
    with refusal("shape", "movement dataset"):
        as_tracks(data.isel({data.confidence.dims[1]: 0}), pixel_size=PIXEL)
    data.position.attrs["space_unit"] = "furlong"
    with refusal("unknown", "movement dataset: space_unit", "'furlong'"):
        as_tracks(data, pixel_size=PIXEL)


def test_profiles_pass_and_what_is_none_is_refused():
    profile = profile_of()
    assert as_tracks(profile) is profile
    with refusal("conflict", "frame_rate"):
        as_tracks(profile, frame_rate=RATE)
    with refusal("unknown", "tracks", "list"):
        as_tracks([1, 2])
    with refusal("missing", "variable 'node'"):
        as_tracks(dataset(time=[0.0, 1.0]))
    with refusal("missing", "profile", "frame 'substrate'"):
        to_movement(profile.assign_attrs(frame="substrate"))
    assert as_tracks(to_movement(profile.assign_attrs(frame="substrate"), unit="m")).attrs["frame"] == "substrate"
    with refusal("unknown", "unit"):
        to_movement(profile, unit="mm")


def test_a_profile_as_a_flat_table():
    frame = to_dataframe(profile_of(1, 4, 2))
    assert list(frame.columns) == ["whisker", "time_s", "node", "x_m", "y_m", "y_sd_m", "arc_length_m"]
    assert len(frame) == 8
    assert frame.arc_length_m.tolist() == [0.0, 5 * PIXEL] * 4


def test_files_of_lines_are_read_as_their_reader_does(tmp_path):
    path = tmp_path / "a.whiskers"
    whole = profile_of(whiskers=1, frames=8, nodes=12).drop_vars("y_sd")
    write_whiskers(whole.assign(x=whole.x.fillna(0.01) + 0 * whole.x, y=0.01 + 0 * whole.y), path)
    how = {"identity": "number", "base": "right", "whiskers": [0], "skin": [(400.0, 100.0)]}
    found = read_tracks(str(path), frame_rate=RATE, pixel_size=PIXEL, **how)
    assert found.identical(read_file(path, CALIBRATION, **how))
    with refusal("conflict", "identity"):
        read_tracks(profile_of(), identity="number")
