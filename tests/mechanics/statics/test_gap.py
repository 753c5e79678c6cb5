"""The gap: where the contact jumps and how the profile follows, against shooting and reference values."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from shooting import held_by_an_edge, jump_over

from vibrissa.exact import cone_kappa, cone_modes, shaft_quadrature
from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.gap import coupling, excursion_at_jump, jump_table, unit_response
from vibrissa.mechanics.statics.profile import Posture, stationary_profile

REFERENCE = Posture(contact=0.29, base_angle=1.2)
LOWER = Posture(contact=0.20, base_angle=1.0)


@pytest.mark.parametrize("posture", [REFERENCE, LOWER, Posture(contact=0.4, base_angle=0.8, friction=0.1)])
def test_unit_response_is_the_slope_of_the_exact_edge_held_profile(posture):
    s = np.linspace(posture.contact + 0.03, 0.98, 12)
    flat = stationary_profile(posture, s)
    normal = np.stack([-np.sin(flat.angle.values), np.cos(flat.angle.values)])
    linear = unit_response(posture).displacement(s)
    error = []
    for step in (8e-4, 4e-4, 2e-4):
        ahead, behind = (held_by_an_edge(posture, flat, d, s)[0] for d in (step, -step))
        error.append(np.abs((normal * (ahead - behind)).sum(0) / (2 * step) - linear).max())
    order = np.log2(np.divide(error[:-1], error[1:]))
    np.testing.assert_allclose(order, 2, atol=0.15)  # a central difference
    assert error[-1] < 0.02 * np.abs(linear).max()


@pytest.mark.parametrize("posture", [REFERENCE, LOWER])
def test_contact_slides_and_sags_as_the_exact_solution_does(posture):
    flat, response = stationary_profile(posture), unit_response(posture)
    step = 2e-5
    (_, ahead), (_, behind) = (held_by_an_edge(posture, flat, d, np.array([0.9])) for d in (step, -step))
    contact, turn, _ = (ahead - behind) / (2 * step)
    assert response.contact == pytest.approx(contact, rel=1e-3)
    assert response.contact_angle == pytest.approx(turn, rel=1e-3)
    assert contact < 0
    assert turn < 0  # the whisker sags into the gap


@pytest.mark.parametrize("posture", [REFERENCE, LOWER])
def test_unit_response_leaves_the_base_at_rest(posture):
    s = 1 - np.array([0, 1e-4, 2e-4])
    u = unit_response(posture).displacement(s)
    assert abs(u[0]) < 1e-12
    assert u[2] == pytest.approx(4 * u[1], rel=2e-3)  # neither displaced nor turned: it starts as (1 − s)²


@pytest.mark.parametrize(
    ("posture", "count", "share"),  # the farther out the contact, the slower
    [(REFERENCE, 12, 0.01), (REFERENCE, 24, 0.0025), (LOWER, 12, 0.014), (LOWER, 24, 0.004)],
)
def test_modes_are_complete_for_the_unit_response(posture, count, share):
    # so the total displacement is continuous where the contact jumps
    s, weights = shaft_quadrature(posture.contact, 400)
    steady = unit_response(posture).displacement(s)
    sum_of_modes = coupling(unit_response(posture), count) @ cone_modes(
        cone_kappa(posture.contact, count), posture.contact, s
    )
    assert np.abs(sum_of_modes - steady).max() <= share * np.abs(steady).max()
    norm = weights * s**2
    assert norm @ (sum_of_modes - steady) ** 2 <= share**2 * (norm @ steady**2)


def test_couplings_obey_bessels_inequality_and_do_not_depend_on_their_number():
    response = unit_response(REFERENCE)
    s, weights = shaft_quadrature(0.29, 200)
    many = coupling(response, 30)
    assert np.sum(many**2) < weights @ (s * response.displacement(s)) ** 2
    np.testing.assert_allclose(coupling(response, 3), many[:3], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("posture", "c"),
    [(REFERENCE, [-0.10030, 0.01904, -0.00548]), (LOWER, [-0.07328, 0.01724, -0.00582])],
)
def test_couplings_of_the_reference_postures(posture, c):
    np.testing.assert_allclose(coupling(unit_response(posture), 3), c, atol=6e-6)


@pytest.mark.parametrize(
    ("posture", "excursion"),
    [
        (REFERENCE, [1.234763e-4, 4.707761e-4, 1.230600e-3]),
        (LOWER, [1.627847e-4, 6.089387e-4, 1.556729e-3]),
    ],
)
def test_jump_table_of_the_model(posture, excursion):
    found = [excursion_at_jump(posture, width) for width in (0.0075, 0.015, 0.025)]
    np.testing.assert_allclose(found, excursion, rtol=5e-7)  # 7 digits printed


@pytest.mark.parametrize(
    ("contact", "base_angle", "friction", "width"),
    [(0.29, 1.2, 0.4, 0.02), (0.15, 0.7, 0.4, 0.03), (0.4, 1.0, 0.0, 0.01), (0.1, 1.2, 0.3, 0.005)],
)
def test_contact_jumps_where_the_marched_profile_meets_the_near_edge(contact, base_angle, friction, width):
    posture = Posture(contact=contact, base_angle=base_angle, friction=friction)
    witness = jump_over(posture, stationary_profile(posture), width)
    assert excursion_at_jump(posture, width) == pytest.approx(witness, abs=1e-9 * max(1, 0.1 / width))


@pytest.mark.parametrize(
    ("posture", "width"),
    [(REFERENCE, 0.0075), (REFERENCE, 0.025), (LOWER, 0.015), (Posture(contact=0.15, base_angle=1.4), 0.03)],
)
def test_profile_carried_on_first_touches_the_near_edge_at_the_jump(posture, width):
    """Another way to d₂: the excursion is imposed, and the height over the near edge looked at."""
    flat, jump = on_the_flat(posture), excursion_at_jump(posture, width)

    def over(d, across):
        held = hold(flat, d)
        s = held.contact + np.linspace(0, 0.08, 4001)
        x, y = held.position(s)
        return np.interp(across, x + held.base[0], y + held.base[1])  # flat.base[1] is H, kept

    assert over(jump, width) == pytest.approx(0, abs=1e-9)
    sag = -over(jump, 0.5 * width)
    assert sag > 0  # between the edges it hangs in the gap
    heights = [over(share * jump, width) for share in (0.0, 0.3, 0.6, 0.9)]
    assert np.all(np.diff(heights) < 0)
    assert heights[-1] > 0


def test_excursion_at_jump_grows_as_the_square_of_narrow_gaps():
    # the cubic sag −Λ cos φ/(6ε⁴)·x(λ² − x²) gives θ_ε; d follows through dθ_ε/dd
    response = unit_response(REFERENCE)
    flat = stationary_profile(REFERENCE)
    stiff = float(flat.contact_force) * np.cos(REFERENCE.friction_angle) / (6 * 0.29**4)
    expected = -stiff / response.contact_angle
    error = [excursion_at_jump(REFERENCE, w) / w**2 / expected - 1 for w in (4e-3, 2e-3, 1e-3)]
    np.testing.assert_allclose(np.divide(error[:-1], error[1:]), 2, atol=0.1)  # first order in λ


@settings(deadline=None, derandomize=True, max_examples=15)
@given(contact=st.floats(0.12, 0.5), base_angle=st.floats(0.3, 1.2), width=st.floats(1e-3, 0.03))
def test_contact_jumps_before_the_land_would_carry_it(contact, base_angle, width):
    jump = excursion_at_jump(Posture(contact=contact, base_angle=base_angle), width)
    assert 0 < jump < width


@pytest.mark.parametrize("posture", [REFERENCE, LOWER])
def test_table_of_excursions_agrees_with_each_solved_alone(posture):
    width = np.random.default_rng(4).uniform(0.9e-3, 0.05, 12)  # 35 µm to 2 mm on 40 mm
    direct = [excursion_at_jump(posture, w) for w in width]
    np.testing.assert_allclose(jump_table(posture, width)(width), direct, rtol=1e-7)


def test_one_gap_needs_no_table():
    width = np.array([0.015, 0.015])
    found = jump_table(REFERENCE, width)(width)
    np.testing.assert_allclose(found, 4.707761e-4, rtol=5e-7)


@pytest.mark.parametrize(("contact", "fold"), [(0.05, 1.269), (0.10, 1.378), (0.12, 1.421), (0.15, 1.486)])
def test_no_response_is_given_beyond_the_fold(contact, fold):
    before = unit_response(Posture(contact=contact, base_angle=fold - 1e-3))
    assert before.determinant < 0
    assert before.contact_angle < -10  # dθ_ε/dd → ∞
    with refusal("range"):
        unit_response(Posture(contact=contact, base_angle=fold + 1e-3))


@pytest.mark.parametrize(
    ("width", "value"),
    [(0.6, "0.6"), (0.45, "0.45 L"), (0.0, "0.0"), (-0.01, "-0.01"), (np.nan, "nan"), (np.inf, "inf")],
)
def test_gap_that_the_whisker_cannot_cross_is_told(width, value):
    with refusal("range", "gap_width", value):
        excursion_at_jump(REFERENCE, width)


def test_one_table_serves_a_batch():
    width = np.random.default_rng(5).uniform(2e-3, 0.03, 9)
    batch = jump_table(REFERENCE, np.array([2e-3, 0.03]))(width)
    np.testing.assert_allclose(batch, [excursion_at_jump(REFERENCE, w) for w in width], rtol=1e-7)


@pytest.mark.parametrize("width", [0.05, 0.06])
def test_a_gap_that_leads_beyond_the_fold_is_refused(width):
    with refusal("range", "gap_width"):
        excursion_at_jump(Posture(contact=0.15, base_angle=1.4), width)


def test_a_wide_gap_that_the_posture_follows_is_not_refused():
    jump = excursion_at_jump(REFERENCE, 0.12)
    held = hold(on_the_flat(REFERENCE), jump)
    x, y = held.position(np.linspace(held.contact, 1, 20001))
    height = np.interp(0.12, x + held.base[0], y + held.base[1])  # of the profile over the near edge
    assert abs(height) < 1e-9
    assert held.determinant < 0


def test_a_table_serves_no_width_outside_of_it():
    table = jump_table(REFERENCE, np.array([0.005, 0.01]))
    with refusal("range", "gap_width"):
        table(np.array([0.02]))
    np.testing.assert_allclose(table(np.array([0.0075])), 1.234763e-4, rtol=1e-6)
