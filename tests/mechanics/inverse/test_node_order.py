"""Profiles whose nodes are stored from the tip on, not from the skin."""

import numpy as np
import pytest

from vibrissa.measures.kinematics import KinematicsSettings, kinematics_of
from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.inverse.stationary_posture import fit_profile
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.stimulus.waveform import motion_at
from vibrissa.texture.surface import periodic_grating
from vibrissa.whisker import Whisker

WHISKER, TIME, SPACE = Whisker(length=0.04, cone_angle=1.5e-3), np.arange(200) / 2000, np.linspace(0.99, 0.32, 60)


@pytest.fixture(scope="module")
def prediction():
    posture, scan = Posture(contact=0.29, base_angle=1.2), Scan(speed=0.1, damping=0.11)
    return predict(WHISKER, posture, periodic_grating(0.02, period=2e-3), scan, n_modes=3)


@pytest.fixture(scope="module")
def profile(prediction):
    x, y = (WHISKER.length * one for one in prediction.position(TIME, SPACE))
    return dataset({"frame": "substrate"}, time=TIME, arc_length=WHISKER.length * (1 - SPACE), x=x, y=y)


@pytest.fixture(scope="module")
def tip_first(profile):
    return profile.isel(node=slice(None, None, -1))


def test_modes_have_the_sign_of_the_prediction(prediction, tip_first):
    found = decompose(tip_first, WHISKER, 0.29, n_modes=3).mode_displacement.values[0]
    true = prediction.mode_displacement(TIME)[0]
    assert np.abs(found - found.mean() - true + true.mean()).max() < 0.01 * np.ptp(true)


def test_a_motion_that_is_replayed_has_its_sign(prediction, tip_first):
    k = 20
    distance = float(WHISKER.length * (1 - SPACE[k]))
    found = motion_at(tip_first, distance).displacement
    true = WHISKER.length * prediction.displacement(TIME, SPACE[k : k + 1])[:, 0]
    assert np.abs(found - found.mean() - true + true.mean()).max() < 0.01 * np.ptp(true)


def test_posture_and_kinematics_are_the_same(profile, tip_first):
    a, b = (fit_profile(one, WHISKER) for one in (profile, tip_first))
    np.testing.assert_allclose([b.contact, b.base_angle], [a.contact, a.base_angle], rtol=1e-9)
    a, b = (kinematics_of(one, KinematicsSettings(nose="left")) for one in (profile, tip_first))
    for name in ("mean_base_x", "mean_base_y", "whisker_angle", "whisker_curvature"):
        np.testing.assert_allclose(b[name], a[name], rtol=1e-9)
