"""How far the assumptions hold: numbers of MODEL.md, and what each diagnostic must say in a plain case."""

from functools import cache

import numpy as np
import pytest

from vibrissa.mechanics.scan.diagnostics import diagnostics, own_weight, percent, relief_diagnostics
from vibrissa.mechanics.scan.gap_report import crossing, held_profile
from vibrissa.mechanics.scan.relief_prediction import predict_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.generators import riding, wave
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
TIME = np.arange(4000) / 20000


def judged(width, *, speed=0.1, whisker=WHISKER, depth=35e-6, response="exact", count=3):
    position = 1e-3 + 2e-2 * np.arange(len(width))  # far apart
    texture = Gaps(position=position, width=np.array(width), depth=depth)
    scan = Scan(speed=speed, damping=0.11, response=response)
    prediction = predict(whisker, POSTURE, texture, scan, n_modes=count)
    return diagnostics(prediction, TIME)


def test_free_end_dips_below_the_land_behind_the_gap():
    dip = judged([0.3e-3, 0.6e-3, 1e-3]).free_end_dip.values
    np.testing.assert_allclose(dip, [16e-6, 59e-6, 152e-6], atol=0.5e-6)


def test_one_contact_holds_only_for_a_short_free_end_over_a_deep_gap():
    short = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.285)  # 0.2 mm beyond the contact
    assert judged([0.3e-3, 0.1e-3], whisker=short).single_contact.values.tolist() == [True, False]
    assert not judged([1e-3], whisker=short, depth=1e-6).single_contact.any()
    assert not judged([1e-3]).single_contact.any()


@pytest.mark.parametrize("response", ["exact", "linear"])
def test_linearity_of_one_gap_is_that_of_the_crossing(response):
    found = judged([0.6e-3], response=response).linearity.values
    np.testing.assert_allclose(found, [0.813, 0.607, 0.221], atol=6e-4)
    np.testing.assert_allclose(crossing(POSTURE, 0.015).linearity, found, rtol=1e-6)


def test_narrow_gaps_are_answered_linearly():
    near, nearer = (1 - judged([width]).linearity.values for width in (4e-6, 2e-6))
    np.testing.assert_allclose(near / nearer, 2, rtol=0.02)  # of first order in λ


def test_mechanism_compares_the_time_over_a_gap_with_the_period():
    slow, fast = (judged([0.6e-3], speed=speed).mechanism.values for speed in (0.05, 0.2))
    np.testing.assert_allclose(slow, 4 * fast)
    assert slow[0] == pytest.approx(0.6e-3 * 2 * np.pi * 123.149 / 0.05, rel=1e-4)


def test_a_whisker_at_rest_keeps_its_load_and_a_fast_one_lifts_off():
    still = judged([1e-6], speed=0.01)
    assert still.least_contact_load == pytest.approx(1, abs=0.01)
    assert still.lift_off == 0
    wild = judged([1.2e-3], count=12)
    assert wild.least_contact_load < 0
    assert wild.lift_off > 0


def test_own_weight_is_that_of_the_cone():
    steel = Whisker(length=0.2, cone_angle=5e-3, youngs_modulus=2e11, density=7850)
    weight = 7850 * 9.81 * np.pi / 3 * (5e-3 * 0.2) ** 2 * 0.2
    unit = np.pi / 4 * 2e11 * 5e-3**4 * 0.2**2
    assert own_weight(steel) == pytest.approx(weight / unit, rel=1e-12)


def test_crossing_meets_the_near_edge_and_keeps_the_base():
    data = crossing(POSTURE, 0.015)
    before = held_profile(POSTURE, contact_distance=float(data.contact_distance[1]))
    at_edge = np.interp(0.015, before.profile_x, before.profile_y)
    assert abs(at_edge) < 2e-6  # over L, between 201 points
    np.testing.assert_allclose(data.base_distance, 0.461768821, rtol=1e-8)
    np.testing.assert_allclose(data.held_excursion, np.array([0, 4.707761e-4, 4.707761e-4 - 0.015]), rtol=1e-6)


