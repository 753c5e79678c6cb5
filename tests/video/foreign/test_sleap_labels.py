"""Labels of SLEAP: each instance is of a track, all of one video."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.video.foreign.head_points import read_head
from vibrissa.video.foreign.tracks import read_tracks
from vibrissa.video.tracking import Calibration

pytest.importorskip("movement")
sleap_io = pytest.importorskip("sleap_io")
pytestmark = pytest.mark.filterwarnings(
    "default"
)  # the library that writes the files warns of movies that are not there

PIXEL = 1e-4
CALIBRATION = Calibration(frame_rate=500.0, pixel_size=PIXEL)
SKELETON = sleap_io.Skeleton(["base", "middle", "tip"])
POINTS = np.array([[50.0, 100.0], [70.0, 101.0], [90.0, 104.0]])
FRAMES = 6


def instance(animal, track=None, by_hand=False):
    points = POINTS + np.array([0, 40 * animal])
    if by_hand:
        return sleap_io.Instance.from_numpy(points, skeleton=SKELETON, track=track)
    scores = np.full(3, 0.9)
    return sleap_io.PredictedInstance.from_numpy(points, skeleton=SKELETON, point_scores=scores, score=0.9, track=track)


def labels(path, instances, videos=("one.mp4",)):
    """Labels of which ``instances(frame)`` are those of a frame, the same in all videos."""
    of = [sleap_io.Video(filename=name) for name in videos]
    frames = [
        sleap_io.LabeledFrame(video=video, frame_idx=frame, instances=instances(frame))
        for video in of
        for frame in range(FRAMES)
    ]
    sleap_io.save_slp(sleap_io.Labels(labeled_frames=frames, videos=of), str(path))
    return path


def test_several_instances_without_a_track_are_refused(tmp_path):
    path = labels(tmp_path / "a.slp", lambda frame: [instance(0), instance(1)] if frame > 2 else [instance(0)])
    with refusal("missing", "a.slp, frame 3", value="2 of no track") as caught:
        read_tracks(path, CALIBRATION)
    assert "assign tracks in SLEAP" in caught.value.remedy


def test_an_instance_without_a_track_beside_one_that_has_is_refused(tmp_path):
    track = sleap_io.Track("a")
    path = labels(tmp_path / "a.slp", lambda frame: [instance(0, track), instance(1)][: 1 + (frame == 4)])
    with refusal("missing", "a.slp, frame 4"):
        read_tracks(path, CALIBRATION)


def test_two_instances_of_a_track_in_a_frame_are_refused(tmp_path):
    track = sleap_io.Track("a")
    path = labels(tmp_path / "a.slp", lambda frame: [instance(0, track), instance(1, track)])
    with refusal("missing", "a.slp, frame 0", value="2 of track a"):
        read_tracks(path, CALIBRATION)


def test_labels_of_several_videos_are_refused_with_their_names(tmp_path):
    path = labels(tmp_path / "a.slp", lambda _: [instance(0)], ("one.mp4", "two.mp4"))
    with refusal("conflict", "a.slp", value="one.mp4, two.mp4"):
        read_tracks(path, CALIBRATION)


def test_one_animal_needs_no_track_and_labels_by_hand_go_before_predictions(tmp_path):
    path = labels(tmp_path / "a.slp", lambda frame: [instance(0)] + [instance(1, by_hand=True)] * (frame == 2))
    profile = read_tracks(path, CALIBRATION)
    expected = np.repeat(POINTS[None, :, 1], FRAMES, axis=0) + 40 * (np.arange(FRAMES) == 2)[:, None]
    np.testing.assert_allclose(profile.y.values[0], expected * PIXEL, rtol=1e-6)


@pytest.mark.parametrize(
    ("kept", "known"), [([0, 1, 2, 3, 7], [0, 1, 2, 3, 4, 5]), ([0, 1, 2, 4, 5, 6, 7], [0, 1, 2, 4, 5, 6])]
)
def test_rows_that_end_early_are_frames_if_they_are_more_than_the_pictures(tmp_path, kept, known):
    path = labels(tmp_path / "a.slp", lambda _: [instance(0)])  # rows of 6 frames
    head = read_head(path, 8, ("base", "tip"), np.array(kept))
    bridged = [3] if len(kept) > FRAMES else []
    np.testing.assert_array_equal(np.flatnonzero(head.known), sorted(known + bridged))
