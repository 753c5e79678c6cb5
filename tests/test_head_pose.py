"""Coordinates that move with the head: there and back, lines linked in them, angles to a face that moves."""

import numpy as np
import pytest
from moved_heads import moved
from refusals import refusal
from simulated_segments import Pad, score, simulate

from vibrissa.head_pose import HeadPose, with_head
from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.quantities import dataset
from vibrissa.video.foreign.head_points import bridged, head_of_keypoints, read_head
from vibrissa.video.foreign.keypoints import Keypoints
from vibrissa.video.link.whisker_linking import link_segments
from vibrissa.video.linked.linked_profile import profile_from_linking
from vibrissa.video.tracking import Calibration

FRAMES = 120


def test_places_go_into_head_coordinates_and_back():
    rng = np.random.default_rng(0)
    head = HeadPose(*rng.normal(100, 30, (3, 50)))
    frame, place = np.arange(50), rng.normal(0, 100, (2, 50))
    np.testing.assert_allclose(head.to_image(frame, *head.to_head(frame, *place)), place, atol=1e-9)
    np.testing.assert_allclose([v[0] for v in head.to_head(frame, *place)], place[:, 0], atol=1e-12)


@pytest.fixture(scope="module")
def pad():
    segments, truth = simulate([Pad(whiskers=4, frames=FRAMES, missing=0.0, broken=0.0, junk=0.0)], 3)
    turned, head = moved(segments, 3)
    return segments, truth, turned, head


def timed(segments, head):
    return with_head(segments.merge(dataset(time=np.arange(FRAMES) / 200)), head)


def test_lines_are_linked_as_if_the_head_were_fixed(pad):
    """Moved and brought back, the lines are those of the fixed head: names, nodes and base follow."""
    segments, truth, turned, head = pad
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    linking = link_segments(timed(turned, head))
    found = score(turned, truth, linking.identity().segment_whisker.values)
    assert found.followed > 0.99
    assert found.wrong < 0.005
    fixed = profile_from_linking(link_segments(segments), calibration, source="fixed")
    profile = profile_from_linking(linking, calibration, source="moved")
    x, y = head.to_head(np.arange(FRAMES)[:, None], profile.x.values / 1e-4, profile.y.values / 1e-4)
    start = np.deg2rad(head.angle[0])
    place = (x + 1j * y - (head.column[0] + 1j * head.row[0])) * np.exp(-1j * start) + 180 + 240j
    reach = min(place.shape[2], fixed.sizes["node"])
    for one in place[:, :, :reach]:
        off = np.abs(one[None] - (fixed.x.values + 1j * fixed.y.values)[:, :, :reach] / 1e-4)
        assert min(np.nanmedian(v) for v in off) < 0.5  # medians of bases depend a little on the axes
    np.testing.assert_allclose(profile.head_angle, head.angle)


def test_frames_without_the_head_are_lost_and_say_why(pad):
    _, _, turned, head = pad
    gone = np.isin(np.arange(FRAMES), range(40, 60))
    part = HeadPose(*(np.where(gone, np.nan, one) for one in head))
    profile = profile_from_linking(
        link_segments(timed(turned, part)), Calibration(frame_rate=200.0, pixel_size=1e-4), source="moved"
    )
    assert np.isnan(profile.x.values[:, gone]).all()
    assert "the head is not known" in profile.attrs["lost"]


def test_the_face_moves_with_the_head():
    """A straight whisker at 70° to the axis of a head that turns: its angle stays, that in the image turns."""
    time = np.arange(300) / 500
    turn = np.deg2rad(30) * np.sin(2 * np.pi * time)
    arc = np.arange(12) * 5e-4
    way = turn - np.deg2rad(110)
    x = 0.01 + 0.002 * np.sin(turn)[:, None] + np.cos(way)[:, None] * arc
    y = 0.01 + np.sin(way)[:, None] * arc
    head = HeadPose(100 + 20 * np.sin(turn), np.full(300, 100.0), np.rad2deg(turn))
    profile = dataset({"pixel_size": 1e-4, "frame": "image"}, lead=("whisker",), whisker=[0], time=time,
                      x=x[None], y=y[None], arc_length=arc[None])  # fmt: skip
    data = kinematics_of(with_head(profile, head), KinematicsSettings())
    np.testing.assert_allclose(data.whisker_angle, np.deg2rad(70), atol=1e-6)
    np.testing.assert_allclose(data.image_angle[0], way, atol=1e-6)


