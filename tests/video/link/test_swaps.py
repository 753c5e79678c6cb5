"""Signs of the blocks between meetings of two whiskers, against every sequence of signs, one by one."""

from itertools import product

import numpy as np
import pytest
from scipy.special import logsumexp

from vibrissa.video.link.chains.swaps import _chain


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
