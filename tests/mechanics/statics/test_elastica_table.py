"""Many equilibria at once, against marching, a boundary-value solver, single postures, balances and limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.integrate import solve_bvp
from shooting import march

from vibrissa.mechanics.statics.elastica_table import equilibria, equilibria_at_height
from vibrissa.mechanics.statics.profile import Posture, flat_curve, stationary_profile

# each friction costs a table of some 50 ms, so the laws draw from a few
FRICTIONS = [-0.2, 0.0, 0.4, 0.8, 2.0]
frictions = st.sampled_from(FRICTIONS)
contacts = st.floats(0.01, 0.99)
angles = st.floats(1e-3, 1.57)

# research/mechanics.md §2b: Λ at θ_b = 0.4, 0.8, 1.2, 1.4, 1.55 and μ = 0.4, 4 digits printed
LOADS = {
    0.05: [0.00630, 0.01254, 0.01926, 0.02305, 0.0262],
    0.1: [0.02575, 0.0512, 0.07853, 0.09381, 0.1065],
    0.2: [0.1119, 0.2221, 0.3391, 0.4036, 0.4561],
    0.3: [0.288, 0.5714, 0.8688, 1.03, 1.16],
    0.5: [1.258, 2.493, 3.769, 4.445, 4.979],
}


def one(contact, base_angle, friction=0.4):
    """Give Λ, H, D and the slopes of a single posture."""
    return [float(column[0]) for column in equilibria([contact], [base_angle], friction)[1:]]


def boundary_value(contact, base_angle, friction):
    """Give Λ, H, D of Eq. 1 as a boundary-value problem with an unknown parameter."""
    phi = np.arctan(friction)
    s = np.geomspace(contact, 1, 60)

    def slope(s, y, load):
        return np.vstack([y[1] / s**4, load[0] * np.cos(phi - y[0]), np.sin(y[0]), np.cos(y[0])])

    def ends(a, b, load):
        return np.array([a[0], a[1], a[2], a[3], b[0] - base_angle])

    guess = np.zeros((4, s.size))
    guess[0] = base_angle * (1 - contact / s) / (1 - contact)
    load = base_angle / (np.cos(phi) * (1 / (6 * contact**2) - 1 / 2 + contact / 3))
    solved = solve_bvp(slope, ends, s, guess, p=[load], tol=1e-8, max_nodes=20000)
    assert solved.success
    return [solved.p[0], solved.y[2, -1], solved.y[3, -1]]


# Numbers known beforehand


def test_load_of_the_reference_posture_to_twelve_digits():
    assert one(0.3, 1.2)[0] == pytest.approx(0.868834564720600578, rel=1e-12)  # mpmath, 18 digits


@pytest.mark.parametrize(
    ("contact", "base_angle", "known"),
    [(0.29, 1.2, [0.799412373, 0.461768821, 0.475665065]), (0.20, 1.0, [0.279204876, 0.506078075, 0.577165761])],
)
def test_reference_postures_of_the_model(contact, base_angle, known):
    np.testing.assert_allclose(one(contact, base_angle)[:3], known, atol=6e-10)


@pytest.mark.parametrize("contact", LOADS)
def test_loads_of_the_table(contact):
    found = equilibria(np.full(5, contact), [0.4, 0.8, 1.2, 1.4, 1.55], 0.4)
    np.testing.assert_allclose(found.contact_force, LOADS[contact], rtol=2e-3, atol=6e-5)


# Other solvers


@pytest.mark.parametrize("friction", [*FRICTIONS, -5.0, -1.0, 10.0])
def test_marching_with_the_load_lands_on_the_base(friction, rng):
    reach = np.pi / 2 if friction > -0.25 else 0.9 * np.arctan(-1 / friction)
    contact, base_angle = rng.uniform(0.02, 0.95, 6), rng.uniform(0.05, 0.99, 6) * reach
    found = equilibria(contact, base_angle, friction)
    landed = [march(e, 0.0, load, np.arctan(friction))[:, -1] for e, load in zip(contact, found[1], strict=True)]
    known = np.column_stack([base_angle, found.contact_distance, found.base_distance])
    np.testing.assert_allclose(np.array(landed)[:, [0, 2, 3]], known, rtol=2e-11)  # DOP853 at 1e-12


@pytest.mark.parametrize("friction", FRICTIONS)
def test_boundary_value_solver_agrees(friction, rng):
    for contact, base_angle in rng.uniform([0.05, 0.2], [0.7, 1.5], (3, 2)):
        # tol 1e-8 bounds the residual of the equation; Λ, H and D come out to 1e-9
        np.testing.assert_allclose(
            one(contact, base_angle, friction)[:3], boundary_value(contact, base_angle, friction), rtol=2e-9
        )


@settings(deadline=None, derandomize=True, max_examples=60)
@given(contact=contacts, base_angle=angles, friction=frictions)
def test_one_of_many_is_the_posture_alone(contact, base_angle, friction):
    alone = flat_curve(Posture(contact=contact, base_angle=base_angle, friction=friction))
    known = [alone.load * contact**2, alone.y[-1] * contact, alone.x[-1] * contact, contact**2 / alone.psi_load[-1]]
    known.append(contact * alone.y_load[-1] / alone.psi_load[-1])
    # near ε = 1 the collocation in ln x loses what 1 − ε is small by
    np.testing.assert_allclose(one(contact, base_angle, friction), known, rtol=1e-11)


def test_order_and_number_of_postures_do_not_matter(rng):
    contact, base_angle = rng.uniform(0.1, 0.6, 2500), rng.uniform(0.2, 1.5, 2500)  # more than one block
    order = rng.permutation(2500)
    found, shuffled = equilibria(contact, base_angle, 0.4), equilibria(contact[order], base_angle[order], 0.4)
    np.testing.assert_allclose(np.array(found)[:, order], shuffled, rtol=1e-12)
    np.testing.assert_allclose(one(contact[2400], base_angle[2400]), [column[2400] for column in found[1:]], rtol=1e-12)
    assert all(column.shape == (0,) for column in equilibria([], [], 0.4))


# Laws


@settings(deadline=None, derandomize=True, max_examples=40)
@given(contact=st.floats(0.02, 0.5), base_angle=angles, cut=st.floats(0.6, 0.98), friction=frictions)
def test_cutting_a_whisker_higher_up_leaves_a_whisker(contact, base_angle, cut, friction):
    # the part between contact and s = σ is itself a stationary cone of length σ
    load, height, distance = one(contact, base_angle, friction)[:3]
    angle, _, x, y = march(contact, 0.0, load, np.arctan(friction), s_end=cut)[:, -1]
    part = one(contact / cut, angle, friction)[:3]
    np.testing.assert_allclose(part, [load / cut**2, y / cut, x / cut], rtol=1e-10)
    assert height > y
    assert distance > x


@settings(deadline=None, derandomize=True, max_examples=40)
@given(contact=st.floats(0.05, 0.95), base_angle=angles, friction=frictions)
def test_force_and_place_of_the_base_by_quadrature(contact, base_angle, friction):
    # over the shaft drawn point by point: H, D, and the moment ∫Λ cos(φ − θ) ds = θ'(1) that the force must balance
    load, height, distance = one(contact, base_angle, friction)[:3]
    z, w = np.polynomial.legendre.leggauss(48)
    s = contact ** ((1 - z) / 2)
    weight = -np.log(contact) * s * w / 2
    posture, phi = Posture(contact=contact, base_angle=base_angle, friction=friction), np.arctan(friction)
    angle = stationary_profile(posture, s).angle.values
    known = [np.sum(weight * f(angle)) for f in (np.sin, np.cos, lambda angle: np.cos(phi - angle))]
    np.testing.assert_allclose([height, distance], known[:2], rtol=1e-11)
    assert load * (distance * np.cos(phi) + height * np.sin(phi)) == pytest.approx(load * known[2], rel=1e-11)
    # θ_b = ∫ s⁻⁴ ∫ Λ cos(φ − θ) ds ds, the order of integration exchanged
    reach = (s**-3 - 1) / 3
    assert load * np.sum(weight * np.cos(phi - angle) * reach) == pytest.approx(base_angle, rel=1e-11)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(contact=contacts, base_angle=angles, friction=frictions)
def test_moment_of_the_force_bends_the_base(contact, base_angle, friction):
    # ∂θ_b/∂ε = −θ'(1)/ε at fixed Λ̂ = Λ/ε², with θ'(1) = Λ(D cos φ + H sin φ)
    load, height, distance, stiffness, _ = one(contact, base_angle, friction)
    phi, step = np.arctan(friction), 1e-6 * min(contact, 1 - contact)
    moment = load * (distance * np.cos(phi) + height * np.sin(phi))
    up, down = (one(contact + h, base_angle, friction)[0] for h in (step, -step))
    by_contact = (up - down) / (2 * step)  # at fixed θ_b
    assert by_contact == pytest.approx(2 * load / contact + stiffness * moment / contact, rel=1e-7)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(contact=contacts, base_angle=st.floats(0.01, 1.56), friction=frictions)
def test_slopes_are_those_of_load_and_height(contact, base_angle, friction):
    _, _, _, stiffness, rise = one(contact, base_angle, friction)
    h = 1e-5 * base_angle
    up, down = (one(contact, base_angle + d, friction) for d in (h, -h))
    np.testing.assert_allclose([stiffness, rise], [(up[i] - down[i]) / (2 * h) for i in (0, 1)], rtol=1e-6)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(contact=contacts, friction=frictions)
def test_a_steeper_base_needs_more_force(contact, friction):
    base_angle = np.linspace(0.01, 1.57, 300)
    found = equilibria(np.full(300, contact), base_angle, friction)
    assert np.all(np.diff(found.contact_force) > 0)
    assert np.all(found.force_slope > 0)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(base_angle=angles, friction=st.sampled_from([*FRICTIONS, 10.0]))
def test_a_longer_whisker_stands_higher(base_angle, friction):
    contact = np.linspace(0.001, 0.999, 300)
    found = equilibria(contact, np.full(300, base_angle), friction)
    assert np.all(np.diff(found.base_distance) < 0)
    assert np.all(np.diff(found.contact_force) > 0)
    assert np.all(np.hypot(found.base_distance, found.contact_distance) < 1 - contact)  # a chord is below its arc


@settings(deadline=None, derandomize=True, max_examples=60)
@given(contact=contacts, base_angle=angles, friction=frictions)
def test_height_gives_back_the_contact(contact, base_angle, friction):
    there = equilibria([contact], [base_angle], friction)
    back = equilibria_at_height(there.base_distance, [base_angle], friction)
    for went, came in zip(there, back, strict=True):
        np.testing.assert_allclose(came, went, rtol=1e-9)


def test_heights_of_a_map_are_met(rng):
    base_angle = rng.uniform(0.05, 1.55, 3000)
    height = rng.uniform(0.001, 0.999, 3000) * np.sin(base_angle)
    for friction in (-0.2, 0.4, 10.0):
        found = equilibria_at_height(height, base_angle, friction)
        np.testing.assert_allclose(found.base_distance, height, rtol=1e-12)
        assert np.all((found.contact > 0) & (found.contact < 1))


# Limits


@pytest.mark.parametrize(("friction", "order"), [(0.0, 2), (0.4, 1)])
def test_small_angles_reach_the_linear_beam_at_the_right_order(friction, order):
    # (s⁴θ')' = Λ cos φ; the first term left out is θ sin φ with friction, θ²/2 without
    contact, base_angle = 0.2, np.array([0.02, 0.01, 0.005])
    linear = base_angle / (1 / (6 * contact**2) - 1 / 2 + contact / 3)
    found = equilibria(np.full(3, contact), base_angle, friction)
    error = np.abs(found.contact_force * np.cos(np.arctan(friction)) / linear - 1)
    np.testing.assert_allclose(np.log2(error[:-1] / error[1:]), order, atol=0.05)


def test_smallest_angles_keep_their_relative_accuracy():
    contact = np.array([0.05, 0.3, 0.9])
    found = equilibria(contact, np.full(3, 1e-9), 0.4)
    linear = 1e-9 / (1 / (6 * contact**2) - 1 / 2 + contact / 3)
    np.testing.assert_allclose(found.contact_force * np.cos(np.arctan(0.4)), linear, rtol=1e-8)


def test_a_whisker_held_by_its_last_bit_of_tip_is_straight():
    found = equilibria([1e-8], [1.0], 0.4)
    np.testing.assert_allclose([found.base_distance[0], found.contact_distance[0]], [np.sin(1), np.cos(1)], rtol=1e-7)


def test_a_stub_is_a_uniform_rod():
    # 1 − ε = δ → 0: the taper no longer counts, θ'' = Λ cos(φ − θ) over δ, whose first integral is elementary
    delta, theta, phi = 1e-6, 1.2, np.arctan(0.4)
    load, height, distance = one(1 - delta, theta)[:3]
    z, w = np.polynomial.legendre.leggauss(60)
    t = (1 + z) / 2  # θ = θ_b t² takes the root of the start away
    angle = theta * t**2
    rate = np.sqrt(2 * (np.sin(phi) - np.sin(phi - angle)))  # dθ/dσ with σ = s√Λ
    length, up, along = (np.sum(w * f * theta * t / rate) for f in (1, np.sin(angle), np.cos(angle)))
    known = [(length / delta) ** 2, delta * up / length, delta * along / length]
    np.testing.assert_allclose([load, height, distance], known, rtol=1e-5)


# What is refused


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: equilibria([0.3, 0.0], [1.0, 1.0], 0.4), ("range", "contact[1]")),
        (lambda: equilibria([1.0], [1.0], 0.4), ("range", "contact[0]")),
        (lambda: equilibria([np.nan], [1.0], 0.4), ("range", "contact[0]")),
        (lambda: equilibria([0.3], [0.0], 0.4), ("range", "base_angle[0]")),
        (lambda: equilibria([0.3, 0.3], [1.0, np.nan], 0.4), ("range", "base_angle[1]")),
        (lambda: equilibria([0.3], [np.pi / 2], 0.4), ("range", "base_angle[0]")),
        (lambda: equilibria([0.3, 0.2], [1.0], 0.4), ("shape", "contact and base_angle")),
        (lambda: equilibria(0.3, 1.0, 0.4), ("shape", "contact and base_angle")),
        (lambda: equilibria([0.3], [1.0], np.nan), ("range", "friction")),
        (lambda: equilibria([0.3], [1.0], -np.inf), ("range", "friction")),
        (lambda: equilibria_at_height([0.3, -0.1], [1.0, 1.0], 0.4), ("range", "base_distance[1]")),
        (lambda: equilibria_at_height([0.3], [1.0, 1.0], 0.4), ("shape", "base_distance and base_angle")),
        (lambda: equilibria_at_height([0.3, np.nan], [1.0, 1.0], 0.4), ("range", "base_distance[1]")),
        # out of reach: a straight whisker ends at sin θ_b
        (
            lambda: equilibria_at_height([0.3, 0.85], [1.0, 1.0], 0.4),
            ("range", "base_distance[1]"),
        ),
        # dragged towards the base with μ = −1, the shaft lines up with the force first
        (lambda: equilibria([0.1, 0.1], [0.9, 1.3], -1.0), ("range", "base_angle[1]")),
        (lambda: equilibria_at_height([0.1, 0.6], [1.3, 1.3], -1.0), ("range", "base_distance[1]")),
        (lambda: equilibria_at_height([0.1], [1.0], -5.0), ("range", "base_angle[0]")),
    ],
)
def test_what_has_no_equilibrium_is_refused_by_name(call, rule):
    with refusal(*rule):
        call()


def test_the_largest_height_told_is_the_limit_of_what_is_found():
    with refusal("range", "base_distance[0]") as refused:
        equilibria_at_height([0.6], [1.3], -1.0)
    top = float(str(refused.value).split(" 0 and ")[1].split()[0])
    assert equilibria_at_height([0.999 * top], [1.3], -1.0).base_distance[0] == pytest.approx(0.999 * top, rel=1e-12)
    with refusal("range", "base_distance[0]"):
        equilibria_at_height([1.001 * top], [1.3], -1.0)


@pytest.fixture
def rng():
    """Give seeded random numbers."""
    return np.random.default_rng(20140101)
