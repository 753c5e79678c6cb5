"""One line whose whisker is known puts right what is wrong about it, and nothing else."""

import numpy as np
import pytest
from simulated_segments import Pad, simulate

from vibrissa.video.link.known.known_lines import LineNames
from vibrissa.video.link.known.known_names import chains_of, names_with
from vibrissa.video.link.known.renamed_linking import line_names, with_names
from vibrissa.video.link.whisker_linking import link_segments

FRAMES, FIRST, STOP = 160, 60, 95
SEEDS = range(3, 9)


@pytest.fixture(scope="module")
def pads():
    return [link_segments(simulate([Pad(whiskers=6, frames=FRAMES, broken=0.05)], seed)[0]) for seed in SEEDS]


def wrong(linking, change):
    """Good names, and the same with some changed from FIRST on to before STOP: ``change`` gives new ones by old."""
    good = line_names(linking)
    table = np.arange(-1, linking.whiskers)
    for old, new in change.items():
        table[old + 1] = new
    here = (linking.pieces.frame >= FIRST) & (linking.pieces.frame < STOP)
    return good, good._replace(whisker=np.where(here, table[good.whisker + 1], good.whisker))


def line_of(linking, names, whisker, frame):
    """A line of a whisker in the first frame from this on in which it has one."""
    return np.flatnonzero((names.whisker == whisker) & (linking.pieces.frame >= frame))[:1]


def marked(linking, names, line, whisker, known=None):
    return names_with(chains_of(linking), names, line, whisker, known or {})[1]


