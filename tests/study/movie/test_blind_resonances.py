"""Resonances in air from geometry alone, beside those seen in awake rats."""

import numpy as np

from vibrissa.study.movie.geometry import atlas_dataset

# Wolfe et al. 2008, PLoS Biol 6:e215, abstract: fundamental while whisking in air, "approximately" [Hz]
AWAKE = {"delta": 35.0, "D3": 110.0}


def test_mean_cones_of_delta_and_d3_resonate_near_what_awake_rats_show():
    predicted = np.array([float(atlas_dataset(name).first_resonance_in_air[0]) for name in AWAKE])
    np.testing.assert_allclose(predicted, [37.2, 123.7], atol=0.05)  # docs/validation.md
    np.testing.assert_allclose(predicted / list(AWAKE.values()), 1, atol=0.15)  # one elastic modulus for all: 13 %
