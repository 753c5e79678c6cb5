"""``benchmarks/whiskers_apart.py``: which whiskers an eye can follow, and how well those are followed."""

import importlib
from pathlib import Path

import numpy as np
import pytest

FRAMES, POINTS = 100, 40


@pytest.fixture(scope="module")
def bench():
    """Give the counts as a module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
        yield importlib.import_module("whiskers_apart")


def lies_apart(bench, rows):
    """Of level whiskers whose points have these rows (whisker, frame, point)."""
    whisker, frame, _ = np.indices(rows.shape)
    points = np.stack([np.broadcast_to(np.arange(POINTS), rows.shape).ravel(), rows.ravel()], axis=1)
    seen = np.full(rows.shape[:2], POINTS)
    return bench.apart(points, frame.ravel(), whisker.ravel(), seen)


def three():
    """Two whiskers 20 px from one another, and a third that lies 3 px from the second in the first 30 frames."""
    rows = np.zeros((3, FRAMES, POINTS))
    rows[1], rows[2] = 20, 40
    rows[2, :30] = 23
    return rows


def test_a_whisker_beside_another_one_does_not_lie_apart(bench):
    lies = lies_apart(bench, three())
    np.testing.assert_array_equal(lies.mean(axis=1), [1, 0.7, 0.7])
    assert not lies[1:, :30].any()


@pytest.mark.parametrize(("points", "alone"), [(17, True), (18, False)])
def test_half_of_it_must_be_away_from_others(bench, points, alone):
    """The three points beside the end of the other one are nearer than 4 px, too."""
    rows = np.zeros((2, 1, POINTS))
    rows[1] = 20
    rows[1, :, :points] = 1
    assert lies_apart(bench, rows)[0, 0] == alone


def test_a_single_whisker_lies_apart(bench):
    assert lies_apart(bench, np.zeros((1, 2, POINTS))).all()


def test_what_is_counted_adds_up_over_movies(bench):
    """The second has its name in 80, the third in 95 of 100 frames; the second's is elsewhere in ten of the others."""
    lies, can = lies_apart(bench, three()), np.ones((3, FRAMES), bool)
    own, given = can.copy(), can.copy()
    own[1, :20] = own[2, :5] = given[1, :10] = given[2, :5] = False
    rows = [bench.counts(lies, can, own, given)] * 2
    assert bench.table_row(rows, 0.95) == ["2", "1.000", "1.000", "0.0"]
    assert bench.table_row(rows, 0.5) == ["4", "0.875", "0.500", f"{1000 * 10 / (90 + 95):.1f}"]
    assert bench.table_row(rows, 0.8) == ["0", "0.000", "0.000", "0.0"]


def test_a_whisker_that_is_never_seen_is_left_out(bench):
    lies = np.ones((2, FRAMES), bool)
    can = lies.copy()
    can[1] = False
    assert sum(value for name, value in bench.counts(lies, can, lies, lies).items() if "whiskers" in name) == 1
