"""From a rendered movie of a head that moves to angles and touches, against the scene's truth."""

import dataclasses

import numpy as np
import pytest
from moved_heads import SIDE, scene

from vibrissa.head_pose import HeadPose
from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.measures.tidy_tables import write_kinematics
from vibrissa.measures.touched_object import Pole as TouchedPole
from vibrissa.video.camera.camera import exposure_times
from vibrissa.video.camera.pad.filming import film
from vibrissa.video.camera.pad.motion import head_path
from vibrissa.video.camera.pad.settings import FilmedPole
from vibrissa.video.camera.pad.truth import scene_truth
from vibrissa.video.linked.linked_tracking import track_linked
from vibrissa.video.tracking import Calibration

FRAMES = 300


@pytest.fixture(scope="module")
def measured():
    one = dataclasses.replace(scene(4), names=("C1", "C2", "C3"), sides=("left",))
    one = dataclasses.replace(one, head=dataclasses.replace(one.head, fur=0.0))
    free = scene_truth(one, FRAMES).profile
    # the pole is where the middle of whisker 1 is when it has come half way forward
    angle = free.whisker_angle.values[1]
    at = int(np.argmin(np.abs(angle - np.quantile(angle, 0.7))))
    place = tuple(float(free[name].values[1, at, 60]) for name in "xy")
    one = dataclasses.replace(one, pole=FilmedPole(position=place, radius=3 * SIDE, touched_by=(1,)))
    truth = scene_truth(one, FRAMES).profile
    path = head_path(one, exposure_times(one.camera, FRAMES))
    head = HeadPose(path.nose[:, 0] / SIDE, path.nose[:, 1] / SIDE, np.rad2deg(path.heading))
    movie = np.concatenate(list(film(one, FRAMES)))
    profile = track_linked(movie, calibration=Calibration(frame_rate=500.0, pixel_size=SIDE), head=head).profile
    touched = TouchedPole(centre=place, radius=3 * SIDE)
    data = kinematics_of(profile, KinematicsSettings(touched=touched, least_frames=3))
    return data, truth, profile


def owners(data, truth):
    """Whisker of the scene that each measured one is, by its angles."""
    off = data.whisker_angle.values[:, None] - truth.whisker_angle.values[None]
    return np.nanmedian(np.abs(off), axis=2).argmin(axis=1)


def best(data, own, whisker):
    """The longest of the measured whiskers that are one of the scene."""
    return max(np.flatnonzero(own == whisker), key=lambda w: np.isfinite(data.whisker_angle.values[w]).sum())


def test_angles_are_those_of_the_scene(measured):
    """A base part of a quarter is bent by about 1°, a constant; without touch the rest of the angle is within 1°."""
    data, truth, profile = measured
    own = owners(data, truth)
    assert set(own) == {0, 1, 2}
    for whisker in range(3):
        one, free = best(data, own, whisker), truth.touching.values[whisker] == 0
        off = np.rad2deg(data.whisker_angle.values[one] - truth.whisker_angle.values[whisker])[free]
        assert np.isfinite(off).mean() > 0.95
        assert abs(np.nanmedian(off)) < 2
        assert np.nanquantile(np.abs(off - np.nanmedian(off)), 0.9) < 1
    assert "the head's axis" in data.attrs["remarks"]
    np.testing.assert_allclose(profile.head_angle, np.rad2deg(head_path(scene(4), truth.time.values).heading))


def test_touches_of_a_pole_that_does_not_move_with_the_head(measured):
    """The pole is in the image; a whisker within two pixels of it is at it, a few frames before and after."""
    data, truth, _ = measured
    touching = data.touching.values[best(data, owners(data, truth), 1)]
    true = truth.touching.values[1] == 1
    known = np.isfinite(touching)
    assert true.sum() > 50
    assert np.mean((touching == 1)[known] == true[known]) > 0.85
    assert data.sizes["touch"] > 0


def test_tables_have_every_whisker_and_frame(measured, tmp_path):
    data, _, _ = measured
    written = write_kinematics(data, tmp_path / "whisks.csv")
    rows = [len(path.read_text().splitlines()) - 1 for path in written]
    assert rows == [data.sizes["whisker"] * FRAMES, data.sizes["touch"]]
