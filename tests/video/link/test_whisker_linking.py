"""Linking held against simulated pads whose truth is known, and against a plain linking by the nearest direction."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from simulated_segments import Pad, main_segment, nearest_angle, score, simulate

from vibrissa.video.link.identities import REASONS
from vibrissa.video.link.whisker_linking import link_segments, linkings

PADS = {
    "four": [Pad(whiskers=4, frames=250)],
    "twelve": [Pad(frames=250)],
    "up": [Pad(whiskers=10, frames=250, direction=-90.0, centre=(320.0, 330.0), spread=120.0)],
    "two sides": [
        Pad(whiskers=6, frames=250, centre=(350.0, 240.0)),
        Pad(whiskers=6, frames=250, centre=(290.0, 240.0), direction=180.0, mirror=True),
    ],
}


@pytest.fixture(scope="module")
def pads():
    return {name: simulate(pad, 1) for name, pad in PADS.items()}


@pytest.fixture(scope="module")
def linked(pads):
    return {name: link_segments(segments) for name, (segments, _) in pads.items()}


@pytest.mark.parametrize("name", PADS)
def test_whiskers_are_counted_and_keep_their_names_though_they_swing_further_than_they_are_apart(pads, linked, name):
    segments, truth = pads[name]
    found = score(segments, truth, linked[name].identity().segment_whisker.values)
    assert found.found == len(truth.visible)
    assert found.followed > 0.95
    assert found.wrong < 0.01


def test_the_nearest_direction_loses_the_names_that_linking_keeps(pads, linked):
    segments, truth = pads["twelve"]
    plain = score(segments, truth, nearest_angle(segments, len(truth.visible)))
    found = score(segments, truth, linked["twelve"].identity().segment_whisker.values)
    assert found.wrong < 0.05 * plain.wrong


def test_names_do_not_depend_on_where_in_the_image_the_pad_is(pads, linked):
    """A movie turned by a quarter gives the same names: no side of the image is special."""
    segments, truth = pads["twelve"]
    turned = segments.copy()
    turned["column"], turned["row"] = segments["row"].copy(), 639 - segments["column"]
    there = score(turned, truth, link_segments(turned).identity().segment_whisker.values)
    assert there.wrong < 0.01
    assert there.followed > 0.95


def test_what_is_called_sure_is_right(pads, linked):
    """Of the lines with a probability of 95 % and more, 99 % are the whisker's; weights are those of harder movies."""
    sure, right = [], []
    for name, (segments, truth) in pads.items():
        identity = linked[name].identity()
        main = main_segment(segments, identity.segment_whisker.values, linked[name].whiskers)
        for k in range(len(main)):
            mine = main[k][main[k] >= 0]
            real = truth.segment[mine]
            sure.append(identity.segment_probability.values[mine])
            right.append(real == np.bincount(real[real >= 0]).argmax())
    chance, hit = np.concatenate(sure), np.concatenate(right)
    assert hit[chance >= 0.95].mean() > 0.99
    assert (chance >= 0.95).mean() > 0.5
    assert hit.mean() - 0.07 < chance.mean() < hit.mean()


def test_a_frame_without_a_line_is_lost_and_says_why(linked):
    identity = linked["four"].identity()
    lost = identity.lost_reason.values
    assert lost.shape == (4, 250)
    assert set(np.unique(lost)) <= set(range(len(REASONS)))
    assert np.isnan(identity.whisker_probability.values[identity.whisker_segment.values < 0]).all()
    # one in ten is missing by chance
    assert 0.05 < (lost == 1).mean() < 0.2


def test_of_three_linkings_that_is_kept_in_which_most_points_probably_have_the_right_name():
    segments, _ = simulate([Pad(whiskers=6, frames=120, broken=0.4)], 7)
    every = linkings(segments)
    lengths = []
    for one in every:
        identity = one.identity()
        points = np.diff(np.append(segments.segment_start, segments.sizes["point"]))
        named = identity.segment_whisker.values >= 0
        lengths.append(((2 * identity.segment_probability.values - 1) * points)[named].sum())
    np.testing.assert_allclose([one.right_length for one in every], lengths)
    assert len({round(length) for length in lengths}) > 1
    best = every[int(np.argmax(lengths))].identity()
    xr.testing.assert_equal(link_segments(segments).identity(), best)


@pytest.mark.parametrize("frames", [1, 2, 7])
def test_in_a_movie_of_too_few_frames_lines_are_nobodys(frames):
    segments, _ = simulate([Pad(whiskers=4, frames=frames)], 1)
    linking = link_segments(segments)
    assert linking.whiskers == 0
    assert (linking.identity().segment_whisker.values == -1).all()
