"""Whiskers found among the lines without a name: one that all linkings left out, and none that is known already."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_segments import Pad, simulate

from vibrissa.video.link import whisker_linking
from vibrissa.video.link.agreed_names import Others, said_by
from vibrissa.video.link.certainty import agreement, mean_of_agreement
from vibrissa.video.link.chains.superfluous import take_away
from vibrissa.video.link.further_whiskers import name_further_whiskers
from vibrissa.video.link.identities import names_of
from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.pad.phase import ALIKE
from vibrissa.video.link.starts.whisker_discovery import best_groups
from vibrissa.video.link.whisker_linking import link_segments

OTHERS = 5  # linkings that say what the one says


def _asked(linking, nobody=()):
    """Others that agree with a linking of one pad, but for some lines, which they leave to nobody."""
    (solution,) = linking.solutions
    names = names_of(solution, solution.lever)
    votes = OTHERS * said_by(names)
    votes[nobody] = 0.0
    votes[nobody, -1] = OTHERS
    linking.others = Others(votes, OTHERS)
    return linking.identity().segment_whisker.values


@pytest.fixture(scope="module")
def field():
    """Lines of eight whiskers and who they are."""
    return simulate([Pad(whiskers=8, frames=240, own=1.0)], 4)


def test_a_whisker_that_all_linkings_left_out_is_found(field):
    segments, truth = field
    linking = link_segments(segments)
    gone = linking.whiskers // 2
    lines = linking.identity().segment_whisker.values == gone
    take_away(linking.solutions[0], gone)
    before = _asked(linking)
    assert (before[lines] < 0).mean() > 0.9
    name_further_whiskers(linking)
    identity = linking.identity()
    after = identity.segment_whisker.values
    assert linking.whiskers == before.max() + 2
    # in the order of their places: it has its number again, and later ones have theirs
    np.testing.assert_array_equal(after[before >= 0], (before + (before >= gone))[before >= 0])
    new = after == gone
    assert (after[lines] == gone).mean() > 0.9
    owner = np.bincount(truth.segment[new & (truth.segment >= 0)]).argmax()
    assert (truth.segment[new] == owner).mean() > 0.95
    sure = identity.segment_probability.values[new]
    assert 0.5 < sure.mean() < 1


@pytest.mark.parametrize(("length", "found"), [(0.7, True), (0.4, False)])
def test_short_lines_make_a_whisker_if_they_are_often_seen_and_not_as_short_as_hairs(field, length, found):
    linking = link_segments(field[0])
    (solution,), gone = linking.solutions, linking.whiskers // 2
    lines, reach = linking.identity().segment_whisker.values == gone, solution.lines.reach.copy()
    reach[lines, 1] = np.minimum(reach[lines, 1], reach[lines, 0] + length)
    solution.lines = solution.lines._replace(reach=reach)
    take_away(solution, gone)
    before = _asked(linking)
    name_further_whiskers(linking)
    assert linking.whiskers == before.max() + 1 + found


def test_where_all_whiskers_are_known_nothing_changes(field):
    linking = link_segments(field[0])
    before, count = _asked(linking), linking.whiskers
    sure = linking.identity().segment_probability.values
    name_further_whiskers(linking)
    assert linking.whiskers == count
    np.testing.assert_array_equal(linking.identity().segment_whisker.values, before)
    np.testing.assert_array_equal(linking.identity().segment_probability.values, sure)


def test_lines_that_a_known_whisker_has_lost_make_no_second_one(field, monkeypatch):
    monkeypatch.setattr(whisker_linking, "named_in_gaps", lambda names, _: names)  # lest it has them again
    linking = link_segments(field[0])
    whisker = linking.identity().segment_whisker.values
    frame = field[0].segment_frame.values
    lost = np.flatnonzero((whisker == 3) & (frame >= 100))
    before, count = _asked(linking, lost), linking.whiskers
    assert (before[lost] < 0).all()
    assert lost.size > 100
    name_further_whiskers(linking)
    assert linking.whiskers == count
    np.testing.assert_array_equal(linking.identity().segment_whisker.values, before)


def test_a_whisker_that_swings_twice_as_far_is_one_group():
    rng = np.random.default_rng(8)
    frames, lever = 300, np.array([0.8, 1.0, 1.1])
    phase = np.stack([15 * np.sin(np.arange(frames) / 6), np.zeros(frames)], axis=1)
    frame, name = np.tile(np.arange(frames), 2), np.repeat(np.arange(2), frames)
    place = np.array([-20.0, 20.0])[name, None] + np.array([1.0, 2.0])[name, None] * phase[frame, :1] * lever
    place += rng.normal(0, 0.2, place.shape)
    count = frame.size
    lines = Lines(
        np.zeros(count, int), np.zeros(count, bool), place, np.tile(0.04 * np.eye(3), (count, 1, 1)),
        np.tile([-1.0, 1.0], (count, 1)), np.zeros((count, 2)),
    )  # fmt: skip
    stretch = np.unique(np.stack([name, frame // 10]), axis=1, return_inverse=True)[1].ravel()  # half a whisk each
    models = best_groups(frame, stretch, lines, phase[frame], lever, ALIKE, 60)
    assert len(models) == 2
    models = sorted(models, key=lambda one: one.place[1])
    np.testing.assert_allclose([one.place[1] for one in models], [-20, 20], atol=0.5)
    np.testing.assert_allclose([one.gain[0, 1] for one in models], [1, 2])


def test_the_mean_of_agreement_is_its_inverse():
    sure = np.array([0.05, 0.5, 0.8, 0.99])
    np.testing.assert_allclose(agreement(mean_of_agreement(sure)), sure, rtol=1e-9)
