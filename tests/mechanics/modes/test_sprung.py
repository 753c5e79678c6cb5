"""Modes of a cone whose base is held by springs, against Bessel functions, the clamp and the rod."""

import numpy as np
import pytest
from refusals import refusal
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv

from vibrissa.exact import cone_kappa, cone_modes
from vibrissa.mechanics.modes.sprung import sprung_modes, sprung_shapes
from vibrissa.mechanics.rod.damping import rod_modes
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness
from vibrissa.mechanics.rod.kernels.shaft import shaft
from vibrissa.mechanics.rod.kernels.step_kernels import Follicle
from vibrissa.mechanics.rod.mesh import Fineness, graded_nodes
from vibrissa.mechanics.statics.contact_law import ContactLaw


def solutions(kappa, s, derivative):
    """The four solutions of Eq. (2), z⁻²F₂(z) with z = 2√(κs), and their derivatives by s."""
    z, order = 2 * np.sqrt(kappa * s), 2 + derivative
    sign = np.array([(-1) ** derivative, (-1) ** derivative, 1, (-1) ** derivative])
    return (2 * kappa) ** derivative * z**-order * sign * np.array([f(order, z) for f in (jv, yv, iv, kv)])


def determinant(kappa, contact, rotation, translation):
    rows = np.array([
        solutions(kappa, contact, 0),
        solutions(kappa, contact, 2),
        solutions(kappa, 1, 2) + rotation * solutions(kappa, 1, 1),
        solutions(kappa, 1, 3) + 4 * solutions(kappa, 1, 2) - translation * solutions(kappa, 1, 0),
    ])  # fmt: skip
    rows = rows / np.abs(rows).max(axis=0)
    return np.linalg.det(rows / np.abs(rows).max(axis=1)[:, None])


@pytest.mark.parametrize(("contact", "rotation", "translation"), [(0.29, 3, 100), (0.2, 10, 300), (0.1, 3, 1e4)])
def test_sprung_modes_are_roots_of_bessel_functions(contact, rotation, translation):
    kappa, _ = sprung_modes(contact, rotation, translation)
    exact = [brentq(determinant, 0.999 * k, 1.001 * k, (contact, rotation, translation), xtol=1e-12) for k in kappa]
    np.testing.assert_allclose(kappa, exact, rtol=3e-6)


@pytest.mark.parametrize("contact", [0.1, 0.29, 0.5])
def test_stiff_springs_are_a_clamp(contact):
    kappa, shape = sprung_modes(contact, 1e5, 1e6)
    s = np.linspace(contact, 1, 50)
    np.testing.assert_allclose(kappa, cone_kappa(contact, 3), rtol=3e-3)
    found, exact = sprung_shapes(contact, shape, s), cone_modes(cone_kappa(contact, 3), contact, s)
    np.testing.assert_allclose(np.abs(found), np.abs(exact), atol=0.01 * np.abs(exact).max())


def test_springs_soften_the_first_mode_as_the_rod_says():
    follicle, errors = Follicle(100.0, 3.0), []
    kappa, _ = sprung_modes(0.29, follicle.rotation, follicle.translation)
    for factor in (1, 2):
        s = graded_nodes(0.2, 0.29, Fineness().refined(factor))
        s = s[s > 0.29 - 1e-12]
        places = np.stack([s, np.zeros_like(s)], axis=1)
        places[0, 1] = -1e-15
        rod, hard = shaft(s, 1.5e-3), Stiffness(1e9, 1e9, ContactLaw(0.0))
        found = rod_modes(rod, np.append(places.ravel(), 0.0), hard, 0.0, follicle)
        bending = found.kappa[[0, 2]]  # the other is the shaft on the springs along x
        errors.append(np.abs(bending / kappa[:2] - 1).max())
        assert found.kappa[1] == pytest.approx(np.sqrt(100 / rod.mass.sum()), rel=1e-3)
    assert errors[1] < errors[0] / 3 < 5e-3
    assert kappa[0] / cone_kappa(0.29, 1)[0] < 0.65


def test_modes_are_normalised():
    s = np.linspace(0.29, 1, 4001)
    _, shape = sprung_modes(0.29, 3.0, 100.0)
    moved = sprung_shapes(0.29, shape, s)
    np.testing.assert_allclose(np.trapezoid(s**2 * moved[:, None] * moved, s), np.eye(3), atol=1e-5)


def test_springs_out_of_range_are_refused():
    with refusal("range", "stiffness against rotation"):
        sprung_modes(0.29, 0.0, 100.0)
    with refusal("range", "contact"):
        sprung_modes(0.01, 3.0, 100.0)
