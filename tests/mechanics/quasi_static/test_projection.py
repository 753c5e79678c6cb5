"""Profiles marched all at once, and their amplitudes, against those found one by one by collocation."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.modes.basis import basis
from vibrissa.mechanics.quasi_static.projection import Projection, profiles
from vibrissa.mechanics.quasi_static.response import quasi_static
from vibrissa.mechanics.quasi_static.response_rows import held_rows
from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.gap import jump_table
from vibrissa.mechanics.statics.profile import Posture

POSTURES = [(0.3, 0.3, 0.4), (0.29, 1.2, 0.4), (0.12, 1.0, 0.2), (0.02, 0.6, 0.4), (0.7, 0.5, 0.0)]
WAY = np.array([0.0, -1e-4, -2e-3, -6e-3, 1e-4, 8e-4])  # over L


def flat_of(contact, base_angle, friction):
    return on_the_flat(Posture(contact=contact, base_angle=base_angle, friction=friction))


@pytest.mark.parametrize("posture", POSTURES)
def test_profiles_marched_are_those_by_collocation(posture):
    flat = flat_of(*posture)
    way = WAY * min(1.0, 3 * flat.contact)
    s = Projection(flat, basis("straight", flat, 1)).s
    found = profiles(flat, way, s)
    for e, d in enumerate(way):
        held = hold(flat, float(d))
        np.testing.assert_allclose(found.unknowns[e, :2], [held.contact, held.contact_angle], atol=1e-10)
        assert found.unknowns[e, 2] == pytest.approx(held.curve.load, rel=1e-9)
        assert found.base_curvature[e] == pytest.approx(held.base_curvature, rel=1e-9)
        on_curve = s >= held.contact
        np.testing.assert_allclose(np.stack([found.x, found.y])[:, e, on_curve], held.position(s[on_curve]), atol=1e-11)


@pytest.mark.parametrize("modes", ["straight", "curved-edge"])
@pytest.mark.parametrize("posture", POSTURES)
def test_rows_are_those_of_profiles_taken_one_by_one(posture, modes):
    flat = flat_of(*posture)
    reach = WAY.min() * min(1.0, 3 * flat.contact), WAY.max() * min(1.0, 3 * flat.contact)
    response = quasi_static(flat.posture, reach, n_modes=5, modes=modes)
    d = np.linspace(*reach, 7)
    one_by_one = np.array([held_rows(flat, response.basis, hold(flat, one)) for one in d.tolist()]).T
    size = np.abs(one_by_one).max(axis=1, keepdims=True)
    size[:5] = size[:5].max()
    np.testing.assert_allclose(response(d) / size, one_by_one / size, atol=1e-9)


def test_equally_wide_gaps_take_fewer_nodes_and_jump_where_others_do():
    posture = Posture(contact=0.29, base_angle=1.2)
    alike, table = jump_table(posture, np.full(3, 0.015)), jump_table(posture, np.array([0.0075, 0.025]))
    assert len(alike.coefficients) < len(table.coefficients)
    width = np.array([0.015, 0.0150149])
    np.testing.assert_allclose(alike(width), table(width), rtol=1e-8)
    assert alike(width[:1])[0] == pytest.approx(4.707761e-4, rel=1e-6)  # MODEL.md


def test_an_excursion_out_of_reach_is_refused_with_the_fold_named():
    flat = flat_of(0.15, 1.4, 0.4)
    with refusal("range", "excursion 0.01 L"):
        profiles(flat, np.array([0.01, 0.3]), np.array([flat.contact, 1.0]))
