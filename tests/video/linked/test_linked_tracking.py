"""Whisking movies tracked without marks, against the truth of rendered scenes; marks; what is refused."""

import dataclasses
import json

import numpy as np
import pytest
from refusals import refusal
from scipy.spatial import cKDTree
from simulated_segments import Pad, simulate

from vibrissa.errors import InputError
from vibrissa.head_pose import HeadPose
from vibrissa.quantities import dataset, require
from vibrissa.quantities.identity import SURE
from vibrissa.study.movie.track_plan import plan_of
from vibrissa.study.spec.settings import MovieFile
from vibrissa.video.camera.camera import Camera
from vibrissa.video.camera.pad.filming import film
from vibrissa.video.camera.pad.settings import Head, WhiskingScene
from vibrissa.video.camera.pad.truth import scene_truth
from vibrissa.video.io.movie import write_movie
from vibrissa.video.link.identities import REASONS
from vibrissa.video.link.thorough_linking import link_thoroughly
from vibrissa.video.link.whisker_linking import link_segments
from vibrissa.video.linked.line_marks import LineMark, snapped
from vibrissa.video.linked.linked_profile import _reasons as reasons_of
from vibrissa.video.linked.linked_profile import profile_from_linking
from vibrissa.video.linked.linked_tracking import track_linked
from vibrissa.video.tracking import Calibration

SIDE, FRAMES = 0.2e-3, 150
CALIBRATION = Calibration(frame_rate=500.0, pixel_size=SIDE)
CAMERA = Camera(frame_rate=500.0, pixel_size=SIDE, width=320, height=240, exposure=3e-4, noise=2.0)
SCENE = WhiskingScene(
    camera=CAMERA,
    head=Head(nose=(30 * SIDE, 120 * SIDE), fur=0.0),
    names=("C1", "C2", "C3", "C4"),
    sides=("left",),
    seed=3,
)


@pytest.fixture(scope="module")
def movie():
    return np.concatenate(list(film(SCENE, FRAMES)))


@pytest.fixture(scope="module")
def tracked(movie):
    return track_linked(movie, calibration=CALIBRATION)


@pytest.fixture(scope="module")
def truth():
    """Columns and rows of the whiskers (whisker, frame, node), ten times as dense as the scene has them."""
    profile = scene_truth(SCENE, FRAMES).profile
    nodes = np.arange(profile.sizes["node"])
    dense = np.linspace(0, nodes[-1], 10 * nodes.size)
    return np.stack([[[np.interp(dense, nodes, at) for at in one] for one in profile[k].values / SIDE] for k in "xy"])


def across(profile, truth, whisker, frame):
    """Distance of measured nodes across each true whisker (true whisker, node), their SD [px]."""
    x, y, sd = (profile[name].values[whisker, frame] / SIDE for name in ("x", "y", "y_sd"))
    points = np.stack([x, y], axis=1)[np.isfinite(sd)]
    out = []
    for line in truth[:, :, frame].transpose(1, 2, 0):
        nearest = cKDTree(line).query(points)[1]
        way = np.gradient(line, axis=0)[nearest]
        way /= np.hypot(*way.T)[:, None]
        off = points - line[nearest]
        out.append(np.where(np.abs((off * way).sum(1)) < 1, off[:, 1] * way[:, 0] - off[:, 0] * way[:, 1], np.inf))
    return np.array(out), sd[np.isfinite(sd)]


def test_every_whisker_is_found_and_keeps_its_name(tracked, truth):
    profile = tracked.profile
    require(profile, "x", "y", "x_sd", "y_sd", "arc_length", "whisker_probability")
    assert profile.sizes["whisker"] == 4
    owners = []
    for whisker in range(4):
        frames = np.flatnonzero(np.isfinite(profile.y_sd.values[whisker]).sum(axis=1) > 3)
        assert frames.size > 0.9 * FRAMES
        own = [np.median(np.abs(across(profile, truth, whisker, t)[0]), axis=1).argmin() for t in frames]
        owners.append(np.bincount(own).argmax())
        assert np.mean(own == owners[-1]) > 0.99
    assert sorted(owners) == [0, 1, 2, 3]


def test_the_error_across_a_line_is_as_large_as_its_standard_deviation(tracked, truth):
    ratios = []
    for whisker in range(4):
        for frame in range(0, FRAMES, 5):
            off, sd = across(tracked.profile, truth, whisker, frame)
            if sd.size:
                own = np.median(np.abs(off), axis=1).argmin()
                ratios.append(off[own] / sd)
    ratio = np.concatenate(ratios)
    ratio = ratio[np.isfinite(ratio)]
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1, abs=0.2)
    assert np.mean(np.abs(ratio) < 1.96) == pytest.approx(0.95, abs=0.03)
    np.testing.assert_array_equal(tracked.profile.x_sd, tracked.profile.y_sd)