def test_two_whiskers_exchanged_for_a_while_are_put_right_by_one_mark(pads):
    mended = []
    for linking in pads:
        for pair in ((0, 1), (2, 3), (4, 5)):
            good, bad = wrong(linking, {pair[0]: pair[1], pair[1]: pair[0]})
            after = marked(linking, bad, line_of(linking, good, pair[0], (FIRST + STOP) // 2), pair[0])
            off = np.flatnonzero(bad.whisker != good.whisker)
            mended.append((after.whisker[off] == good.whisker[off]).mean())
            elsewhere = np.delete(np.arange(good.whisker.size), off)
            assert (after.whisker[elsewhere] != good.whisker[elsewhere]).mean() < 0.01
    assert np.median(mended) > 0.98
    assert np.mean(mended) > 0.8


def test_lines_that_lost_their_name_have_it_again(pads):
    mended = []
    for linking in pads:
        good, bad = wrong(linking, {2: -1})
        line = line_of(linking, good, 2, (FIRST + STOP) // 2)
        after = marked(linking, bad, line, 2)
        off = np.flatnonzero(bad.whisker != good.whisker)
        mended.append((after.whisker[off] == 2).mean())
        elsewhere = np.delete(np.arange(good.whisker.size), off)
        gained = elsewhere[after.whisker[elsewhere] != good.whisker[elsewhere]]
        assert set(good.whisker[gained]) <= {-1}  # in frames in which the whisker was not found
        assert gained.size <= 1
        assert after.sure[line] == 1
        taken = off[after.whisker[off] == 2]
        assert set(after.sure[taken]) <= {0.55, 0.75, 0.97, 1.0}
        assert np.median(after.sure[taken]) >= 0.75
    assert np.mean(mended) > 0.9


def test_a_mark_that_says_what_is_known_makes_it_sure_and_changes_no_name(pads):
    linking = pads[0]
    names = line_names(linking)
    names = names._replace(sure=np.where(names.whisker >= 0, 0.5, 0.0))
    line = line_of(linking, names, 3, 80)
    after = marked(linking, names, line, 3)
    np.testing.assert_array_equal(after.whisker, names.whisker)
    assert after.sure[line] == 1
    solution = linking.solutions[0]
    raised = np.flatnonzero(after.sure != names.sure)
    assert set(solution.tracklet[raised]) == set(solution.tracklet[line])
    assert set(names.whisker[raised]) == {3}


def test_what_was_known_before_bounds_what_a_mark_changes(pads):
    linking = pads[0]
    good, bad = wrong(linking, {2: 3, 3: 2})
    held = int(line_of(linking, bad, 2, FIRST + 25)[0])  # by hand a line is called 2 though it is 3
    after = marked(linking, bad, line_of(linking, good, 2, FIRST + 10), 2, {held: 2})
    frame = linking.pieces.frame
    assert after.whisker[held] == 2
    early = (frame >= FIRST) & (frame < FIRST + 20) & np.isin(good.whisker, [2, 3])
    assert (after.whisker[early] == good.whisker[early]).mean() > 0.8
    late = (frame > frame[held]) & (frame < STOP)
    np.testing.assert_array_equal(after.whisker[late], bad.whisker[late])


def test_no_other_line_of_the_whisker_lies_beside_a_known_one(pads):
    linking = pads[0]
    names = line_names(linking)
    reach, frame = linking.lines.reach, linking.pieces.frame
    for wanted in range(linking.whiskers):
        line = line_of(linking, names, (wanted + 1) % linking.whiskers, 100)
        after = marked(linking, names, line, wanted)
        others = np.setdiff1d(np.flatnonzero((after.whisker == wanted) & (frame == frame[line])), line)
        shared = np.minimum(reach[others, 1], reach[line, 1]) - np.maximum(reach[others, 0], reach[line, 0])
        assert (shared <= 0.25 * np.ptp(reach[line])).all()
        assert after.whisker[line] == wanted


def test_a_new_whisker_takes_lines_without_a_name_only(pads):
    linking = pads[0]
    good = line_names(linking)
    bad = good._replace(whisker=np.where(good.whisker == 5, -1, good.whisker))
    lines = line_of(linking, good, 5, 80)
    chains, after = names_with(chains_of(linking), bad, lines, 6, {})
    assert len(chains.roster) == linking.whiskers + 1
    np.testing.assert_array_equal(after.whisker[bad.whisker >= 0], bad.whisker[bad.whisker >= 0])
    lost = good.whisker == 5
    assert (after.whisker[lost] == 6).mean() > 0.8
    assert (good.whisker[after.whisker == 6] == 5).mean() > 0.9
    identity = with_names(linking, after, 7).identity()
    assert identity.whisker_segment.shape == (7, FRAMES)
    np.testing.assert_array_equal(identity.segment_whisker, after.whisker)


def test_lines_of_no_pad_and_whiskers_without_lines_change_nothing(pads):
    linking = pads[0]
    names, chains = line_names(linking), chains_of(linking)
    astray = np.setdiff1d(np.arange(names.whisker.size), linking.solutions[0].who)
    assert astray.size
    more, after = names_with(chains, names, astray[:1], linking.whiskers, {})
    assert more.roster[-1] == (-1, 0)
    assert after is names
    again, same = names_with(more, names, astray[:1], linking.whiskers, {})
    assert again is more
    assert isinstance(same, LineNames)


def test_what_is_known_of_one_pad_stays_when_the_other_is_marked():
    sides = [Pad(whiskers=6, frames=100, centre=(350.0, 240.0))]
    sides.append(Pad(whiskers=6, frames=100, centre=(290.0, 240.0), direction=180.0, mirror=True))
    linking = link_segments(simulate(sides, 1)[0])
    chains, names, known = chains_of(linking), line_names(linking), {}
    assert {pad for pad, _ in chains.roster} == {0, 1}
    for pad in (0, 1, 0):  # a line of one whisker of the pad is called another one
        free = [n for n, (there, _) in enumerate(chains.roster) if there == pad and n not in known.values()]
        one, other = free[:2]
        line = line_of(linking, names, one, 40)
        names = names_with(chains, names, line, other, known)[1]
        known[int(line[0])] = other
    for line, whisker in known.items():
        assert names.whisker[line] == whisker
        assert names.sure[line] == 1
