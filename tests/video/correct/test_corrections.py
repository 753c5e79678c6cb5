"""Edits by hand over the linker's names, on a simulated pad whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal
from simulated_segments import Pad, score, simulate

from vibrissa.video.correct.correction import Correction
from vibrissa.video.correct.edits import Edit, LinePoint
from vibrissa.video.link.chains.exclusion import Solution
from vibrissa.video.link.whisker_linking import link_segments

FRAMES = 160


@pytest.fixture(scope="module")
def pad():
    return simulate([Pad(whiskers=6, frames=FRAMES, broken=0.05)], 3)


@pytest.fixture(scope="module")
def linking(pad):
    return link_segments(pad[0])


@pytest.fixture
def correction(linking):
    return Correction(linking)


def longest(correction, whisker):
    """Segments of the longest piece of a whisker, by frames."""
    named = correction.named
    pieces = named.piece[named.whisker == whisker]
    best = np.bincount(pieces).argmax()
    return np.flatnonzero(named.piece == best)


def middle(correction, whisker):
    segments = longest(correction, whisker)
    return int(segments[segments.size // 2])


def free_piece(correction):
    """The longest piece that has no name, in frames one after the other."""
    named = correction.named
    free = np.flatnonzero((named.whisker < 0) & ~named.gone)
    return np.flatnonzero(named.piece == np.bincount(named.piece[free]).argmax())


def edit_on(correction, do, segment, **more):
    return Edit(do=do, at=correction.point_on(segment), **more)


def state(correction):
    named = correction.named
    return named.whiskers, correction.labels, *(one.tolist() for one in named[1:])


def a_join(correction):
    """Take a piece apart, so that its two halves can be joined."""
    segments = longest(correction, 2)
    correction.apply(edit_on(correction, "split", int(segments[segments.size // 2])))
    to = correction.point_on(int(segments[0]))
    return edit_on(correction, "join", int(segments[-1]), to=to)


EDITS = {
    "name": lambda c: edit_on(c, "name", middle(c, 1), whisker=4),
    "name whole": lambda c: edit_on(c, "name", middle(c, 1), whisker=4, whole=True),
    "new": lambda c: edit_on(c, "name", middle(c, 1), whisker=c.named.whiskers),
    "mark": lambda c: edit_on(c, "mark", middle(c, 1), whisker=2),
    "join": a_join,
    "split": lambda c: edit_on(c, "split", middle(c, 1)),
    "delete": lambda c: edit_on(c, "delete", middle(c, 1)),
    "delete line": lambda c: edit_on(c, "delete", middle(c, 1), alone=True),
    "swap": lambda c: Edit(do="swap", frame=60, whiskers=(1, 2)),
    "call": lambda c: Edit(do="call", whisker=1, label="C2"),
}


@pytest.mark.parametrize("kind", EDITS)
def test_an_edit_taken_back_leaves_no_trace_and_comes_again_as_it_was(correction, kind):
    edit = EDITS[kind](correction)
    before, made = state(correction), len(correction.edits)
    said = correction.apply(edit)
    edited = state(correction)
    assert "\n" not in said
    assert edited != before
    assert correction.undo() == edit
    assert state(correction) == before
    assert correction.redo() == edit
    assert state(correction) == edited
    assert len(correction.edits) == made + 1


@pytest.mark.parametrize("kind", EDITS)
def test_edits_made_again_on_the_movie_lead_to_the_same_names(correction, linking, kind):
    correction.apply(EDITS[kind](correction))
    correction.apply(edit_on(correction, "mark", middle(correction, 3), whisker=3))
    again = Correction(linking)
    again.apply_all(correction.edits, "edits")
    assert state(again) == state(correction)


def test_a_line_alone_is_deleted_and_the_rest_of_its_piece_stays(correction):
    before, line = correction.named, middle(correction, 1)
    correction.apply(edit_on(correction, "delete", line, alone=True))
    after, others = correction.named, np.arange(before.whisker.size) != line
    assert (before.whisker[line], after.whisker[line], after.gone[line]) == (1, -1, True)
    np.testing.assert_array_equal(after.whisker[others], before.whisker[others])
    assert np.unique(after.piece[longest(correction, 1)]).size == 1


def test_a_whisker_is_called_once_and_no_two_alike(linking):
    correction = Correction(linking, labels={0: "B1", 2: "C1"})
    before = correction.named
    assert correction.apply(Edit(do="call", whisker=1, label="C2")) == "Whisker 1 is called C2"
    assert correction.labels == {0: "B1", 1: "C2", 2: "C1"}
    correction.apply(Edit(do="call", whisker=2, label="c1"))  # its own, written otherwise
    correction.apply(Edit(do="call", whisker=0, label="delta"))
    assert correction.labels == {0: "delta", 1: "C2", 2: "c1"}
    with refusal("conflict", "name", "c2"):
        correction.apply(Edit(do="call", whisker=3, label="c2"))
    with refusal("range", "whisker", "6"):
        correction.apply(Edit(do="call", whisker=6, label="D1"))
    correction.undo()
    assert correction.labels[0] == "B1"
    assert correction.apply(Edit(do="call", whisker=0, label="")) == "Whisker 0 is called 0"
    assert correction.labels == {1: "C2", 2: "c1"}
    np.testing.assert_array_equal(correction.named.whisker, before.whisker)


@pytest.mark.parametrize("whole", [False, True])
def test_a_named_piece_is_the_whisker_whatever_the_linker_says(correction, whole):
    segments = np.flatnonzero(correction.named.whisker == 1) if whole else longest(correction, 1)
    correction.apply(edit_on(correction, "name", middle(correction, 1), whisker=4, whole=whole))
    named = correction.named
    assert set(named.whisker[segments]) == {4}
    assert (named.sure[segments] == 1).all()


def test_no_whisker_has_two_lines_beside_one_another_in_a_frame(correction):
    """Lines that the linker gave to the whisker make room for the ones by hand."""
    correction.apply(edit_on(correction, "name", middle(correction, 1), whisker=4))
    named, lying = correction.named, correction.lying
    mine = np.flatnonzero(named.whisker == 4)
    for frame in np.unique(lying.frame[mine]):
        here = mine[lying.frame[mine] == frame]
        low, high = lying.reach[here].T
        order = np.argsort(low)
        assert (high[order][:-1] - low[order][1:] < 0.6 * (high - low)[order][1:]).all()


def test_a_swap_exchanges_names_from_its_frame_on_and_twice_is_none(correction):
    before, frame = correction.named.whisker.copy(), correction.lying.frame
    edit = Edit(do="swap", frame=60, whiskers=(1, 2))
    correction.apply(edit)
    after = correction.named.whisker
    early = np.isin(before, [1, 2]) & (frame < 60)
    late = frame >= 60
    np.testing.assert_array_equal(after[late & (before == 1)], 2)
    np.testing.assert_array_equal(after[late & (before == 2)], 1)
    np.testing.assert_array_equal(after[early], before[early])
    correction.apply(edit)
    held = np.isin(before, [1, 2]) & late
    np.testing.assert_array_equal(correction.named.whisker[held], before[held])


def test_a_swap_says_nothing_of_how_sure_names_are(correction):
    before = correction.named
    correction.apply(Edit(do="swap", frame=60, whiskers=(1, 2)))
    np.testing.assert_array_equal(correction.named.sure, before.sure)
    held = int(np.flatnonzero((before.whisker == 1) & (correction.lying.frame > 100))[0])
    correction.apply(edit_on(correction, "mark", held, whisker=2))  # by hand, and then exchanged with the others
    correction.apply(Edit(do="swap", frame=60, whiskers=(1, 2)))
    assert correction.named.whisker[held] == 1
    assert correction.named.sure[held] == 1


def test_it_says_which_piece_is_named_and_what_is_undone(correction):
    segments = longest(correction, 1)
    said = correction.apply(edit_on(correction, "name", int(segments[0]), whisker=4))
    assert said.endswith(", is whisker 4")
    assert said[1:] == correction.said(0)[1:]
    whole = correction.apply(edit_on(correction, "delete", middle(correction, 2), whole=True))
    assert whole.startswith("The whole of whisker 2, frames ")


def test_a_split_ends_the_name_and_a_join_gives_it_back(correction):
    segments = longest(correction, 2)
    cut = correction.lying.frame[segments[segments.size // 2]]
    join = a_join(correction)
    named, rest = correction.named, segments[correction.lying.frame[segments] >= cut]
    assert set(named.whisker[rest]) == {-1}
    assert len(set(named.piece[rest])) == 1
    assert set(named.whisker[np.setdiff1d(segments, rest)]) == {2}
    correction.apply(join)
    assert set(correction.named.whisker[segments]) == {2}


def test_pieces_without_a_name_are_joined_and_split(correction):
    one = free_piece(correction)
    frame, named = correction.lying.frame, correction.named
    others = np.flatnonzero((named.whisker < 0) & (frame > frame[one].max()) & (named.piece != named.piece[one[0]]))
    edit = edit_on(correction, "join", int(one[0]), to=correction.point_on(int(others[0])))
    correction.apply(edit)
    piece = correction.named.piece
    assert piece[one[0]] == piece[others[0]]
    correction.apply(edit_on(correction, "split", int(others[0])))
    piece = correction.named.piece
    assert piece[one[0]] != piece[others[0]]
    assert len(set(piece[one])) == 1


def test_a_deleted_piece_is_nobodys_for_the_linker_too(correction):
    segments = longest(correction, 1)
    correction.apply(edit_on(correction, "delete", middle(correction, 1)))
    assert correction.named.gone[segments].all()
    assert (correction.named.whisker[segments] == -1).all()
    correction.apply(edit_on(correction, "name", int(segments[0]), whisker=1))
    assert not correction.named.gone[segments].any()


def test_one_mark_after_a_swap_of_the_truth_brings_both_whiskers_back(pad, linking):
    """A wrong block, as a meeting may leave it: what was held is corrected, and the linker follows."""
    segments, truth = pad
    correction = Correction(linking)
    good = score(segments, truth, correction.named.whisker)
    wrong = Edit(do="swap", frame=80, whiskers=(2, 3))
    correction.apply(wrong)
    bad = score(segments, truth, correction.named.whisker)
    correction.apply(wrong)
    mended = score(segments, truth, correction.named.whisker)
    assert bad.wrong > 0.1 > 0.01 >= mended.wrong
    assert mended.followed > good.followed - 0.01


def test_a_whisker_that_was_not_found_is_followed_from_one_piece_of_it(linking, pad):
    """A whisker is taken out of the chains; one piece of it, named by hand, brings all of it back."""
    truth = pad[1].segment
    [full] = linking.solutions
    poor = Solution(full.frames, full.frame, full.lines, full.who, full.phase, full.lever, full.tracklet)
    poor.place([one.model for one in full.labels[:5]])
    correction = Correction(replace(linking, solutions=[poor]))
    lost = np.bincount(truth[(linking.identity().segment_whisker.values == 5) & (truth >= 0)]).argmax()
    lines = np.flatnonzero(truth == lost)
    assert (correction.named.whisker[lines] >= 0).mean() < 0.3
    piece = correction.named.piece
    held = np.flatnonzero(piece == np.argsort(np.bincount(piece[lines]))[-2])  # the second longest, a third of it
    assert held.size < 0.4 * lines.size
    correction.apply(edit_on(correction, "name", int(held[0]), whisker=5))
    assert correction.named.whiskers == 6
    assert (correction.named.whisker[lines] == 5).mean() > 0.85


def test_what_cannot_be_is_refused_in_one_line_and_changes_nothing(correction):
    before = state(correction)
    at = correction.point_on(middle(correction, 1))
    start = correction.point_on(int(longest(correction, 1)[0]))
    count = correction.named.whiskers
    bad = {
        "range": [
            Edit(do="name", at=at, whisker=count + 1),
            Edit(do="mark", at=at, whisker=count),
            Edit(do="split", at=start),
            Edit(do="name", at=LinePoint(at.frame, -500.0, -500.0), whisker=1),
            Edit(do="delete", at=LinePoint(FRAMES, 10.0, 10.0)),
            Edit(do="swap", frame=3, whiskers=(0, count)),
        ],
        "conflict": [
            Edit(do="join", at=at, to=at),
            Edit(do="join", at=at, to=correction.point_on(middle(correction, 2))),
        ],
        "too-few": [Edit(do="swap", frame=FRAMES, whiskers=(0, 1))],
    }
    for code, edits in bad.items():
        for edit in edits:
            with refusal(code):
                correction.apply(edit)
    for step in (correction.undo, correction.redo):
        with refusal("missing"):
            step()
    assert state(correction) == before


def test_a_new_edit_forgets_what_was_taken_back(correction):
    correction.apply(EDITS["swap"](correction))
    correction.undo()
    assert correction.undone == 1
    correction.apply(EDITS["mark"](correction))
    assert correction.undone == 0
    with refusal("missing", "redo"):
        correction.redo()


def test_what_was_taken_back_does_not_change_later_edits(correction, linking):
    for kind in ("mark", "swap", "delete"):
        correction.apply(EDITS[kind](correction))
    for _ in range(3):
        correction.undo()
    other = edit_on(correction, "name", middle(correction, 3), whisker=0)
    correction.apply(other)
    fresh = Correction(linking)
    fresh.apply(other)
    assert state(correction) == state(fresh)
