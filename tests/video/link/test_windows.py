"""Whiskers linked in windows that overlap: names over the windows, and pads that drift further than they are apart."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_segments import Pad, score, simulate

from vibrissa.video.link.pad.pads import Lines
from vibrissa.video.link.starts.windows import lengths, linked_in_windows, some_lines
from vibrissa.video.link.thorough_linking import link_thoroughly
from vibrissa.video.link.whisker_linking import linkings


class _Label:
    def __init__(self, seen):
        self.seen, self.chance = np.array(seen, int), np.ones(len(seen))


class _Solution:
    """Whiskers of a window, as far as windows ask for them."""

    def __init__(self, frame, whiskers):
        self.frames, self.frame = int(frame.max(initial=0)) + 1, frame
        self.labels = [_Label(one) for one in whiskers]


def _linker(frame, whisker, rng, left_out=()):
    """Linker that knows the truth and gives whiskers in any order; of windows it leaves some whiskers out."""

    def linked(here, first, stop):
        assert ((frame[here] >= first) & (frame[here] < stop)).all()
        known = [k for k in rng.permutation(whisker.max() + 1) if (first, k) not in left_out]
        return _Solution(frame[here] - first, [np.flatnonzero(whisker[here] == k) for k in known])

    return linked


@pytest.fixture
def three():
    frame, whisker = np.repeat(np.arange(500), 3), np.tile(np.arange(3), 500)
    return frame, whisker


def test_short_movies_have_no_windows():
    assert lengths(299) == []
    assert lengths(300) == [200]
    assert lengths(700) == [200, 300, 450]


def test_a_whisker_has_one_name_in_all_windows_in_whatever_order_they_have_them(three):
    frame, whisker = three
    name = linked_in_windows(500, frame, 100, _linker(frame, whisker, np.random.default_rng(1)))
    for k in range(3):
        assert np.unique(name[whisker == k]).size == 1
    assert sorted(np.unique(name)) == [0, 1, 2]


def test_a_whisker_that_a_window_has_not_goes_on_under_another_name(three):
    frame, whisker = three
    linked = _linker(frame, whisker, np.random.default_rng(2), left_out={(200, 1)})
    name = linked_in_windows(500, frame, 100, linked)
    before, after = name[(whisker == 1) & (frame < 240)], name[(whisker == 1) & (frame >= 260)]
    assert np.unique(before).size == np.unique(after).size == 1
    assert before[0] != after[0]
    assert np.unique(name[whisker == 2]).size == 1


def test_a_window_that_exchanges_two_whiskers_is_not_joined_with_the_next_ones(three):
    """Half of the lines that either has in common are not the same."""
    frame, whisker = three
    truth = _linker(frame, whisker, np.random.default_rng(3))

    def linked(here, first, stop):
        if first != 200:
            return truth(here, first, stop)
        late = frame[here] >= 275
        changed = np.where(late & (whisker[here] < 2), 1 - whisker[here], whisker[here])
        return _Solution(frame[here] - first, [np.flatnonzero(changed == k) for k in range(3)])

    name = linked_in_windows(500, frame, 100, linked)
    assert np.unique(name[whisker == 2]).size == 1
    assert not np.intersect1d(name[(whisker == 0) & (frame < 200)], name[(whisker == 1) & (frame > 300)]).size


def test_no_frame_has_a_name_twice():
    rng = np.random.default_rng(4)
    frame = np.repeat(np.arange(400), 4)
    whisker = rng.integers(0, 3, frame.size)  # some frames have two lines of a whisker; a window takes the last
    name = linked_in_windows(400, frame, 150, _linker(frame, whisker, rng))
    some = name >= 0
    pairs = np.stack([frame[some], name[some]])
    assert np.unique(pairs, axis=1).shape == pairs.shape


def test_windows_without_lines_have_no_whiskers():
    frame, whisker = np.repeat(np.arange(500), 3), np.tile(np.arange(3), 500)
    late = frame >= 300
    frame, whisker = frame[late], whisker[late]
    name = linked_in_windows(500, frame, 100, _linker(frame, whisker, np.random.default_rng(5)))
    assert sorted(np.unique(name)) == [0, 1, 2]
    nobody = linked_in_windows(500, frame, 100, lambda here, first, stop: _Solution(np.zeros(1, int), []))
    assert (nobody == -1).all()


def test_a_long_movie_with_lines_in_few_frames_has_no_whiskers():
    """Five frames of 900: no whisker is seen in a twentieth of them."""
    segments, _ = simulate([Pad(whiskers=4, frames=5)], 3)
    far = segments.segment_frame.copy(data=np.where(segments.segment_frame > 2, 895, 0) + segments.segment_frame.values)
    late = segments.assign(segment_frame=far).assign_attrs(frames=900)
    assert link_thoroughly(late)[1].whiskers == 0


def test_lines_are_cut_to_some_of_them():
    lines = Lines(*(np.arange(5.0) for _ in Lines._fields))
    np.testing.assert_array_equal(some_lines(lines, np.array([1, 3])).reach, [1.0, 3.0])


def test_whiskers_that_drift_further_than_they_are_apart_keep_their_names_over_a_long_movie():
    """Thirteen whiskers 6° apart that drift by 6°: as a whole, 0.55 of the lines had their name, 0.16 another."""
    drifting = Pad(
        whiskers=13,
        frames=1200,
        spread=75.0,
        opening=0.5,
        amplitude=14.0,
        missing=0.4,
        broken=0.2,
        drift=6.0,
        carried=0.4,
        own=2.2,
    )
    segments, truth = simulate([drifting], 41)
    found = [score(segments, truth, one.identity().segment_whisker.values) for one in linkings(segments)]
    assert np.mean([one.followed for one in found]) > 0.7
    assert np.mean([one.wrong for one in found]) < 0.1
