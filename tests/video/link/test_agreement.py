"""What several linkings say of one movie: names are matched, and the line gets the name on which most agree."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from simulated_segments import Pad, score, simulate

from vibrissa.video.link.agreed_names import Others, agreed
from vibrissa.video.link.agreement import CutLinking, PointNames, best_and_others, renamed
from vibrissa.video.link.certainty import agreement
from vibrissa.video.link.identities import ABSENT, SHARED, TORN, UNSURE, Names
from vibrissa.video.link.names_by_base import RIGHT
from vibrissa.video.link.whisker_linking import link_segments, linkings

NOBODY = 2  # of two whiskers


def _names(whisker, sure, main, also=None, reason=None):
    main = np.array(main)
    chance = np.where(main >= 0, np.array(sure)[main], np.nan)
    reason = np.where(main >= 0, 0, ABSENT) if reason is None else np.array(reason)
    also = np.full(len(whisker), -1) if also is None else np.array(also)
    return Names(np.array(whisker), also, np.array(sure), main, chance, reason, np.zeros((len(whisker), 6)))


def _lines(frame, stretch=None, reach=None):
    """Frames, plain stretches (each line alone if none are given) and reach of lines (one after the other likewise)."""
    every = np.arange(len(frame))
    reach = np.stack([every, every + 1.0], axis=1) if reach is None else np.array(reach)
    stretch = np.full(len(frame), -1) if stretch is None else np.array(stretch)
    return SimpleNamespace(frame=np.array(frame), tracklet=stretch, lines=SimpleNamespace(reach=reach))


def _agreed(names, lines, *others, votes=None):
    """Agreed names when others say a whisker for each line, 0.9 sure, or nobody."""
    sums = np.zeros((len(names.whisker), 3)) if votes is None else votes
    for one in others:
        sums[np.arange(len(one)), one] += 0.9
    count = len(others) if votes is None else 1
    return agreed(names, lines, Others(sums, count))


def test_numbers_of_another_linking_are_those_with_most_points_in_common():
    mine = PointNames(np.array([0, 0, 0, 1, 1, -1, 2]), np.full(7, 0.9))
    other = PointNames(np.array([3, 3, 1, 1, 1, 1, 0]), np.full(7, 0.8))
    found = renamed(other, mine, 4, 3)
    np.testing.assert_array_equal(found.whisker, [0, 0, 1, 1, 1, 1, 2])
    np.testing.assert_array_equal(found.sure, other.sure)
    # a whisker that only the other one has is nobody here
    assert (
        renamed(PointNames(np.array([0, 1]), np.ones(2)), PointNames(np.array([0, -1]), np.ones(2)), 2, 1).whisker
        == [0, -1]
    ).all()


def test_two_that_agree_overrule_the_third():
    names, frame = _names([0, 1, 0], [0.9, 0.9, 0.9], [[0, 2], [1, -1]]), _lines([0, 0, 1])
    found = _agreed(names, frame, [0, 1, 1], [0, 1, 1])
    np.testing.assert_array_equal(found.whisker, [0, 1, 1])
    np.testing.assert_array_equal(found.main, [[0, -1], [1, 2]])
    np.testing.assert_allclose(found.sure, agreement(np.array([0.9, 0.9, 0.6])))
    assert found.reason[0, 1] == UNSURE  # one says that it is there
    assert np.isnan(found.chance[0, 1])
    np.testing.assert_array_equal(found.chance[1], found.sure[[1, 2]])


def test_a_line_that_two_leave_without_a_name_has_none():
    names, frame = _names([0, -1], [0.7, 0.0], [[0]] * 2), _lines([0, 0])
    found = _agreed(names, frame, [NOBODY, 1], [NOBODY, 1])
    np.testing.assert_array_equal(found.whisker, [-1, 1])
    np.testing.assert_array_equal(found.main, [[-1], [1]])


def test_the_piece_that_stood_for_a_whisker_does_so_as_long_as_it_keeps_its_name():
    names, frame = _names([0, 0], [0.9, 0.9], [[0], [-1]]), _lines([0, 0])
    np.testing.assert_array_equal(_agreed(names, frame, [0, 0]).main, [[0], [-1]])
    np.testing.assert_array_equal(_agreed(names, frame, [1, 0], [1, 0]).main, [[1], [0]])


def test_a_line_in_a_plain_stretch_has_a_third_of_its_name_from_the_stretch():
    """Of three lines of one stretch the middle one is the other whisker's, as each linking says, but less surely."""
    names = _names([0, 1, 0], [0.9, 0.5, 0.9], [[0, -1, 2], [-1, 1, -1]])
    votes = np.array([[0.9, 0, 0], [0, 0.5, 0], [0.9, 0, 0]])
    same = _lines([0, 1, 2], stretch=[5, 5, 5])
    np.testing.assert_array_equal(_agreed(names, _lines([0, 1, 2]), votes=votes).whisker, [0, 1, 0])
    found = _agreed(names, same, votes=votes)
    np.testing.assert_array_equal(found.whisker, [0, 1, 0])
    np.testing.assert_allclose(found.sure[1], agreement(np.array([2 / 3 * 0.5 + 1 / 3 * 0.5 / 3]))[0])
    least = names._replace(sure=np.array([0.9, 0.0, 0.9]))
    np.testing.assert_array_equal(_agreed(least, same, votes=votes).whisker, [0, 0, 0])


