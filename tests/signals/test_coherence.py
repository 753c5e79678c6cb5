"""Coherence within a band."""

import numpy as np

from vibrissa.signals.coherence import band_coherence


def test_a_constant_signal_has_no_coherence():
    noise = np.random.default_rng(0).normal(size=4000)
    for pair in ((np.zeros(4000), noise), (noise, np.ones(4000))):
        assert np.isnan(band_coherence(*pair, 1000.0, 0.5, (5.0, 50.0)))
    assert abs(band_coherence(noise, noise, 1000.0, 0.5, (5.0, 50.0)) - 1) < 1e-9
