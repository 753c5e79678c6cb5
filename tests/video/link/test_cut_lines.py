"""Lines that go over from one whisker to another where they cross: made movies with known truth."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from simulated_segments import Pad, simulate

from vibrissa.quantities import dataset
from vibrissa.video.link.courses.course import EDGES, Courses, smoothed
from vibrissa.video.link.courses.cut_lines import _together, cut_lines
from vibrissa.video.link.courses.whose_points import whose_points
from vibrissa.video.link.pad.pads import BEYOND
from vibrissa.video.link.pad.pads import Pad as Place
from vibrissa.video.link.thorough_linking import link_thoroughly, linked_before
from vibrissa.video.link.whisker_linking import link_segments

FRAMES, POINTS = 120, 170
REST = np.array([-45.0, 8.0, -8.0, 45.0])  # directions of four whiskers [°]; the middle two cross halfway
BASE = np.array([-25.0, -12.0, 12.0, 25.0])  # rows of their bases


def crossing(seed: int, share: float) -> tuple[xr.Dataset, np.ndarray]:
    """Four whiskers in all frames; in a share of them the middle two exchange their tips. And whose each point is."""
    rng = np.random.default_rng(seed)
    time, along = np.arange(FRAMES), np.arange(POINTS)
    swing = 10 * np.sin(2 * np.pi * time / 40)
    lines, owner, frame = [], [], []
    for t in time:
        angle = np.deg2rad(REST + swing[t] + rng.normal(0, 0.3, 4))
        x = 100 + np.cos(angle)[:, None] * along
        y = 240 + BASE[:, None] + np.sin(angle)[:, None] * along + rng.normal(0, 0.2, (4, POINTS))
        who = np.repeat(np.arange(4)[:, None], POINTS, axis=1)
        if rng.random() < share:
            middle = int(np.abs(y[1] - y[2]).argmin())
            for part in (x, y, who):
                part[1:3, middle:] = part[2:0:-1, middle:].copy()
        lines.append(np.stack([x, y]).reshape(2, -1))
        owner.append(who.ravel())
        frame += 4 * [t]
    column, row = np.concatenate(lines, axis=1)
    flat = np.full(column.size, 2.0)
    segments = dataset(
        {"frames": FRAMES, "width": 640, "height": 480, "source": "crossing"},
        segment_frame=np.array(frame),
        segment_start=POINTS * np.arange(4 * FRAMES),
        column=column,
        row=row,
        line_width=flat,
        line_contrast=np.tile(np.repeat([20.0, 30.0, 40.0, 50.0], POINTS), FRAMES),
        position_sd=0.1 * flat,
    )
    return segments, np.concatenate(owner)


def astray(first: np.ndarray, owner: np.ndarray) -> float:
    """Share of the points that are of another whisker than most of their line."""
    parts = np.split(owner, first[1:])
    return 1 - sum(np.bincount(part + 1).max() for part in parts) / owner.size


def furthest_back(column: np.ndarray, first: np.ndarray) -> float:
    """By how much lines turn back from one point to the next at most [px]."""
    parts = np.split(column, first[1:])
    return max(float((np.diff(one) * np.sign(one[0] - one[-1])).max()) for one in parts)


def test_lines_are_cut_where_they_go_over_to_another_whisker_and_put_together_again():
    before, after = [], []
    for seed in range(4):
        segments, owner = crossing(seed, 0.1)
        cut = cut_lines(link_segments(segments))
        before.append(astray(segments.segment_start.values, owner))
        after.append(astray(cut.first, owner[cut.points]))
        # no point is used twice, and hardly any is left out where pieces meet; no line turns back further than before
        assert np.unique(cut.points).size == cut.points.size > 0.999 * owner.size
        column, start = segments.column.values, segments.segment_start.values
        assert furthest_back(column[cut.points], cut.first) < furthest_back(column, start) + 1
        assert cut.first.size == segments.sizes["segment"]
    assert min(before) > 0.01
    # where whiskers are within a pixel or two of one another either is right
    assert max(after) < 0.004
    assert np.mean(after) < 0.2 * np.mean(before)


def test_lines_that_are_one_whisker_each_stay_as_they_are():
    segments, truth = simulate([Pad(whiskers=5, frames=120, spread=90.0, missing=0.05, broken=0.0, junk=1.0)], 3)
    cut = cut_lines(link_segments(segments))
    start = segments.segment_start.values
    size, was = np.diff(np.append(cut.first, cut.points.size)), np.diff(np.append(start, segments.sizes["point"]))
    first = cut.points[cut.first]
    assert cut.first.size == pytest.approx(start.size, rel=0.02)
    assert np.isin(first, start).mean() > 0.97
    # some whiskers are in two pieces where others cross them, and are put together
    assert ((first == start[cut.source]) & (size == was[cut.source])).mean() > 0.95
    assert astray(cut.first, np.repeat(truth.segment, was)[cut.points]) < 0.005


def test_lines_of_few_points_are_not_lost():
    """Points 16 px apart, as files of other programs may have them: no line of 10."""
    segments, _ = simulate([Pad(whiskers=4, frames=60, spread=60.0, missing=0.0, broken=0.0, junk=0.0)], 1)
    lines = [one[::16] for one in np.split(np.arange(segments.sizes["point"]), segments.segment_start.values[1:])]
    sizes = [one.size for one in lines]
    assert max(sizes) < 12
    few = segments.isel(point=np.concatenate(lines))
    few = few.assign(segment_start=("segment", np.cumsum([0, *sizes[:-1]])))
    cut = cut_lines(link_segments(few))
    assert cut.first.size == few.sizes["segment"]


def test_a_course_between_readings_is_what_a_gaussian_process_expects():
    rng, frames, keep = np.random.default_rng(1), 40, 0.9
    when = np.array([2, 3, 9, 10, 25])
    spread = np.array([[1.0, 0.6, 0.2], [0.6, 1.5, 0.3], [0.2, 0.3, 0.8]])
    error = np.stack([np.diag(rng.uniform(0.05, 0.5, 3)) for _ in when])
    x = rng.normal(size=(when.size, 3))
    found = smoothed(frames, when, x, error, spread, keep)
    time = keep ** np.abs(np.arange(frames)[:, None] - np.arange(frames))
    prior = np.kron(time, spread)
    seen = (3 * when[:, None] + np.arange(3)).ravel()
    noise = np.zeros((seen.size, seen.size))
    for k in range(when.size):
        noise[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = error[k]
    expected = prior[:, seen] @ np.linalg.solve(prior[np.ix_(seen, seen)] + noise, x.ravel())
    np.testing.assert_allclose(found, expected.reshape(frames, 3), atol=1e-9)


@pytest.fixture
def two_courses() -> tuple[Courses, Place]:
    """Two straight whiskers, 20 px apart at the inner radius, that cross in the middle."""
    pad = Place(np.zeros(2), 0.0, 50.0, 150.0)
    width = 10 / pad.degree
    place = np.array([[[-width, 0.0, width]], [[width, 0.0, -width]]])
    none = np.zeros((2, EDGES.size + 1))
    return Courses(place, none, np.full(2, 1.2), np.ones((2, 1), np.bool_)), pad


def _whose(two_courses: tuple[Courses, Place], across: np.ndarray, far: float = 1.0) -> np.ndarray:
    courses, pad = two_courses
    along = np.linspace(-1, far, across.size)
    one = (np.zeros(1, np.int64), np.zeros(1, np.int64), np.array([across.size]))
    return whose_points(courses, pad, *one, along, across, np.ones(1, np.bool_))


def test_points_go_over_where_courses_cross(two_courses):
    along = np.linspace(-1, 1, 100)
    width = two_courses[0].place[0, 0, 2]
    straight, bent = _whose(two_courses, along * width), _whose(two_courses, np.abs(along) * width)
    np.testing.assert_array_equal(straight, 0)
    assert set(bent[:40]) == {1}
    assert set(bent[60:]) == {0}


def test_a_far_part_stays_with_the_whisker_that_the_line_is_where_lines_are_fitted(two_courses):
    """Beyond, courses are a guess: a line may lie on that of another whisker there."""
    along = np.linspace(-1, 3, 200)
    width = two_courses[0].place[0, 0, 2]
    reaching = two_courses[0]._replace(tip=np.full(2, 3.0)), two_courses[1]
    bent = np.where(along < BEYOND, along, -along) * width  # goes over to the other whisker's course
    np.testing.assert_array_equal(_whose(reaching, bent, 3.0), 0)
    early = np.where(along < 0.6, along, -along) * width  # goes over where courses are known
    assert set(_whose(reaching, early, 3.0)[-100:]) == {1}


def test_pieces_of_one_whisker_that_lie_aside_of_one_another_are_two_lines():
    """A far piece that leaps onto the neighbour's tip, or that goes on where the other ends."""
    along = np.arange(60.0)
    near, on, aside = (
        np.stack([along + start, np.full(60, across)], 1) for start, across in ((0, 0), (64, 1), (64, 30))
    )
    for far, count in ((on, 1), (aside, 2)):
        where, runs = np.concatenate([near, far]), [np.arange(60), np.arange(60, 120)[::-1]]
        lines = _together(runs, where)
        assert len(lines) == count
        assert sorted(np.concatenate(lines)) == list(range(120))


