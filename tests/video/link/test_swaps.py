"""Signs of the blocks between meetings of two whiskers, against every sequence of signs, one by one."""

from itertools import product

import numpy as np
import pytest
from scipy.special import logsumexp

from vibrissa.video.link.chains.swaps import Wandering, _chain, swap_of
from vibrissa.video.link.chains.whisker_models import prior_spread


@pytest.mark.parametrize("blocks", [1, 2, 7])
def test_signs_are_the_likeliest_sequence_and_chances_the_sums_over_all(blocks):
    rng = np.random.default_rng(blocks)
    for _ in range(20):
        block, cut = rng.normal(0, 3, blocks), rng.uniform(0, 6, blocks - 1)
        every = np.array(list(product([1.0, -1.0], repeat=blocks)))
        worth = every @ block / 2 - (np.diff(every, axis=1) != 0) @ cut
        sign, chance = _chain(block, cut)
        np.testing.assert_array_equal(sign, every[np.argmax(worth)])
        turned = [logsumexp(worth[every[:, b] < 0]) - logsumexp(worth) for b in range(blocks)]
        np.testing.assert_allclose(chance, np.exp(turned), rtol=1e-9)


def test_where_nothing_decides_names_stay():
    sign, chance = _chain(np.zeros(4), np.array([0.1, 2.0, 0.7]))
    assert sign.tolist() == [1.0] * 4
    assert (chance == 0.5).all()  # to the bit: above it names would be exchanged


def test_what_a_short_line_does_not_show_says_nothing_of_a_swap():
    """Two whiskers cross with every swing; of the one below the inner part is not seen, and is guessed."""
    rng = np.random.default_rng(2)
    frame = np.arange(200)
    phase = np.stack([20 * np.sin(2 * np.pi * frame / 60), 20 * np.cos(2 * np.pi * frame / 60)], axis=1)
    shown = np.abs(0.3 * phase[:, 0]) > 1.5
    apart = np.tile(0.3 * phase[:, :1], (1, 3)) + rng.normal(0, 0.5, (200, 3))
    below = phase[:, 0] > 0
    apart[below, 0] -= 14.0  # a guess that is wrong by the same in every frame
    error = np.tile(0.1 * np.eye(3), (2, 200, 1, 1))
    error[1, below, 0, 0] = 8.0**2
    usual, alike = prior_spread(np.array([0.8, 1.0, 1.1])), np.zeros((shown.sum(), 2))

    def swapped(error):
        known = Wandering(usual, np.zeros((3, 3)), error[:, shown], 0.85, True)
        lines = apart[shown], np.zeros((shown.sum(), 3))
        found = swap_of(frame[shown], *lines, alike, known, phase[shown], np.zeros(shown.sum() - 1))
        return found.chance > 0.5

    assert not swapped(error).any()
    everywhere_alike = np.broadcast_to(error.mean(axis=1, keepdims=True), error.shape)
    assert swapped(everywhere_alike).any()
