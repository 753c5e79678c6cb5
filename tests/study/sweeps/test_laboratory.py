"""The virtual laboratory: who is in it follows from one seed, and what disturbs it does what it says."""

import dataclasses

import numpy as np
import pytest
from refusals import refusal
from scipy.integrate import solve_ivp

from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture, stationary_profile
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.spec.nuisance import Nuisance
from vibrissa.study.sweeps.laboratory import plan
from vibrissa.study.sweeps.nuisance import disturbed, friction_noise, hum, slow_motion, travel, wandered
from vibrissa.study.sweeps.truth import ModalMotion
from vibrissa.texture.surface import Gaps, random_grating
from vibrissa.whisker import Whisker, atlas

RNG = np.random.default_rng
SMALL = Laboratory(truth="modes", animals=1, whiskers=("beta", "C2"), conditions=1, textures=2, n_frames=600)


@pytest.fixture(scope="module")
def sweeps():
    return plan(SMALL)[0]


@pytest.fixture(scope="module")
def prediction():
    return predict(
        Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05),
        Posture(contact=0.29, base_angle=1.2),
        random_grating(0.1, rng=RNG(1)),
        Scan(speed=0.1, damping=0.11),
    )


# Who is in it


def test_every_whisker_meets_every_texture(sweeps):
    assert len(sweeps) == SMALL.n_sweeps == 4
    assert [(one.whisker_name, one.key[3]) for one in sweeps] == [("beta", 0), ("beta", 1), ("C2", 0), ("C2", 1)]
    assert [one.number for one in sweeps] == [0, 1, 2, 3]
    assert sweeps[0].posture == sweeps[1].posture != sweeps[2].posture


def test_postures_stand_at_their_height_and_within_the_box(sweeps):
    for one in sweeps:
        height = float(stationary_profile(one.posture).base_distance) * one.whisker.length
        assert height == pytest.approx(one.base_height, rel=1e-8)
        assert SMALL.base_heights[0] <= one.base_height <= SMALL.base_heights[1]
        assert SMALL.base_angles[0] <= one.posture.base_angle <= SMALL.base_angles[1]
        assert max(SMALL.contacts[0], one.whisker.tip) < one.posture.contact < SMALL.contacts[1]


def test_whiskers_lie_within_two_standard_deviations_of_the_atlas(sweeps):
    for one in sweeps:
        entry = next(entry for entry in atlas() if entry.name == one.whisker_name)
        assert abs(one.whisker.length - entry.length) <= 2 * entry.length_sd
        assert abs(one.whisker.cone_angle - entry.cone_angle) <= 2 * entry.cone_angle_sd


def test_equal_seeds_give_equal_sweeps_and_others_other_ones(sweeps):
    assert plan(SMALL)[0] == sweeps
    assert plan(dataclasses.replace(SMALL, seed=1))[0][0].whisker != sweeps[0].whisker


def test_more_runs_leave_the_others_as_they_are(sweeps):
    more = [one for one in plan(dataclasses.replace(SMALL, runs=2))[0] if one.key[4] == 0]
    assert [one.key for one in more] == [one.key for one in sweeps]
    assert [(one.whisker, one.posture) for one in more] == [(one.whisker, one.posture) for one in sweeps]


def test_spread_of_stiffness_and_damping_is_off_until_asked_for(sweeps):
    assert {one.whisker.youngs_modulus for one in sweeps} == {SMALL.youngs_modulus}
    assert {one.scan.damping for one in sweeps} == {SMALL.damping}
    spread = plan(dataclasses.replace(SMALL, youngs_modulus_spread=0.1, damping_spread=0.3))[0]
    assert len({one.whisker.youngs_modulus for one in spread}) == len({one.scan.damping for one in spread}) == 2


@pytest.mark.parametrize(
    ("field", "value", "rule"),
    [
        ("animals", 0, ("range", "Laboratory.animals")),
        ("whiskers", ("B12",), ("unknown", "Laboratory.whiskers")),
        ("base_angles", (1.4, 0.8), ("range", "Laboratory.base_angles")),
        ("speeds", (), ("too-few", "Laboratory")),
        ("n_frames", 10_000, ("range", "Laboratory.n_frames")),
    ],
)
def test_laboratories_that_cannot_be_are_refused(field, value, rule):
    with refusal(*rule):
        Laboratory(**{field: value})


def test_a_laboratory_without_postures_says_so():
    with refusal("range", "Laboratory"):
        plan(dataclasses.replace(SMALL, base_heights=(0.2, 0.3)))


# What disturbs it


def test_nothing_disturbs_by_default(prediction):
    t, s = np.linspace(0, 0.1, 20), np.array([0.3, 0.6, 1.0])
    for found, true in zip(
        disturbed(ModalMotion(prediction), Nuisance(), 1.0, RNG(0)).position(t, s),
        prediction.position(t, s),
        strict=True,
    ):
        np.testing.assert_array_equal(found, true)


def test_slow_motion_has_the_spread_asked_for_and_nothing_faster():
    t = np.arange(0, 2, 1e-3)
    drawn = np.array([slow_motion(3e-6, 0.1, 2.0, RNG(seed))(t) for seed in range(400)])
    assert drawn.std() == pytest.approx(3e-6, rel=0.03)  # 400 draws of 20 waves
    power = np.abs(np.fft.rfft(drawn)).mean(axis=0)
    assert power[np.fft.rfftfreq(t.size, 1e-3) > 10.01].max() < 1e-9 * power.max()


