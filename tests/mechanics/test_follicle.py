"""Curvature and moment at the base."""

import numpy as np
import pytest

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.follicle import base_curvature, base_moment
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, youngs_modulus=3.74e9)


def test_base_curvature_is_that_of_the_displaced_shaft():
    kappa, q = cone_kappa(0.3, 3), np.array([[2e-3, -1e-3], [5e-4, 3e-4], [1e-4, 2e-4]])
    arc = np.linspace(0, 0.2, 12)  # clamped: u = C s²/2 + O(s³) from the base
    u = q.T @ cone_modes(kappa, 0.3, 1 - arc) * WHISKER.length
    fit = [np.polynomial.Polynomial.fit(arc * WHISKER.length, row, 10).deriv(2)(0.0) for row in u]
    np.testing.assert_allclose(base_curvature(WHISKER, kappa, 0.3, q), fit, rtol=1e-5)


def test_moment_of_a_curved_cylinder_end_by_hand():
    # b = 60 µm: Eπb⁴/4 = 3.74e9 · π/4 · 1.296e-17 = 3.8068e-8 N m²
    assert base_moment(WHISKER, np.array([2.0]))[0] == pytest.approx(2 * 3.8068e-8, rel=1e-4)
