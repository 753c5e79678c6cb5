"""Keypoints of DeepLabCut and SLEAP as profiles: through movement, and on their own."""

import json
import sys

import h5py
import numpy as np
import pytest
from refusals import refusal

from vibrissa.video.foreign.keypoints import Keypoints, profile_from_keypoints
from vibrissa.video.foreign.tracks import kind_of, read_tracks
from vibrissa.video.tracking import Calibration

PIXEL = 1e-4
CALIBRATION = Calibration(frame_rate=500.0, pixel_size=PIXEL)
NAMES = [f"w{i}" for i in range(6)]
FRAMES = 9


def positions():
    """Six points on a parabola that moves up and down, x and y (T, 6) [px], and their likelihood."""
    x = 50 + 20.0 * np.arange(6) + np.zeros((FRAMES, 1))
    y = 100 + 0.01 * (x - 50) ** 2 + np.sin(np.arange(FRAMES))[:, None]
    likelihood = np.full(x.shape, 0.99)
    likelihood[3, 2] = 0.1
    return x, y, likelihood


def deeplabcut(path, individuals=("one",), first=0) -> None:
    x, y, likelihood = positions()
    many = len(individuals) > 1
    columns = [(who, name, axis) for who in individuals for name in NAMES for axis in ("x", "y", "likelihood")]
    header = [["scorer"] + ["net"] * len(columns)]
    header += [["individuals"] + [one[0] for one in columns]] if many else []
    header += [["bodyparts"] + [one[1] for one in columns], ["coords"] + [one[2] for one in columns]]
    rows = np.stack([x, y, likelihood], axis=2).reshape(FRAMES, -1)
    rows = np.concatenate([rows + 1000 * i * (np.arange(18) % 3 < 2) for i in range(len(individuals))], axis=1)
    lines = [",".join(one) for one in header] + [
        f"{first + i}," + ",".join(map(repr, map(float, r))) for i, r in enumerate(rows)
    ]
    path.write_text("\n".join(lines) + "\n")


def sleap_analysis(path) -> None:
    x, y, likelihood = positions()
    with h5py.File(path, "w") as file:
        file["tracks"] = np.stack([x.T, y.T])[None]
        file["node_names"], file["track_names"] = [name.encode() for name in NAMES], [b"one"]
        file["point_scores"] = likelihood.T[None]


def sleap_labels(path) -> None:
    sleap_io = pytest.importorskip("sleap_io")
    x, y, likelihood = positions()
    skeleton, video, track = sleap_io.Skeleton(list(NAMES)), sleap_io.Video(filename="no.mp4"), sleap_io.Track("one")
    frames = []
    for t in range(FRAMES):
        points = np.stack([x[t], y[t]], axis=1)
        one = sleap_io.PredictedInstance.from_numpy(
            points, skeleton=skeleton, point_scores=likelihood[t], score=1.0, track=track
        )
        frames.append(sleap_io.LabeledFrame(video=video, frame_idx=t + (t > 4), instances=[one]))
    labels = sleap_io.Labels(labeled_frames=frames, videos=[video], skeletons=[skeleton], tracks=[track])
    sleap_io.save_slp(labels, str(path))


# Through movement


def test_deeplabcut_table(tmp_path):
    pytest.importorskip("movement")
    deeplabcut(tmp_path / "a.csv")
    assert kind_of(tmp_path / "a.csv") == "DeepLabCut"
    x, y, likelihood = positions()
    profile = read_tracks(tmp_path / "a.csv", CALIBRATION)
    expected = np.where(likelihood < 0.6, np.nan, [x, y]) * PIXEL
    np.testing.assert_allclose([profile.x.values[0], profile.y.values[0]], expected)
    assert profile.attrs["keypoints_left_out"] == 1
    steps = np.hypot(20, np.diff(y[0]))
    np.testing.assert_allclose(profile.arc_length[0] / PIXEL, np.concatenate([[0], np.cumsum(steps)]))
    np.testing.assert_allclose(profile.time, np.arange(FRAMES) / 500)
    everything = read_tracks(tmp_path / "a.csv", CALIBRATION, least_likelihood=0.0)
    assert everything.attrs["keypoints_left_out"] == 0
    np.testing.assert_allclose(everything.y.values[0], y * PIXEL)


def test_deeplabcut_of_several_individuals_and_whiskers(tmp_path):
    pytest.importorskip("movement")
    deeplabcut(tmp_path / "a.csv", individuals=("left", "right"))
    x, _, _ = positions()
    whiskers = [["w1", "w0"], ["w3", "w4", "w5"]]
    profile = read_tracks(tmp_path / "a.csv", CALIBRATION, keypoints=whiskers)
    assert dict(profile.sizes) == {"whisker": 4, "time": FRAMES, "node": 3}
    np.testing.assert_allclose(profile.x.values[0, :, :2], x[:, [1, 0]] * PIXEL)
    np.testing.assert_allclose(profile.x.values[3], (1000 + x[:, 3:]) * PIXEL)
    assert np.isnan(profile.x.values[0, :, 2]).all()
    assert np.isnan(profile.arc_length.values[0, 2])


@pytest.mark.filterwarnings("default")  # the library that writes the test's file warns of a movie that is not there
@pytest.mark.parametrize("kind", ["analysis", "labels"])
def test_sleap_files(tmp_path, kind):
    pytest.importorskip("movement")
    path = tmp_path / ("a.h5" if kind == "analysis" else "a.slp")
    (sleap_analysis if kind == "analysis" else sleap_labels)(path)
    assert kind_of(path) == "SLEAP"
    profile = read_tracks(path, CALIBRATION)
    _, y, _ = positions()
    read = profile.y.values[0]
    if kind == "labels":  # frame 5 has no instance
        assert profile.attrs["lost"] == '[[[5, 5, "not in the file"]]]'
        read = np.delete(read, 5, axis=0)
    np.testing.assert_allclose(read, y * PIXEL, rtol=1e-6)  # single precision