def test_of_two_lines_side_by_side_the_likelier_has_the_name_and_of_two_ends_both():
    names = _names([0, 0], [0.9, 0.8], [[1], [-1]])
    beside = _agreed(names, _lines([0, 0], reach=[[0.0, 1.0], [0.5, 2.0]]))
    np.testing.assert_array_equal(beside.whisker, [0, -1])
    np.testing.assert_array_equal(beside.main, [[0], [-1]])
    ends = _agreed(names, _lines([0, 0], reach=[[0.0, 1.0], [0.9, 2.0]]))
    np.testing.assert_array_equal(ends.whisker, [0, 0])
    names = _names([0, 0], [0.9, 0.8], [[0, 1], [-1, -1]])
    others = _agreed(names, _lines([0, 1], reach=[[0.0, 1.0], [0.5, 2.0]]))
    np.testing.assert_array_equal(others.whisker, [0, 0])


def test_a_pad_without_whiskers_stays_so():
    none = Names(*np.full((2, 3), -1), np.zeros(3), *(np.zeros((0, 2)) for _ in range(3)), np.zeros((3, 6)))
    assert agreed(none, _lines([0, 0, 1]), Others(np.full((3, 1), 3.0), 5)) is none
    nobody = PointNames(np.full(3, -1), np.zeros(3))
    assert (renamed(PointNames(np.array([0, 1, -1]), np.ones(3)), nobody, 2, 0).whisker == -1).all()
    assert (renamed(nobody, PointNames(np.array([0, 1, -1]), np.ones(3)), 0, 2).whisker == -1).all()


def test_reasons_and_shared_lines_follow_the_names():
    frame = _lines([0, 1])
    names = _names([0, 0], [0.9, 0.9], [[0, 1], [-1, -1]], also=[1, 1], reason=[[TORN, 0], [SHARED, SHARED]])
    found = _agreed(names, frame, [0, 1], [0, 1])
    np.testing.assert_array_equal(found.also, [1, -1])
    np.testing.assert_array_equal(found.reason, [[0, UNSURE], [SHARED, 0 if found.sure[1] >= 0.7 else UNSURE]])


def test_of_linkings_that_disagree_the_common_names_are_about_as_good_as_the_best_ones():
    """Four pads whose whiskers swing further than they are apart, three starts each: agreement does no harm."""
    pad = Pad(whiskers=8, frames=200, spread=50.0, amplitude=20.0, missing=0.2, carried=0.4, drift=3.0, opening=0.3)
    scores = np.array([_before_and_after(pad, seed) for seed in (3, 4, 5, 6)])
    (followed, wrong), (followed_after, wrong_after) = scores.mean(axis=0)
    assert wrong_after <= wrong + 0.005
    assert followed_after >= followed - 0.015


def _before_and_after(pad, seed):
    """Share followed and share wrong of the best linking alone, and of the names on which all agree."""
    segments, truth = simulate([pad], seed)
    each = [CutLinking(one, np.arange(segments.sizes["point"])) for one in linkings(segments)]
    alone = [replace(one.linking) for one in each]
    best = best_and_others(each, segments.sizes["point"])
    two = (one.identity().segment_whisker.values for one in (alone[best], each[best].linking))
    return [(one.followed, one.wrong) for one in (score(segments, truth, names) for names in two)]


def test_one_linking_alone_says_what_it_said():
    segments, _ = simulate([Pad(whiskers=4, frames=60)], 1)
    linking = link_segments(segments)
    before = linking.identity()
    best_and_others([CutLinking(linking, np.arange(segments.sizes["point"]))], segments.sizes["point"])
    assert linking.others.linkings == 0
    after, named = linking.identity(), before.segment_whisker.values >= 0
    np.testing.assert_array_equal(after.segment_whisker.values[named], before.segment_whisker.values[named])
    new = (after.segment_whisker.values >= 0) & ~named
    assert (after.segment_probability.values[new] == RIGHT).all()  # by where they begin, see test_still_and_bent.py