def test_two_keypoints_are_a_head():
    x, y = np.array([[[0.0, 10.0], [0.0, 0.0]]]), np.array([[[0.0, 0.0], [0.0, 10.0]]])
    points = Keypoints(["neck", "nose"], x, y, np.ones((1, 2, 2)))
    head = head_of_keypoints("file", points, 0.6, 3)
    np.testing.assert_allclose(head.angle[:2], [0, 90])
    np.testing.assert_allclose(head.column[:2], [10, 0])
    assert np.isnan(head.angle[2])
    with refusal("unknown", "head_points"):
        head_of_keypoints("file", points, 0.6, 3, ["neck", "tail"])


def test_a_table_is_a_head_and_short_gaps_are_bridged(tmp_path):
    path = tmp_path / "head.csv"
    path.write_text("frame,column,row,angle_deg\n0,10,20,170\n2,14,20,-170\n")
    head = read_head(path, 12)
    np.testing.assert_allclose(head.angle[:3], [170, 180, 190])
    np.testing.assert_allclose(head.column[:3], [10, 12, 14])
    assert not head.known[3:].any()
    long = HeadPose(*np.array([[0.0, *[np.nan] * 6, 7.0]] * 3))
    assert bridged(long, 5).known.sum() == 2
    with refusal("format", None):
        read_head(path, 2)
    path.write_text("frame,column,row,angle_deg\n0,10,20,170\n2,14,20,-170\n0,11,20,170\n")
    with refusal("format", "head.csv, line 4, frame", "'0'") as caught:
        read_head(path, 12)
    assert caught.value.rule == "must give each frame once"


@pytest.mark.parametrize(
    "table", ["frame,column,row,angle_deg\n0,10,20,170\n", "column,row,angle_deg,frame\n10,20,170,0\n"]
)
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_a_table_is_known_by_its_column_of_frames(table, mark, tmp_path):
    (tmp_path / "head.csv").write_text(mark + table, encoding="utf-8")
    head = read_head(tmp_path / "head.csv", 1)
    np.testing.assert_allclose([head.column[0], head.row[0], head.angle[0]], [10, 20, 170])


def test_degrees_in_a_column_without_a_unit_are_refused(tmp_path):
    (tmp_path / "head.csv").write_text("frame,column,row,angle\n0,10,20,3\n1,10,20,170\n")
    with refusal("format", "head.csv, line 3, angle", "'170'") as caught:
        read_head(tmp_path / "head.csv", 2)
    assert "angle_deg" in caught.value.remedy
    (tmp_path / "head.csv").write_text("frame,column,row,angle_rad\n0,10,20,7\n")
    np.testing.assert_allclose(read_head(tmp_path / "head.csv", 1).angle, np.rad2deg(7))


def test_two_motions_after_one_another_are_one():
    rng = np.random.default_rng(4)
    first, left = (HeadPose(*np.cumsum(rng.normal(0, size, (3, 30)), axis=1)) for size in (3.0, 1.0))
    both = first.with_motion(left)
    frame, x, y = np.arange(30), rng.uniform(0, 100, 30), rng.uniform(0, 100, 30)
    np.testing.assert_allclose(both.to_head(frame, x, y), left.to_head(frame, *first.to_head(frame, x, y)))
    np.testing.assert_allclose(both.to_image(frame, x, y), first.to_image(frame, *left.to_image(frame, x, y)))
