"""Whiskers found without seeds: on scenes whose count is known, and on real stills."""

from functools import cache

import numpy as np
import pytest
from real_data import real
from refusals import refusal
from scenes import scene

from vibrissa.video.camera.rendering import Camera, render_background
from vibrissa.video.find.finding import common_base, find_whiskers
from vibrissa.video.follow.following import REASONS, centrelines
from vibrissa.video.io.movie import read_blocks

SCENES = 100


def one_line(width, height, start, stop, depth=60.0, sigma=0.8, noise=3.0, seed=0):
    """A straight Gaussian line drawn here, on even light with noise."""
    rng = np.random.default_rng(seed)
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    (x0, y0), (x1, y1) = start, stop
    length = np.hypot(x1 - x0, y1 - y0)
    along = ((column - x0) * (x1 - x0) + (row - y0) * (y1 - y0)) / length
    across = (-(column - x0) * (y1 - y0) + (row - y0) * (x1 - x0)) / length
    taper = 1 - 0.6 * along / length
    dark = depth * taper * np.exp(-(across**2) / (2 * sigma**2)) * ((along >= 0) & (along <= length))
    return np.clip(np.rint(180 - dark + noise * rng.standard_normal(dark.shape)), 0, 255).astype(np.uint8)


def distances(found, lines):
    """Distance of each seed to each true centreline [px]."""
    return np.array([[np.hypot(c - w.seed[0], r - w.seed[1]).min() for c, r in lines] for w in found])


@cache
def found_in(seed):
    return find_whiskers(scene(seed).image)


def right(seed):
    """Whether each whisker has one seed on it, and no other seed is there."""
    one, found = scene(seed), found_in(seed)
    off = distances(found, one.lines)
    return len(found) == len(one.lines) and off.min(axis=1).max() < 2 and len(set(off.argmin(axis=1))) == len(found)


def test_every_whisker_has_one_seed_in_nineteen_scenes_of_twenty():
    wrong = [seed for seed in range(SCENES) if not right(seed)]
    assert len(wrong) <= 0.05 * SCENES, wrong


def test_the_side_of_the_bases_is_the_thick_one():
    for seed in range(20):
        assert common_base(found_in(seed)) == scene(seed).base, seed


def test_a_seed_is_on_its_whisker_for_the_tracker_too():
    reasons = []
    for seed in range(12):
        (lines,) = centrelines([scene(seed).image[None]], seeds=[w.seed for w in found_in(seed)])
        reasons += [REASONS[code] for code in lines.reason[:, 0]]
    # where whiskers cross in the first frame, the tracker may read two on one line, and says so
    assert set(reasons) <= {"followed", "on another whisker's line"}
    assert reasons.count("followed") > 0.8 * len(reasons)


@pytest.mark.parametrize(
    ("start", "stop", "base"),
    [
        ((20, 40), (180, 80), "left"),
        ((180, 120), (20, 60), "right"),
        ((90, 10), (120, 140), "top"),
        ((60, 150), (100, 10), "bottom"),
    ],
)
def test_a_line_is_found_in_every_direction_with_its_length(start, stop, base):
    (found,) = find_whiskers(one_line(200, 160, start, stop))
    assert found.base == base
    np.testing.assert_allclose(found.length, np.hypot(*np.subtract(stop, start)), atol=25)
    (dx, dy), (x, y) = np.subtract(stop, start), np.subtract(found.line, start).T
    across = (dx * y - dy * x) / np.hypot(dx, dy)
    assert np.abs(across).max() < 1.5


def test_bright_whiskers_are_found_where_they_are_asked_for():
    image = one_line(200, 160, (20, 40), (180, 80))
    assert not find_whiskers(image, polarity="bright")
    (found,) = find_whiskers(255 - image, polarity="bright")
    assert found.base == "left"


def test_edges_noise_and_slopes_of_light_are_no_whiskers():
    camera = Camera(width=200, height=160, background=150.0, gradient=(100, 60))
    rng = np.random.default_rng(3)
    for noise in (0, 1, 6):
        light = render_background(camera).astype(float)
        light[60:, 120:] = 20  # a face, a holder
        image = np.clip(light + noise * rng.standard_normal(light.shape), 0, 255).astype(np.uint8)
        assert not find_whiskers(image)


def test_a_base_given_leaves_out_lines_that_do_not_run_from_it():
    image = np.minimum(one_line(200, 160, (20, 60), (180, 80)), one_line(200, 160, (100, 10), (110, 150)))
    assert len(find_whiskers(image)) == 2
    (across,) = find_whiskers(image, base="left")
    (down,) = find_whiskers(image, base="top")
    assert across.base == "left"
    assert down.base == "top"
    assert abs(across.seed[1] - 70) < 15
    assert abs(down.seed[0] - 105) < 15


def test_seeds_lie_in_the_region():
    image = one_line(200, 160, (20, 60), (180, 80))
    (found,) = find_whiskers(image, region=(120, 0, 199, 159))
    assert found.seed[0] >= 120
    assert not find_whiskers(image, region=(0, 100, 199, 159))


@pytest.mark.parametrize(
    ("still", "seeds", "base"),
    [
        ("one-whisker.jpg", [(250, 133)], "right"),
        ("three-whiskers.png", [(200, 99), (200, 180), (200, 242)], "left"),
    ],
)
def test_whiskers_of_real_stills_are_found_and_counted(still, seeds, base):
    (image,) = next(read_blocks(real(f"stills/{still}")))
    found = find_whiskers(image)
    assert len(found) == len(seeds)
    assert common_base(found) == base
    for point in seeds:
        assert min(np.hypot(*(w.line - point).T).min() for w in found) < 4


def test_a_dense_field_gives_the_whiskers_that_stand_clear():
    (image,) = next(read_blocks(real("whiskiwrap-movies/test_video2.mp4"), 1))
    found = find_whiskers(image)
    assert common_base(found) == "left"
    assert 3 <= len(found) <= 6
    assert all(w.seed[1] > 180 for w in found)  # none on the holder


@pytest.mark.parametrize(
    ("bad", "rule"),
    [
        ({"image": np.zeros((3, 40, 40))}, ("shape", "image")),
        ({"image": np.zeros((10, 40))}, ("shape", "image")),
        ({"polarity": "grey"}, ("unknown", "polarity")),
        ({"base": "middle"}, ("unknown", "base")),
    ],
)
def test_bad_input_is_told(bad, rule):
    with refusal(*rule):
        find_whiskers(**{"image": np.zeros((40, 40))} | bad)
