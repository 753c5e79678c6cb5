"""Forces of the rod against their derivatives, scipy's band solver, a brute search of the ground, Coulomb's law."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.linalg import solve_banded

from vibrissa.mechanics.rod.kernels.band_kernels import HALF, WIDTH, add_block, solve_band
from vibrissa.mechanics.rod.kernels.contact_kernels import Stiffness, add_contacts, find_near, untouched
from vibrissa.mechanics.rod.kernels.elastic_kernels import add_elastic, bend, segments
from vibrissa.mechanics.rod.kernels.ground import clearance, ground_of
from vibrissa.mechanics.rod.kernels.shaft import shaft
from vibrissa.mechanics.rod.mesh import Fineness, graded_nodes
from vibrissa.mechanics.statics.contact_law import ContactLaw
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps

ALPHA = 1.5e-3


def bent(count=9, seed=0):
    """A coarse shaft, bent and stretched at random, with rates."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.2, 1, count + 1)
    rod = shaft(s, ALPHA, curvature=0.3)
    angle = np.cumsum(rng.normal(0.1, 0.1, count))
    steps = rod.rest * (1 + 1e-3 * rng.normal(size=count))
    x = np.concatenate([[0.0], np.cumsum(steps * np.cos(angle))])
    y = np.concatenate([[0.0], np.cumsum(steps * np.sin(angle))])
    at = np.concatenate([np.stack([x, y], axis=1).ravel(), [angle[-1] + 0.2]])
    return rod, at, 1e-3 * rng.normal(size=at.size)


def whole(band, size):
    out = np.zeros((size, size))
    for row in range(size):
        for column in range(max(0, row - HALF), min(size, row + HALF + 1)):
            out[row, column] = band[row, HALF + column - row]
    return out


def derivative(function, at, step):
    """Minus the derivative of a force, by central differences."""
    columns = []
    for i in range(at.size):
        ahead, behind = at.copy(), at.copy()
        ahead[i] += step
        behind[i] -= step
        columns.append((function(behind) - function(ahead)) / (2 * step))
    return np.array(columns).T


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_the_band_solver_solves_as_scipys_does(seed):
    rng = np.random.default_rng(seed)
    size = int(rng.integers(3, 40))
    band = rng.normal(size=(size + HALF, WIDTH))
    band[:, HALF] = 20 + rng.random(size + HALF)
    right = np.concatenate([rng.normal(size=size), np.zeros(HALF)])
    diagonals = np.zeros((WIDTH, size))
    for row in range(size):
        for column in range(max(0, row - HALF), min(size, row + HALF + 1)):
            diagonals[HALF + row - column, column] = band[row, HALF + column - row]
    expected = solve_banded((HALF, HALF), diagonals, right[:size])
    solve_band(band, right)
    np.testing.assert_allclose(right[:size], expected, rtol=1e-12, atol=1e-15)


def test_a_block_couples_two_nodes():
    band = np.zeros((6 + HALF, WIDTH))
    add_block(band, 0, 2, (1.0, 2.0, 3.0, 4.0))
    np.testing.assert_array_equal(whole(band, 6)[:2, 4:], [[1, 2], [3, 4]])


@pytest.mark.parametrize("damping", [0.0, 2e-3])
def test_the_elastic_matrix_is_minus_the_derivative_of_the_forces(damping):
    rod, at, rate = bent()
    per_rate, work = 700.0, segments(rod.rest.size)

    def force(places):
        out, band = np.zeros(at.size), np.zeros((at.size + HALF, WIDTH))
        rates = rate + per_rate * (places - at)
        bend(rod, damping, places, rates, work)
        add_elastic(rod, damping, per_rate, places, rates, work, out, band)
        return out, band

    expected = derivative(lambda places: force(places)[0], at, 1e-7)
    found = whole(force(at)[1], at.size)
    if damping:  # the direction in which a rate counts turns too, which Newton's method may leave out
        np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())
    else:
        np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_elastic_forces_neither_push_nor_turn_the_whole():
    rod, at, rate = bent(seed=3)
    work, out, band = segments(rod.rest.size), np.zeros(at.size), np.zeros((at.size + HALF, WIDTH))
    bend(rod, 1e-3, at, rate, work)
    add_elastic(rod, 1e-3, 0.0, at, rate, work, out, band)
    force, places = out[:-1].reshape(-1, 2), at[:-1].reshape(-1, 2)
    scale = np.abs(force).sum()
    np.testing.assert_allclose(force.sum(axis=0), 0, atol=1e-12 * scale)
    torque = (places[:, 0] * force[:, 1] - places[:, 1] * force[:, 0]).sum() + out[-1]
    assert abs(torque) < 1e-12 * scale


