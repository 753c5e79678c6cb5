"""P-values of what envelope and phase explain, of rates that neither drives."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vibrissa.neural.coding.phase_parts import by_chance


def test_small_p_values_are_as_rare_as_they_say():
    rng, n, smooth = np.random.default_rng(3), 3000, 15
    found = []
    for _ in range(1500):
        one, *two = gaussian_filter1d(rng.normal(size=(3, n)), smooth, axis=1, mode="wrap")
        found.append(by_chance(np.array(two) - np.mean(two, axis=1, keepdims=True), one, 30, 4 * smooth))
    share = [np.mean(np.array(found) <= q) for q in (0.05, 0.01, 0.003, 0.001)]
    assert np.all(share <= np.array([0.075, 0.02, 0.008, 0.004]))  # about two standard errors above a small excess
