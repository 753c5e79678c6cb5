"""Height profiles: straight between points, walls where they step, and what is refused."""

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.texture.relief import Relief
from vibrissa.texture.surface import Troughs, random_grating


def relief(position, height):
    return Relief(position=np.array(position, float), height=np.array(height, float))


def test_height_worked_by_hand():
    surface = relief([0, 1e-3, 1e-3, 3e-3], [0, 2e-3, 1e-3, -1e-3])
    x = [-1, 0, 0.5e-3, np.nextafter(1e-3, 0), 1e-3, 2e-3, 3e-3, 5, np.nan]
    np.testing.assert_allclose(surface.at(x), [0, 0, 1e-3, 2e-3, 1e-3, 0, -1e-3, -1e-3, np.nan], atol=1e-17)


def test_relief_of_troughs_is_as_high_as_they_are():
    texture = random_grating(0.05, rng=np.random.default_rng(3))
    x = np.random.default_rng(4).uniform(-0.01, 0.06, 10_000)
    np.testing.assert_array_equal(Relief.from_troughs(texture).at(x), texture.height(x))
    edges = np.concatenate([texture.position, texture.end])
    np.testing.assert_array_equal(Relief.from_troughs(texture).at(edges), texture.height(edges))


def test_one_gap_as_points():
    one = Relief.from_troughs(Troughs(position=np.array([2.0]), width=np.array([0.5]), depth=1e-3))
    np.testing.assert_array_equal(one.position, [1.5, 2, 2, 2.5, 2.5, 3])
    np.testing.assert_array_equal(one.height, [0, 0, -1e-3, -1e-3, 0, 0])
    assert one.length == 1.5


@pytest.mark.parametrize(
    ("position", "height", "rule"),
    [
        ([0, 1e-3], [0], "one height for each"),
        ([[0, 1e-3]], [[0, 0]], "one height for each"),
        ([0], [0], "at least two points"),
        ([0, np.nan], [0, 0], "finite .*, got point 2"),
        ([0, 1e-3], [np.inf, 0], "finite .*, got point 1"),
        ([0, 2e-3, 1e-3], [0, 0, 0], r"ascending positions, got point 3 at 0\.001 m.*sort"),
        ([0, 1e-3, 1e-3, 2e-3], [0, 1e-4, 1e-4, 0], "must not repeat a point, got point 3"),
        ([0, 1e-3, 1e-3, 1e-3], [0, 1e-4, 2e-4, 0], "no more than two heights at one position, got point 4"),
        ([0, 1e-5], [0, 0], "at least 3.5e-05 m long.*in metres"),
        ([0, 30], [0, 0], "within 10 m, got point 2.*in metres"),
        ([0, 1e-3], [0, 35], "within 0.01 m of the substrate line, got point 2.*in metres"),
    ],
)
def test_impossible_reliefs_are_refused(position, height, rule):
    with pytest.raises(InputError, match=rule) as refused:
        relief(position, height)
    assert len(str(refused.value).splitlines()) == 1


def test_what_lies_low_of_gaps_are_the_gaps():
    texture = random_grating(0.02, rng=np.random.default_rng(5))
    start, width = Relief.from_troughs(texture).low()
    np.testing.assert_array_equal(start, texture.position)
    np.testing.assert_allclose(width, texture.width, rtol=1e-9)
    assert not Relief(position=np.array([0, 1e-2]), height=np.zeros(2)).low()[0].size