def test_mass_and_stiffness_are_those_of_the_cone():
    s = graded_nodes(0.2, 0.29, Fineness())
    rod = shaft(s, ALPHA)
    assert rod.mass.sum() == pytest.approx((1 - 0.2**3) / 3, rel=1e-14)
    assert rod.rest.sum() == pytest.approx(0.8, rel=1e-14)
    assert pytest.approx(s[np.argmin(np.abs(s - 0.29))], abs=1e-15) == 0.29


def test_a_tip_beyond_the_contact_is_refused():
    with refusal("range", "Whisker.tip", "0.3"):
        graded_nodes(0.3, 0.29, Fineness())


# The ground

GAPS = Gaps(np.array([0.0, 1e-3]), np.array([0.4e-3, 0.2e-3]), 35e-6)
LENGTH = 0.04


def brute(ground, x, y):
    """Distance of a point from the line of the ground, sampled densely between its corners."""
    near = (ground.x > x - 0.1) & (ground.x < x + 0.1)
    corners_x = np.concatenate([[x - 0.1], ground.x[near], [x + 0.1]])
    corners_y = np.concatenate([[0.0], ground.y[near], [0.0]])
    best = np.inf
    for k in range(corners_x.size - 1):
        share = np.linspace(0, 1, 20001)
        px = corners_x[k] + share * (corners_x[k + 1] - corners_x[k])
        py = corners_y[k] + share * (corners_y[k + 1] - corners_y[k])
        best = min(best, float(np.hypot(px - x, py - y).min()))
    return best


@pytest.mark.parametrize("radius", [0.0, 20e-6])
def test_distances_from_the_ground_are_those_of_a_brute_search(radius):
    ground = ground_of(GAPS, LENGTH, radius)
    rng = np.random.default_rng(1)
    for _ in range(60):
        x, y = rng.uniform(-0.01, 0.04), rng.uniform(-1e-3, 1e-3)
        found, nx, ny, _ = clearance(ground, x, y, -1.0, np.inf)
        assert abs(found) == pytest.approx(brute(ground, x, y), abs=1e-5)
        assert np.hypot(nx, ny) == pytest.approx(1, rel=1e-12)
        ahead = clearance(ground, x + 1e-7 * nx, y + 1e-7 * ny, -1.0, np.inf)[0]
        assert ahead == pytest.approx(found + 1e-7, abs=1e-12)  # the direction leads away from the ground
        for reach in (0.0, 2e-4):  # of a point above the ground, what is farther than the reach is not looked for
            assert clearance(ground, x, y, -1.0, reach)[0] == pytest.approx(min(found, reach), abs=1e-18)


def test_the_sides_of_the_ground():
    ground = ground_of(GAPS, LENGTH)
    depth = 35e-6 / LENGTH
    assert clearance(ground, -0.01, 1e-4, 0.0, np.inf)[0] == pytest.approx(1e-4)
    assert clearance(ground, -0.01, -1e-4, 0.0, np.inf)[0] == pytest.approx(-1e-4)
    assert clearance(ground, 0.005, -depth + 1e-5, -depth, np.inf)[0] == pytest.approx(1e-5)
    wall = clearance(ground, -1e-5, -depth / 2, -depth / 2, np.inf)
    assert wall[:3] == pytest.approx((-1e-5, 1.0, 0.0))
    above = clearance(ground, -1e-5, -1e-5, 0.0, np.inf)  # it slid off the edge: the wall does not catch it
    assert above[:3] == pytest.approx((-1e-5, 0.0, 1.0))


def test_a_height_profile_is_its_own_ground():
    x = np.linspace(0, 2e-3, 41)
    surface = HeightProfile(position=x, height=20e-6 * np.sin(2 * np.pi * x / 1e-3 + 0.1))
    ground = ground_of(surface, LENGTH)
    np.testing.assert_allclose(ground.x[1:-1] * LENGTH, x)
    inside = np.diff(surface.height, 2) < -1e-12
    np.testing.assert_array_equal(
        np.isin(np.arange(2, 41), ground.edge[(ground.edge > 1) & (ground.edge < 41)]), inside
    )


