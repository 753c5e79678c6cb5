"""Profile, lines and movie that do not belong together are refused before anything is written."""

import json

import numpy as np
import pytest
import tifffile
from corrected_pad import make_pad
from refusals import refusal

from vibrissa.netcdf import load, save
from vibrissa.video.correct.corrected_profile import corrected_profile
from vibrissa.video.correct.opening import open_tracks
from vibrissa.video.io.movie import read_blocks, write_movie

FRAMES = 40


@pytest.fixture(scope="module")
def pad(tmp_path_factory):
    return make_pad(tmp_path_factory.mktemp("opened"), FRAMES)


def frames_of(movie):
    return np.concatenate(list(read_blocks(movie)))


def opened(pad, said=None, **other):
    files = {"profile": pad.profile, "movie": pad.movie, "segments": pad.segments} | other
    tell = (lambda text: None) if said is None else said.append
    return open_tracks(**files, edits=pad.profile.with_name("none.json"), tell=tell, progress=lambda *_: None)


def test_a_profile_that_names_no_lines_is_refused_before_lines_are_sought(pad, tmp_path):
    """Keypoints of another program: lines found anew are other whiskers."""
    before = load(pad.profile)
    del before.attrs["identity_from"], before.attrs["identities"]
    foreign = tmp_path / "keypoints.nc"
    save(before.assign_attrs(format="DeepLabCut"), foreign)
    with refusal("conflict", str(foreign)) as caught:
        opened(pad, profile=foreign, segments=None)
    assert caught.value.rule == "must be linked from lines: whiskers of lines that are found now are other ones"
    assert caught.value.value == "whiskers of DeepLabCut"
    first = f"track it first: vibrissa track {pad.movie} --tracking link --segments lines.nc --out profile.nc"
    assert caught.value.remedy == f"{first}; or give the lines by `segments`"
    assert list(tmp_path.iterdir()) == [foreign]
    assert opened(pad, profile=foreign).correction.named.whiskers >= 6  # its lines are given


def test_a_movie_of_another_length_is_refused(pad, tmp_path):
    longer, shorter = tmp_path / "longer.npy", tmp_path / "shorter.npy"
    frames = frames_of(pad.movie)
    np.save(longer, np.concatenate([frames, frames[:1]]))
    np.save(shorter, frames[:-1])
    for movie, count in ((longer, FRAMES + 1), (shorter, FRAMES - 1)):
        with refusal("conflict", str(movie)) as caught:
            opened(pad, movie=movie)
        assert str(caught.value).endswith(
            f"must be the movie of {pad.profile}, {FRAMES} frames, got {count}; give the movie that was tracked"
        )
    part = tmp_path / "part.nc"
    save(load(pad.profile).assign_attrs(first_frame=0, last_frame=FRAMES - 1), part)
    opened(pad, profile=part, movie=longer)  # a part says nothing of what follows it
    with refusal("conflict", str(shorter)):
        opened(pad, profile=part, movie=shorter)


def test_a_movie_of_another_name_is_remarked(pad, tmp_path):
    named, said = tmp_path / "named.nc", []
    save(load(pad.profile).assign_attrs(movie="pad.mkv", movie_frames=FRAMES), named)
    opened(pad, said, profile=named)
    assert said == []
    other = tmp_path / "other.mkv"
    write_movie(other, [frames_of(pad.movie)])
    opened(pad, said, profile=named, movie=other)
    assert said == [f"{named} was tracked in pad.mkv, not in other.mkv: is that the same movie?"]
    longer = tmp_path / "pad.npy"  # a format that states its number of frames
    np.save(longer, np.concatenate([frames_of(pad.movie)] * 2))
    with refusal("conflict", str(longer), str(2 * FRAMES)):
        opened(pad, profile=named, movie=longer)


def test_lines_after_missing_frames_are_of_the_movie(pad, tmp_path):
    """37 pictures of 40 frames, of which the profile counts all."""
    images, kept = tmp_path / "images", tmp_path / "kept.nc"
    images.mkdir()
    for number, frame in enumerate(frames_of(pad.movie)):
        if number not in (20, 21, 22):
            tifffile.imwrite(images / f"{number:03d}.tif", frame)
    save(load(pad.profile).assign_attrs(drop_frames="nan", movie="images", movie_frames=FRAMES - 3), kept)
    tracks = opened(pad, profile=kept, movie=images)
    assert tracks.movie.frames == FRAMES
    corrected = corrected_profile(tracks)  # without an edit
    shown = np.isfinite(corrected.x.values).any(axis=(0, 2))
    np.testing.assert_array_equal(np.flatnonzero(~shown), [20, 21, 22])
    assert all([20, 22, "not in the movie"] in runs for runs in json.loads(corrected.attrs["lost"]))
    assert corrected.attrs["missing_frames"] == 3
    save(load(pad.profile).assign_attrs(movie="images", movie_frames=FRAMES - 3), kept)
    with refusal("conflict", "segments"):
        opened(pad, profile=kept, movie=images)
