"""Lines that nobody has and that fill a gap of one whisker alone."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from simulated_segments import Pad, simulate

from vibrissa.video.link.chains.chain_kernel import log_chance
from vibrissa.video.link.identities import ABSENT, SHARED, Names, names_of
from vibrissa.video.link.names_in_gaps import FEWEST, MOST, RIGHT, SURE, named_in_gaps
from vibrissa.video.link.whisker_linking import link_segments


@pytest.fixture(scope="module")
def linked():
    """Solution and names of six whiskers, and the lines that are each one's in truth."""
    segments, truth = simulate([Pad(whiskers=6, frames=200, own=1.0)], 2)
    (solution,) = link_segments(segments).solutions
    return solution, names_of(solution, solution.lever), truth.segment


def _without(names, lines):
    """Names of which these lines have none."""
    whisker = names.whisker.copy()
    whisker[lines] = -1
    return names._replace(whisker=whisker, main=np.where(np.isin(names.main, lines), -1, names.main))


def test_names_taken_from_a_whisker_in_most_frames_come_back(linked):
    solution, names, real = linked
    back = right = 0
    for n in range(len(solution.labels)):
        own = np.flatnonzero(names.whisker == n)
        gone = own[solution.frame[own] % 12 >= 6]
        before = _without(names, gone)
        found = named_in_gaps(before, solution)
        new = np.flatnonzero((found.whisker >= 0) & (before.whisker < 0))
        owner = np.bincount(real[own][real[own] >= 0]).argmax()
        back += np.isin(gone, new).mean() / len(solution.labels)
        right += (real[new] == owner).mean() / len(solution.labels)
        others = np.setdiff1d(np.arange(real.size), np.append(new, gone))
        np.testing.assert_array_equal(found.whisker[others], names.whisker[others])
    assert back > 0.85
    assert right > 0.95


def test_a_line_in_a_gap_is_as_probable_as_all_ways_through_it_given_those_of_the_whisker(linked):
    solution, names, _ = linked
    model, own = solution.labels[2].model, names.main[2][names.main[2] >= 0]
    for line in own[5:180:25]:
        rest = own[own != line]
        candidate, chance = solution.visited(model, rest, np.array([line]), -6.0)
        assert candidate.tolist() == [line]
        ways = [_all_ways(solution, model, rest, free) for free in ([], [line])]
        np.testing.assert_allclose(chance[0], 1 - np.exp(ways[0] - ways[1]), atol=1e-6)


def _all_ways(solution, model, own, free):
    """Logarithm of the chance of all chains that surely have some lines and may have others, which are worth less."""
    one = solution._label(model, np.sort(np.append(own, np.array(free, int))))
    gain = one.gain + np.where(np.isin(one.seen, own), 30.0, -6.0)
    missed = np.log(model.missed)
    return log_chance(solution.frames, solution.frame[one.seen], gain, one.again, one.leaves, *one.steps, missed)


class _Wanted:
    """Two whiskers with a line in every even frame, and one free line each in frames 1 and 3; who wants it is given."""

    def __init__(self, wanted, lines=FEWEST, frames=None):
        self.wanted, self.free = np.array(wanted), np.array([2 * lines, 2 * lines + 1])
        self.frame = np.concatenate([np.repeat(2 * np.arange(lines), 2), [1, 3]])
        self.frames = 4 * lines if frames is None else frames
        self.who, self.labels = np.arange(2 * lines + 2), [SimpleNamespace(model=n) for n in range(2)]
        main = np.full((2, 4 * lines), -1)
        main[:, : 2 * lines : 2] = np.arange(2 * lines).reshape(-1, 2).T
        whisker = np.append(np.tile([0, 1], lines), [-1, -1])
        chance, reason = np.where(main >= 0, 0.9, np.nan), np.where(main >= 0, 0, ABSENT)
        sure, also = np.where(whisker >= 0, 0.9, 0.0), np.full(whisker.size, -1)
        self.names = Names(whisker, also, sure, main, chance, reason, np.zeros((whisker.size, 6)))

    def visited(self, model, own, free, more):
        assert more > 0
        np.testing.assert_array_equal(free, self.free)
        return free, self.wanted[model]


def test_a_line_that_one_whisker_alone_wants_is_its():
    pad = _Wanted([[0.9, 0.2], [0.3, 0.6]])
    found = named_in_gaps(pad.names, pad)
    np.testing.assert_array_equal(found.whisker[pad.free], [0, 1])
    np.testing.assert_array_equal(found.main[[0, 1], [1, 3]], pad.free)
    np.testing.assert_array_equal(found.reason[[0, 1], [1, 3]], 0)
    np.testing.assert_array_equal(found.sure[pad.free], RIGHT)
    np.testing.assert_array_equal(found.chance[[0, 1], [1, 3]], found.sure[pad.free])
    assert (pad.names.whisker[pad.free] < 0).all()  # those given are not changed


def test_a_line_that_two_want_or_none_has_no_name():
    pad = _Wanted([[0.9, 0.4], [0.7, 0.4]])
    assert named_in_gaps(pad.names, pad) is pad.names


def test_a_whisker_that_is_hardly_seen_has_no_gaps():
    pad = _Wanted([[0.9, 0.9], [0.1, 0.1]], lines=FEWEST - 1)
    assert named_in_gaps(pad.names, pad) is pad.names


@pytest.mark.parametrize(("over", "named"), [(0.99, 0), (1.01, 2)])
def test_gaps_of_a_whisker_that_is_mostly_seen_are_left(over, named):
    pad = _Wanted([[0.9, 0.2], [0.3, 0.6]], frames=FEWEST / MOST * over)
    assert (named_in_gaps(pad.names, pad).whisker[pad.free] >= 0).sum() == named


@pytest.mark.parametrize("sure", [SURE + 0.01, 0.8, 0.95])
def test_a_name_in_a_gap_is_no_surer_than_those_of_its_whisker(sure):
    pad = _Wanted([[0.9, 0.2], [0.3, 0.6]])
    found = named_in_gaps(pad.names._replace(chance=np.where(pad.names.main >= 0, sure, np.nan)), pad)
    np.testing.assert_allclose(found.sure[pad.free], min(sure, RIGHT))


def test_gaps_of_a_whisker_whose_names_are_doubtful_are_left():
    pad = _Wanted([[0.9, 0.2], [0.3, 0.6]])
    names = pad.names._replace(chance=np.where(pad.names.main >= 0, [[SURE - 0.01], [0.9]], np.nan))
    np.testing.assert_array_equal(named_in_gaps(names, pad).whisker[pad.free], [-1, 1])


def test_a_whisker_that_has_a_line_again_runs_along_no_other():
    pad = _Wanted([[0.9, 0.1], [0.1, 0.1]])
    also, reason = pad.names.also.copy(), pad.names.reason.copy()
    also[pad.free[1]], also[0], reason[0, 1] = 0, 1, SHARED  # line 0 is in a frame in which whisker 1 has one
    found = named_in_gaps(pad.names._replace(also=also, reason=reason), pad)
    assert found.reason[0, 1] == 0
    assert found.also[pad.free[1]] == 0  # in frame 3 it still has none
    assert found.also[0] == -1


def test_without_whiskers_nothing_is_named():
    pad = _Wanted([[0.9, 0.1], [0.1, 0.1]])
    pad.labels = []
    none = pad.names._replace(main=pad.names.main[:0], chance=pad.names.chance[:0], whisker=np.full(pad.frame.size, -1))
    assert named_in_gaps(none, pad) is none