def test_what_is_not_seen_is_nan_and_says_why(tracked):
    profile = tracked.profile
    seen = np.isfinite(profile.x.values).any(axis=2)
    np.testing.assert_array_equal(np.isfinite(profile.whisker_probability), seen)
    assert np.nanmin(profile.whisker_probability) >= 0.9
    for whisker, runs in enumerate(json.loads(profile.attrs["lost"])):
        gone = np.zeros(FRAMES, bool)
        for first, last, reason in runs:
            gone[first : last + 1] = True
            assert reason
        np.testing.assert_array_equal(gone, ~seen[whisker])


def test_a_higher_probability_leaves_the_surer_names_and_says_what_is_gone():
    linking = link_segments(simulate([Pad(whiskers=6, frames=150, broken=0.1)], 2)[0])
    calibration = Calibration(frame_rate=500.0, pixel_size=SIDE)
    loose, strict = (
        profile_from_linking(linking, calibration, source="pad", least_probability=least) for least in (0.0, 0.95)
    )
    assert (loose.sizes["whisker"], strict.attrs["least_probability"]) == (6, 0.95)
    chance = loose.whisker_probability.values
    same = strict.whisker_probability.values
    assert (chance < 0.95).any()
    np.testing.assert_array_equal(same, np.where(chance >= 0.95, chance, np.nan))
    reasons = {reason for runs in json.loads(strict.attrs["lost"]) for *_, reason in runs}
    assert "which line it is cannot be decided" in reasons
    assert "which line it is cannot be decided" not in loose.attrs["lost"]


@pytest.mark.parametrize("frames", [1, 7])
def test_a_movie_of_too_few_frames_is_refused_with_what_to_do(movie, frames):
    with pytest.raises(InputError, match=f"at least 8 frames to be linked, got {frames}; follow whiskers from seeds"):
        track_linked(movie[:frames], calibration=CALIBRATION)


@pytest.mark.parametrize("least", [-0.1, 1.5, float("nan")])
def test_a_probability_is_from_0_to_1_and_of_whiskers_that_are_linked(least):
    movie = MovieFile(path="frames", pixel_size=SIDE, least_probability=0.9)
    assert plan_of(movie, list).remarks == ("tracking 'link': least_probability given",)
    with pytest.raises(InputError, match="least_probability must be from 0 to 1"):
        plan_of(dataclasses.replace(movie, least_probability=least), list)


def place(profile, whisker, frame, node):
    """A measured place of a whisker [px]."""
    x, y = (profile[name].values[whisker, frame] / SIDE for name in "xy")
    at = np.flatnonzero(np.isfinite(x))[node]
    return float(x[at]), float(y[at])


def test_marked_whiskers_have_their_names_and_come_first(movie, tracked):
    """The lines are found again in a part of the movie: frames of marks, segments and errors are the movie's."""
    marks = [
        LineMark(40, *place(tracked.profile, 2, 40, 8), "C3"),
        LineMark(90, *place(tracked.profile, 0, 90, 8), "C1"),
    ]
    marks.append(
        marks[0]._replace(frame=60, column=place(tracked.profile, 2, 60, 8)[0], row=place(tracked.profile, 2, 60, 8)[1])
    )
    profile, segments = track_linked(movie, calibration=CALIBRATION, marks=marks, start=30)
    assert json.loads(profile.attrs["names"])[:2] == ["C3", "C1"]
    assert profile.sizes["whisker"] == 4
    assert segments.attrs["first_frame"] == segments.segment_frame.values[0] == 30
    for name, old in ((0, 2), (1, 0)):
        same = tracked.profile.isel(whisker=old, time=slice(30, None))
        off = np.hypot(
            profile.x.values[name, :, 5] - same.x.values[:, 5], profile.y.values[name, :, 5] - same.y.values[:, 5]
        )
        assert np.nanmedian(off) < SIDE
    assert np.mean(segments.segment_whisker.values >= 0) > 0.9
    with refusal("range", "mark") as caught:
        track_linked(movie, calibration=CALIBRATION, marks=[LineMark(29, 100, 100, "C1")], start=30)
    assert "from 30 to 149" in str(caught.value)


def test_frames_without_a_head_are_reported(movie):
    known = np.where(np.arange(FRAMES) < 25, np.nan, 1.0)
    profile, _ = track_linked(movie, calibration=CALIBRATION, head=HeadPose(160 * known, 120 * known, 0 * known))
    [line] = json.loads(profile.attrs["remarks"])
    assert line == f"the head is known in {FRAMES - 25} of {FRAMES} frames; in the others whiskers are lost"