def test_a_table_that_skips_frames_is_refused(tmp_path):
    deeplabcut(tmp_path / "a.csv", first=5)
    with refusal("format", "a.csv", value="'5'"):
        read_tracks(tmp_path / "a.csv", CALIBRATION)


def test_a_cell_that_is_no_number_is_told_in_one_line(tmp_path):
    pytest.importorskip("movement")
    deeplabcut(tmp_path / "a.csv")
    (tmp_path / "a.csv").write_text((tmp_path / "a.csv").read_text().replace("50.0", "fifty", 1))
    with refusal("format", "a.csv, line 4, column 2"):
        read_tracks(tmp_path / "a.csv", CALIBRATION)


def test_without_movement_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "movement.io.load_poses", None)
    monkeypatch.setitem(sys.modules, "movement", None)
    deeplabcut(tmp_path / "a.csv")
    with refusal("package", "a.csv"):
        read_tracks(tmp_path / "a.csv", CALIBRATION)


# On their own


def keypoints() -> Keypoints:
    x, y, likelihood = positions()
    return Keypoints(NAMES, x[None], y[None], likelihood[None])


def test_nodes_on_the_spline_lie_on_the_curve():
    profile = profile_from_keypoints(keypoints(), calibration=CALIBRATION, node_spacing=5 * PIXEL)
    x, y = profile.x.values[0] / PIXEL, profile.y.values[0] / PIXEL
    expected = 100 + 0.01 * (x - 50) ** 2 + np.sin(np.arange(FRAMES))[:, None]
    # error of a cubic spline over steps of h in chord: the curve is a parabola, its parameter is not
    np.testing.assert_allclose(y, expected, atol=0.2)
    assert np.isfinite(x).all()
    steps = np.hypot(np.diff(x), np.diff(y))
    np.testing.assert_allclose(steps, 5, rtol=0.03)


def test_nothing_stands_beside_a_keypoint_not_seen():
    profile = profile_from_keypoints(keypoints(), calibration=CALIBRATION, node_spacing=5 * PIXEL, least_likelihood=0.5)
    lengths = np.concatenate([[0], np.cumsum(np.hypot(20, np.diff(positions()[1][0])))])
    arc = profile.arc_length.values[0] / PIXEL
    beside = (arc > lengths[1]) & (arc < lengths[3])
    assert np.array_equal(np.isnan(profile.x.values[0, 3]), beside)
    assert np.isfinite(profile.x.values[0, 4]).all()


def test_a_hidden_keypoint_does_not_move_the_nodes_of_the_others():
    """A straight whisker that looks longer by 10 % in every other frame; one keypoint is hidden in one frame."""
    along = np.array([0.0, 18.0, 41.0, 60.0, 82.0, 100.0]) * np.where(np.arange(FRAMES) % 2, 1.1, 1.0)[:, None]
    x, y = 50 + 0.8 * along, 100 + 0.6 * along
    x[2, 3] = y[2, 3] = np.nan
    points = Keypoints(NAMES, x[None], y[None], np.ones((1, *x.shape)))
    profile = profile_from_keypoints(points, calibration=CALIBRATION, node_spacing=5 * PIXEL)
    hidden, whole = (np.stack([profile.x.values[0, k], profile.y.values[0, k]]) for k in (2, 0))
    arc = profile.arc_length.values[0] / PIXEL
    beside = (arc > 41.0) & (arc < 82.0)
    assert np.array_equal(np.isnan(hidden[0]), beside | (arc > 100))
    seen = np.isfinite(hidden)
    np.testing.assert_allclose(hidden[seen], whole[seen], atol=1e-9 * PIXEL)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ([["w0", "nose"]], ("unknown", "keypoints")),
        ([["w0"]], ("too-few", "keypoints")),
        ([["w0", "w0"]], ("too-few", "keypoints")),
    ],
)
def test_names_that_make_no_whisker_are_refused(wanted, message):
    with refusal(*message):
        profile_from_keypoints(keypoints(), calibration=CALIBRATION, keypoints=wanted)


def test_neighbours_never_seen_together_have_no_distance():
    points = keypoints()
    points.x[0, :, 3] = np.nan
    with refusal("too-few", "the keypoints"):
        profile_from_keypoints(points, calibration=CALIBRATION)


def test_the_choice_of_keypoints_is_told():
    profile = profile_from_keypoints(keypoints(), calibration=CALIBRATION, keypoints=[["w5", "w4"]])
    assert json.loads(profile.attrs["keypoints"]) == [["w5", "w4"]]
    assert profile.attrs["arc_length_from"] == "first keypoint"


def test_keypoints_of_several_whiskers_are_not_taken_for_one():
    """A line from the tip of one whisker to the base of the next turns back."""
    x, y, likelihood = positions()
    names = [f"{whisker}_{k}" for whisker in "ab" for k in range(6)]
    both = np.hstack([x, x + 3.0]), np.hstack([y, y + 40.0]), np.hstack([likelihood, likelihood])
    points = Keypoints(names, *(values[None] for values in both))
    with refusal("missing", "keypoints", "a line through those of dlc.csv that turns back at a_5"):
        profile_from_keypoints(points, calibration=CALIBRATION, source="dlc.csv")
    named = profile_from_keypoints(points, calibration=CALIBRATION, keypoints=[names[:6], names[6:]])
    assert named.sizes["whisker"] == 2
