"""The contact law: Coulomb's limit, its derivatives, and an adhesive contact by programs that know only its formula."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.optimize import brentq
from shooting import force_angle, held_by_an_edge, jump_over, march

from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.quasi_static.response import quasi_static
from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE
from vibrissa.mechanics.statics.contact_law import ContactLaw, direction, friction_ratio, inclination, sliding_friction
from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.gap import excursion_at_jump, jump_table, unit_response
from vibrissa.mechanics.statics.profile import Posture, stationary_profile

ADHESIVE = Posture(contact=0.29, base_angle=1.2, friction=0.2, adhesion=0.35)
POSTURES = [ADHESIVE, Posture(contact=0.15, base_angle=0.9, friction=0.0, adhesion=0.6)]
laws = st.builds(ContactLaw, st.floats(0, 3), st.floats(0, 3))
loads = st.floats(1e-3, 1e3)


@settings(deadline=None)
@given(friction=st.floats(-3, 3), load=loads)
def test_coulomb_force_has_one_direction(friction, load):
    law = ContactLaw(friction, 0.0)
    phi, rate = inclination(law, load)
    cos, sin, by_load, along_by_load = direction(law, load)
    assert phi == pytest.approx(np.arctan(friction), rel=1e-15)
    assert rate == 0
    assert (by_load, along_by_load) == (cos, sin)


@pytest.mark.parametrize("adhesion", [0.0, 1e-300])
def test_without_adhesion_friction_is_coulomb_s_to_the_bit(adhesion):
    coulomb = Posture(contact=0.29, base_angle=1.2)
    weak = replace(coulomb, adhesion=adhesion)
    for name, values in stationary_profile(coulomb).items():
        np.testing.assert_array_equal(stationary_profile(weak)[name], values)
    assert excursion_at_jump(weak, 0.015) == excursion_at_jump(coulomb, 0.015)
    np.testing.assert_array_equal(unit_response(weak).shift_at_nodes, unit_response(coulomb).shift_at_nodes)
    for condition in ("slide", "edge", "flat"):
        one, two = (curved_modes(at, 3, condition=condition, law="coulomb").kappa for at in (weak, coulomb))
        np.testing.assert_array_equal(one, two)


@settings(deadline=None)
@given(law=laws, load=loads)
def test_parts_of_the_force_obey_the_law(law, load):
    cos, sin, *_ = direction(law, load)
    assert sin / cos == pytest.approx(law.friction + law.adhesion * (load * cos) ** (-1 / 3), rel=1e-12)
    assert np.hypot(cos, sin) == pytest.approx(1, rel=1e-14)


@settings(deadline=None)
@given(law=laws, load=loads)
def test_derivatives_of_the_force_are_those_of_differences(law, load):
    step = 1e-5 * load

    def parts(at):
        return at * np.array(direction(law, at)[:2])

    slope = (parts(load + step) - parts(load - step)) / (2 * step)
    np.testing.assert_allclose(direction(law, load)[2:], slope, rtol=1e-7, atol=1e-8)
    turned = (inclination(law, load + step)[0] - inclination(law, load - step)[0]) / 2e-5
    assert inclination(law, load)[1] == pytest.approx(turned, rel=1e-6, abs=1e-9)


@settings(deadline=None)
@given(law=laws, load=loads, contact=st.floats(0.02, 0.95))
def test_sliding_friction_changes_as_differences_of_the_law(law, load, contact):
    normal = load * direction(law, load)[0] * contact**2

    def drag(force, place):
        return force * friction_ratio(law, force / place**2)[0]

    by_normal = (drag(normal * (1 + 1e-5), contact) - drag(normal * (1 - 1e-5), contact)) / (2e-5 * normal)
    by_place = (drag(normal, contact * (1 + 1e-5)) - drag(normal, contact * (1 - 1e-5))) / (2e-5 * contact)
    np.testing.assert_allclose(
        sliding_friction(law, load, contact), [by_normal, by_place], rtol=1e-6, atol=1e-9 * (1 + load)
    )


@pytest.mark.parametrize("posture", POSTURES)
def test_adhesive_profile_is_that_of_shooting(posture):
    def base_angle(load):
        return march(posture.contact, 0.0, load, force_angle(posture, posture.contact, load))[0, -1]

    force = brentq(lambda load: base_angle(load) - posture.base_angle, 0.05, 3, xtol=1e-13)
    s = np.linspace(posture.contact, 1, 20)
    theta, _, x, y = march(posture.contact, 0.0, force, force_angle(posture, posture.contact, force), points=s)
    found = stationary_profile(posture, s)
    assert float(found.contact_force) == pytest.approx(force, rel=1e-10)
    for values, name in ((theta, "angle"), (x, "profile_x"), (y, "profile_y")):
        np.testing.assert_allclose(found[name], values, atol=1e-10)
    assert found.attrs["adhesion"] == posture.adhesion


def test_adhesion_inclines_a_light_contact_the_most():
    light, heavy = (on_the_flat(replace(ADHESIVE, base_angle=angle)) for angle in (0.3, 1.3))
    assert light.contact_force < heavy.contact_force
    assert light.force_angle > heavy.force_angle > np.arctan(ADHESIVE.friction)


@pytest.mark.parametrize("posture", POSTURES)
def test_height_gives_back_the_contact(posture):
    height = float(stationary_profile(posture).base_distance)
    found = Posture.at_height(height, posture.base_angle, posture.friction, posture.adhesion)
    assert found.contact == pytest.approx(posture.contact, rel=1e-10)


@pytest.mark.parametrize("excursion", [-0.01, 0.004])
def test_an_edge_holds_the_adhesive_whisker_as_shooting_says(excursion):
    s = np.linspace(ADHESIVE.contact + 0.03, 0.98, 8)
    flat = on_the_flat(ADHESIVE)
    place, unknown = held_by_an_edge(ADHESIVE, stationary_profile(ADHESIVE), excursion, s)
    held = hold(flat, excursion)
    np.testing.assert_allclose([held.contact, held.contact_angle, held.contact_force], unknown, atol=1e-9)
    np.testing.assert_allclose(held.position(s), place, atol=1e-9)
    tabulated = quasi_static(ADHESIVE, (-0.011, 0.005), n_modes=2)  # by the compiled kernels
    follicle = tabulated(np.array([excursion]))[2:, 0]
    known = {
        "base_curvature": held.base_curvature,
        "transverse_force": held.transverse_force,
        "axial_force": held.axial_force,
        "contact_load": held.contact_force * np.cos(held.force_angle + held.contact_angle),
        "contact_angle": held.contact_angle,
    }
    np.testing.assert_allclose(follicle, [known[name] for name in FOLLICLE], atol=1e-9)


@pytest.mark.parametrize("posture", POSTURES)
def test_linear_response_is_the_slope_of_the_exact_one(posture):
    step = np.array([-2e-4, -1e-4, 1e-4, 2e-4])
    exact, linear = (quasi_static(posture, (-5e-4, 5e-4), form=form, n_modes=4) for form in ("exact", "linear"))
    slope = exact(step) @ (np.array([1, -8, 8, -1]) / 12e-4)
    found = linear(step) @ (np.array([1, -8, 8, -1]) / 12e-4)
    np.testing.assert_allclose(found, slope, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("width", [0.008, 0.015])
def test_the_contact_jumps_where_shooting_says(width):
    expected = jump_over(ADHESIVE, stationary_profile(ADHESIVE), width)
    assert excursion_at_jump(ADHESIVE, width) == pytest.approx(expected, abs=1e-9)
    many = jump_table(ADHESIVE, np.array([0.006, 0.02]))
    assert many(np.array([width]))[0] == pytest.approx(expected, abs=1e-9)
    assert expected != pytest.approx(excursion_at_jump(replace(ADHESIVE, adhesion=0.0), width), rel=1e-3)


def test_verbs_take_the_adhesion(vibrissa):
    how = ("--contact", 0.29, "--base-angle", 1.2, "--friction", 0.2, "--adhesion", 0.35, "--json")
    held = on_the_flat(ADHESIVE)
    assert json.loads(vibrissa("profile", *how)[1])["contact_force"] == pytest.approx(held.contact_force, rel=1e-12)
    found = json.loads(vibrissa("gap", *how, "--gap-width", 0.015)[1])
    assert found["excursion_at_jump"] == pytest.approx(excursion_at_jump(ADHESIVE, 0.015), rel=1e-12)
    options = ("--about", "profile", "--contact-condition", "edge")
    kappa = json.loads(vibrissa("modes", *how, *options)[1])["kappa"]
    np.testing.assert_allclose(kappa, curved_modes(ADHESIVE, len(kappa), condition="edge").kappa, rtol=1e-12)


@pytest.mark.parametrize(
    ("constants", "quantity"),
    [
        ({"adhesion": -0.1}, "Posture.adhesion"),
        ({"adhesion": np.nan}, "Posture.adhesion"),
        ({"adhesion": 0.1, "friction": -0.1}, "Posture.friction"),
    ],
)
def test_constants_of_no_contact_are_refused(constants, quantity):
    with refusal("range") as refused:
        replace(ADHESIVE, **constants)
    assert refused.value.quantity == quantity
