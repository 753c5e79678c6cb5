"""How far the assumptions hold along a path: beside the ordinary prediction, and moment by moment."""

import numpy as np
import pytest

from vibrissa.mechanics.modes.shift import resonance_shift
from vibrissa.mechanics.scan.diagnostics import diagnostics, own_weight
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.scan.verdict import verdict
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.whisking.active_whisking import predict_slow, remarks, slow_signals
from vibrissa.mechanics.whisking.path_diagnostics import contact_slip, path_diagnostics
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3, tip=0.05)
SEVERAL = Gaps(position=np.array([1e-3, 1.9e-3, 2.6e-3, 3.4e-3]), width=np.array([0.6e-3, 0.2e-3, 0.5e-3, 1e-3]))
ONE = Gaps(position=np.array([1e-3]), width=np.array([0.6e-3]))
EXACT = Scan(speed=0.12, damping=0.11, response="exact")


@pytest.mark.parametrize(
    ("whisker", "angle", "found"),
    [
        (Whisker(length=0.04, cone_angle=1.5e-3, tip=0.289), 0.5, "caution: own weight is 0.21 of the"),
        (Whisker(length=0.04, cone_angle=1.5e-3, tip=0.289), 1.2, "first resonance −26 % about the profile"),
        (Whisker(length=0.06, cone_angle=0.6e-3, tip=0.289), 0.3, "outside the model: own weight is 3.2 of the"),
    ],
)
def test_posture_at_rest_is_judged_as_the_ordinary_prediction(whisker, angle, found):
    path = PosturePath(time=np.array([0, 0.06]), contact=np.full(2, 0.29), base_angle=np.full(2, angle))
    slow = predict_slow(whisker, path, SEVERAL, EXACT, n_modes=3)
    known = predict(whisker, Posture(contact=0.29, base_angle=angle), SEVERAL, EXACT, n_modes=3)
    t = np.linspace(0, 0.06, 900)
    data = slow_signals(slow, t)
    judged = diagnostics(known, t)
    for name in ("weight_ratio", "lift_off", "slip_reversed", "resonance_ratio", "growth_rate"):
        np.testing.assert_allclose(data[name], judged[name], rtol=1e-6, atol=1e-12)
    assert data.attrs["verdict"] == remarks(slow, t)[0] == verdict(judged)
    assert found in data.attrs["verdict"]


def test_contact_that_the_vibration_stops_sticks():
    """A slow scan at little damping: the vibrating contact goes back over the ground at some times, not at others."""
    path = PosturePath(time=np.array([0, 0.3]), contact=np.full(2, 0.29), base_angle=np.full(2, 1.0))
    asked = Scan(speed=0.015, damping=0.02, response="linear")
    slow = predict_slow(WHISKER, path, ONE, asked, n_modes=3)
    known = predict(WHISKER, Posture(contact=0.29, base_angle=1.0), ONE, asked, n_modes=3)
    t = np.linspace(0, 0.3, 6000)
    judged = diagnostics(known, t)
    assert 0 < float(judged.slip_reversed) < 1
    assert contact_slip(slow, t).min() == pytest.approx(float(judged.least_slip), rel=1e-6)
    line = remarks(slow, t)[0]
    assert f"contact sticks in {100 * float(judged.slip_reversed):.2g} % of the time" in line
    assert "how far the linear response holds is not judged" in line


def test_weight_and_resonance_are_judged_at_the_worst_moment():
    t = np.linspace(0, 0.25, 21)
    swing = (1 - np.cos(2 * np.pi * t / 0.25)) / 2
    path = PosturePath(time=t, contact=0.25 + 0.08 * swing, base_angle=0.5 + 0.6 * swing)
    slow = predict_slow(WHISKER, path, ONE, Scan(speed=0.4, damping=0.11), n_modes=1)
    facts = path_diagnostics(slow, np.linspace(0, 0.25, 501))
    force = [on_the_flat(path.at(one)).contact_force for one in np.linspace(0, 0.25, 101)]
    assert float(facts.weight_ratio) == pytest.approx(own_weight(WHISKER) / min(force), rel=1e-3)
    steepest = resonance_shift(path.at(0.125), 1)
    np.testing.assert_allclose(facts.resonance_ratio, steepest.resonance_ratio, rtol=1e-9)