@cache
def relief_of_gaps(response, modes="straight"):
    texture = random_grating(0.02, rng=np.random.default_rng(1))
    scan = Scan(speed=0.1, damping=0.11, response=response, modes=modes)
    gaps = predict(WHISKER, POSTURE, texture, scan, n_modes=3)
    ground = predict_relief(WHISKER, POSTURE, HeightProfile.from_gaps(texture), scan, n_modes=3)
    return gaps, ground


@pytest.mark.parametrize(("response", "modes"), [("exact", "straight"), ("linear", "curved-edge")])
def test_a_relief_of_gaps_is_judged_as_the_gaps(response, modes):
    gaps, ground = relief_of_gaps(response, modes)
    expected, found = diagnostics(gaps, TIME), relief_diagnostics(ground, TIME)
    assert int(found.valley_steps) == 0
    for name in set(found) & set(expected):
        np.testing.assert_allclose(found[name], expected[name], rtol=2e-5, atol=1e-12, err_msg=name)
    assert set(expected) - set(found) == {"free_end_dip", "single_contact"}


def test_level_ground_has_no_jump_and_so_no_linearity():
    level = HeightProfile(position=np.array([0, 1e-2, 2e-2]), height=np.zeros(3))
    found = relief_diagnostics(predict_relief(WHISKER, POSTURE, level, Scan(speed=0.1, damping=0.11), n_modes=2), TIME)
    assert np.isnan(found.linearity).all()
    assert np.isnan(found.mechanism).all()
    assert found.lift_off == 0


@pytest.mark.parametrize(
    ("z", "points"), [((0, 0, 50e-6, 50e-6), 4), ((50e-6, 50e-6, 0, 0), 4), ((0, 0, 50e-6, 50e-6), 2001)]
)
def test_a_jump_over_a_wall_is_no_step_through_a_smooth_valley(z, points):
    corners = np.array([0, 5e-3, 5e-3 + (0 if points == 4 else 5e-6), 10e-3])
    x = corners if points == 4 else np.linspace(0, 10e-3, points)
    ground = HeightProfile(position=x, height=np.array(z) if points == 4 else np.interp(x, corners, z))
    found = relief_diagnostics(predict_relief(WHISKER, POSTURE, ground, Scan(speed=0.1, damping=0.11), n_modes=2), TIME)
    assert int(found.valley_steps) == 0
    assert np.isfinite(found.mechanism).all()  # there is a jump


@pytest.mark.parametrize("period", [0.02, 0.03])
def test_steps_through_a_smooth_valley_are_told_from_jumps_over_gaps(period):
    shape = wave(2 * period, amplitude=0.1e-3, period=period, phase=np.pi / 2, spacing=20e-6)
    smooth = predict_relief(WHISKER, POSTURE, shape, Scan(speed=0.1, damping=0.11), n_modes=2)
    found = relief_diagnostics(smooth, TIME)
    assert int(found.valley_steps) == smooth.episodes.counts["jump"] > 3
    bend = np.cos(np.arctan(0.4)) * 0.799412373 / (6 * 0.29**4)
    curvature = 0.1e-3 * (2 * np.pi / period) ** 2 * WHISKER.length  # over 1/L, where it is largest
    assert float(found.longest_valley_step) == pytest.approx(curvature / (4 * bend) * WHISKER.length, rel=0.15)
    texture = Gaps(position=np.array([0.3, 0.8]) * period, width=np.array([5e-4, 5e-4]))
    both = riding(HeightProfile.from_gaps(texture), shape)
    rough = predict_relief(WHISKER, POSTURE, both, Scan(speed=0.1, damping=0.11), n_modes=2)
    jumps, steps = rough.episodes.counts["jump"], int(relief_diagnostics(rough, TIME).valley_steps)
    assert 2 <= jumps - steps <= 4  # the gaps, and where they cut a valley short


@pytest.mark.parametrize(
    ("share", "told"),
    [(1.0, "100 %"), (0.999, "100 %"), (0.0995, "10 %"), (0.031, "3.1 %"), (1e-7, "less than 0.01 %")],
)
def test_shares_are_told_without_exponents(share, told):
    assert percent(share) == told