def test_marks_that_contradict_one_another_are_reported(movie, tracked):
    """Two whiskers of one frame under one name: one of them cannot be it."""
    marks = [LineMark(90, *place(tracked.profile, k, 90, 8), "C1") for k in (0, 2)]
    profile, _ = track_linked(movie, calibration=CALIBRATION, marks=marks)
    several, unkept, *_ = json.loads(profile.attrs["remarks"])
    assert several.startswith("marks of C1 are on lines of 2 whiskers")
    assert unkept.startswith("1 of 2 marks are not kept: C1 in frame 90, column ")


@pytest.mark.parametrize(
    ("mark", "said"),
    [
        (LineMark(FRAMES, 100, 100, "C1"), "must be in a frame from 0 to 149"),
        (LineMark(0, 320, 100, "C1"), "must lie in the image of 320 × 240 pixels"),
        (LineMark(0, 300, 5, "C1"), "the nearest line of frame 0 passes at column"),
    ],
)
def test_a_mark_that_fits_nothing_names_the_nearest_line(tracked, mark, said):
    with refusal("range", "mark") as caught:
        snapped(tracked.segments, mark)
    assert said in str(caught.value)
    assert f"frame {mark.frame}, column {mark.column}" in str(caught.value)


def test_a_mark_in_a_frame_without_lines_names_the_nearest_frame_that_has_some(tracked):
    whole = tracked.segments
    keep = int(np.searchsorted(whole.segment_frame, 10))
    part = whole.isel(segment=slice(0, keep), point=slice(0, int(whole.segment_start[keep])))
    with refusal("range", "mark") as caught:
        snapped(part, LineMark(20, 100, 100, "C1"))
    assert "the nearest line of frame 9 passes" in str(caught.value)


@pytest.fixture
def never_linked(monkeypatch):
    """Fail if lines are linked."""

    def link(_):
        raise AssertionError("lines were linked first")

    monkeypatch.setattr("vibrissa.video.linked.linked_tracking.link_thoroughly", link)


@pytest.mark.usefixtures("never_linked")
def test_a_mark_on_no_line_is_refused_before_lines_are_linked(movie):
    with refusal("range", "mark"):
        track_linked(movie, calibration=CALIBRATION, marks=[LineMark(20, 300, 5, "C1")])


@pytest.mark.parametrize("at", [(FRAMES, 100, 100), (9, 100, 100), (20, 320, 100), (20, 100, -1)])
def test_a_mark_off_the_movie_is_refused_before_its_frames_are_searched(movie, tmp_path, monkeypatch, at):
    def find(*_, **__):
        raise AssertionError("frames were searched first")

    monkeypatch.setattr("vibrissa.video.linked.linked_tracking.find_segments", find)
    write_movie(tmp_path / "movie.mkv", [movie])  # which does not state how many frames it has
    np.save(tmp_path / "movie.npy", movie)
    for one in (movie, tmp_path / "movie.npy", *([tmp_path / "movie.mkv"] if at[0] < FRAMES else [])):
        with refusal("range", "mark"):
            track_linked(one, calibration=CALIBRATION, marks=[LineMark(*at, "C1")], start=10)


@pytest.mark.usefixtures("never_linked")
def test_two_names_on_one_line_are_refused_before_lines_are_linked(movie, tracked):
    here = place(tracked.profile, 1, 20, 8)
    with refusal("conflict", "mark"):
        track_linked(movie, calibration=CALIBRATION, marks=[LineMark(20, *here, "C1"), LineMark(20, *here, "C2")])


def test_a_region_keeps_the_coordinates_of_the_movie(movie, tracked):
    found = track_linked(movie, calibration=CALIBRATION, region=(60, 20, 319, 239)).profile
    assert np.nanmin(found.x) >= 60 * SIDE
    lines = cKDTree(
        np.stack([tracked.segments.column, tracked.segments.row, 1e3 * point_frames(tracked.segments)], axis=1)
    )
    at = [
        (x, y, 1e3 * t)
        for w in range(found.sizes["whisker"])
        for t in range(0, FRAMES, 10)
        for x, y in nodes(found, w, t)
    ]
    assert np.median(lines.query(np.array(at))[0]) < 0.6


def nodes(profile, whisker, frame):
    x, y = (profile[name].values[whisker, frame] / SIDE for name in "xy")
    return zip(x[np.isfinite(x)], y[np.isfinite(x)], strict=True)