def test_a_tip_that_stands_off_meets_all_edges_so_much_earlier():
    texture = Gaps(position=np.array([1e-3, 2e-3]), width=np.array([3e-4, 4e-4]))
    met = wandered(texture, 0.1, lambda t: np.full(t.shape, 5e-5))
    np.testing.assert_allclose(met.position, texture.position - 5e-5)
    np.testing.assert_allclose(met.width, texture.width)
    assert travel(texture, met) == pytest.approx(0, abs=1e-15)


def test_a_tip_that_advances_evenly_compresses_the_texture():
    texture = random_grating(0.05, rng=RNG(3))
    met = wandered(texture, 0.1, lambda t: 1e-3 * t)  # v t + 1e-3 t = x: met as by a stage 1 % faster
    np.testing.assert_allclose(met.position / 0.1, texture.position / 0.101, rtol=2e-4)  # first order of 1 %


def test_a_wander_that_turns_edges_about_is_refused():
    with refusal("range", "texture"):
        wandered(random_grating(0.05, rng=RNG(3)), 0.1, lambda t: 2e-3 * np.sin(2000 * t))


def test_hum_is_a_sum_of_harmonics():
    t = np.arange(0, 1, 1e-3)
    lines = 2 * np.abs(np.fft.rfft(hum(6e-6, 50.0, RNG(2))(t))) / t.size
    np.testing.assert_allclose(lines[[50, 100, 150]], [6e-6, 3e-6, 2e-6], rtol=1e-9)
    lines[[50, 100, 150]] = 0
    assert lines.max() < 1e-15


def test_a_head_that_drifts_carries_the_whole_whisker(prediction):
    t, s = np.linspace(0, 1, 30), np.array([0.35, 0.6, 1.0])
    found = disturbed(ModalMotion(prediction), Nuisance(head_drift=1e-4, drift_time=0.3), 1.0, RNG(4)).position(t, s)
    for moved, still in zip(found, prediction.position(t, s), strict=True):
        shift = moved - still
        np.testing.assert_allclose(shift, shift[:, :1] * np.ones(3), atol=1e-15)
        assert 0.2e-4 < shift[:, 0].std() * 0.04 < 3e-4


def test_friction_carries_a_held_whisker_from_one_equilibrium_to_the_next(prediction):
    noise = friction_noise(prediction, 0.05, 30.0, 0.5, RNG(5))
    posture = prediction.posture
    height = float(stationary_profile(posture).base_distance)
    other = Posture.at_height(height, posture.base_angle, 0.41)
    s = np.array([0.35, 0.6, 0.8])
    places = []
    for one in (posture, other):
        profile = stationary_profile(one, s)
        places.append((profile.profile_x - profile.contact_distance, profile.profile_y - profile.base_distance))
    for axis in range(2):
        moved = (places[1][axis] - places[0][axis]).values
        np.testing.assert_allclose(0.01 * noise.unit[axis](s), moved, rtol=0.03, atol=1e-7)  # second order in 0.01


def test_friction_noise_has_its_spread_and_corner(prediction):
    noise = friction_noise(prediction, 0.05, 30.0, 20.0, RNG(6))
    assert noise.friction.std() == pytest.approx(0.05, rel=0.05)
    step = noise.time[1]
    power = np.abs(np.fft.rfft(noise.friction)) ** 2
    f = np.fft.rfftfreq(noise.time.size, step)
    slow, fast = power[(f > 1) & (f < 10)].mean(), power[(f > 280) & (f < 320)].mean()
    assert slow / fast == pytest.approx(1 + (300 / 30) ** 2, rel=0.2)


def test_friction_noise_drives_the_modes_as_equation_six_says(prediction):
    noise = friction_noise(prediction, 0.05, 30.0, 0.3, RNG(7))
    omega, zeta, c = prediction.omega[0], prediction.scan.damping, noise.coupling[0]

    def slope(t, state):  # y = q + c δμ, p = ẏ − 2ζω c δμ: no derivative of the noise
        drive = c * np.interp(t, noise.time, noise.friction)
        rate = state[1] + 2 * zeta * omega * drive
        return rate, -2 * zeta * omega * rate + omega**2 * (drive - state[0])

    t = noise.time[noise.time < 0.3]
    y = solve_ivp(slope, (0, 0.3), (0, 0), t_eval=t, max_step=4 * t[1], rtol=1e-6, atol=1e-12).y[0]
    late = t > 0.15  # what it started from has died out
    found = noise.modes[0, : t.size] + c * noise.friction[: t.size]
    np.testing.assert_allclose(y[late], found[late], atol=0.005 * found.std())


@pytest.mark.parametrize(("name", "value"), [("hum", -1e-6), ("wander", np.nan), ("drift_time", 0.0)])
def test_nuisances_out_of_range_are_refused(name, value):
    with refusal("range", f"Nuisance.{name}", str(value)):
        Nuisance(**{name: value})


def test_a_sweep_that_would_not_fit_into_memory_is_refused_beforehand(monkeypatch):
    monkeypatch.setenv("VIBRISSA_MEMORY", "4")  # GB, of which a half may be taken: 60,000 frames take 2.2
    with refusal("range", "a sweep", value="60,000 frames of 400 nodes, which need 2.16 GB"):
        dataclasses.replace(SMALL, n_frames=60_000, texture_length=6.0)
