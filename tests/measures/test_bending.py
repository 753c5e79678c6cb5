"""Δκ against the free whisker."""

import numpy as np

from vibrissa.measures.bending import bending


def test_it_does_not_depend_on_the_line_of_the_face():
    rng = np.random.default_rng(0)
    angle = np.radians(90 + 20 * np.sin(np.arange(3000) / 40)) + 0.02 * rng.standard_normal(3000)
    curvature = 20 + 40 * (angle - 1.5) ** 2 + rng.standard_normal(3000)
    here = bending(angle, curvature, np.ones(3000, bool))
    turned = bending(angle + np.radians(0.7), curvature, np.ones(3000, bool))
    np.testing.assert_allclose(turned.change, here.change, atol=1e-9)
    np.testing.assert_array_equal(turned.held, here.held)
