"""Lines divided into whiskers by what most linkings say of them, against all ways to divide a few."""

from __future__ import annotations

import numpy as np
import pytest

from vibrissa.video.link.consensus import LITTLE, consensus


def _same(found, expected):
    """Whether two divisions are the same but for the numbers of their parts."""
    pairs = set(zip(found.tolist(), np.asarray(expected).tolist(), strict=True))
    return len(pairs) == len({a for a, _ in pairs}) == len({b for _, b in pairs})


def _alone(count):
    return np.full(count, -1)


def _divisions(count):
    """All divisions of some lines, as restricted growth strings."""
    if not count:
        yield []
        return
    for rest in _divisions(count - 1):
        for part in range(max(rest, default=-1) + 2):
            yield [*rest, part]


def _agreement(label, sure, part):
    """Attraction less repulsion within the parts, pair by pair."""
    weight = np.where(label >= 0, np.maximum(2 * sure - 1, LITTLE), 0.0)
    total = 0.0
    for i in range(part.size):
        for j in np.flatnonzero(part[:i] == part[i]):
            each = np.where(label[:, i] == label[:, j], 1.0, -1.0)
            total += (weight[:, i] * weight[:, j] * each).sum()
    return total


@pytest.mark.parametrize("seed", range(12))
def test_a_few_lines_are_divided_as_well_as_they_can_be(seed):
    rng = np.random.default_rng(seed)
    truth = rng.integers(0, 3, 8)
    label = np.stack([rng.permutation(3)[truth] for _ in range(4)])
    label = np.where(rng.random(label.shape) < 0.2, rng.integers(-1, 3, label.shape), label)
    sure = rng.uniform(0.5, 1.0, label.shape)
    found = consensus(label, sure, _alone(8))
    named = np.flatnonzero(found >= 0)
    np.testing.assert_array_equal(named, np.flatnonzero((label >= 0).any(axis=0)))
    some = label[:, named], sure[:, named]
    best = max(_agreement(*some, np.array(one)) for one in _divisions(named.size))
    assert _agreement(*some, found[named]) >= best - 1e-9


def test_linkings_that_number_whiskers_otherwise_agree():
    truth = np.repeat([0, 1, 2, 3], 25)
    label = np.array([[0, 1, 2, 3], [3, 2, 0, 1], [1, 0, 3, 2]])[:, truth]
    assert _same(consensus(label, np.full(label.shape, 0.9), _alone(100)), truth)


def test_what_each_linking_exchanges_at_another_time_is_outvoted():
    """Two whiskers, whose names four of five linkings exchange for 20 of 100 frames, each in others."""
    frame, truth = np.tile(np.arange(100), 2), np.repeat([0, 1], 100)
    label = np.stack([np.where((frame >= at) & (frame < at + 20), 1 - truth, truth) for at in (0, 20, 40, 60, 100)])
    assert _same(consensus(label, np.full(label.shape, 0.9), _alone(200)), truth)


def test_a_whisker_that_most_linkings_lack_is_one_and_no_linking_says_how_many_there_are():
    truth = np.repeat([0, 1, 2], 40)
    label = np.stack([np.where(truth == k, -1, truth) for k in (0, 1, 2)])
    assert _same(consensus(label, np.full(label.shape, 0.8), _alone(120)), truth)


def test_sure_names_outweigh_those_that_are_as_likely_wrong_as_right():
    truth = np.repeat([0, 1], 30)
    wrong = np.tile([0, 1], 30)
    label, sure = np.stack([truth, wrong, wrong]), np.repeat([0.95, 0.5, 0.5], 60).reshape(3, 60)
    assert _same(consensus(label, sure, _alone(60)), truth)
    assert _same(consensus(label, sure[::-1], _alone(60)), wrong)


def test_lines_of_a_stretch_that_have_the_same_names_stay_together_and_those_without_have_none():
    label = np.array([[0, 0, 0, -1, 1, 1], [2, 2, 2, -1, 2, 0]])
    found = consensus(label, np.full(label.shape, 0.9), np.array([4, 4, -1, 4, 7, 7]))
    assert found[3] == -1
    assert len(set(found[:3])) == 1
    assert (consensus(np.full((3, 4), -1), np.zeros((3, 4)), _alone(4)) == -1).all()
    assert consensus(np.zeros((2, 0), np.int64), np.zeros((2, 0)), _alone(0)).size == 0
