"""Height profiles: straight between points, walls where they step, and what is refused."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, random_grating


def relief(position, height):
    return HeightProfile(position=np.array(position, float), height=np.array(height, float))


def test_height_worked_by_hand():
    surface = relief([0, 1e-3, 1e-3, 3e-3], [0, 2e-3, 1e-3, -1e-3])
    x = [-1, 0, 0.5e-3, np.nextafter(1e-3, 0), 1e-3, 2e-3, 3e-3, 5, np.nan]
    np.testing.assert_allclose(surface.at(x), [0, 0, 1e-3, 2e-3, 1e-3, 0, -1e-3, -1e-3, np.nan], atol=1e-17)


def test_relief_of_troughs_is_as_high_as_they_are():
    texture = random_grating(0.05, rng=np.random.default_rng(3))
    x = np.random.default_rng(4).uniform(-0.01, 0.06, 10_000)
    np.testing.assert_array_equal(HeightProfile.from_gaps(texture).at(x), texture.height(x))
    edges = np.concatenate([texture.position, texture.end])
    np.testing.assert_array_equal(HeightProfile.from_gaps(texture).at(edges), texture.height(edges))


def test_one_gap_as_points():
    one = HeightProfile.from_gaps(Gaps(position=np.array([2.0]), width=np.array([0.5]), depth=1e-3))
    np.testing.assert_array_equal(one.position, [1.5, 2, 2, 2.5, 2.5, 3])
    np.testing.assert_array_equal(one.height, [0, 0, -1e-3, -1e-3, 0, 0])
    assert one.length == 1.5


@pytest.mark.parametrize(
    ("position", "height", "rule"),
    [
        ([0, 1e-3], [0], ("shape", "relief")),
        ([[0, 1e-3]], [[0, 0]], ("shape", "relief")),
        ([0], [0], ("too-few", "relief")),
        ([0, np.nan], [0, 0], ("format", "relief")),
        ([0, 1e-3], [np.inf, 0], ("format", "relief")),
        ([0, 2e-3, 1e-3], [0, 0, 0], ("format", "relief")),
        ([0, 1e-3, 1e-3, 2e-3], [0, 1e-4, 1e-4, 0], ("format", "relief")),
        ([0, 1e-3, 1e-3, 1e-3], [0, 1e-4, 2e-4, 0], ("format", "relief")),
        ([0, 1e-5], [0, 0], ("range", "relief")),
        ([0, 30], [0, 0], ("format", "relief")),
        ([0, 1e-3], [0, 35], ("format", "relief")),
    ],
)
def test_impossible_reliefs_are_refused(position, height, rule):
    with refusal(*rule) as refused:
        relief(position, height)
    assert len(str(refused.value).splitlines()) == 1


def test_what_lies_low_of_gaps_are_the_gaps():
    texture = random_grating(0.02, rng=np.random.default_rng(5))
    start, width = HeightProfile.from_gaps(texture).low()
    np.testing.assert_array_equal(start, texture.position)
    np.testing.assert_allclose(width, texture.width, rtol=1e-9)
    assert not HeightProfile(position=np.array([0, 1e-2]), height=np.zeros(2)).low()[0].size


def test_a_wall_at_the_end_is_one_as_if_land_followed_it():
    ending = relief([0, 1e-3, 1e-3], [0, 0, -1e-4])
    followed = relief([0, 1e-3, 1e-3, 2e-3], [0, 0, -1e-4, -1e-4])
    x = np.array([-1, 0, 0.5e-3, 1e-3, 1.001e-3, 5e-3, 2])
    np.testing.assert_array_equal(ending.at(x), followed.at(x))
    beginning, led = relief([0, 0, 1e-3], [3e-5, 0, 0]), relief([-1e-3, 0, 0, 1e-3], [3e-5, 3e-5, 0, 0])
    np.testing.assert_array_equal(beginning.at(x), led.at(x))
