"""The model seen through the decomposition: resonances of the exact response come back without bias."""

import numpy as np
import pytest

from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.inverse.observation_model import seen_motion
from vibrissa.mechanics.inverse.resonance import fit_modes, widened
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.05, cone_angle=1.5e-3)
TIME = np.arange(1600) / 2000
ARC = np.arange(1, 300) * 116e-6


def swept(seed, noise):
    """A prediction and its modes, decomposed from exact centrelines with the tracker's kind of noise [m]."""
    rng = np.random.default_rng(seed)
    posture = Posture(contact=0.25, base_angle=1.25)
    motion = predict(WHISKER, posture, random_grating(0.16, rng=rng), Scan(speed=0.15, damping=0.11))
    x, y = (WHISKER.length * one for one in motion.position(TIME, 1 - ARC / WHISKER.length))
    x, y = (one + noise * rng.standard_normal(one.shape) for one in (x, y))
    profile = dataset(time=TIME, node=np.arange(len(ARC)), arc_length=ARC, x=x, y=y)
    return motion, decompose(profile, WHISKER, posture.contact)


@pytest.fixture(scope="module")
def clean():
    return swept(1, 1e-8)


def test_what_is_found_of_the_model_is_what_was_found_of_its_movie(clean):
    motion, modal = clean
    seen = seen_motion(motion, modal, TIME)
    whole = seen.own[:, None] * motion.amplitudes(TIME)[:3] + seen.beside
    off = whole - whole.mean(axis=1, keepdims=True) - modal.mode_displacement.values
    # motion of second order in q that no mode holds, beside modes that are ever smaller
    assert np.all(off.std(axis=1) < [1e-4, 3e-3, 0.03] * modal.mode_displacement.values.std(axis=1))
    np.testing.assert_allclose(seen.own, 1, atol=1e-3)


def test_resonances_of_the_exact_response_come_back_without_bias(clean):
    motion, modal = clean
    truth = motion.omega[:3] / (2 * np.pi)
    through = fit_modes(modal, truth, prediction=motion)[0].resonant_frequency.values / truth - 1
    bare = fit_modes(modal.drop_vars("displacement"), truth, prediction=motion)[0].resonant_frequency.values / truth - 1
    assert np.all(np.abs(through[:2]) < [2e-5, 1e-4])
    assert np.all(np.abs(bare[:2]) > 2 * np.abs(through[:2]))


def test_few_whole_frames_leave_the_modes_as_they_are(clean):
    motion, modal = clean
    few = modal.assign(displacement=modal.displacement.where(modal.time < 0.04))
    seen = seen_motion(motion, few, TIME)
    np.testing.assert_array_equal(seen.own, 1)
    np.testing.assert_allclose(seen.beside, motion.mode_drive(TIME)[:3])


def fit(frequency, factor):
    told = {
        f"resonant_frequency{end}": [frequency * one] for end, one in (("", 1), ("_low", 1 / factor), ("_high", factor))
    }
    return dataset(mode=[1], damping=[0.1], damping_low=[0.09], damping_high=[0.1 / 0.9], **told)


def test_an_error_of_the_posture_adds_to_the_interval_as_independent_errors_do():
    wide = widened(fit(100.0, 1.03), [fit(100.0 * np.exp(0.04 / 1.959964), 1.5)])
    half = np.hypot(np.log(1.03), 0.04)
    assert float(wide.resonant_frequency_high[0]) == pytest.approx(100 * np.exp(half), rel=1e-6)
    assert float(wide.resonant_frequency_low[0]) == pytest.approx(100 * np.exp(-half), rel=1e-6)
    assert float(wide.damping_low[0]) == pytest.approx(0.09, rel=1e-9)
    assert float(wide.resonant_frequency[0]) == 100.0
    assert widened(fit(100.0, 1.03), []).identical(fit(100.0, 1.03))
