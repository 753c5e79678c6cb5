"""What several linkings say of one movie: whiskers are those on which most agree, and how sure each line is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from simulated_segments import Pad, score, simulate

from vibrissa.video.link.agreed_names import Agreed, agreed
from vibrissa.video.link.agreement import CutLinking, common_linking
from vibrissa.video.link.certainty import agreement
from vibrissa.video.link.identities import ABSENT, SHARED, TORN, UNSURE, Names
from vibrissa.video.link.whisker_linking import link_segments, linkings


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


def _agreed(names, lines, whisker, said):
    """Names for what linkings say of two whiskers and nobody."""
    return agreed(names, lines, Agreed(np.array(whisker), np.array(said)))


def test_names_are_those_agreed_on_and_as_sure_as_the_mean_says():
    names, frame = _names([0, 1, 0], [0.9, 0.9, 0.9], [[0, 2], [1, -1]]), _lines([0, 0, 1])
    found = _agreed(names, frame, [0, 1, 1], [[0.9, 0.0, 0.1], [0.0, 0.8, 0.0], [0.3, 0.6, 0.0]])
    np.testing.assert_array_equal(found.whisker, [0, 1, 1])
    np.testing.assert_array_equal(found.main, [[0, -1], [1, 2]])
    np.testing.assert_allclose(found.sure, agreement(np.array([0.9, 0.8, 0.6])))
    assert found.reason[0, 1] == UNSURE  # some say that it is there
    assert np.isnan(found.chance[0, 1])
    np.testing.assert_array_equal(found.chance[1], found.sure[[1, 2]])


def test_a_line_that_is_nobodys_has_no_name():
    names, frame = _names([0, -1], [0.7, 0.0], [[0]] * 2), _lines([0, 0])
    found = _agreed(names, frame, [-1, 1], [[0.3, 0.0, 0.6], [0.0, 0.6, 0.2]])
    np.testing.assert_array_equal(found.whisker, [-1, 1])
    np.testing.assert_array_equal(found.main, [[-1], [1]])
    assert found.sure[0] == 0


def test_the_piece_that_stood_for_a_whisker_does_so_as_long_as_it_keeps_its_name():
    names, frame = _names([0, 0], [0.9, 0.9], [[0], [-1]]), _lines([0, 0])
    said = [[0.5, 0.5, 0.0]] * 2
    np.testing.assert_array_equal(_agreed(names, frame, [0, 0], said).main, [[0], [-1]])
    np.testing.assert_array_equal(_agreed(names, frame, [1, 0], said).main, [[1], [0]])


def test_a_line_in_a_plain_stretch_is_sure_by_a_third_from_the_stretch():
    names = _names([0, 0, 0], [0.9, 0.5, 0.9], [[0, 1, 2], [-1, -1, -1]])
    said = [[0.9, 0.0, 0.0], [0.3, 0.0, 0.0], [0.9, 0.0, 0.0]]
    found = _agreed(names, _lines([0, 1, 2], stretch=[5, 5, 5]), [0, 0, 0], said)
    np.testing.assert_allclose(found.sure[1], agreement(np.array([2 / 3 * 0.3 + 1 / 3 * 0.7]))[0])
    alone = _agreed(names, _lines([0, 1, 2]), [0, 0, 0], said)
    np.testing.assert_allclose(alone.sure, agreement(np.array([0.9, 0.3, 0.9])))


def test_of_two_lines_side_by_side_the_likelier_has_the_name_and_of_two_ends_both():
    names, said = _names([0, 0], [0.9, 0.8], [[1], [-1]]), [[0.9, 0.0, 0.0], [0.8, 0.0, 0.0]]
    beside = _agreed(names, _lines([0, 0], reach=[[0.0, 1.0], [0.5, 2.0]]), [0, 0], said)
    np.testing.assert_array_equal(beside.whisker, [0, -1])
    np.testing.assert_array_equal(beside.main, [[0], [-1]])
    ends = _agreed(names, _lines([0, 0], reach=[[0.0, 1.0], [0.9, 2.0]]), [0, 0], said)
    np.testing.assert_array_equal(ends.whisker, [0, 0])
    names = _names([0, 0], [0.9, 0.8], [[0, 1], [-1, -1]])
    others = _agreed(names, _lines([0, 1], reach=[[0.0, 1.0], [0.5, 2.0]]), [0, 0], said)
    np.testing.assert_array_equal(others.whisker, [0, 0])


def test_a_pad_without_whiskers_stays_so():
    none = Names(*np.full((2, 3), -1), np.zeros(3), *(np.zeros((0, 2)) for _ in range(3)), np.zeros((3, 6)))
    assert agreed(none, _lines([0, 0, 1]), Agreed(np.full(3, -1), np.ones((3, 1)))) is none


def test_reasons_and_shared_lines_follow_the_names():
    frame, said = _lines([0, 1]), [[0.9, 0.0, 0.0], [0.0, 0.3, 0.0]]
    names = _names([0, 0], [0.9, 0.9], [[0, 1], [-1, -1]], also=[1, 1], reason=[[TORN, 0], [SHARED, SHARED]])
    found = _agreed(names, frame, [0, 1], said)
    np.testing.assert_array_equal(found.also, [1, -1])
    np.testing.assert_array_equal(found.reason, [[0, ABSENT], [SHARED, 0 if found.sure[1] >= 0.7 else UNSURE]])


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
    best, found = common_linking(each, segments.sizes["point"])
    two = (one.identity().segment_whisker.values for one in (each[best].linking, found))
    return [(one.followed, one.wrong) for one in (score(segments, truth, names) for names in two)]


def test_an_exchange_of_names_in_one_of_three_linkings_is_outvoted():
    """Whatever numbers each gives its whiskers; the lines are the same in all."""
    segments, truth = simulate([Pad(whiskers=5, frames=120)], 2)
    each = [
        _renumbered(link_segments(segments), order) for order in ([0, 1, 2, 3, 4], [3, 0, 4, 1, 2], [4, 3, 2, 1, 0])
    ]
    assert each[0].linking.whiskers == 5
    each[1] = _exchanged(each[1], 1, 3, 60)
    _, found = common_linking(each, segments.sizes["point"])
    names = found.identity().segment_whisker.values
    one = score(segments, truth, names)
    assert (one.found, one.switches) == (5, 0)
    assert one.wrong < 0.002
    place = [np.median(found.lines.place[names == k, 1]) for k in range(5)]
    assert (np.diff(place) > 0).all()


class _Said(SimpleNamespace):
    """A linking that says other names."""

    def identity(self):
        return self.names


def _renumbered(linking, order):
    names = linking.identity()
    number = np.append(order, -1)
    names = names.assign(segment_whisker=("segment", number[names.segment_whisker.values]))
    said = _Said(
        names=names, **{word: getattr(linking, word) for word in ("pieces", "pads", "lines", "solutions", "head")}
    )
    said.whiskers = linking.whiskers
    return CutLinking(said, np.arange(linking.pieces.column.size))


def _exchanged(one, a, b, frame):
    names = one.linking.names
    whisker, late = names.segment_whisker.values, one.linking.pieces.frame >= frame
    other = np.select([late & (whisker == a), late & (whisker == b)], [b, a], whisker)
    one.linking.names = names.assign(segment_whisker=("segment", other))
    return one


def test_one_linking_alone_says_what_it_said():
    segments, _ = simulate([Pad(whiskers=4, frames=60)], 1)
    linking = link_segments(segments)
    before = linking.identity()
    _, found = common_linking([CutLinking(linking, np.arange(segments.sizes["point"]))], segments.sizes["point"])
    np.testing.assert_array_equal(found.identity().segment_whisker, before.segment_whisker)


def test_linkings_without_whiskers_agree_on_none():
    segments, _ = simulate([Pad(whiskers=2, frames=60)], 1)
    linking = link_segments(segments)
    for solution in linking.solutions:
        solution.place([])
    _, found = common_linking([CutLinking(linking, np.arange(segments.sizes["point"]))] * 2, segments.sizes["point"])
    assert found.whiskers == 0
    assert (found.identity().segment_whisker == -1).all()
