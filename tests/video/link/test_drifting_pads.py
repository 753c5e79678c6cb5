"""Pads whose fan opens and whose whiskers drift: lever, drift, joined tracklets and torn links against known truth."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_segments import Pad, main_segment, score, simulate

from vibrissa.video.link.chains.swap_moves import _at_base
from vibrissa.video.link.chains.swaps import Wandering, swap_of
from vibrissa.video.link.chains.torn_links import torn_links
from vibrissa.video.link.chains.whisker_models import prior_spread
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.turning import learnt_lever
from vibrissa.video.link.whisker_linking import link_segments

FIELD = {
    "whiskers": 12,
    "frames": 300,
    "spread": 75.0,
    "opening": 0.35,
    "amplitude": 15.0,
    "missing": 0.2,
    "drift": 4.0,
    "carried": 0.4,
}


def _lines(place):
    count = len(place)
    reach = np.tile([-1.0, 1.0], (count, 1))
    covariance = np.tile(0.01 * np.eye(3), (count, 1, 1))
    return Lines(np.zeros(count, int), np.zeros(count, bool), place, covariance, reach, np.zeros((count, 2)))


def test_the_lever_is_learnt_from_plain_links():
    rng = np.random.default_rng(3)
    lever, frames, count = np.array([0.8, 1.0, 1.1]), 200, 6
    swing = np.cumsum(rng.normal(0, 1.5, frames))
    place = np.concatenate([10.0 * k + swing[:, None] * lever for k in range(count)])
    place += rng.normal(0, 0.1, place.shape)
    frame, name = np.tile(np.arange(frames), count), np.repeat(np.arange(count), frames)
    found = learnt_lever(frame, name, _lines(place), np.array([0.35, 1.0, 1.2]))
    # the prior counts for 300 of 6 × 198 × 2 × 1.5² = 5,300 °²
    np.testing.assert_allclose(found, lever, atol=0.03)
    unknown = learnt_lever(frame, np.full(frame.size, -1), _lines(place), np.array([0.35, 1.0, 1.2]))
    np.testing.assert_allclose(unknown, [0.35, 1.0, 1.2])


def test_a_name_that_leaves_a_line_is_counted_for_both_whiskers():
    frame = np.tile(np.arange(10), 3)
    tracklet = np.repeat([0, 1, 2], 10)
    whisker = np.repeat([0, 1, 2], 10)
    np.testing.assert_array_equal(torn_links(frame, tracklet, whisker, 3), 0)
    whisker[5:10] = 1
    whisker[12] = 2  # one line alone is an accident
    # whisker 0 has 5 lines left, whisker 1 fourteen
    np.testing.assert_allclose(torn_links(frame, tracklet, whisker, 3), [1 / 5, 1 / 14, 0])


def test_a_swap_that_a_drift_explains_is_not_made():
    """Two whiskers drift past one another: the difference changes sign, no meeting is a swap."""
    rng = np.random.default_rng(5)
    frame = np.arange(400)
    drift = 3.0 * np.cos(np.pi * frame / 400)[:, None]
    one, other = drift + rng.normal(0, 0.3, (400, 3)), rng.normal(0, 0.3, (400, 3))
    alike = np.zeros((400, 2))
    small, phase, plain = np.diag([1.0, 0.5, 1.0]), np.zeros((400, 2)), np.zeros(399)
    error = np.broadcast_to(0.09 * np.eye(3), (2, 400, 3, 3))
    stiff = swap_of(frame, one, other, alike, Wandering(small, np.zeros((3, 3)), error, 0.9, True), phase, plain)
    loose = swap_of(frame, one, other, alike, Wandering(small, 9 * np.eye(3), error, 0.9, True), phase, plain)
    assert stiff is not None
    assert loose is not None
    assert np.ptp(stiff.chance) > 0.9
    unlike = np.minimum(loose.chance, 1 - loose.chance)
    assert unlike[[0, -1]].max() > np.minimum(stiff.chance, 1 - stiff.chance)[[0, -1]].max()


def test_bases_that_are_exchanged_for_long_are_no_swap_where_whiskers_stray_at_their_bases_alone():
    """Two whiskers 3° apart meet twice; between, each line begins on the other one's base, 5° away."""
    rng = np.random.default_rng(7)
    frame = np.arange(200)
    apart = np.tile([5.0, 3.0, 3.0], (200, 1))
    apart[[60, 61, 62, 120, 121, 122]] = 0.0
    apart[61:121, 0] *= -1
    one, other = apart + rng.normal(0, 0.3, (200, 3)), rng.normal(0, 0.3, (200, 3))
    usual = prior_spread(np.array([0.8, 1.0, 1.1]))
    error = np.broadcast_to(0.04 * np.eye(3), (2, 200, 3, 3))
    learnt = usual + np.diag([8.0, 0.0, 0.0])

    def swaps(spread):
        known = Wandering(spread, np.zeros((3, 3)), error, 0.85, True)
        found = swap_of(frame, one, other, np.zeros((200, 2)), known, np.zeros((200, 2)), np.zeros(199))
        return found.chance[70:110].mean()

    assert swaps(usual) > 0.9
    assert swaps(usual + np.diag([_at_base(learnt, usual), 0.0, 0.0])) < 0.1


def test_a_whisker_that_strays_as_much_everywhere_strays_no_more_at_its_base():
    usual = prior_spread(np.array([0.8, 1.0, 1.1]))
    assert _at_base(4 * usual, usual) == pytest.approx(0.0)
    assert _at_base(usual + np.diag([2.0, 0, 0]), usual) == pytest.approx(2.0)
    assert _at_base(usual / 2, usual) == 0.0


def test_whiskers_that_drift_as_far_as_they_are_apart_keep_their_names():
    """Twelve whiskers; still places and a fixed lever gave 21, and 35 % of the lines the wrong name."""
    segments, truth = simulate([Pad(**FIELD)], 13)
    linking = link_segments(segments)
    assert linking.lever(0)[0] > 0.7
    found = score(segments, truth, linking.identity().segment_whisker.values)
    assert found.found <= 14
    assert found.followed > 0.9
    assert found.wrong < 0.1


def test_what_is_called_sure_is_right_on_drifting_pads():
    """Of the lines of two further pads said to be at least 90 % sure, 95 % are right."""
    sure, right = [], []
    for seed in (21, 22):
        segments, truth = simulate([Pad(**FIELD)], seed)
        linking = link_segments(segments)
        identity = linking.identity()
        main = main_segment(segments, identity.segment_whisker.values, linking.whiskers)
        for mine in (row[row >= 0] for row in main):
            real = truth.segment[mine]
            if (real >= 0).any():
                sure.append(identity.segment_probability.values[mine])
                right.append(real == np.bincount(real[real >= 0]).argmax())
    chance, hit = np.concatenate(sure), np.concatenate(right)
    assert (chance >= 0.9).sum() > 1000
    assert hit[chance >= 0.9].mean() > 0.95
