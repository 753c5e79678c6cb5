"""Seeds that the program found itself: bad ones are left out with a remark; given ones are refused."""

import json

import numpy as np
import pytest
from drawn_lines import DrawnLine, draw
from refusals import refusal

from vibrissa.video.tracking import Calibration, track

CALIBRATION = Calibration(frame_rate=500.0, pixel_size=1e-4)


@pytest.fixture(scope="module")
def movie():
    """Two lines that hold still, at rows 43.5 and 83.5 in the middle."""
    rng = np.random.default_rng(2)
    lines = [DrawnLine(0.0, -20.0, 55.0), DrawnLine(0.0, 20.0, 55.0)]
    return np.stack([draw(lines, rng=rng) for _ in range(10)])


def tracked(movie, seeds, **how):
    return track([movie], seeds=seeds, calibration=CALIBRATION, **how)


def test_a_seed_on_nothing_and_one_on_a_line_that_is_followed_are_left_out(movie):
    profile = tracked(movie, [(60, 44), (60, 110), (60, 84), (30, 84)], own_seeds=True)
    remarks = json.loads(profile.attrs["remarks"])
    assert profile.sizes["whisker"] == 2
    assert len(remarks) == 2
    assert remarks[0].startswith("the seed at 60,110 is left out: no whisker")
    assert "on another whisker's line" in remarks[1]
    np.testing.assert_allclose(np.nanmean(profile.y, axis=(1, 2)) / 1e-4, [43.5, 83.5], atol=0.1)


def test_good_seeds_are_followed_as_if_they_were_given(movie):
    seeds = [(60, 44), (60, 84)]
    own, given = tracked(movie, seeds, own_seeds=True), tracked(movie, seeds)
    assert own.identical(given)


def test_places_in_remarks_are_those_of_the_whole_image(movie):
    profile = tracked(movie, [(60, 44), (100, 115)], own_seeds=True, region=(20, 30, 127, 127))
    assert "the seed at 100,115 is left out" in profile.attrs["remarks"]


def test_a_bad_seed_that_is_given_and_no_good_seed_at_all_are_refused(movie):
    with refusal("range", "seed"):
        tracked(movie, [(60, 44), (60, 110)])
    with refusal("too-few", "whiskers"):
        tracked(movie, [(60, 110)], own_seeds=True)
