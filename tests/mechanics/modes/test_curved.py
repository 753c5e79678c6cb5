"""Modes about the curved profile, against numbers of other programs, a chain of rigid links and the laws of motion."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from refusals import refusal
from scipy.integrate import solve_ivp
from scipy.linalg import eig
from scipy.optimize import brentq
from shooting import force_angle, march

from vibrissa.exact import cone_kappa, shaft_quadrature
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture

ANGLES = (0.4, 0.8, 1.2, 1.4)
# research/mechanics.md §2d and MODEL.md: a chain of 200 rigid links; the same in Exudyn, 80 ANCF elements
CHAIN = {0.1: [12.136, 11.615, 10.684, 10.074], 0.3: [23.326, 22.064, 19.935, 18.590]}
CHAIN_SECOND = [66.689, 65.568, 63.480, 62.071]
EXUDYN = [(0.1, 1.2, 10.682), *zip([0.3] * 4, ANGLES, [23.323, 22.061, 19.932, 18.587], strict=True)]
COULOMB = [23.766, 22.892, 21.067, 19.837]
FIXED = [("slide", "constant"), ("slide", "coulomb"), ("stick", "constant")]  # a point of the shaft is
WAYS = [*FIXED, ("edge", "coulomb"), ("flat", "constant"), ("flat", "coulomb")]
# benchmarks/peers/edge.py: a chain over an edge, 60, 120 and 240 links, of first and second order in their length
EDGE = {
    0.3: [23.60196743, 23.60755881, 23.60891227],
    0.8: [21.42568507, 21.41803592, 21.41395521],
    1.2: [17.67487804, 17.62102867, 17.59482067],
    1.4: [14.97010236, 14.85541476, 14.79858568],
}


def posture(contact=0.3, base_angle=1.2, friction=0.4, adhesion=0.0):
    return Posture(contact=contact, base_angle=base_angle, friction=friction, adhesion=adhesion)


CASES = {"usual": posture(), "rough": posture(0.15, 0.9, 0.8), "adhesive": posture(0.3, 1.1, 0.2, 0.4)}
at_cases = pytest.mark.parametrize("at", CASES.values(), ids=CASES)


@pytest.mark.parametrize("contact", CHAIN)
def test_sliding_under_constant_friction_resonates_as_a_chain_of_links_does(contact):
    found = [curved_modes(posture(contact, angle), 2).kappa for angle in ANGLES]
    np.testing.assert_allclose([kappa[0] for kappa in found], CHAIN[contact], rtol=5e-5)
    if contact == 0.3:
        np.testing.assert_allclose([kappa[1] for kappa in found], CHAIN_SECOND, rtol=5e-5)


@pytest.mark.parametrize(("contact", "base_angle", "kappa"), EXUDYN)
def test_sliding_resonates_as_in_exudyn(contact, base_angle, kappa):
    assert curved_modes(posture(contact, base_angle), 1).kappa[0] == pytest.approx(kappa, rel=3e-4)


def test_sliding_under_coulomb_friction():
    found = [curved_modes(posture(0.3, angle), 1, law="coulomb").kappa[0] for angle in ANGLES]
    np.testing.assert_allclose(found, COULOMB, atol=6e-4)


def test_stuck_whisker_is_an_arch():
    found = [curved_modes(posture(contact, 1e-4), 1, condition="stick").kappa[0] for contact in (0.1, 0.2, 0.3, 0.4)]
    np.testing.assert_allclose(found, [19.8, 35.7, 59.6, 95.6], atol=0.06)
    assert curved_modes(posture(), 1, condition="stick").kappa[0] == pytest.approx(55.6, abs=0.06)


def chain_kappa(at, links, condition, law):
    """κ₁ and κ₂ of rigid rods joined by torsion springs, laid along Eq. 1 by shooting, second order in their length."""
    h, force = (1 - at.contact) / links, float(on_the_flat(at).contact_force)
    middles, joints = at.contact + h * (np.arange(links) + 0.5), at.contact + h * np.arange(1, links + 1)
    phi = force_angle(at, at.contact, force)
    angle = march(at.contact, 0.0, force, phi, points=middles)[0]
    spring = joints**4 / h * np.where(joints > 1 - h / 2, 2, 1)  # at the clamp half a link bends
    stretch = np.eye(links) - np.eye(links, k=1)  # rotation of a joint
    push = force * np.sin(phi - angle) * h
    stiffness = stretch.T @ (spring[:, None] * stretch) + np.diag(push)
    lever = -h * (np.triu(np.ones((links, links)), 1) + np.eye(links) / 2)  # centres, from the base
    x, y = lever * -np.sin(angle), lever * np.cos(angle)
    inertia = (middles**2 * h)[:, None]
    mass = x.T @ (inertia * x) + y.T @ (inertia * y) + np.diag(middles**2 * h**3 / 12)
    tip_x, tip_y = h * np.sin(angle), -h * np.cos(angle)
    held = np.stack([tip_y, tip_x] if condition == "stick" else [tip_y])
    by_load = at.friction + 2 / 3 * at.adhesion * at.contact ** (2 / 3) * (force * np.cos(phi)) ** (-1 / 3)  # dT/dN
    work = np.stack([tip_y - by_load * tip_x]) if law == "coulomb" else held
    trial, test = (np.linalg.svd(rows)[2][len(rows) :].T for rows in (held, work))
    square = eig(test.T @ mass @ trial, test.T @ stiffness @ trial, right=False)
    return np.sort((1 / np.sqrt(square.astype(complex))).real)[:2]


@pytest.mark.parametrize(("condition", "law"), FIXED)
@at_cases
def test_a_chain_of_links_converges_to_the_modes(at, condition, law):
    exact = curved_modes(at, 2, condition=condition, law=law).kappa
    coarse, fine = (chain_kappa(at, links, condition, law) for links in (60, 120))
    np.testing.assert_allclose((coarse - exact) / (fine - exact), 4, rtol=0.05)  # second order
    np.testing.assert_allclose((4 * fine - coarse) / 3, exact, rtol=1e-5)


@pytest.mark.parametrize("base_angle", EDGE)
def test_a_chain_over_an_edge_converges_to_its_modes(base_angle):
    few, some, many = EDGE[base_angle]
    limit = (8 * many - 6 * some + few) / 3
    assert curved_modes(posture(0.3, base_angle), 1, condition="edge").kappa[0] == pytest.approx(limit, rel=3e-5)


def miss_at_base(at, kappa, held, condition, law, change):
    """(θ, x, y) at the base less what they are at rest, by marching the bent shaft and its inertia up to there.

    ``change`` is of the load, and of two of: where the contact is on the shaft, in space, and its angle.
    """
    rest = float(held.contact_force)
    phi = force_angle(at, at.contact, rest)
    normal_force = (rest + change[0]) * np.cos(phi)
    moved = change[1] if condition in ("edge", "flat") else 0.0
    along = change[2] if condition == "flat" else change[1] if condition == "slide" else 0.0
    turn = change[2] if condition != "flat" else 0.0
    normal = turn if condition == "edge" else 0.0
    adhesive = at.adhesion * (normal_force * (at.contact + moved)) ** (2 / 3)
    drag = at.friction * normal_force + adhesive if law == "coulomb" else rest * np.sin(phi)
    push = [-drag * np.cos(normal) - normal_force * np.sin(normal)]
    push.append(normal_force * np.cos(normal) - drag * np.sin(normal))

    def slope(s, state):
        theta, m, fx, fy, x, y, theta_rest, m_rest, x_rest, y_rest = state
        inertia = kappa**2 * s**2
        return [
            *(m / s**4, fy * np.cos(theta) - fx * np.sin(theta), inertia * (x - x_rest), inertia * (y - y_rest)),
            *(np.cos(theta), np.sin(theta)),
            *(m_rest / s**4, rest * np.cos(phi - theta_rest), np.cos(theta_rest), np.sin(theta_rest)),
        ]

    # from the contact to ε the shaft is straight, to first order
    start = [turn, -moved * normal_force, *push, along - moved * np.cos(turn), -moved * np.sin(turn), *[0.0] * 4]
    tight = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "max_step": 0.01}
    end = solve_ivp(slope, (at.contact, 1), np.array(start, complex), **tight).y[:, -1]
    return end[[0, 4, 5]] - end[[6, 8, 9]]


def determinant(kappa, at, held, condition, law):
    """0 where a small change at the contact swings with the base at rest; derivatives by steps along i."""
    steps = 1e-12j * np.eye(3)
    return np.linalg.det([miss_at_base(at, kappa, held, condition, law, step).imag / 1e-12 for step in steps])


@pytest.mark.parametrize(("condition", "law"), [way for way in WAYS if way[0] != "stick"])
@at_cases
def test_shooting_the_bent_shaft_finds_the_resonances(at, condition, law):
    """Eq. 1 with the inertia of a small swing, marched from the moved contact: no weak form and no modes."""
    for kappa in curved_modes(at, 2, condition=condition, law=law).kappa:
        bracket = (kappa * (1 - 1e-3), kappa * (1 + 1e-3))
        found = brentq(determinant, *bracket, args=(at, on_the_flat(at), condition, law), rtol=1e-10)
        assert found == pytest.approx(kappa, rel=1e-7)


@pytest.mark.parametrize("adhesion", [0.0, 0.3])
@pytest.mark.parametrize("contact", [0.1, 0.15])
def test_on_the_fold_nothing_brings_a_whisker_back_to_its_edge(contact, adhesion):
    """κ₁² changes sign with the determinant of the profile held by an edge, which knows of no modes."""
    angles = (1.3, 1.45) if contact == 0.1 else (1.4, 1.55)
    friction = 0.4 - adhesion / 2

    def at(angle):
        return posture(contact, angle, friction, adhesion)

    fold = brentq(lambda angle: on_the_flat(at(angle)).determinant, *angles, xtol=1e-13)
    near = [curved_modes(at(fold + step), 1, condition="edge") for step in (-1e-4, 1e-4)]
    before, after = near[0].kappa[0] ** 2, near[1].growth[0] ** 2
    assert near[0].growth[0] == near[1].kappa[0] == 0
    assert 0 < before < 0.1
    assert after == pytest.approx(before, rel=1e-2)
    assert np.isnan(near[1].base_curvature[0])


def test_smooth_edge_holds_as_well_as_it_is_held():
    """Without friction all is conservative: the modes are their own duals."""
    modes = curved_modes(posture(friction=0.0), 4, condition="edge")
    s = np.linspace(0.3, 1, 50)
    np.testing.assert_allclose(modes.adjoint(s), modes.displacement(s), atol=1e-8 * np.abs(modes.adjoint(s)).max())


@pytest.mark.parametrize("law", ["constant", "coulomb"])
def test_nearly_straight_on_flat_ground_is_clamped(law):
    """Roots of the Bessel determinant with V = V' = 0 at both ends."""
    clamped = {0.1: 13.288373446, 0.2: 19.346795243, 0.3: 28.233705613, 0.4: 42.193816273}
    found = [curved_modes(posture(c, 1e-6), 1, condition="flat", law=law).kappa[0] for c in clamped]
    np.testing.assert_allclose(found, list(clamped.values()), rtol=1e-6)


