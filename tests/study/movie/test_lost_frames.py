"""Frames that were lost leave out envelopes and resonances, and the remark names the part that has them."""

from types import SimpleNamespace

import numpy as np

from vibrissa.quantities import dataset
from vibrissa.study.movie.backward import analyse
from vibrissa.study.sweeps.recorded_sweeps import since_start
from vibrissa.whisker import Whisker

WHISKER, ARC = Whisker(length=0.04, cone_angle=1.5e-3), np.linspace(0.0, 0.027, 60)
FRAMES = 3000


def profile_without(lost, frames=FRAMES, **attrs):
    """A whisker that trembles, not seen in some frames."""
    motion = np.random.default_rng(0).normal(size=(frames, 1)) * 1e-5 * np.sin(np.pi * ARC / 0.03)
    x, y = np.tile(ARC, (frames, 1)), motion + ARC**2 / 0.1
    x[lost], y[lost] = np.nan, np.nan
    known = {"frame": "substrate", "frame_rate": 2000.0, **attrs}
    return dataset(known, time=np.arange(frames) / 2000, arc_length=ARC, x=x, y=y)


def left_out(profile):
    return analyse(profile, WHISKER, 0.29)["modal"].attrs["left_out"]


def test_the_longest_stretch_without_a_loss_is_named_and_has_envelopes():
    profile = profile_without([1000], movie="a.mkv")
    modal = analyse(profile, WHISKER, 0.29)["modal"]
    assert "envelope" not in modal
    stretch = "the longest stretch without a loss is frames 1001 to 2999: track it by itself (start 1001, stop 3000)"
    assert modal.attrs["left_out"] == f"envelopes and resonances: 1 of 3000 frames were lost; {stretch}"
    part = analyse(profile.isel(time=slice(1001, 3000)), WHISKER, 0.29)
    assert np.isfinite(part["modal"].envelope).all()
    assert "is frames 1001 to 1499:" in left_out(profile.isel(time=slice(900, 1500)))


def test_a_track_without_a_movie_is_not_to_be_tracked_again():
    assert left_out(profile_without([1000])).endswith("the longest stretch without a loss is frames 1001 to 2999")


def test_frames_of_a_sweep_are_numbered_from_the_first_of_its_movie():
    """Time 0 is the contact's meeting with the texture, half a second after the movie's first frame."""
    sweep = since_start(profile_without([100], 500, movie="a.mkv"), SimpleNamespace(start=0.5))
    np.testing.assert_allclose(sweep.time[[0, -1]], [-0.5, -0.2505])
    assert left_out(sweep).endswith("the longest stretch without a loss is frames 101 to 499")


def test_a_stretch_is_named_as_too_short_exactly_where_no_resonance_can_be_fitted():
    tenth = left_out(profile_without(np.arange(0, FRAMES, 10), movie="a.mkv"))
    assert tenth.endswith("the longest stretch without a loss is frames 1 to 9, too short for the fits")
    short = 0
    for frames in range(20, 100):
        profile = profile_without([frames], FRAMES, movie="a.mkv").isel(time=slice(0, frames + 1))
        part = analyse(profile.isel(time=slice(0, frames)), WHISKER, 0.29)
        none_fits = part["resonance_white"].attrs.get("left_out", "").count("at least 20 bins") == 3
        assert left_out(profile).endswith("too short for the fits") == none_fits
        short += none_fits
    assert 0 < short < 80  # both are there


def test_a_stretch_in_which_all_resonances_fold_is_not_called_too_short():
    """Every fourth frame: the lowest resonance lies above half of 500 Hz."""
    slow = profile_without([1000], movie="a.mkv").isel(time=slice(0, FRAMES, 4))
    slow = slow.assign_attrs(frame_rate=500.0)
    whisker = Whisker(length=0.018, cone_angle=1.5e-3)
    modal = analyse(slow, whisker, 0.29)["modal"]
    assert modal.expected_frequency[0] > 250
    told = modal.attrs["left_out"]
    assert "frames 251 to 749; mode 1 is expected at" in told
    assert told.endswith("record faster")
