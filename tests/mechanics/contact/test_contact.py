"""Contact along any relief: gaps by their own module, random ground by brute force, smooth ground in closed form."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.contact.episodes import STICK, episodes
from vibrissa.mechanics.contact.gap_events import trough_events
from vibrissa.mechanics.statics.edge_contact import hold, on_the_flat
from vibrissa.mechanics.statics.gap import unit_response
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, periodic_grating, random_grating
from vibrissa.whisker import Whisker

L = 0.04
WHISKER = Whisker(length=L, cone_angle=1.5e-3, tip=0.05)
REFERENCE = Posture(contact=0.29, base_angle=1.2)
FLAT = on_the_flat(REFERENCE)
BEND = FLAT.contact_force * np.cos(REFERENCE.friction_angle) / (6 * REFERENCE.contact**4)  # K of y ≈ θ_ε u + K u³


@cache
def shared_table(height):
    """Profiles for reliefs of the reference posture within ± this height [m]."""
    return episodes(rough(0, height=height / 2), WHISKER, FLAT).table


def relief(x, h):
    return HeightProfile(position=np.asarray(x, float), height=np.asarray(h, float))


def followed(surface, height=0.1e-3):
    return episodes(surface, WHISKER, FLAT, shared_table(height))


def rough(seed, points=60, spacing=80e-6, height=25e-6):
    h = np.convolve(np.random.default_rng(seed).normal(size=points + 4), [1, 2, 3, 2, 1], "valid")
    return relief(spacing * np.arange(points), height * h / h.std())


# gaps

NARROW_LANDS = Gaps(position=1e-3 + 0.405e-3 * np.arange(12.0), width=np.full(12, 0.4e-3))


@pytest.mark.parametrize(
    ("posture", "texture"),
    [
        (REFERENCE, random_grating(0.03, rng=np.random.default_rng(1))),
        (REFERENCE, NARROW_LANDS),
        (REFERENCE, periodic_grating(0.02, period=2.2e-3, width=1.1e-3)),
        (Posture(contact=0.2, base_angle=1.0), random_grating(0.03, rng=np.random.default_rng(2))),
        (Posture(contact=0.35, base_angle=0.7, friction=0.2), random_grating(0.03, rng=np.random.default_rng(3))),
        (Posture(contact=0.2, base_angle=1.3), periodic_grating(0.01, period=0.4e-3)),
    ],
)
def test_rectangular_gaps_are_those_of_the_gap_module(posture, texture):
    events = trough_events(texture, WHISKER, posture, L)  # times are then travels over L
    history = episodes(HeightProfile.from_gaps(texture), WHISKER, on_the_flat(posture))
    jumps = history.travelled[history.jumped]
    assert len(jumps) == len(texture.width)
    first, second = events.time[0::3], events.time[1::3]
    np.testing.assert_allclose(jumps - first, second - first, rtol=1e-6)
    travel = np.linspace(0, events.time[-1] + 0.01, 4001)
    travel = travel[np.abs(travel[:, None] - second).min(axis=1) > 1e-9]
    np.testing.assert_allclose(history.contact(travel)[0], events.excursion(travel), atol=1e-10)


def test_history_of_gaps_is_glide_stick_jump_stick():
    history = followed(HeightProfile.from_gaps(Gaps(position=np.array([2e-3]), width=np.array([0.6e-3]))))
    seen = [(int(k), bool(j)) for k, j in zip(history.kind, history.jumped, strict=True) if k == STICK or j]
    assert seen == [(0, False), (0, True)]  # stuck to the far edge, then to the near one
    assert history.counts["jump"] == 1
    travel = np.array([1.9, 2.0 + 1e-6, 2.6 - 1e-6, 2.7]) * 1e-3 / L
    d, z, place = history.contact(travel)
    np.testing.assert_allclose(place * L * 1e3, [1.9, 2.0, 2.6, 2.7], atol=1e-6)
    np.testing.assert_allclose(d, [0, 1e-9 / L, -1e-9 / L, 0], atol=1e-12)
    np.testing.assert_allclose(z, 0, atol=1e-15)


# any ground, by brute force


def clearance(held, surface, place):
    """Least height of the base side above the ground, over L, on a dense grid."""
    s = np.linspace(held.contact, min(1.0, held.contact + 0.12), 1500)
    x, y = held.position(s)
    ground = surface.at((place + x - x[0]) * L) / L
    return float((y - y[0] + held.height - ground)[1:].min())


def brute_force(surface, travels, places):
    """X(τ) on a grid: it stays, and where the base side cuts into the ground goes there."""
    ground, found, k, held = surface.at(places * L) / L, [], 0, FLAT
    for tau in travels:
        while True:
            held = hold(FLAT, float(tau - places[k]), held, height=float(ground[k]))
            s = np.linspace(held.contact, held.contact + 0.12, 1500)
            x, y = held.position(s)
            ahead = places[k + 1 : k + 500]
            shaft = np.interp(ahead - places[k], x - x[0], y - y[0]) + ground[k]
            gap = shaft - ground[k + 1 : k + 500]
            if gap.min() > -1e-8:
                break
            beside = gap[0] < -1e-8  # it glides; else the deepest of what is cut into
            k += 1 + (0 if beside else int(gap.argmin()))
        found.append(places[k])
    return np.array(found)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_ground_is_crossed_as_by_brute_force(seed):
    surface = rough(seed, points=75)  # it ends beyond the travel: a level facet is touched in no one point
    step = 10e-6 / L
    places = np.arange(-250, 60 * 8) * step  # the surface's points are among them
    travels = np.arange(-2.5e-3, 3.0e-3, 5e-6) / L
    expected = brute_force(surface, travels, places)
    history = followed(surface)
    agrees = np.abs(history.contact(travels)[2] - expected) <= 1.5 * step
    assert history.counts["jump"] >= 3
    assert agrees.mean() > 0.98  # a jump may come a step of the travel late
    assert agrees[-50:].all()


def stepped(seed, height=15e-6):
    """Lands of random heights between vertical walls."""
    rng = np.random.default_rng(seed)
    walls, heights = np.cumsum(rng.uniform(0.05e-3, 0.4e-3, 16)), height * rng.normal(size=17)
    return relief(np.concatenate([[0], np.repeat(walls, 2), walls[-1:] + 1e-4]), np.repeat(heights, 2))


@pytest.mark.parametrize("surface", [*map(rough, range(4, 10)), *map(stepped, range(4, 8))])
def test_base_side_clears_the_ground_at_every_moment_and_the_contact_never_goes_back(surface):
    history = followed(surface)
    travels = np.sort(np.random.default_rng(1).uniform(-1e-3, 5e-3, 60)) / L
    d, z, place = history.contact(travels)
    assert np.all(np.diff(place) >= -1e-14)
    held = FLAT
    for one in zip(d, z, place, strict=True):
        held = hold(FLAT, float(one[0]), held, height=float(one[1]))
        assert clearance(held, surface, one[2]) > -1e-11


# smooth ground, steps and ramps, in closed form


def slopes():
    """∂θ_ε/∂d and ∂θ_ε/∂z on the flat; raising the contact is lowering the base."""
    by = np.linalg.solve(FLAT.sensitivity, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]]))[1]
    assert by[0] == pytest.approx(unit_response(REFERENCE).contact_angle, rel=1e-12)
    return by


def test_on_a_gentle_hill_the_contact_glides_where_the_angle_is_the_slope():
    x = np.linspace(0, 0.02, 4001)
    curvature = 1e-3 / L  # per metre: the slope falls to −0.0005
    history = followed(relief(x, -curvature * x**2 / 2))
    assert not np.any(history.jumped & (history.place * L < 0.02))  # at its foot it does
    travels = np.linspace(1e-3, 19e-3, 50) / L
    d, z, place = history.contact(travels)
    by_d, by_z = slopes()
    np.testing.assert_allclose(by_d * d + by_z * z, -curvature * place * L, rtol=5e-3)  # linear in small angles
    assert np.all(d > 0)  # it sags into the descent


def test_on_waves_it_jumps_in_the_valleys_alone():
    x, wave = np.arange(0, 0.03, 5e-6), 2 * np.pi / 0.01
    history = followed(relief(x, 10e-6 * np.sin(wave * x)))
    landed = history.place[history.jumped] * L
    landed = landed[(landed > 1e-3) & (landed < 29e-3)]
    assert landed.size > 100
    before = landed - 0.1e-3  # a step reaches across the inflection
    assert np.all((np.sin(wave * landed) < 0) | (np.sin(wave * before) < 0))


def test_in_a_gentle_valley_the_contact_steps_by_a_quarter_of_the_curvature_over_the_bend():
    x = np.arange(0, 0.02, 2e-6)
    curvature = 0.05  # over 1/L
    history = followed(relief(x, curvature * ((x - 0.01) / L) ** 2 / 2 * L))
    landed = history.place[history.jumped & (np.abs(history.place * L - 0.01) < 5e-3)]
    assert landed.size > 200
    # θ_ε u + K u³ comes down on h' u + c u²/2 at u = c/4K
    assert np.diff(landed).mean() == pytest.approx(curvature / (4 * BEND), rel=0.05)


def test_step_up_is_met_by_its_corner():
    high = 10e-6
    history = followed(relief([0, 5e-3, 5e-3, 10e-3], [0, 0, high, high]))
    assert history.counts["jump"] == 1
    jump = int(np.flatnonzero(history.jumped)[0])
    assert history.place[jump] == pytest.approx(5e-3 / L, abs=1e-15)
    distance = 5e-3 / L - history.travelled[jump]  # on the flat d = 0: X is the travel
    s = np.linspace(FLAT.contact, FLAT.contact + 0.1, 20001)
    x, y = FLAT.position(s)
    assert distance == pytest.approx(np.interp(high / L, y - y[0], x - x[0]), rel=1e-6)
    assert distance == pytest.approx((high / L / BEND) ** (1 / 3), rel=0.1)
    assert history.contact([1.0])[0][0] == pytest.approx(history.table.box.tilt * high / L, rel=1e-2)


@pytest.mark.parametrize("slope", [0.01, -0.01])
def test_on_a_ramp_the_shaft_lies_along_it(slope):
    history = followed(relief([0, 5e-3, 9e-3, 15e-3], [0, 0, slope * 4e-3, slope * 4e-3]))
    travels = np.array([6.5, 7.0, 7.5]) * 1e-3 / L
    d, z, place = history.contact(travels)
    np.testing.assert_allclose(z, slope * (place - 5e-3 / L), atol=1e-15)
    angles = [hold(FLAT, float(a), height=float(b)).contact_angle for a, b in zip(d, z, strict=True)]
    np.testing.assert_allclose(np.tan(angles), slope, rtol=1e-8)
    assert history.counts["jump"] == 1  # at the one concave corner: the foot
    foot = 5e-3 if slope > 0 else 9e-3
    landed = history.place[history.jumped][0] * L
    across = np.sqrt(4 * abs(slope) / (27 * BEND))  # before the corner; it lands half as far behind
    assert landed - foot == pytest.approx(across / 2 * L, rel=0.12)  # the cubic is a tenth off there


# laws


def test_splitting_facets_changes_nothing():
    surface = rough(3)
    middle = (surface.position[1:] + surface.position[:-1]) / 2
    x = np.sort(np.concatenate([surface.position, middle]))
    travels = np.linspace(-1e-3, 6e-3, 5000) / L
    one, other = followed(surface).contact(travels), followed(relief(x, surface.at(x))).contact(travels)
    assert np.abs(one[0] - other[0]).max() < 1e-6  # rounding bends a split facet, and steps by √(1e-16/K) follow
    assert np.median(np.abs(one[0] - other[0])) < 1e-12


def test_polylines_converge_on_the_surface_they_sample():
    def sampled(count):
        x = np.linspace(0, 0.01, count)
        surface = relief(x, 15e-6 * np.sin(2 * np.pi * x / 2.5e-3) + 4e-6 * np.cos(2 * np.pi * x / 1.1e-3))
        return followed(surface).contact(np.linspace(1e-3, 8e-3, 20001) / L)[0]

    finest = sampled(25601)
    errors = [np.abs(sampled(count) - finest).mean() for count in (401, 801, 1601, 3201)]
    assert all(later < 0.6 * earlier for earlier, later in pairwise(errors))


def test_a_whisker_twice_as_long_on_a_surface_twice_as_large_does_the_same():
    surface = rough(5)
    big = episodes(
        relief(2 * surface.position, 2 * surface.height),
        Whisker(length=2 * L, cone_angle=1.5e-3),
        FLAT,
        shared_table(0.1e-3),
    )
    one = followed(surface)
    np.testing.assert_allclose(big.travelled, one.travelled, rtol=1e-12, atol=1e-13)
    np.testing.assert_array_equal(big.kind, one.kind)


def test_what_no_posture_follows_is_refused_with_the_place():
    with refusal("range", "the relief") as refused:
        episodes(
            relief([0, 0.01, 0.01, 0.05], [0, 0, 9.5e-3, 9.5e-3]),
            WHISKER,
            on_the_flat(Posture(contact=0.2, base_angle=1.4)),
        )
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("height", [1e-6, 20e-6, -20e-6])
@pytest.mark.parametrize("posture", [REFERENCE, Posture(contact=0.5, base_angle=0.8)])
def test_a_long_straight_part_is_the_same_in_one_facet_and_in_many(posture, height):
    """Half a whisker in one facet, farther than the profile must be known: up, level and down again."""
    x, h = L * np.array([0, 0.6, 1.0, 1.6]), height * np.array([0, 1, 1, 0])
    fine = np.linspace(0, x[-1], 961)
    flat, travelled = on_the_flat(posture), np.linspace(0, 1.8, 2000)
    coarse, many = (episodes(one, WHISKER, flat) for one in (relief(x, h), relief(fine, np.interp(fine, x, h))))
    assert coarse.counts["jump"] == many.counts["jump"] > 0
    np.testing.assert_allclose(coarse.contact(travelled), many.contact(travelled), atol=1e-9)
