"""E, follicle and damping together, from resonances of a simulated whisker whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.inverse.follicle_fit import PARAMETERS, Resonances, follicle_fit, predicted
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
CONTACTS = np.array([0.2, 0.25, 0.3, 0.35, 0.4])
SOFT, CLAMPED = np.array([3.74e9, 3.0, 100.0, 0.11]), np.array([3.74e9, 2e4, 5e5, 0.11])
SEEDS = 60


def simulated(truth, contacts=CONTACTS, *, sd=0.01, near_sd=0.02, damping_sd=0.01, rng=None):
    """What a tracker would give, with independent errors; without a generator none."""
    f, zeta, near = predicted(WHISKER, contacts, truth, 3, 5e-3)
    noise = np.zeros((3, *f.shape)) if rng is None else rng.standard_normal((3, *f.shape))
    return Resonances(
        contact=contacts,
        frequency=f * (1 + sd * noise[0]),
        frequency_sd=sd * f,
        damping=zeta + damping_sd * noise[1],
        damping_sd=np.full_like(f, damping_sd),
        near=near + near_sd * noise[2],
        near_sd=np.full_like(f, near_sd),
    )


def test_without_noise_the_truth_comes_back():
    fit = follicle_fit(WHISKER, simulated(SOFT))
    np.testing.assert_allclose(fit.estimate, SOFT, rtol=2e-3)
    assert fit.chi_square < 0.05
    assert all(fit.identified.values())
    assert fit.freedom == 41


def test_intervals_hold_the_truth_as_often_as_they_say():
    fits = [follicle_fit(WHISKER, simulated(SOFT, rng=np.random.default_rng(seed))) for seed in range(SEEDS)]
    held = np.mean([(fit.low <= SOFT) & (fit.high >= SOFT) for fit in fits], axis=0)
    assert held.min() > 0.86  # 0.95 less three standard errors
    assert 0.90 < held.mean() < 0.99
    drawn = np.array([np.append(np.log(fit.estimate[:3]), fit.estimate[3]) for fit in fits])
    said = np.mean([np.sqrt(np.diag(fit.covariance)) for fit in fits], axis=0)
    np.testing.assert_allclose(drawn.std(axis=0, ddof=1), said, rtol=0.35)  # of 60: ± 9 %, three of them
    assert np.mean([fit.chi_square for fit in fits]) == pytest.approx(41, abs=4 * np.sqrt(2 * 41 / SEEDS))


def test_of_a_clamped_whisker_the_modulus_is_identified_and_the_springs_are_not():
    fit = follicle_fit(WHISKER, simulated(CLAMPED, rng=np.random.default_rng(0)))
    assert fit.identified == dict(zip(PARAMETERS, [True, False, False, True], strict=True))
    assert fit.low[0] < CLAMPED[0] < fit.high[0]
    assert np.isnan(fit.high[1:3]).all()
    assert fit.low[1] > 10


def test_three_frequencies_of_one_contact_fit_a_clamp_and_a_soft_follicle_alike():
    one = replace(simulated(CLAMPED, CONTACTS[2:3], rng=np.random.default_rng(0)), near=None, near_sd=None)
    fit = follicle_fit(WHISKER, one)
    assert not fit.unique
    assert not fit.identified["youngs_modulus"]
    assert fit.high[0] > 3 * CLAMPED[0]


def test_frequencies_alone_know_the_modulus_times_the_damping_factor():
    without = replace(simulated(SOFT), damping=None, damping_sd=None)
    fit = follicle_fit(WHISKER, without)
    assert np.isnan(fit.estimate[3])
    assert not fit.identified["damping"]
    assert fit.estimate[0] == pytest.approx(SOFT[0] * (1 - 0.11**2), rel=2e-3)


def test_faster_resonances_are_a_stiffer_shaft_and_the_same_follicle():
    slow = simulated(SOFT)
    fast = replace(slow, frequency=2 * slow.frequency, frequency_sd=2 * slow.frequency_sd)
    one, other = follicle_fit(WHISKER, slow), follicle_fit(WHISKER, fast)
    np.testing.assert_allclose(other.estimate, one.estimate * [4, 1, 1, 1], rtol=1e-6)


def test_too_few_or_bad_measurements_are_refused():
    f = np.array([[100.0, 300.0]])
    with refusal("too-few", "frequencies and displacements"):
        follicle_fit(WHISKER, Resonances(contact=[0.3], frequency=f, frequency_sd=0.01 * f))
    with refusal("range", "frequency_sd"):
        follicle_fit(WHISKER, Resonances(contact=[0.3], frequency=f, frequency_sd=0 * f))
    with refusal("shape", "frequency"):
        follicle_fit(WHISKER, Resonances(contact=[0.3, 0.2], frequency=f, frequency_sd=0.01 * f))
    with refusal("shape", "near and near_sd"):
        follicle_fit(WHISKER, Resonances(contact=[0.3], frequency=f, frequency_sd=0.01 * f, near=np.ones((2, 2))))
