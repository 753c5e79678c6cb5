"""All lines in all frames: lines drawn at every angle, scenes of the virtual camera, recorded movies and stills."""

from functools import cache

import numpy as np
import pytest
from drawn_lines import DrawnLine, across, draw, parts
from real_data import real
from refusals import refusal
from scenes import scene
from scipy.spatial import cKDTree

from vibrissa.quantities import require
from vibrissa.quantities.segments import SEGMENTS
from vibrissa.video.find.movie_segments import LineSearch, find_segments, joined, segment_blocks
from vibrissa.video.foreign.whisk_files import read_whiskers
from vibrissa.video.io.colour import write_colour
from vibrissa.video.io.movie import read_blocks

ANGLES, SEEDS = 15, 50
LENGTH = 90.0


@cache
def drawn():
    """Lines at all angles, and what is found in a movie with one of them in each frame."""
    rng = np.random.default_rng(2)
    angles = np.pi * (np.arange(ANGLES) + 0.1) / ANGLES
    lines = [DrawnLine(angle, rng.uniform(-1, 1), LENGTH / 2) for angle in angles for _ in range(SEEDS)]
    return lines, find_segments(np.stack([draw([line], rng=rng) for line in lines]))


def offsets(lines, found):
    """Frame, distance across the true line, place along it, and SD, of all points (n, 4)."""
    rows = []
    for frame, points in parts(found):
        off, along = across(lines[frame], 128, points[:, 0], points[:, 1])
        rows.append(np.stack([np.full(off.size, frame), off, along, points[:, 4]], axis=1))
    return np.concatenate(rows)


def test_a_line_at_any_angle_is_one_segment_from_end_to_end():
    lines, found = drawn()
    assert found.sizes["segment"] == len(lines)
    np.testing.assert_array_equal(found.segment_frame, np.arange(len(lines)))
    lengths = [np.ptp(across(lines[frame], 128, points[:, 0], points[:, 1])[1]) for frame, points in parts(found)]
    np.testing.assert_allclose(np.median(lengths), LENGTH, atol=2)
    assert np.mean(np.abs(np.array(lengths) - LENGTH) < 8) > 0.97
    # points are a pixel apart
    steps = np.concatenate([np.hypot(*np.diff(points[:, :2], axis=0).T) for _, points in parts(found)])
    np.testing.assert_allclose(np.median(steps), 1, atol=0.05)


