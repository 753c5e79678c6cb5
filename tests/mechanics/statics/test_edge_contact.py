"""The profile on an edge, against shooting, balances of force and moment, and reference values."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from shooting import held_by_an_edge, march

from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.gap import unit_response
from vibrissa.mechanics.statics.profile import Posture, stationary_profile

REFERENCE = Posture(contact=0.29, base_angle=1.2)
LOWER = Posture(contact=0.20, base_angle=1.0)
STEEP = Posture(contact=0.20, base_angle=1.4)

# postures and excursions short of the fold
held_profiles = st.builds(
    lambda contact, base_angle, friction, share: hold(
        on_the_flat(Posture(contact=contact, base_angle=base_angle, friction=friction)), share * contact
    ),
    contact=st.floats(0.15, 0.5),
    base_angle=st.floats(0.3, 1.2),
    friction=st.floats(0, 0.5),
    share=st.floats(-0.12, 0.01),
)


@pytest.mark.parametrize(
    ("posture", "excursion"),
    [
        (REFERENCE, -0.03),
        (REFERENCE, -0.01),
        (REFERENCE, 1.2e-3),
        (REFERENCE, 4e-3),
        (LOWER, -0.02),
        (LOWER, 1e-3),
        (STEEP, -0.02),
        (STEEP, 1e-3),
        (Posture(contact=0.4, base_angle=0.8, friction=0.0), -0.03),
        (Posture(contact=0.4, base_angle=0.8, friction=0.0), 3e-3),
        (Posture(contact=0.12, base_angle=1.2), 1e-3),
    ],
)
def test_held_profile_is_the_one_that_shooting_finds(posture, excursion):
    held = hold(on_the_flat(posture), excursion)
    s = np.linspace(max(posture.contact, held.contact) + 0.01, 0.98, 9)
    position, unknown = held_by_an_edge(posture, stationary_profile(posture), excursion, s)
    np.testing.assert_allclose([held.contact, held.contact_angle, held.contact_force], unknown, atol=1e-11)
    np.testing.assert_allclose(held.position(s), position, atol=1e-11)
    theta, moment, *_ = march(*unknown, posture.friction_angle, points=np.append(s, 1.0))
    np.testing.assert_allclose(held.angle(s), theta[:-1], atol=1e-11)
    assert held.base_curvature == pytest.approx(moment[-1], abs=1e-11)  # s⁴ = 1 at the base


@settings(deadline=None, derandomize=True, max_examples=20)
@given(held=held_profiles)
def test_base_keeps_its_angle_and_height_while_the_edge_moves(held):
    flat = on_the_flat(held.posture)
    assert float(held.angle(np.array([1.0]))[0]) == pytest.approx(held.posture.base_angle, abs=1e-11)
    assert held.base[0] - flat.base[0] == pytest.approx(held.excursion, abs=1e-11)
    assert held.base[1] == pytest.approx(flat.base[1], abs=1e-11)
    x, y = held.position(np.array([held.contact, 1.0]))
    np.testing.assert_allclose([x[0], y[0]], [-held.base[0], -held.base[1]], atol=1e-12)  # the edge itself
    np.testing.assert_allclose([x[1], y[1]], 0, atol=1e-12)


@settings(deadline=None, derandomize=True, max_examples=20)
@given(held=held_profiles)
def test_moment_and_forces_at_the_base_balance_the_edge(held):
    flat, towards = on_the_flat(held.posture), held.posture.friction_angle + held.contact_angle
    lever = (flat.base[0] + held.excursion) * np.cos(towards) + flat.base[1] * np.sin(towards)
    assert held.base_curvature == pytest.approx(held.contact_force * lever, rel=1e-9)
    # the edge pushes with Λ(−sin, cos)(φ + θ_ε); the shaft hands it on
    push = held.contact_force * np.array([-np.sin(towards), np.cos(towards)])
    cos, sin = np.cos(held.posture.base_angle), np.sin(held.posture.base_angle)
    assert held.transverse_force == pytest.approx(push @ [-sin, cos], rel=1e-12)
    assert held.axial_force == pytest.approx(push @ [cos, sin], rel=1e-12)


@settings(deadline=None, derandomize=True, max_examples=10)
@given(held=held_profiles)
def test_shaft_is_as_long_as_it_was_and_its_ends_are_straight(held):
    s = np.concatenate([np.linspace(0.5 * held.contact, held.contact, 5), np.linspace(1, 1.2, 5)])
    x, y = held.position(s)
    for end, angle in ((slice(0, 5), held.contact_angle), (slice(5, 10), held.posture.base_angle)):
        np.testing.assert_allclose(np.diff(x[end]) / np.diff(s[end]), np.cos(angle), atol=1e-10)
        np.testing.assert_allclose(np.diff(y[end]) / np.diff(s[end]), np.sin(angle), atol=1e-10)
        np.testing.assert_allclose(held.angle(s[end]), angle, atol=1e-11)
    node, weight = np.polynomial.legendre.leggauss(60)
    s = held.contact + (1 - held.contact) * (node + 1) / 2
    along = (1 - held.contact) / 2 * weight @ np.cos(held.angle(s))
    assert along == pytest.approx(held.base[0], abs=1e-9)  # D = ∫ cos θ ds


@settings(deadline=None, derandomize=True, max_examples=10)
@given(held=held_profiles)
def test_an_edge_that_comes_back_leaves_nothing(held):
    flat = on_the_flat(held.posture)
    back = hold(flat, 0.0, held)
    found, expected = ((one.contact, one.contact_angle, one.contact_force, one.base_curvature) for one in (back, flat))
    np.testing.assert_allclose(found, expected, atol=1e-11)


def test_the_way_to_an_excursion_does_not_matter():
    flat = on_the_flat(REFERENCE)
    at_once = hold(flat, -0.02)
    over = hold(flat, -0.02, hold(flat, 0.003))
    np.testing.assert_allclose(
        [over.contact, over.contact_angle, over.contact_force],
        [at_once.contact, at_once.contact_angle, at_once.contact_force],
        atol=1e-11,
    )


@settings(deadline=None, derandomize=True, max_examples=15)
@given(held=held_profiles)
def test_sensitivity_is_the_slope_of_the_marched_profile(held):
    """Central differences of ∂(θ_b, D, H)/∂(ε, θ_ε, Λ); the package works with Λ̂ = Λ/ε² in place of Λ."""
    unknown = np.array([held.contact, held.contact_angle, held.contact_force])
    slope = np.empty((3, 3))
    for k, step in enumerate(1e-4 * np.array([held.contact, 1.0, held.contact_force])):
        ahead, behind = (
            march(*(unknown + sign * step * np.eye(3)[k]), held.posture.friction_angle)[[0, 2, 3], -1]
            for sign in (1, -1)
        )
        slope[:, k] = (ahead - behind) / (2 * step)
    assert held.determinant == pytest.approx(np.linalg.det(slope), rel=1e-4)
    by_load = np.array(  # Λ̂ at fixed Λ falls as ε grows
        [[1, 0, 0], [0, 1, 0], [-2 * held.curve.load / held.contact, 0, 1 / held.contact**2]]
    )
    np.testing.assert_allclose(held.sensitivity @ by_load, slope, atol=2e-6 * np.abs(slope).max())


@pytest.mark.parametrize(("contact", "fold"), [(0.05, 1.269), (0.10, 1.378), (0.12, 1.421), (0.15, 1.486)])
def test_determinant_changes_sign_at_the_folds_of_the_model(contact, fold):
    before, beyond = (
        on_the_flat(Posture(contact=contact, base_angle=angle)).determinant for angle in (fold - 1e-3, fold + 1e-3)
    )
    assert before < 0 < beyond


@pytest.mark.parametrize("posture", [REFERENCE, LOWER, STEEP])
def test_slope_at_the_flat_is_the_linear_response(posture):
    flat, unit = on_the_flat(posture), unit_response(posture)
    assert flat.determinant == pytest.approx(unit.determinant, rel=1e-10)
    error = []
    for step in (4e-4, 2e-4, 1e-4):
        ahead, behind = hold(flat, step), hold(flat, -step)
        found = [(getattr(ahead, name) - getattr(behind, name)) / (2 * step) for name in ("contact", "contact_angle")]
        found.append((ahead.curve.load - behind.curve.load) / (2 * step))
        error.append(np.abs(np.divide(found, [unit.contact, unit.contact_angle, unit.load]) - 1).max())
    np.testing.assert_allclose(np.log2(np.divide(error[:-1], error[1:])), 2, atol=0.1)  # a central difference


def test_determinant_falls_as_the_root_of_what_is_left_to_the_fold():
    flat = on_the_flat(STEEP)
    with refusal("range", "excursion 0.1 L") as told:
        hold(flat, 0.1)
    message = str(told.value)
    assert "\n" not in message
    assert "fold's determinant is -" in message
    assert "lower the base angle" in message
    fold = float(message.split("beyond ")[1].split(" L")[0])
    near = np.array([0.985, 0.99]) * fold
    square = np.array([hold(flat, d).determinant ** 2 for d in near])  # a straight line in d, to 0 on the fold
    vanishes = near[1] + square[1] * (near[1] - near[0]) / (square[0] - square[1])
    assert vanishes == pytest.approx(fold, abs=2e-5)  # the last step tried is 1e-5 L


@pytest.mark.parametrize("excursion", [0.2, -0.4])
def test_no_profile_is_made_up_where_there_is_none(excursion):
    with refusal("range"):
        hold(on_the_flat(REFERENCE), excursion)


def test_forces_of_the_model():
    flat = on_the_flat(REFERENCE)
    found = [flat.transverse_force, flat.axial_force, flat.base_curvature]
    np.testing.assert_allclose(found, [0.545672, 0.584211, 0.490152], atol=6e-7)  # MODEL.md, "Statics"
