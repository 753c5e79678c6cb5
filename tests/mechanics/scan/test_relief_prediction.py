"""What the whisker answers to a relief: gaps as ever, and laws for any ground."""

from functools import cache

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.quasi_static.response_rows import FOLLICLE, held_rows
from vibrissa.mechanics.scan.relief_prediction import free_end_depth, predict_relief
from vibrissa.mechanics.scan.sampled import scanned_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.edge_contact import hold
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.generators import riding, self_affine, wave
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)
GRATING = random_grating(0.03, rng=np.random.default_rng(1))
TIMES = np.arange(0, 0.36, 1.7e-4)


@cache
def over_gaps(form, modes="straight"):
    scan = Scan(speed=0.1, damping=0.11, response=form, modes=modes)
    return (
        predict(WHISKER, POSTURE, GRATING, scan, n_modes=5),
        predict_relief(WHISKER, POSTURE, HeightProfile.from_gaps(GRATING), scan, n_modes=5),
    )


@pytest.mark.parametrize(("form", "modes"), [("exact", "straight"), ("linear", "straight"), ("exact", "curved")])
def test_rectangular_gaps_give_the_prediction_of_gaps(form, modes):
    gaps, ground = over_gaps(form, modes)
    scale = np.abs(gaps.amplitudes(TIMES)).max()
    for name in ("amplitudes", "mode_displacement", "drive"):
        expected, found = getattr(gaps, name)(TIMES), getattr(ground, name)(TIMES)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * max(scale, np.abs(expected).max()))
    s = np.linspace(0.1, 1, 400)
    some = TIMES[::200]
    np.testing.assert_allclose(ground.displacement(some, s), gaps.displacement(some, s), atol=1e-6)  # at ε it bends
    np.testing.assert_allclose(ground.position(some, s), gaps.position(some, s), atol=2e-6)  # of its slip: trapezia


def test_linear_rows_are_the_tangent_in_height_as_in_excursion():
    response = over_gaps("linear")[1].response
    flat, step = response.flat, 1e-5
    zero, one = np.zeros(1), np.ones(1)
    for d, z in ((1.0, 0.0), (0.0, 1.0)):
        up, down = (held_rows(flat, response.basis, hold(flat, k * step * d, height=k * step * z)) for k in (1, -1))
        slope = (response(d * one, z * one) - response(zero, zero))[:, 0]
        np.testing.assert_allclose(slope, (up - down) / (2 * step), rtol=1e-4, atol=1e-5)


@cache
def hilly():
    shape = wave(0.03, amplitude=0.15e-3, period=0.03, spacing=50e-6)
    rough = self_affine(0.03, rng=np.random.default_rng(2), rms=3e-6, spacing=5e-6, shortest=50e-6)
    return predict_relief(WHISKER, POSTURE, riding(rough, shape), Scan(speed=0.1, damping=0.11), n_modes=4)


def test_drive_follows_the_held_profiles():
    prediction = hilly()
    t = np.sort(np.random.default_rng(3).uniform(0, 0.3, 40))
    d, z, _ = prediction.contact(t)
    drive, n = prediction.drive(t), len(prediction.kappa)
    held = [hold(prediction.response.flat, float(a), height=float(b)) for a, b in zip(d, z, strict=True)]
    expected = {
        "base_curvature": [one.base_curvature for one in held],
        "transverse_force": [one.transverse_force for one in held],
        "axial_force": [one.axial_force for one in held],
        "contact_angle": [one.contact_angle for one in held],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(drive[n + FOLLICLE.index(name)], values, atol=2e-8)


def test_whole_displacement_is_continuous_where_the_contact_jumps():
    prediction = hilly()
    jumped = prediction.episodes.jumped
    at = prediction.episodes.travelled[jumped] * 0.4
    at = at[at > 0.01][:20]
    before, after = prediction.mode_displacement(at - 1e-10), prediction.mode_displacement(at + 1e-10)
    size = np.abs(prediction.mode_displacement(TIMES)).max()
    np.testing.assert_allclose(after, before, atol=1e-5 * size)
    assert np.abs(prediction.amplitudes(at + 1e-10) - prediction.amplitudes(at - 1e-10)).max() > 1e-3 * size


@pytest.mark.parametrize("speed", [0.05, 0.005])
def test_on_a_smooth_hill_it_hardly_vibrates(speed):
    x = np.linspace(0, 0.02, 1001)
    hill = HeightProfile(position=x, height=-0.1 * x**2)  # at its foot the contact jumps
    prediction = predict_relief(WHISKER, POSTURE, hill, Scan(speed=speed, damping=0.11), n_modes=1)
    t = np.linspace(0.05, 0.9, 5001) * 0.02 / speed
    assert np.abs(prediction.amplitudes(t)).max() < 1e-3 * np.ptp(prediction.mode_drive(t))


def test_higher_ground_loads_the_whisker():
    high = HeightProfile(position=np.array([0, 1e-2, 2e-2]), height=np.array([0, 2e-4, 2e-4]))
    prediction = predict_relief(WHISKER, POSTURE, high, Scan(speed=0.1, damping=0.11), n_modes=2)
    start, end = prediction.drive(np.array([-1.0, 10.0])).T
    for name in ("base_curvature", "transverse_force", "contact_load"):
        row = 2 + FOLLICLE.index(name)
        assert end[row] > start[row]
    at_height = Posture.at_height(prediction.response.flat.base[1] - 2e-4 / 0.04, 1.2)
    level = predict_relief(
        WHISKER,
        at_height,
        HeightProfile(position=high.position, height=0 * high.height),
        Scan(speed=0.1, damping=0.11),
        n_modes=2,
    )
    found = level.drive(np.array([-1.0]))[2:, 0]
    np.testing.assert_allclose(end[2:], found, rtol=1e-6, atol=1e-9)


def test_scan_of_a_relief_as_a_dataset():
    data = scanned_relief(hilly(), 4000.0, nodes=[0.0, 0.01])
    assert data.attrs["jumps"] == hilly().episodes.counts["jump"]
    np.testing.assert_allclose(data.contact_ground, 0.1 * data.time - 0.04 * data.excursion, atol=1e-12)
    np.testing.assert_allclose(data.contact_rise, hilly().relief.at(data.contact_ground.values), atol=1e-12)
    assert data.displacement.dims == ("time", "node")
    assert np.isfinite(data.base_moment).all()
    assert data.base_moment_quasi_static.attrs["units"] == "N m"


def test_free_end_dips_below_the_land_behind_a_gap():
    gap = Gaps(position=np.array([2e-3]), width=np.array([1e-3]))
    prediction = predict_relief(
        WHISKER, POSTURE, HeightProfile.from_gaps(gap), Scan(speed=0.1, damping=0.11), n_modes=1
    )
    jump = prediction.episodes.travelled[prediction.episodes.jumped][0] * 0.4
    depth = free_end_depth(prediction, np.array([0.0, jump + 1e-9]))
    assert depth[0] == pytest.approx(0, abs=1e-12)
    tail = (0.29 - 0.05) * 0.04
    assert depth[1] == pytest.approx(0.152e-3 * tail / 1e-3, rel=0.03)  # 152 µm at the gap's width, straight beyond


def test_contact_beyond_the_tip_and_unknown_forms_are_refused():
    stump = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.3)
    with refusal("range", "Posture.contact"):
        predict_relief(stump, POSTURE, HeightProfile.from_gaps(GRATING), Scan(speed=0.1, damping=0.1))