@pytest.mark.parametrize(("condition", "law"), [("slide", "constant"), ("slide", "coulomb"), ("edge", "coulomb")])
@pytest.mark.parametrize("contact", [0.02, 0.3, 0.7])
def test_flat_whisker_has_the_straight_modes(contact, condition, law):
    straight, way = cone_kappa(contact, 6), {"condition": condition, "law": law}
    one, two = (curved_modes(posture(contact, angle), 6, **way).kappa / straight - 1 for angle in (1e-3, 2e-3))
    assert np.all(np.abs(one) < 1e-3)
    np.testing.assert_allclose(2 * one - two, 0, atol=5e-7)  # friction's pull is linear, the rest of the angle's square
    without = curved_modes(posture(contact, 1e-4, friction=1e-9), 6, **way).kappa
    np.testing.assert_allclose(without, straight, rtol=1e-6)


@pytest.mark.parametrize(("condition", "law"), WAYS)
@pytest.mark.parametrize(
    ("contact", "count"), [*((contact, 6) for contact in (0.001, 0.005, 0.1, 0.5, 0.98)), (0.001, 24), (0.98, 24)]
)
def test_more_polynomials_change_nothing(contact, condition, law, count):
    at = on_the_flat(posture(contact))
    few, many = (curved_modes(at, n, condition=condition, law=law) for n in (count, count + 16))
    rtol = 1e-8 if condition == "edge" else 1e-10  # near and beyond the fold κ₁² is a small difference
    np.testing.assert_allclose(few.kappa, many.kappa[:count], rtol=rtol)
    np.testing.assert_allclose(few.growth, many.growth[:count], rtol=1e-7)


