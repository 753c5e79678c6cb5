"""Eq. 1 on the flat, against marching, balances of force and moment, and reference values."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from shooting import march

from vibrissa.mechanics.statics.profile import Posture, stationary_profile

contacts = st.floats(0.02, 0.8)
angles = st.floats(0.05, 1.5)
frictions = st.floats(-0.3, 0.8)

# research/mechanics.md §2b: Λ at θ_b = 0.4, 0.8, 1.2, 1.4, 1.55 (solve_bvp, 4 digits printed)
LOADS = {
    0.05: [0.00630, 0.01254, 0.01926, 0.02305, 0.0262],
    0.1: [0.02575, 0.0512, 0.07853, 0.09381, 0.1065],
    0.2: [0.1119, 0.2221, 0.3391, 0.4036, 0.4561],
    0.3: [0.288, 0.5714, 0.8688, 1.03, 1.16],
    0.5: [1.258, 2.493, 3.769, 4.445, 4.979],
}


def test_load_of_the_reference_posture_to_twelve_digits():
    load = stationary_profile(Posture(contact=0.3, base_angle=1.2)).contact_force  # mpmath, 18 digits
    assert float(load) == pytest.approx(0.868834564720600578, rel=1e-12)


@pytest.mark.parametrize(
    ("contact", "base_angle", "load", "height", "distance"),
    [(0.29, 1.2, 0.799412373, 0.461768821, 0.475665065), (0.20, 1.0, 0.279204876, 0.506078075, 0.577165761)],
)
def test_reference_postures_of_the_model(contact, base_angle, load, height, distance):
    flat = stationary_profile(Posture(contact=contact, base_angle=base_angle))
    found = [float(flat[name]) for name in ("contact_force", "base_distance", "contact_distance")]
    np.testing.assert_allclose(found, [load, height, distance], atol=6e-10)


@pytest.mark.parametrize("contact", LOADS)
def test_loads_of_the_table(contact):
    found = [
        float(stationary_profile(Posture(contact=contact, base_angle=b)).contact_force)
        for b in (0.4, 0.8, 1.2, 1.4, 1.55)
    ]
    np.testing.assert_allclose(found, LOADS[contact], rtol=2e-3, atol=6e-5)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(contact=contacts, base_angle=angles, friction=frictions)
def test_marching_with_the_load_lands_on_the_base(contact, base_angle, friction):
    posture = Posture(contact=contact, base_angle=base_angle, friction=friction)
    s = np.linspace(contact, 1, 11)
    flat = stationary_profile(posture, s)
    theta, _, x, y = march(contact, 0.0, float(flat.contact_force), np.arctan(friction), points=s)
    np.testing.assert_allclose(flat.angle, theta, atol=2e-10)
    np.testing.assert_allclose(flat.profile_x, x, atol=1e-10)
    np.testing.assert_allclose(flat.profile_y, y, atol=1e-10)
    np.testing.assert_allclose([flat.contact_distance, flat.base_distance], [x[-1], y[-1]], atol=1e-10)


@pytest.mark.parametrize(("contact", "base_angle", "friction"), [(0.3, 1.0, 5.0), (0.1, 1.5, 20.0), (0.2, 0.5, -0.9)])
def test_marching_agrees_at_extreme_friction_too(contact, base_angle, friction):
    flat = stationary_profile(Posture(contact=contact, base_angle=base_angle, friction=friction))
    end = march(contact, 0.0, float(flat.contact_force), np.arctan(friction))[[0, 2, 3], -1]
    np.testing.assert_allclose(end, [base_angle, flat.contact_distance, flat.base_distance], atol=1e-9)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(contact=contacts, base_angle=angles, friction=frictions)
def test_moment_at_the_base_balances_the_contact_force(contact, base_angle, friction):
    s = np.append(contact, 1 - (1 - contact) * 0.02 * np.arange(8)[::-1])
    flat = stationary_profile(Posture(contact=contact, base_angle=base_angle, friction=friction), s)
    curvature = np.polynomial.Polynomial.fit(s[1:], flat.angle[1:], 7).deriv()(1.0)
    phi, load = np.arctan(friction), float(flat.contact_force)
    arm = float(flat.contact_distance) * np.cos(phi) + float(flat.base_distance) * np.sin(phi)
    assert curvature == pytest.approx(load * arm, rel=1e-6)  # a derivative of interpolated data


def test_moment_at_the_base_of_the_reference_posture():
    flat = stationary_profile(Posture(contact=0.29, base_angle=1.2))
    phi = np.arctan(0.4)
    load, d, h = (float(flat[n]) for n in ("contact_force", "contact_distance", "base_distance"))
    found = [load * np.cos(1.2 - phi), load * np.sin(1.2 - phi), load * (d * np.cos(phi) + h * np.sin(phi))]
    np.testing.assert_allclose(found, [0.545672, 0.584211, 0.490152], atol=6e-7)  # MODEL.md, "Statics"


@settings(deadline=None, derandomize=True, max_examples=30)
@given(contact=st.floats(0.02, 0.5), base_angle=angles, cut=st.floats(0.6, 0.98), friction=frictions)
def test_cutting_a_whisker_higher_up_leaves_a_whisker(contact, base_angle, cut, friction):
    # the part between contact and s = σ is itself a stationary cone of length σ
    whole = stationary_profile(Posture(contact=contact, base_angle=base_angle, friction=friction), [contact, cut])
    angle = float(whole.angle[1])
    part = stationary_profile(Posture(contact=contact / cut, base_angle=angle, friction=friction), [contact / cut, 1])
    assert float(part.contact_force) == pytest.approx(float(whole.contact_force) / cut**2, rel=1e-10)
    np.testing.assert_allclose(part.profile_x * cut, whole.profile_x, atol=1e-11)
    np.testing.assert_allclose(part.profile_y * cut, whole.profile_y, atol=1e-11)


@settings(deadline=None, derandomize=True, max_examples=30)
@given(contact=contacts, base_angle=st.floats(0.05, 1.3), friction=st.floats(0, 0.8))
def test_curve_touches_the_flat_and_bends_away_from_it(contact, base_angle, friction):
    flat = stationary_profile(Posture(contact=contact, base_angle=base_angle, friction=friction))
    assert abs(float(flat.angle[0])) < 1e-12
    assert np.all(np.diff(flat.angle) > -1e-13)
    assert np.all(flat.profile_y >= -1e-13)
    assert np.hypot(flat.contact_distance, flat.base_distance) < 1 - contact  # a chord is shorter than its arc


@settings(deadline=None, derandomize=True, max_examples=20)
@given(contact=contacts, base_angle=st.floats(0.05, 1.5), step=st.floats(1e-3, 0.02))
def test_a_steeper_base_needs_more_force(contact, base_angle, step):
    low, high = (
        float(stationary_profile(Posture(contact=contact, base_angle=b)).contact_force)
        for b in (base_angle, base_angle + step)
    )
    assert high > low


@pytest.mark.parametrize(("friction", "order"), [(0.0, 2), (0.4, 1)])
def test_small_angles_reach_the_linear_beam_at_the_right_order(friction, order):
    # (s⁴θ')' = Λ cos φ; the first term left out is θ sin φ with friction, θ²/2 without
    contact, s = 0.2, np.linspace(0.2, 1, 30)
    shape = 1 / (6 * contact**2) - 1 / (2 * s**2) + contact / (3 * s**3)
    error = []
    for base_angle in (0.02, 0.01, 0.005):
        flat = stationary_profile(Posture(contact=contact, base_angle=base_angle, friction=friction), s)
        linear = base_angle / shape[-1]
        error.append(abs(float(flat.contact_force) * np.cos(np.arctan(friction)) / linear - 1))
    np.testing.assert_allclose(np.log2(np.divide(error[:-1], error[1:])), order, atol=0.05)


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: Posture(contact=0.0, base_angle=1.0), ("range", "Posture.contact")),
        (lambda: Posture(contact=1.0, base_angle=1.0), ("range", "Posture.contact")),
        (lambda: Posture(contact=np.nan, base_angle=1.0), ("range", "Posture.contact")),
        (lambda: Posture(contact=-0.3, base_angle=1.0), ("range", "Posture.contact")),
        (lambda: Posture(contact=0.3, base_angle=0.0), ("range", "Posture.base_angle")),
        (lambda: Posture(contact=0.3, base_angle=-1.0), ("range", "Posture.base_angle")),
        (lambda: Posture(contact=0.3, base_angle=np.nan), ("range", "Posture.base_angle")),
        (lambda: Posture(contact=0.3, base_angle=1.0, friction=np.nan), ("range", "Posture.friction")),
        (lambda: stationary_profile(Posture(contact=0.3, base_angle=1.0), [0.4, np.nan]), ("range", "s")),
        (lambda: stationary_profile(Posture(contact=0.3, base_angle=1.0), [1.01]), ("range", "s")),
        (lambda: Posture(contact=0.3, base_angle=1.6), ("range", "Posture.base_angle")),
        (lambda: Posture(contact=0.3, base_angle=1.0, friction=np.inf), ("range", "Posture.friction")),
        (lambda: stationary_profile(Posture(contact=0.3, base_angle=1.0), [0.2]), ("range", "s")),
    ],
)
def test_postures_out_of_range_are_refused(call, rule):
    with refusal(*rule):
        call()