def test_the_position_has_no_bias_at_any_angle():
    lines, found = drawn()
    frame, off, _, sd = offsets(lines, found).T
    for k in range(ANGLES):
        here = (frame // SEEDS == k) & np.isfinite(sd)
        means = [off[here & (frame == one)].mean() for one in np.unique(frame[here])]
        assert abs(np.mean(means)) < 4 * np.std(means) / np.sqrt(SEEDS), k


def test_the_standard_deviation_is_that_of_the_errors():
    lines, found = drawn()
    _, off, along, sd = offsets(lines, found).T
    inner = np.isfinite(sd) & (np.abs(along) < LENGTH / 2 - 2)
    ratio = off[inner] / sd[inner]
    assert 0.95 < ratio.std() < 1.05
    assert 0.93 < np.mean(np.abs(ratio) < 1.96) < 0.97
    assert np.mean(~np.isfinite(sd)) < 0.01


@pytest.mark.parametrize(("sigma", "depth"), [(0.6, 60.0), (1.5, 40.0), (3.0, 40.0)])
def test_width_and_contrast_are_measured_whatever_the_scale(sigma, depth):
    rng = np.random.default_rng(5)
    line = DrawnLine(0.5, 0.3, 80.0, depth, sigma)
    found = find_segments(np.stack([draw([line], size=200, rng=rng) for _ in range(3)]))
    width = np.sqrt(8 * np.log(2)) * sigma
    assert found.sizes["segment"] == 3
    np.testing.assert_allclose(np.nanmedian(found.line_width), width, rtol=0.06)
    np.testing.assert_allclose(np.nanmedian(found.line_contrast), depth, rtol=0.06)


@pytest.mark.parametrize("between", [10, 15, 20, 35, 60, 90])
def test_two_lines_that_cross_each_go_straight_on(between):
    rng = np.random.default_rng(6)
    frames = []
    for start in np.arange(0, 180, 15):
        angles = np.radians([start, start + between])
        frames.append([DrawnLine(angle, 0.0, 55.0, depth) for angle, depth in zip(angles, (50, 40), strict=True)])
    found = find_segments(np.stack([draw(lines, rng=rng) for lines in frames]))
    straight = 0
    for frame, points in parts(found):
        off = np.array([np.abs(across(line, 128, *points[:, :2].T)[0]).max() for line in frames[frame]])
        straight += off.min() < 2 and np.hypot(*np.ptp(points[:, :2], axis=0)) > 95
    assert straight >= 2 * len(frames) - 2
    assert found.sizes["segment"] <= 2 * len(frames) + 1


def test_bright_lines_are_the_dark_ones_of_the_negative():
    lines = [DrawnLine(0.4, 0.2), DrawnLine(2.0, -0.4)]
    movie = np.stack([draw(lines, rng=np.random.default_rng(seed)) for seed in range(3)])
    dark = find_segments(movie, LineSearch(line_width=1.8))
    bright = find_segments(255 - movie, LineSearch(line_width=1.8, polarity="bright"))
    assert dark.sizes["segment"] == 6
    np.testing.assert_allclose(bright.column, dark.column, atol=1e-3)
    np.testing.assert_allclose(bright.position_sd, dark.position_sd, rtol=1e-3)
    assert find_segments(movie, LineSearch(line_width=1.8, polarity="bright")).sizes["segment"] == 0


def test_noise_an_edge_and_a_body_are_no_lines():
    rng = np.random.default_rng(3)
    for noise in (0, 1, 6):
        light = np.full((160, 200), 150.0) + np.linspace(0, 60, 200)
        light[60:, 120:] = 15
        image = np.clip(light + noise * rng.standard_normal(light.shape), 0, 255).astype(np.uint8)
        assert find_segments(image[None], LineSearch(line_width=1.8)).sizes["segment"] == 0, noise


@pytest.mark.parametrize(("radius", "whole"), [(6, True), (15, True), (30, False)])
def test_a_line_goes_on_behind_a_pole_and_ends_at_a_body(radius, whole):
    rng = np.random.default_rng(1)
    row, column = np.mgrid[:128, :128]
    dark = np.hypot(row - 64, column - 64) < radius
    frames = np.stack([draw([DrawnLine(angle, 3.0, 60.0)], rng=rng) for angle in (0.4, 1.2, 2.5)])
    found = find_segments(np.where(dark, np.uint8(12), frames))
    assert np.bincount(found.segment_frame, minlength=3).tolist() == ([1, 1, 1] if whole else [2, 2, 2])
    for _, points in parts(found):  # what the pole hides is not measured
        hidden = np.hypot(points[:, 0] - 64, points[:, 1] - 64) < radius - 2
        assert np.isnan(points[hidden, 4]).all()


def test_scenery_that_stays_vanishes_with_the_median_and_whiskers_that_sweep_remain():
    rng = np.random.default_rng(4)
    post = DrawnLine(1.2, -30.0, 50.0, 60.0)
    sweeps = [DrawnLine(0.3, offset, 45.0) for offset in np.linspace(-10, 40, 24)]
    # the post is taken away before the end: where it was the image is then brighter than the median
    movie = np.stack([draw([post, sweep][k > 19 :], rng=rng) for k, sweep in enumerate(sweeps)])
    assert find_segments(movie).sizes["segment"] >= 2 * len(movie) - 6
    found = find_segments(movie, LineSearch(background="median", line_width=1.8))
    assert found.sizes["segment"] == len(movie)
    _, off, _, _ = offsets(sweeps, found).T
    assert np.abs(off).max() < 1.5


def test_blocks_threads_and_regions_give_the_same_lines():
    rng = np.random.default_rng(8)
    movie = np.stack([draw([DrawnLine(0.2 + 0.01 * k, 0.1 * k)], rng=rng) for k in range(40)])
    search = LineSearch(line_width=1.8, threads=2)
    calls = []
    whole = find_segments(movie, search, progress=lambda *call: calls.append(call))
    assert whole.identical(joined(segment_blocks(movie, LineSearch(line_width=1.8))))
    assert calls[-1][1:] == (40, 40)
    require(whole, *SEGMENTS)
    assert (whole.attrs["frames"], whole.attrs["width"], whole.attrs["height"]) == (40, 128, 128)
    late = find_segments(movie, search, start=35)
    np.testing.assert_array_equal(late.segment_frame, np.arange(35, 40))
    part = find_segments(movie, LineSearch(line_width=1.8, region=(10, 30, 120, 100)))
    assert part.sizes["segment"] == 40
    for (_, one), (_, other) in zip(parts(part), parts(whole), strict=True):
        # points of both are a pixel apart, from different first ones
        assert np.median(cKDTree(other[:, :2]).query(one[:, :2])[0]) < 0.55


def test_a_movie_in_colour_is_read_as_grey_and_says_so(tmp_path):
    rng = np.random.default_rng(9)
    grey = np.stack([draw([DrawnLine(0.7, 0.4)], rng=rng) for _ in range(3)])
    # light of one colour: red, green and blue are shares of the grey level
    write_colour(tmp_path / "colour.mkv", (grey[..., None] * np.array([1.0, 0.9, 0.5])).astype(np.uint8))
    found = find_segments(tmp_path / "colour.mkv")
    assert "colour" in found.attrs["remarks"]
    assert found.sizes["segment"] == 3


def test_whiskers_of_rendered_scenes_are_covered():
    covered, total = 0, 0
    for seed in range(30):
        one = scene(seed)
        found = find_segments(one.image[None])
        tree = cKDTree(np.stack([found.column, found.row], axis=1))
        for column, row in one.lines:
            off, _ = tree.query(np.stack([column, row], axis=1))
            covered, total = covered + np.count_nonzero(off < 1.5), total + off.size
    assert covered > 0.9 * total


@pytest.mark.parametrize(("still", "region"), [(1, (80, 260, 160, 330)), (4, (250, 400, 240, 450))])
def test_hand_drawn_whiskers_are_found(still, region):
    (image,) = next(read_blocks(real(f"whisking/still-{still}.png")))
    (mask,) = next(read_blocks(real(f"whisking/still-{still}-mask.png")))
    row, column = np.nonzero(mask > 100)
    left, right, top, bottom = region
    inside = (column >= left) & (column <= right) & (row >= top) & (row <= bottom)
    found = find_segments(image[None])
    # ten places between two points of a line
    lines = [points[:, :2] for _, points in parts(found)]
    ends = [np.linspace(0, len(line) - 1, 10 * len(line)) for line in lines]
    between = [
        np.stack([np.interp(at, np.arange(len(one)), one[:, k]) for k in (0, 1)], axis=1)
        for at, one in zip(ends, lines, strict=True)
    ]
    off, _ = cKDTree(np.concatenate(between)).query(np.stack([column, row], axis=1)[inside])
    assert np.mean(off <= 2) >= 0.75
    assert np.median(off[off <= 2]) <= 0.35


def test_whisks_long_segments_are_found_too():
    path = real("whiskiwrap-movies/test_video2.mp4")
    every = 100
    theirs = [one for one in read_whiskers(real("whiskiwrap-movies/test_video2.whiskers")) if one.frame % every == 0]
    theirs = [one for one in theirs if one.x.size > 100]
    movie = np.stack([frame for block in read_blocks(path) for frame in block])[::every]
    found = dict.fromkeys(range(len(movie)), np.full((1, 5), np.inf))
    for frame, points in parts(find_segments(movie)):
        found[frame] = np.concatenate([found[frame], points])
    shares = []
    for one in theirs:
        near = found[one.frame // every][:, :2]
        off = np.hypot(one.x[:, None] - near[:, 0], one.y[:, None] - near[:, 1]).min(axis=1)
        shares.append(np.mean(off < 2))
    assert np.mean(np.array(shares) > 0.5) >= 0.95


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: find_segments(np.zeros((40, 40), np.uint8)), ("shape", "movie")),
        (lambda: find_segments(np.zeros((2, 20, 40), np.uint8)), ("range", "movie")),
        (lambda: find_segments(np.zeros((2, 40, 40), np.uint8), start=3), ("range", "start, stop")),
        (lambda: LineSearch(polarity="grey"), ("unknown", "polarity")),
        (lambda: LineSearch(background="mode"), ("unknown", "background")),
        (lambda: LineSearch(least_length=0), ("range", "least_length")),
        (lambda: LineSearch(threads=0), ("range", "threads")),
        (
            lambda: find_segments(np.zeros((2, 40, 40), np.uint8), LineSearch(region=(0, 0, 50, 39))),
            ("range", "region"),
        ),
        (
            lambda: find_segments(np.zeros((2, 40, 40), np.uint8), LineSearch(background=np.zeros((3, 3)))),
            ("shape", "background"),
        ),
    ],
)
def test_bad_searches_are_refused(call, rule):
    with refusal(*rule):
        call()