@cache
def case(condition, law):
    modes = curved_modes(posture(), 6, condition=condition, law=law)
    s, weights = shaft_quadrature(0.3, 120)
    return modes, s, weights, modes.displacement(s)


@pytest.mark.parametrize(("condition", "law"), WAYS)
def test_modes_are_orthonormal_to_their_duals(condition, law):
    modes, s, weights, shift = case(condition, law)
    np.testing.assert_allclose(
        np.einsum("xis,xjs,s->ij", modes.adjoint(s), shift, weights * s**2), np.eye(6), atol=1e-11
    )
    np.testing.assert_allclose(np.einsum("xis,xis,s->i", shift, shift, weights * s**2), 1, atol=1e-11)
    if law == "constant":
        np.testing.assert_allclose(modes.adjoint(s), shift, atol=1e-12)
    assert np.all(modes.base_curvature > 0)


@pytest.mark.parametrize(("condition", "law"), WAYS)
def test_modes_neither_stretch_the_shaft_nor_leave_their_supports(condition, law):
    modes, *_ = case(condition, law)
    s, step = np.linspace(0.31, 0.99, 50), 1e-5
    slope = (modes.displacement(s + step) - modes.displacement(s - step)) / (2 * step)
    angle = modes.flat.angle(s)
    scale = np.abs(slope).max()
    np.testing.assert_allclose(np.cos(angle) * slope[0] + np.sin(angle) * slope[1], 0, atol=1e-8 * scale)
    across = -np.sin(angle) * slope[0] + np.cos(angle) * slope[1]
    np.testing.assert_allclose(across, modes.rotation(s), atol=1e-6 * scale)
    base, contact = modes.displacement(np.array([1.0, 0.3])).transpose(2, 0, 1)
    np.testing.assert_allclose(base, 0, atol=1e-12)
    np.testing.assert_allclose(modes.rotation(np.ones(1)), 0, atol=1e-11)
    np.testing.assert_allclose(contact if condition == "stick" else contact[1], 0, atol=1e-12)
    if condition == "flat":
        np.testing.assert_allclose(modes.rotation(np.array([0.3])), 0, atol=1e-10)


