"""Lines cut before whiskers are known: where another line's end, continued, fits better than their own part."""

from __future__ import annotations

import numpy as np
import pytest

from vibrissa.video.link.courses.doubtful_lines import doubtful_lines
from vibrissa.video.link.courses.meetings import DRAWN, SHORTEST, meetings
from vibrissa.video.link.courses.smooth_curve import misfit
from vibrissa.video.link.pad.pieces import Pieces

WIDTH, SD = 2.0, 0.1
HALF, CROSSING = 150, 6.0  # points to either side of the crossing; angle there [°]


def crossing(seed: int, exchanged: bool, gap: int = 25) -> list[np.ndarray]:
    """Lines of two curved whiskers that cross: one through the crossing, and the ends of the other one.

    Where they are exchanged the line through it begins on the one and ends on the other whisker.
    """
    rng = np.random.default_rng(seed)
    x = np.arange(-HALF, HALF)
    slope = np.tan(np.deg2rad(CROSSING / 2))
    one, other = slope * x + 4e-4 * x**2, -slope * x + 3e-4 * x**2 + 1e-6 * x**3
    one, other = (np.stack([x, y + rng.normal(0, SD, x.size)], axis=1) + 200 for y in (one, other))
    before, beyond = slice(0, HALF - gap), slice(HALF + gap, 2 * HALF)
    if exchanged:
        long = np.concatenate([one[:HALF], other[HALF:]])
        return [long, other[before], one[beyond]]
    return [one, other[before], other[beyond]]


def pieces(frames: list[list[np.ndarray]], sd: float = SD) -> Pieces:
    """Lines of several frames as segments."""
    lines = [line for frame in frames for line in frame]
    points, size = np.concatenate(lines), np.array([len(line) for line in lines])
    frame = np.repeat(np.arange(len(frames)), [len(one) for one in frames])
    stop = np.cumsum(size)
    flat = np.ones(len(points))
    return Pieces(len(frames), frame, stop - size, stop, *points.T, WIDTH * flat, flat, sd * flat)


def places(cut_first: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Points at which lines are cut."""
    return np.setdiff1d(cut_first, first)


def test_the_misfit_of_a_cubic_is_that_of_a_plain_least_squares_fit():
    rng = np.random.default_rng(1)
    x = np.concatenate([np.arange(0.0, 40), np.arange(60.0, 110)])
    y = 1e-3 * (x - 50) ** 2 + rng.normal(0, 0.2, x.size)
    y[-1] = y[0]  # the way from the first to the last point is that of the columns
    sd = rng.uniform(0.1, 0.4, x.size)
    fit = np.polyval(np.polyfit(x / 100, y, 3, w=1 / sd), x / 100)
    found = misfit(np.stack([x, y], axis=1), sd, np.arange(39, -1, -1), np.arange(40, 90))
    assert found == pytest.approx((((y - fit) / sd) ** 2).sum(), rel=1e-6)


def test_a_part_that_does_not_lie_beyond_fits_no_curve():
    x = np.arange(80.0)
    points = np.stack([x, 0 * x], axis=1)
    assert misfit(points, np.ones(80), np.arange(60, 40, -1), np.arange(20, 40)) == np.inf


def test_lines_that_begin_on_one_whisker_and_end_on_another_are_cut_near_the_crossing():
    frames = [crossing(seed, True) for seed in range(50)]
    given = pieces(frames)
    at = places(doubtful_lines(given).first, given.start)
    found = np.unique(given.frame[np.searchsorted(given.start, at, side="right") - 1])
    assert found.size == 50
    # where the whiskers are less than a width apart
    assert np.abs(given.column[at] - 200).max() < WIDTH / np.tan(np.deg2rad(CROSSING))


def test_lines_that_are_one_whisker_are_not_cut_where_another_one_crosses():
    given = pieces([crossing(seed, False) for seed in range(50)])
    assert places(doubtful_lines(given).first, given.start).size == 0


@pytest.mark.parametrize("turn", [0.0, 90.0, 215.0])
def test_direction_and_order_of_points_do_not_matter(turn):
    lines = crossing(3, True)
    c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    turned = [line @ np.array([[c, s], [-s, c]]) for line in lines]
    plain, given = pieces([lines]), pieces([turned])
    at = places(doubtful_lines(plain).first, plain.start)
    np.testing.assert_array_equal(places(doubtful_lines(given).first, given.start), at)
    backwards = pieces([[line[::-1] for line in turned]])
    there = places(doubtful_lines(backwards).first, backwards.start)
    np.testing.assert_allclose(2 * HALF - 1 - there, at, atol=2)


def test_a_cut_keeps_every_point_and_leaves_no_short_piece():
    given = pieces([crossing(seed, seed % 2 == 0) for seed in range(20)])
    cut = doubtful_lines(given)
    np.testing.assert_array_equal(cut.points, np.arange(given.column.size))
    assert np.diff(np.append(cut.first, cut.points.size)).min() >= (DRAWN + SHORTEST) * WIDTH
    np.testing.assert_array_equal(cut.source, given.owner[cut.first])


def test_lines_whose_deviation_is_not_known_are_cut_too():
    given = pieces([crossing(0, True)], sd=np.nan)
    assert places(doubtful_lines(given).first, given.start).size == 1


def test_lines_far_from_each_other_or_at_a_large_angle_do_not_meet():
    x = np.arange(100.0)
    flat = np.stack([x, 0 * x], axis=1)
    for other in (np.stack([x, 0 * x + 30], axis=1), np.stack([50 + 0 * x, x - 110], axis=1)):
        points = np.concatenate([flat, other])
        assert not meetings(points, np.full(200, SD), np.array([0, 100, 200]), WIDTH)


def test_points_that_do_not_spread_are_no_error():
    lines = crossing(0, True)
    at = places(doubtful_lines(pieces([lines])).first, pieces([lines]).start)
    given = pieces([[*lines, np.full((60, 2), 200.0)]])
    np.testing.assert_array_equal(places(doubtful_lines(given).first, given.start), at)