@pytest.mark.parametrize("radius", [1e-6, 10e-6, 35e-6])
def test_a_rounded_edge_misses_its_arc_by_three_nanometres_at_most(radius):
    ground = ground_of(Gaps(np.array([0.0]), np.array([0.4e-3]), 35e-6), LENGTH, radius)
    x, y = ground.x[1:-1] * LENGTH, ground.y[1:-1] * LENGTH
    arc = (x <= 0) & (y >= -radius)
    middle = np.hypot(x[arc][1:] + x[arc][:-1] + 2 * radius, y[arc][1:] + y[arc][:-1] + 2 * radius) / 2
    assert np.hypot(x[arc] + radius, y[arc] + radius) == pytest.approx(radius, rel=1e-9)
    assert 1e-9 < radius - middle.min() < 3e-9 * (1 + 1e-6)


def test_a_radius_beyond_half_a_land_is_refused():
    with refusal("range", "edge_radius"):
        ground_of(Gaps(np.array([0.0, 0.41e-3]), np.array([0.4e-3, 0.2e-3])), LENGTH, 20e-6)


# Contacts

LAWS = {"coulomb": ContactLaw(0.4), "adhesive": ContactLaw(0.2, 0.3)}


def touching(law, slip):
    """A shaft on a gap's edge and on the land behind it, after a small motion along the ground."""
    rod = shaft(np.linspace(0.253, 1, 16), ALPHA)
    ground = ground_of(GAPS, LENGTH)
    at = np.zeros(2 * rod.s.size + 1)
    at[0:-1:2], at[1:-1:2] = rod.s - 0.29, 0.02 * (rod.s - 0.29) - 3e-4
    before = at.copy()
    before[0:-1:2] -= slip
    touch = untouched(rod.s.size, ground.edge.size)
    find_near(rod, ground, (0.0, 0.0), at, touch)
    return rod, ground, Stiffness(1e5, 1e5, law), at, before, touch


@pytest.mark.parametrize("slip", [1e-9, 1e-4, -1e-4])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_matrix_of_the_contacts_is_minus_the_derivative_of_their_forces(law, slip):
    rod, ground, stiffness, at, before, touch = touching(law, slip)

    def force(places):
        out, band = np.zeros(at.size), np.zeros((at.size + HALF, WIDTH))
        add_contacts(rod, ground, stiffness, (0.0, 0.0), (0.0, 0.0), places, before, touch, out, band)
        return out, band

    out, band = force(at)
    expected, found = derivative(lambda places: force(places)[0], at, 1e-9), whole(band, at.size)
    assert touch.summary[4] >= 2
    np.testing.assert_allclose(found, expected, atol=2e-2 * np.abs(expected).max())  # frozen directions
    assert np.abs(out).max() > 0


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_friction_sticks_below_what_the_law_allows_and_dissipates_above(law):
    for slip, sticks in ((1e-9, True), (1e-4, False), (-1e-4, False)):
        rod, ground, stiffness, at, before, touch = touching(law, slip)
        out, band = np.zeros(at.size), np.zeros((at.size + HALF, WIDTH))
        add_contacts(rod, ground, stiffness, (0.0, 0.0), (0.0, 0.0), at, before, touch, out, band)
        normal, drag, _, _, contacts, sticking, _, work, lost = touch.summary[:9]
        assert (sticking == contacts) == sticks
        assert drag * slip < 0
        assert work == 0  # the ground does not move
        assert lost == pytest.approx(0, abs=1e-18) if sticks else lost > 0
        if law.adhesion == 0:
            assert abs(drag) <= 0.4 * normal * (1 + 1e-12)


def test_what_is_in_the_air_is_not_touched():
    rod, ground, stiffness, at, before, touch = touching(LAWS["coulomb"], 0.0)
    at[1:-1:2] += 0.1
    find_near(rod, ground, (0.0, 0.0), at, touch)
    out, band = np.zeros(at.size), np.zeros((at.size + HALF, WIDTH))
    add_contacts(rod, ground, stiffness, (0.0, 0.0), (0.0, 0.0), at, before, touch, out, band)
    assert not out.any()
    assert touch.near[0] == 0
