"""A profile that is opened and saved again without an edit stays as it was."""

import json
from dataclasses import replace

import numpy as np
import pytest
from moved_heads import moved
from refusals import refusal
from simulated_segments import HEIGHT, WIDTH, Pad, simulate

from vibrissa.head_pose import with_head
from vibrissa.measures.face import Face
from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.netcdf import load, save
from vibrissa.quantities import dataset
from vibrissa.video.correct.corrected_profile import corrected_profile
from vibrissa.video.correct.edit_file import write_edits
from vibrissa.video.correct.edits import Edit
from vibrissa.video.correct.opening import marked_names, open_tracks, profile_numbers
from vibrissa.video.io.movie import write_movie
from vibrissa.video.link.thorough_linking import IDENTIFIED, link_thoroughly
from vibrissa.video.linked.linked_profile import profile_from_linking
from vibrissa.video.tracking import Calibration, numbered_from

FRAMES, FIRST, LAST = 90, 20, 59  # of the movie; of a part of it


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """Folder with movie, lines and profile of a drifting pad, whose linkings do not agree in every line."""
    folder = tmp_path_factory.mktemp("tracked")
    pad = Pad(whiskers=7, frames=FRAMES, spread=50.0, amplitude=20.0, missing=0.2, carried=0.4, drift=3.0, opening=0.3)
    lines, linking = link_thoroughly(simulate([pad], 7)[0])
    identity = linking.identity()
    assert (identity.segment_whisker.values != replace(linking, others=None).identity().segment_whisker.values).any()
    save(lines.assign({name: identity[name] for name in IDENTIFIED}), folder / "lines.nc")
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    profile = profile_from_linking(linking, calibration, source="pad", first=[3])  # as if marked: it comes first
    names = [f"whisker {k}" for k in range(profile.sizes["whisker"])]
    save(profile.assign_attrs(names=json.dumps(["C2", *names[1:]]), marks="[]"), folder / "profile.nc")
    write_movie(folder / "movie.mkv", [np.full((FRAMES, HEIGHT, WIDTH), 190, np.uint8)])
    return folder


@pytest.fixture(scope="module", params=[False, True], ids=["still", "moving head"])
def part(tmp_path_factory, request):
    """Folder as of a part of a movie that was tracked: the frames of its lines are the movie's."""
    folder, count = tmp_path_factory.mktemp("part"), LAST + 1 - FIRST
    lines = simulate([Pad(whiskers=7, frames=count, spread=50.0, amplitude=20.0, missing=0.1)], 4)[0]
    if request.param:
        lines, head = moved(lines, 4)
        lines = with_head(lines.merge(dataset(time=np.arange(count) / 200), combine_attrs="override"), head)
    later = lines.segment_frame + FIRST
    lines, linking = link_thoroughly(lines.assign(segment_frame=later).assign_attrs(first_frame=FIRST))
    identity = linking.identity()
    save(lines.assign({name: identity[name] for name in IDENTIFIED}), folder / "lines.nc")
    calibration = Calibration(frame_rate=200.0, pixel_size=1e-4)
    save(numbered_from(profile_from_linking(linking, calibration, source="pad"), FIRST), folder / "profile.nc")
    write_movie(folder / "movie.mkv", [np.full((FRAMES, HEIGHT, WIDTH), 190, np.uint8)])
    return folder


def opened(folder, **attrs):
    """Tracks of a folder, whose profile has some more attributes."""
    profile = folder / "again.nc"
    save(load(folder / "profile.nc").assign_attrs(attrs), profile)
    words = {"tell": lambda text: None, "progress": lambda *_: None, "edits": folder / "no.json"}
    return open_tracks(profile, folder / "movie.mkv", segments=folder / "lines.nc", **words)


def test_without_an_edit_places_and_names_are_the_same(tracked):
    tracks = opened(tracked)
    before, after = tracks.profile, corrected_profile(tracks)
    for name in ("x", "y", "arc_length", "time"):
        np.testing.assert_allclose(after[name].values, before[name].values, atol=1e-12)
    assert after.attrs["identities"] == before.attrs["identities"]
    assert json.loads(after.attrs["names"])[0] == "C2"
    assert (after.attrs["marks"], after.attrs["edits"]) == ("[]", 0)


def test_what_whiskers_are_called_is_in_the_profile_and_in_what_is_measured(tracked):
    tracks = opened(tracked)
    two = json.loads(tracks.profile.attrs["identities"])[1]
    tracks.correction.apply(Edit(do="call", whisker=int(tracks.numbers[two]), label="δ"))
    after = corrected_profile(tracks)
    assert json.loads(after.attrs["names"])[:3] == ["C2", "δ", "whisker 2"]
    measured = kinematics_of(after, KinematicsSettings(face=Face(caudal=(0.0, 0.0), rostral=(0.0, 1.0))))
    assert measured.whisker_label.values[:2].tolist() == ["C2", "δ"]
    assert marked_names(after, np.arange(tracks.correction.named.whiskers))[int(tracks.numbers[two])] == "δ"


def test_a_corrected_profile_without_its_edits_is_refused(tracked):
    with refusal("conflict", str(tracked / "again.nc")) as caught:
        opened(tracked, edits=2)
    assert "got 2 edits and no " in str(caught.value)