def test_a_whisker_begins_at_its_skin(movie, tracked):
    """Arc length counts from the skin point that is given, 12 px further out, of the nearest whisker alone."""
    base = [
        np.nanmedian(np.array([place(tracked.profile, w, t, 0) for t in range(0, FRAMES, 10)]), axis=0) for w in (0, 1)
    ]
    out = np.median(np.array([place(tracked.profile, 0, t, 3) for t in range(0, FRAMES, 10)]), axis=0)
    skin = base[0] + 12 * (out - base[0]) / np.hypot(*(out - base[0]))
    profile = track_linked(movie, calibration=CALIBRATION, skin=[tuple(skin)]).profile
    first = [np.median(np.array([place(profile, w, t, 0) for t in range(0, FRAMES, 10)]), axis=0) for w in (0, 1)]
    assert np.hypot(*(first[0] - base[0])) > 8
    assert np.hypot(*(first[1] - base[1])) < 1
    with refusal("shape", "skin"):
        track_linked(movie, calibration=CALIBRATION, skin=[(1.0, 1.0)] * 9)


def point_frames(segments):
    return np.repeat(segments.segment_frame.values, np.diff(np.append(segments.segment_start, segments.sizes["point"])))


def test_a_movie_without_lines_is_refused():
    rng = np.random.default_rng(0)
    noise = rng.normal(150, 2, (8, 64, 64)).astype(np.uint8)
    with refusal("too-few", "movie"):
        track_linked(noise, calibration=CALIBRATION)


def test_lit_whiskers_are_tracked_as_dark_ones_are():
    scene = dataclasses.replace(SCENE, polarity="bright", names=("C1", "C3"))
    lit = np.concatenate(list(film(scene, 60)))
    profile = track_linked(lit, calibration=CALIBRATION, polarity="bright").profile
    assert profile.sizes["whisker"] == 2
    assert np.isfinite(profile.x.values).any(axis=2).mean() > 0.9


def test_a_sheet_of_many_whiskers_names_those_that_are_seen_at_their_tips(movie, tracked):
    from vibrissa.figures.others import preview

    profile = tracked.profile.isel(whisker=[0, 1, 2, 3, 0, 1, 2]).assign_coords(whisker=np.arange(7))
    profile["x"][5, 0], profile["y_sd"][5, 0] = np.nan, np.nan
    figure = preview.draw(preview.compute([movie], profile, [0, 100]))
    first, second = figure.axes[:2]
    assert "6 of 7 whiskers" in first.get_title(loc="left")
    names = [text.get_text() for text in first.texts]
    assert {"0", "6"} <= set(names)
    assert "5" not in names
    assert "5" in [text.get_text() for text in second.texts]


def test_a_whisker_whose_line_is_also_another_ones_is_lost_for_that_reason():
    """Whisker 0 has a line in frame 0 that runs along whisker 1, too; in frame 1 each has its own."""
    identity = dataset(
        segment_whisker=np.array([0, 0, 1]),
        segment_other=np.array([1, -1, -1]),
        segment_probability=np.full(3, 0.9),
        whisker_segment=np.array([[0, 1], [-1, 2]]),
        whisker_probability=np.array([[0.9, 0.9], [np.nan, 0.9]]),
        lost_reason=np.array([[0, 0], [3, 0]]),
    )
    found = reasons_of(identity, 0.7)
    assert [REASONS[code] for code in found[:, 0]] == ["one line with another whisker"] * 2
    assert not found[:, 1].any()


def test_no_name_in_a_profile_is_less_sure_than_asked():
    pad = Pad(whiskers=7, frames=90, spread=50.0, amplitude=20.0, missing=0.2, broken=0.5, drift=3.0, opening=0.3)
    linking = link_thoroughly(simulate([pad], 0)[0])[1]
    profile = profile_from_linking(linking, Calibration(frame_rate=200.0, pixel_size=1e-4), source="pad")
    main = linking.identity().whisker_probability.values[json.loads(profile.attrs["identities"])]
    named = np.isfinite(profile.whisker_probability.values)
    assert (main[named] < SURE).any()  # of the piece that is shown elsewhere, not of the one that has the nodes
    assert profile.whisker_probability.values[named].min() >= SURE


def test_whiskers_without_a_sure_name_are_reported_with_their_probability():
    pad = Pad(whiskers=7, frames=90, spread=50.0, amplitude=20.0, missing=0.2, broken=0.5, drift=3.0, opening=0.3)
    linking = link_thoroughly(simulate([pad], 0)[0])[1]
    identity = linking.identity()
    whisker, sure = identity.segment_whisker.values, identity.segment_probability.values
    most = np.sort([sure[whisker == one].max() for one in range(linking.whiskers)])
    least = most[0] + (most[1] - most[0]) / 2  # between the two whiskers that are least sure at their best
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    profile = profile_from_linking(linking, calibration, source="pad", least_probability=least)
    (said,) = json.loads(profile.attrs["remarks"])
    known = f"1 more whisker has no name that is {least:g} sure: its lines would be kept with a `least_probability` of "
    assert said.startswith(f"{known}{np.floor(100 * most[0]) / 100:.2f} or less")
    assert "remarks" not in profile_from_linking(linking, calibration, source="pad").attrs
