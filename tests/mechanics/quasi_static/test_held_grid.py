"""Profiles held at a grid by compiled loops are those that collocation holds; what is expected only saves time."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from refusals import refusal

from vibrissa.mechanics.contact.episodes import episodes
from vibrissa.mechanics.quasi_static.held_table import ContactBox, held_table
from vibrissa.mechanics.quasi_static.relief_response import flat_tilt
from vibrissa.mechanics.statics.chebyshev import unit_nodes
from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.generators import self_affine
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
POSTURES = [Posture(contact=0.29, base_angle=1.2), Posture(contact=0.6, base_angle=0.5, friction=0.0)]


@pytest.fixture(scope="module", params=POSTURES, ids=["steep", "flat"])
def table(request):
    flat = on_the_flat(request.param)
    return held_table(flat, ContactBox((-0.02, -1e-3), (0.004, 5e-4), flat_tilt(flat)), reach=0.05)


def some_nodes(table):
    """Excursion and height of nodes of the table, their index, and the profile that collocation holds there."""
    count = table.shape[1]
    first, second = map(unit_nodes, table.shape)
    d, z = table.box.place(tuple(np.meshgrid(first, second, indexing="ij")))
    for j, k in ((0, 0), (table.shape[0] - 1, count - 1), (4, 2)):
        yield j * count + k, hold(table.flat, d[j, k], height=z[j, k])


def test_every_node_holds_the_profile_that_collocation_holds(table):
    s = np.array([0.1, table.flat.contact, 0.7, 0.95, 1.0, 1.01])
    positions = table.positions(s)
    for node, held in some_nodes(table):
        np.testing.assert_allclose(
            table.unknowns.reshape(-1, 3)[node],
            [held.contact, held.contact_angle, held.curve.load],
            rtol=1e-9,
            atol=1e-11,
        )
        np.testing.assert_allclose(positions[:, :, node], held.position(s), atol=1e-11)


def test_the_shaft_ahead_of_the_contact_is_where_its_table_says(table):
    u = np.array([1e-4, 0.01, 0.03, 0.05])
    for node, held in some_nodes(table):
        j, k = divmod(node, table.shape[1])
        at = [unit_nodes(n)[i] for i, n in zip((j, k), table.shape, strict=True)]
        rise = np.polynomial.chebyshev.chebval3d(
            2 * u / table.reach - 1, *(np.full(len(u), x) for x in at), table.ahead
        )
        s = np.linspace(held.contact, 1, 4000)
        x, y = held.position(s)
        np.testing.assert_allclose(u * rise, np.interp(u, x - x[0], y - y[0]), atol=2e-8)  # of chords


def test_a_box_beyond_the_fold_is_refused_with_the_place(table):
    with refusal("range"):
        held_table(table.flat, ContactBox((-0.02, -1e-3), (2.0, 5e-4), table.box.tilt), reach=0.05)


@pytest.mark.parametrize("extent", [(-0.05, 0.01), (-1e-4, 1e-5), (-5.0, 3.0)], ids=["wide", "narrow", "absurd"])
@pytest.mark.parametrize("enough", [(14, 6), (27, 12)])
def test_what_is_expected_of_a_scan_changes_nothing_but_its_time(extent, enough):
    like = SimpleNamespace(extent=extent, table=SimpleNamespace(enough=enough))
    relief, flat = self_affine(0.01, rng=np.random.default_rng(3), rms=3e-6, spacing=5e-6), on_the_flat(POSTURES[0])
    plain, other = episodes(relief, WHISKER, flat), episodes(relief, WHISKER, flat, like=like)
    travelled = np.linspace(0, plain.travelled[-1], 500)
    np.testing.assert_array_equal(other.kind, plain.kind)
    np.testing.assert_allclose(other.contact(travelled), plain.contact(travelled), atol=1e-9)
    low, high = plain.extent
    sheared = np.subtract(plain.contact(travelled)[0], plain.table.box.tilt * plain.contact(travelled)[1])
    assert low <= sheared.min() + 1e-12 < sheared.max() - 1e-12 <= high
    assert plain.table.box.low[0] <= low <= high <= plain.table.box.high[0]


def test_a_table_has_as_many_nodes_as_it_takes_in_either_direction_and_tells_how_few_would_do():
    """High ground takes more than low; begun with what was enough, the table is the same to its tolerance."""
    flat = on_the_flat(POSTURES[0])
    low, high = (held_table(flat, ContactBox((-0.05, -z), (0.01, z), flat_tilt(flat)), 0.1) for z in (1e-4, 6e-3))
    assert low.shape[0] <= high.shape[0]
    assert low.shape[1] < high.shape[1]
    again = held_table(flat, high.box, high.reach, high.enough)
    assert again.shape == high.enough
    assert again.enough == high.enough
    finest = held_table(flat, high.box, high.reach, (32, 14))
    at = [np.linspace(-1, 1, 9)] * 2
    first, second = np.meshgrid(*at)
    values = [chebyshev.chebval2d(first, second, np.moveaxis(one.ahead, 0, -1)) for one in (again, high, finest)]
    for one in values[:2]:
        np.testing.assert_allclose(one, values[2], atol=2e-8 * np.abs(values[2]).max())