def test_a_part_of_a_movie_stays_a_part(tracked):
    after = corrected_profile(opened(tracked, first_frame=20, last_frame=59))
    whole = corrected_profile(opened(tracked))
    np.testing.assert_array_equal(after.x, whole.x[:, 20:60])
    np.testing.assert_array_equal(after.time, whole.time[20:60])
    assert (after.attrs["first_frame"], after.attrs["last_frame"]) == (20, 59)
    for runs, seen in zip(json.loads(after.attrs["lost"]), np.isfinite(after.x).any("node").values, strict=True):
        lost = np.zeros(40, bool)
        for first, last, _ in runs:
            lost[first : last + 1] = True
        np.testing.assert_array_equal(lost, ~seen)


def test_a_tracked_part_without_an_edit_stays_as_it_was(part):
    tracks = opened(part)
    before, after = tracks.profile, corrected_profile(tracks)
    for name in ("x", "y", "arc_length", "time", "whisker_probability"):
        np.testing.assert_allclose(after[name].values, before[name].values, atol=1e-12)
    assert (after.attrs["first_frame"], after.attrs["last_frame"]) == (FIRST, LAST)
    # why a frame is lost is what all linkings say together; they are not asked again
    frames = [[run[:2] for run in runs] for runs in json.loads(before.attrs["lost"])]
    assert [[run[:2] for run in runs] for runs in json.loads(after.attrs["lost"])] == frames


def test_an_edit_of_a_tracked_part_has_the_frame_of_the_movie(part):
    tracks, frame = opened(part), 50
    named, frames = tracks.correction.named, load(part / "lines.nc").segment_frame.values
    line = int(np.flatnonzero((frames == frame) & (named.whisker == tracks.numbers[0]))[0])
    point = tracks.correction.point_on(line)
    assert point.frame == frame
    tracks.correction.apply(Edit(do="delete", at=point, alone=True))
    before, after = (np.isfinite(one.x.values).any(axis=-1) for one in (tracks.profile, corrected_profile(tracks)))
    whisker = json.loads(tracks.profile.attrs["identities"]).index(0)
    assert np.argwhere(before != after).tolist() == [[whisker, frame - FIRST]]


def test_older_edits_of_a_tracked_part_are_refused(part, tracked):
    """Their frames counted from the part, and their lines lay on the pictures of other frames."""
    for folder, late in ((tracked, False), (part, True)):
        tracks, file = opened(folder), folder / "old.edits.json"
        write_edits(file, tracks.movie, [Edit(do="call", whisker=0, label="E9")])
        words = {"tell": lambda text: None, "progress": lambda *_: None, "edits": file}
        files = folder / "again.nc", folder / "movie.mkv"
        assert open_tracks(*files, segments=folder / "lines.nc", **words).correction.labels[0] == "E9"
        file.write_text(file.read_text().replace('"version": 2', '"version": 1'))
        if not late:
            assert open_tracks(*files, segments=folder / "lines.nc", **words).correction.labels[0] == "E9"
            continue
        with refusal("format", str(file)) as caught:
            open_tracks(*files, segments=folder / "lines.nc", **words)
        assert f"{FIRST} frames too early" in str(caught.value)


def test_a_corrected_part_without_a_node_is_refused(part):
    tracks = opened(part, first_frame=70, last_frame=80)
    with refusal("too-few", "movie.mkv") as caught:
        corrected_profile(tracks)
    assert "must show whiskers in frames 70 to 80" in str(caught.value)


def test_what_was_remarked_of_the_movie_is_kept(tracked):
    after = corrected_profile(opened(tracked, movie_remarks='["mpeg4 may have altered the grey levels"]'))
    assert json.loads(after.attrs["remarks"])[-1] == "mpeg4 may have altered the grey levels"
    assert "movie_remarks" in after.attrs
    assert "movie_remarks" not in corrected_profile(opened(tracked)).attrs


def test_an_edit_changes_what_it_is_about(tracked):
    tracks = opened(tracked)
    named = tracks.correction.named
    line = int(np.flatnonzero(named.whisker == 2)[10])
    tracks.correction.apply(Edit(do="delete", at=tracks.correction.point_on(line)))
    now = tracks.correction.named
    assert now.gone[line]
    others = ~now.gone
    assert (now.whisker == named.whisker)[others].mean() > 0.9


@pytest.mark.parametrize("share", np.arange(0.1, 0.95, 0.1).round(1))
def test_a_mark_that_says_what_is_known_changes_nothing_far_away(tracked, share):
    """The linker, when it is asked anew, would have other names where it disagrees with what six linkings agreed on."""
    correction = opened(tracked).correction
    before, frame = correction.named.whisker, correction.lying.frame
    named = np.flatnonzero(before >= 0)
    line = int(named[int(share * named.size)])
    correction.apply(Edit(do="mark", at=correction.point_on(line), whisker=int(before[line])))
    changed = np.flatnonzero(correction.named.whisker != before)
    assert (np.abs(frame[changed] - frame[line]) <= 15).all()


def test_whiskers_have_the_numbers_of_the_profile(tracked):
    tracks, said = opened(tracked), []
    words = {"tell": said.append, "progress": lambda *_: None, "edits": tracked / "no.json"}
    open_tracks(tracked / "profile.nc", tracked / "movie.mkv", segments=tracked / "lines.nc", **words)
    assert said == ["whisker 0 is C2"]
    kept, whiskers = json.loads(tracks.profile.attrs["identities"]), tracks.correction.linking.whiskers
    numbers = profile_numbers(tracks.profile, tracks.numbers, whiskers + 1)  # and one that the profile does not keep
    assert sorted(numbers) == list(range(whiskers + 1))
    assert numbers[tracks.numbers[kept]].tolist() == list(range(len(kept)))
    foreign = tracks.profile.assign_attrs(identity_from="WHISK")
    assert profile_numbers(foreign, tracks.numbers, 4).tolist() == [0, 1, 2, 3]