def test_a_line_on_no_course_is_nobodys_and_one_that_is_there_in_part_stays_whole(two_courses):
    np.testing.assert_array_equal(_whose(two_courses, np.full(100, 3 * two_courses[0].place[0, 0, 2])), -1)
    assert (_whose(two_courses, np.linspace(1, 8, 100) * two_courses[0].place[0, 0, 0]) == -1).all()


def test_a_cut_keeps_the_frames_of_a_movie_that_was_searched_in_part():
    segments, _ = simulate([Pad(whiskers=4, frames=60, spread=60.0)], 1)
    later = segments.assign(segment_frame=segments.segment_frame + 30).assign_attrs(first_frame=30)
    cut, linking = link_thoroughly(later)
    plain, same = link_thoroughly(segments)
    assert cut.attrs == later.attrs
    np.testing.assert_array_equal(cut.segment_frame, plain.segment_frame + 30)
    xr.testing.assert_equal(linking.identity(), same.identity())
    assert set(cut.variables) == set(segments.variables)


def test_lines_that_have_names_keep_them_when_they_are_opened_again():
    segments, _ = simulate([Pad(whiskers=5, frames=150, junk=2.0)], 5)
    lines, linking = link_thoroughly(segments)
    identity = linking.identity()
    named = lines.merge(identity, combine_attrs="override").assign_attrs(lines.attrs)
    same, again = linked_before(named)
    assert same is named
    assert again.whiskers == linking.whiskers
    was, now = identity.segment_whisker.values, again.identity().segment_whisker.values
    assert (was == now)[was >= 0].mean() > 0.98
    # lines of the first part of a longer movie are no less certain
    _, part = linked_before(named.assign_attrs(frames=600))
    longer = part.identity().identity_probability.values
    np.testing.assert_allclose(longer, again.identity().identity_probability.values, atol=0.05)


def test_lines_without_names_are_linked_first_and_keep_what_was_agreed():
    segments, _ = simulate([Pad(whiskers=4, frames=60, spread=60.0)], 1)
    lines, linking = linked_before(segments)
    expected, same = link_thoroughly(segments)
    xr.testing.assert_equal(lines.drop_vars(["segment_whisker", "segment_other", "segment_probability"]), expected)
    was, now = same.identity().segment_whisker.values, linking.identity().segment_whisker.values
    np.testing.assert_array_equal(lines.segment_whisker, was)
    assert (was == now)[was >= 0].mean() > 0.98
