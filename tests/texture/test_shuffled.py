"""A shuffled texture has the same gaps and lands, elsewhere."""

import numpy as np

from vibrissa.texture.shuffled import shuffled
from vibrissa.texture.surface import random_grating


def test_gaps_and_lands_are_the_same_in_another_order():
    texture = random_grating(0.1, rng=np.random.default_rng(1))
    other = shuffled(texture, np.random.default_rng(2))
    np.testing.assert_allclose(np.sort(other.width), np.sort(texture.width))
    lands = [one.position[1:] - one.end[:-1] for one in (texture, other)]
    np.testing.assert_allclose(np.sort(lands[0]), np.sort(lands[1]), atol=1e-15)
    np.testing.assert_allclose(other.position[0], texture.position[0])
    assert other.depth == texture.depth
    np.testing.assert_allclose(other.end[-1], texture.end[-1])
    assert abs(np.corrcoef(other.width, texture.width)[0, 1]) < 0.3
