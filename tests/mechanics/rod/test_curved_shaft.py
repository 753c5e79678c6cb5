"""A shaft that is curved in air: its free shape, its table, and where it touches the ground."""

import numpy as np
import pytest
from refusals import refusal
from rods import POSTURE, cone, resting
from scipy.integrate import solve_bvp

from vibrissa.mechanics.rod.curved_profile import curved_profile
from vibrissa.mechanics.rod.equilibrium import resting_rod
from vibrissa.mechanics.rod.kernels.elastic_kernels import add_elastic, bend, segments
from vibrissa.mechanics.rod.kernels.shaft import shaft
from vibrissa.mechanics.rod.mesh import Fineness, graded_nodes
from vibrissa.mechanics.rod.rod_settings import Rod
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import IntrinsicCurvature

TABLE = IntrinsicCurvature(distance=(0.0, 0.04), curvature=(25.0, 5.0))


def unloaded(rod, s):
    """Places of a shaft whose segments have their own lengths and angles, from the base (1, 0) to the tip."""
    turn = np.pi / 3 - np.cumsum(rod.rest_angle[::-1])[:-1][::-1]
    steps = rod.rest[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    places = np.concatenate([-np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 2))])
    return np.append(places.ravel(), np.pi / 3)


def test_the_free_shape_is_the_integral_of_the_table_and_carries_no_force():
    errors = []
    for factor in (1, 2, 4):
        s = graded_nodes(0.2, 0.29, Fineness().refined(factor))
        rod = shaft(s, 1.5e-3, curvature=Rod(intrinsic_curvature=TABLE).curvature_at(s, 0.04))
        at, work = unloaded(rod, s), segments(s.size - 1)
        force, band = np.zeros(at.size + 5), np.zeros((at.size + 5, 11))
        bend(rod, 0.0, at, np.zeros_like(at), work)
        add_elastic(rod, 0.0, 0.0, at, np.zeros_like(at), work, force, band)
        assert np.abs(force[: at.size]).max() < 1e-7  # of an axial stiffness of 1e8
        fine = np.linspace(1, s[0], 4001)  # θ' = Lκ₀ towards the base
        own = 0.04 * TABLE.at((1 - fine) * 0.04)
        theta = np.pi / 3 - np.concatenate([[0], np.cumsum((own[1:] + own[:-1]) / 2 * -np.diff(fine))])
        middle = (theta[1:] + theta[:-1]) / 2
        tip = np.array([np.sum(np.cos(middle) * np.diff(fine)), np.sum(np.sin(middle) * np.diff(fine))])
        errors.append(float(np.hypot(*(at[:2] - tip))))
    assert errors[0] < 1e-3
    assert errors[0] > 3 * errors[1] > 9 * errors[2]  # second order: 4


def test_a_constant_table_is_the_constant():
    same = IntrinsicCurvature(distance=(0.0, 0.01, 0.03), curvature=(15.0, 15.0, 15.0))
    settings = [Rod(intrinsic_curvature=one, hold_contact=True) for one in (15.0, same)]
    number, table = (resting_rod(cone(0.15), POSTURE, damping=0.11, settings=one) for one in settings)
    np.testing.assert_allclose(table.state.at, number.state.at, atol=1e-12)
    np.testing.assert_allclose(table.drive, number.drive, rtol=1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.4, 0.8])
def test_without_curvature_the_profile_is_that_of_eq_1(friction):
    posture = Posture(contact=0.2, base_angle=1.0, friction=friction)
    flat, found = on_the_flat(posture), curved_profile(posture, np.zeros_like)
    assert found.load == pytest.approx(flat.contact_force, rel=1e-8)
    np.testing.assert_allclose(found.base, [*flat.base, 1.0], rtol=1e-8)


@pytest.mark.parametrize("curvature", [-1.2, 0.6])
def test_the_curved_profile_is_that_of_another_solver(curvature):
    def slope(s, y, p):
        phi = np.arctan(0.4)
        return np.array([y[1] / s**4 + curvature, p[0] * np.cos(phi - y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(first, last, p):
        return np.array([*first, last[0] - 1.2])

    s = np.linspace(0.29, 1, 400)
    start = np.array([1.2 * (s - 0.29) / 0.71, 0 * s, s - 0.29, 0.3 * (s - 0.29)])
    other = solve_bvp(slope, ends, s, start, p=[0.8], tol=1e-9, max_nodes=20000)
    found = curved_profile(POSTURE, lambda s: np.full_like(s, curvature))
    assert found.load == pytest.approx(other.p[0], rel=1e-6)
    np.testing.assert_allclose(found.base[:2], other.y[2:, -1], rtol=1e-6)


@pytest.mark.parametrize("curvature", [15.0, 25.0])
def test_a_curved_whisker_touches_where_it_is_told(curvature):
    rod = resting(tip=0.15, intrinsic_curvature=curvature, hold_contact=True)
    normal, drag, first, last = rod.touch.summary[:4]
    load = curved_profile(POSTURE, lambda s: np.full_like(s, 0.04 * curvature)).load
    assert 0.288 < first <= last < 0.294
    assert np.hypot(normal, drag) == pytest.approx(load, rel=3e-3)
    assert rod.state.at[1] > 1e-3  # the free end is off the ground


def test_a_whisker_that_turns_too_far_by_itself_is_refused():
    with refusal("range", "intrinsic curvature"):
        resting_rod(cone(0.15), POSTURE, damping=0.1, settings=Rod(intrinsic_curvature=60.0, hold_contact=True))