@pytest.mark.parametrize(("condition", "law"), WAYS)
def test_forces_and_moments_balance_the_whisker_s_momentum(condition, law):
    modes, s, weights, shift = case(condition, law)
    inertia = modes.kappa**2 * (shift * weights * s**2).sum(axis=-1)
    np.testing.assert_allclose(modes.base_force, modes.contact_force + inertia, rtol=1e-10)
    flat, phi = modes.flat, modes.flat.posture.friction_angle
    place, foot = np.array(flat.position(s)), np.array(flat.position(np.array([0.3])))
    rest = flat.contact_force * np.array([-np.sin(phi), np.cos(phi)])

    def turning(arm, force):
        return arm[0] * force[1] - arm[1] * force[0]

    slid = modes.displacement(np.array([0.3]))[:, :, 0]
    if condition == "edge":  # which is where the load is, and stays
        slid = 0 * slid
    if condition == "flat":  # the bending moment at ε is that of the load at ε + δε
        step = 1e-4 * np.arange(6)
        bend = [Polynomial.fit(step, row, 5).deriv()(0.0) for row in modes.rotation(0.3 + step)]
        slid[0] -= 0.3**4 * np.array(bend) / rest[1]
    swing = modes.kappa**2 * (turning(place[:, None], shift) * weights * s**2).sum(axis=-1)
    moment = -(turning(slid, rest[:, None]) + turning(foot, modes.contact_force) + swing)
    np.testing.assert_allclose(modes.base_curvature, moment, rtol=1e-8)


