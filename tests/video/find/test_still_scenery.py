"""Scenery of a movie: what stays, in one part of the movie after another; frames with too many lines."""

import numpy as np
import pytest
from drawn_lines import DrawnLine, draw

from vibrissa.video.find import frame_lines, movie_segments
from vibrissa.video.find.movie_segments import LineSearch, find_segments
from vibrissa.video.find.still_scenery import even_sample, sceneries


@pytest.mark.parametrize("count", [1, 5, 11, 12, 100, 777])
def test_a_sample_is_even_whatever_the_number(count):
    frames = (np.full((2, 2), k) for k in range(count))
    numbers = np.array([k for k, _ in even_sample(frames, 6)])
    assert min(count, 6) <= numbers.size < 12
    assert numbers[0] == 0
    assert len(set(np.diff(numbers))) <= 1
    assert numbers.size == 1 or count - numbers[-1] <= numbers[1]


def test_each_part_has_its_scenery_and_a_short_rest_has_the_one_before():
    movie = np.concatenate([np.full((100, 4, 4), 10, np.uint8), np.full((100, 4, 4), 30, np.uint8)])
    one = [image[0, 0] for image in sceneries([movie[:150]], "mean", span=100)]
    two = [image[0, 0] for image in sceneries([movie[:149]], "mean", span=100)]
    assert (one, two) == ([10, 30], [10])
    # a black frame moves the mean, not the median
    movie[5] = 0
    (median,) = sceneries([movie[:100]], "median", span=100)
    assert median[0, 0] == 10


def test_scenery_that_is_moved_between_parts_gives_no_lines(monkeypatch):
    """A post that is elsewhere in the second part is scenery there too; one image for all has both."""
    monkeypatch.setattr(movie_segments, "SPAN", 64)
    monkeypatch.setattr(movie_segments.sceneries, "__defaults__", (64,))
    rng = np.random.default_rng(3)
    sweeps = [DrawnLine(0.3, offset, 45.0) for offset in np.tile(np.linspace(-45, 45, 32), 4)]
    posts = [DrawnLine(1.2, -30.0, 50.0, 60.0), DrawnLine(1.2, 35.0, 50.0, 60.0)]
    movie = np.stack([draw([posts[k // 64], sweep], rng=rng) for k, sweep in enumerate(sweeps)])
    for kind in ("mean", "median"):
        found = find_segments(movie, LineSearch(background=kind, line_width=1.8))
        angle = [np.arctan2(np.ptp(one[:, 1]), np.ptp(one[:, 0])) for one in lines(found)]
        assert 110 <= len(angle) <= 140
        assert np.mean(np.array(angle) < 0.5) > 0.97


def lines(found):
    return np.split(np.stack([found.column, found.row], axis=1), found.segment_start.values[1:])


def test_frames_with_more_lines_than_are_kept_say_so(monkeypatch):
    """Lines at two directions in turn, so that none goes on as another."""
    one, other = (draw([DrawnLine(angle, 0.0, 13.0, 60.0)], size=36) for angle in (0.3, 1.9))
    image = np.tile(np.block([[one, other], [other, one]]), (3, 3))
    assert find_segments(image[None], LineSearch(line_width=1.8)).attrs["remarks"] == "[]"
    monkeypatch.setattr(frame_lines, "LINES", 20)
    crowded = find_segments(image[None], LineSearch(line_width=1.8))
    assert crowded.sizes["segment"] <= 20
    assert "more lines than are kept" in crowded.attrs["remarks"]
