"""The rod at rest against Eq. (1), exact modes, and modes about the curved profile; and its damping."""

import numpy as np
import pytest
from refusals import refusal
from rods import POSTURE, cone, resting
from scipy.linalg import eigh

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.rod.damping import rod_modes
from vibrissa.mechanics.rod.equilibrium import resting_rod
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness
from vibrissa.mechanics.rod.kernels.ground import ground_of
from vibrissa.mechanics.rod.kernels.shaft import shaft
from vibrissa.mechanics.rod.mesh import Fineness, graded_nodes
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.statics.contact_law import ContactLaw
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture

REFINED = (1, 2, 4)


def test_the_modes_of_the_straight_shaft_converge_to_the_exact_ones():
    errors, hard = [], Stiffness(1e9, 1e9, ContactLaw(0.0))
    for factor in REFINED:
        s = graded_nodes(0.2, 0.29, Fineness().refined(factor))
        s = s[s > 0.29 - 1e-12]
        places = np.stack([s, np.zeros_like(s)], axis=1)
        places[0, 1] = -1e-15  # the first node alone touches
        found = rod_modes(shaft(s, 1.5e-3), np.append(places.ravel(), 0.0), hard, 0.0)
        errors.append(found.kappa / cone_kappa(0.29, 3) - 1)
    np.testing.assert_allclose(errors[0], 0, atol=0.015)
    np.testing.assert_allclose(errors[-1], 0, atol=1.2e-3)
    assert np.all(np.abs(errors[0]) > 3 * np.abs(errors[1]))  # second order: 4
    assert np.all(np.abs(errors[1]) > 3 * np.abs(errors[2]))


def test_the_modes_of_a_free_cone_are_those_in_air():
    s = np.linspace(1e-4, 1, 400)
    rod = shaft(s, 1.5e-3)
    size = s.size
    bend = np.zeros((size, size))  # ½ Σ B (Δy_i/h_i − Δy_{i−1}/h_{i−1})², clamped at the base
    for i in range(1, size):
        row = np.zeros(size)
        row[i - 1 : i + 1] += np.array([1, -1]) / rod.rest[i - 1]
        if i < size - 1:
            row[i : i + 2] += np.array([-1, 1]) / rod.rest[i]
        bend += rod.bending[i] * np.outer(row, row)
    kappa = np.sqrt(eigh(bend[:-1, :-1], np.diag(rod.mass[:-1]), eigvals_only=True)[:2])
    np.testing.assert_allclose(kappa, [8.71925886, 21.14566239], rtol=1e-3)  # MODEL.md


@pytest.mark.parametrize("posture", [POSTURE, Posture(contact=0.2, base_angle=1.0, friction=0.3)], ids=str)
def test_the_equilibrium_converges_to_the_stationary_profile(posture):
    flat, errors = on_the_flat(posture), []
    for factor in REFINED:
        rod = resting(tip=posture.contact - 0.05, refined=factor, posture=posture)
        normal, drag, first, last = rod.touch.summary[:4]
        assert drag == pytest.approx(-posture.friction * normal, rel=1e-9)
        assert posture.contact - 0.006 < first < last < posture.contact + 0.006
        load = flat.contact_force * np.cos(posture.friction_angle)
        errors.append([normal / load - 1, rod.work.moment[-1] / flat.base_curvature - 1])
    np.testing.assert_allclose(errors[0], 0, atol=3e-3)
    np.testing.assert_allclose(errors[-1], 0, atol=2e-4)


def test_the_follicle_bears_the_static_forces():
    rod = resting(refined=4)
    x, y = -rod.work.force_x[-1], -rod.work.force_y[-1]
    transverse = -x * np.sin(1.2) + y * np.cos(1.2)
    axial = x * np.cos(1.2) + y * np.sin(1.2)
    found = [transverse, axial, rod.work.moment[-1]]
    np.testing.assert_allclose(found, [0.545672, 0.584211, 0.490152], rtol=3e-4)  # MODEL.md


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_the_modes_about_the_equilibrium_are_those_that_slide_and_roll_on_the_flat(friction):
    posture = Posture(contact=0.29, base_angle=1.2, friction=friction)
    expected = curved_modes(posture, 3, condition="flat", law="coulomb").kappa
    found = resting(refined=2, posture=posture).modes.kappa
    np.testing.assert_allclose(found, expected, rtol=5e-3)


def test_damping_gives_each_of_three_modes_its_ratio():
    rod = resting()
    modes, damping = rod.modes, rod.damping
    mass = np.append(np.repeat(rod.shaft.mass, 2), 0.0)
    np.testing.assert_allclose((modes.dual * mass) @ modes.shape.T, np.eye(3), atol=1e-6)
    np.testing.assert_allclose((modes.shape**2 * mass).sum(axis=1), 1)
    modal = [
        damping.modal @ ((damping.shape @ d) * (damping.shape @ s))
        for d, s in zip(modes.dual, modes.shape, strict=True)
    ]
    ratio = (damping.mass + damping.stiffness * modes.stiffness + modal) / (2 * modes.kappa)
    np.testing.assert_allclose(ratio, 0.11, rtol=1e-9)
    assert min(damping.mass, damping.stiffness, damping.modal[1]) > 0


def test_intrinsic_curvature_lifts_the_free_end():
    rod = resting(tip=0.15, intrinsic_curvature=15.0)
    tip = rod.state.at[1]
    assert tip > 30e-6 / 0.04  # MODEL.md: lifted off the ground
    assert rod.touch.summary[2] > 0.25
    pressed = resting(tip=0.15, intrinsic_curvature=-15.0)
    assert pressed.touch.summary[2] == 0.15


def test_a_thick_shaft_rests_on_its_surface():
    rod = resting(thick=True)
    node = np.argmin(np.abs(rod.shaft.s - 0.29))
    assert rod.state.at[2 * node + 1] == pytest.approx(1.5e-3 * 0.29, rel=0.02)


def test_friction_that_pushes_towards_the_base_is_refused():
    with refusal("range", "Posture.friction", "-0.1"):
        resting_rod(cone(), Posture(contact=0.29, base_angle=1.2, friction=-0.1), damping=0.1)


@pytest.mark.parametrize(
    ("name", "value"),
    [("step", 0.0), ("step", 1.0), ("intrinsic_curvature", np.inf), ("follicle_rotation", 0.0), ("ground", -1.0)],
)
def test_settings_out_of_range_are_refused(name, value):
    with refusal("range", f"Rod.{name}"):
        Rod(**{name: value})


def test_a_compliant_follicle_lowers_the_resonance_and_keeps_the_posture():
    clamped = resting()
    for follicle, sprung in (({"follicle_rotation": 3.0}, 0.70), ({"follicle_translation": 100.0}, 0.73)):
        rod = resting(**follicle)
        np.testing.assert_allclose(rod.state.at[-3:], clamped.state.at[-3:], atol=1e-12)
        assert rod.modes.kappa[0] / clamped.modes.kappa[0] == pytest.approx(
            sprung, abs=0.06
        )  # MODEL.md, on the straight
        count, step = 200, 0.05
        drive = np.hstack([np.zeros((count + 1, 2)), np.tile(rod.drive, (count + 1, 1))])
        fresh = resting_rod(cone(), POSTURE, damping=0.11, settings=Rod(**follicle))
        drive[:, 0] = -0.07 * step * np.arange(count + 1)
        fresh.run(ground_of(None, 1.0), drive, step, np.zeros((0, rod.state.at.size)))
        np.testing.assert_allclose(fresh.state.at[-3:], clamped.state.at[-3:], atol=2e-6)