def test_friction_changes_as_its_law_says():
    constant, coulomb = case("slide", "constant")[0].contact_force, case("slide", "coulomb")[0].contact_force
    np.testing.assert_array_equal(constant[0], 0)
    np.testing.assert_allclose(coulomb[0], -0.4 * coulomb[1], rtol=1e-12)
    assert np.all(np.abs(case("stick", "constant")[0].contact_force) > 1)
    flat = case("flat", "coulomb")[0].contact_force
    np.testing.assert_allclose(flat[0], -0.4 * flat[1], rtol=1e-12)
    edge, (modes, *_) = case("edge", "coulomb")[0].contact_force, case("edge", "coulomb")
    phi, turn = np.arctan(0.4), modes.rotation(np.array([0.3]))[:, 0]
    across = edge[0] * np.cos(phi) + edge[1] * np.sin(phi)  # of the load at rest: by its turning alone
    np.testing.assert_allclose(across, -modes.flat.contact_force * turn, rtol=1e-10)


def test_small_angles_give_the_straight_forces():
    """MODEL.md, "Signals": V''' + 4V'' = 163.26 of mode 1 at ε = 0.29."""
    modes = curved_modes(posture(0.29, 1e-5), 1)
    np.testing.assert_allclose(modes.transverse_force, 163.26, atol=5e-3)
    np.testing.assert_allclose(modes.axial_force, 0, atol=1e-3)


def test_free_end_goes_on_straight():
    modes, *_ = case("slide", "constant")
    x, y = modes.displacement(np.array([0.1, 0.3]))
    turn = modes.rotation(np.array([0.1, 0.3]))
    np.testing.assert_allclose(turn[:, 0], turn[:, 1])
    np.testing.assert_allclose(x[:, 0], x[:, 1])
    np.testing.assert_allclose(y[:, 0], -0.2 * turn[:, 0])


@settings(deadline=None, derandomize=True, max_examples=40)
@given(contact=st.floats(0.005, 0.9), angle=st.floats(0.01, 1.5), friction=st.floats(0, 1.5))
def test_no_posture_of_usual_friction_flutters(contact, angle, friction):
    at = on_the_flat(posture(contact, angle, friction))
    ways = [curved_modes(at, 6, condition=where, law=law) for where, law in WAYS if where != "edge"]
    constant, _, stuck, clamped, _ = ways
    for modes in ways:
        assert np.all(modes.growth == 0)
        assert np.all(np.diff(modes.kappa) > 0)
    assert np.all(stuck.kappa > constant.kappa)  # one constraint more raises every frequency
    assert np.all(clamped.kappa > constant.kappa)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(contact=st.floats(0.02, 0.9), angle=st.floats(0.01, 1.5), friction=st.floats(0, 1.5))
def test_an_edge_lets_go_beyond_the_fold_alone(contact, angle, friction):
    at = on_the_flat(posture(contact, angle, friction))
    modes = curved_modes(at, 6, condition="edge")
    np.testing.assert_array_equal(modes.growth > 0, [at.determinant > 0] + [False] * 5)
    assert np.all(np.diff(modes.kappa) > 0)


def test_a_stub_on_ground_of_huge_friction_flutters():
    modes = curved_modes(posture(0.8, 1.2, 10.0), 3, law="coulomb")
    assert modes.kappa[0] == pytest.approx(modes.kappa[1], rel=1e-14)  # a conjugate pair, but for rounding
    np.testing.assert_array_equal(modes.growth > 0, [True, True, False])
    assert np.isnan(modes.base_curvature[:2]).all()
    assert np.isfinite(modes.base_force[:, 2]).all()
    chain = chain_kappa(posture(0.8, 1.2, 10.0), 200, "slide", "coulomb")
    np.testing.assert_allclose(modes.kappa[:2], chain, rtol=1e-3)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: curved_modes(posture(), 1, condition="glue"), ("unknown", "contact condition")),
        (lambda: curved_modes(posture(), 1, law="dry"), ("unknown", "friction law")),
        (lambda: curved_modes(posture(), 1, condition="stick", law="coulomb"), ("range", "friction law")),
        (lambda: curved_modes(posture(), 1, condition="edge", law="constant"), ("unknown", "friction law")),
    ],
)
def test_bad_requests_are_refused(call, message):
    with refusal(*message):
        call()
