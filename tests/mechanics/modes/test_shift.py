"""How far modes about the curved profile are from straight ones, as datasets, remarks and diagnostics."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.exact import cone_kappa, shaft_quadrature
from vibrissa.mechanics.modes.shift import curved_eigenmodes, resonance_shift, shift_remark
from vibrissa.mechanics.scan.diagnostics import diagnostics, remarks
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

POSTURE = Posture(contact=0.3, base_angle=1.2)
WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)


def test_shift_of_the_first_resonance_is_that_of_the_model():
    """MODEL.md, "Modes about the curved profile": κ₁ drops by 15.5 % or 10.7 % at ε = 0.3, θ_b = 1.2."""
    shift = resonance_shift(POSTURE, 2)
    assert list(shift.contact_law.values) == ["constant", "coulomb", "stuck", "edge", "flat"]
    np.testing.assert_allclose(100 * (shift.resonance_ratio[:2, 0] - 1), [-15.5, -10.7], atol=0.05)
    np.testing.assert_allclose(shift.kappa[:3, 0], [19.935, 21.067, 55.6], rtol=3e-4)
    np.testing.assert_allclose(shift.kappa[3, 0], 17.569, rtol=3e-5)  # a chain of links over an edge, extrapolated
    assert 21.067 < shift.kappa[4, 0] < 28.234  # held more than a point is, less than a straight clamp
    np.testing.assert_allclose(shift.kappa_straight, cone_kappa(0.3, 2), rtol=1e-14)
    np.testing.assert_array_equal(shift.growth_rate, 0)


def test_shift_in_hertz():
    shift = resonance_shift(POSTURE, 2, whisker=WHISKER)
    np.testing.assert_allclose(shift.resonant_frequency * 2 * np.pi * WHISKER.timescale, shift.kappa, rtol=1e-14)
    with refusal("range", "contact"):
        resonance_shift(POSTURE, whisker=Whisker(length=0.04, cone_angle=1.5e-3, tip=0.4))


def test_shapes_are_orthonormal_under_the_mass():
    s, weights = shaft_quadrature(0.3, 100)
    data = curved_eigenmodes(POSTURE, 4, s=s)
    across, along = data.mode_across.values, data.mode_along.values
    norm = (across * weights * s**2) @ across.T + (along * weights * s**2) @ along.T
    np.testing.assert_allclose(norm, np.eye(4), atol=1e-11)
    ends = curved_eigenmodes(POSTURE, 4)
    np.testing.assert_allclose(ends.mode_across[:, [0, -1]], 0, atol=1e-12)
    assert np.all(np.abs(ends.mode_along[:, 0]) > 0.1)  # it slides
    stuck = curved_eigenmodes(POSTURE, 4, condition="stick")
    np.testing.assert_allclose(stuck.mode_along[:, 0], 0, atol=1e-12)
    assert stuck.attrs["condition"] == "stick"
    assert curved_eigenmodes(POSTURE, 1, condition="edge").attrs["friction_law"] == "coulomb"


def test_remark_tells_each_law():
    line = shift_remark(resonance_shift(POSTURE, 1))
    assert (
        "by −25.5 % (on an edge), −15.5 % (one point sliding, friction constant), −10.7 % (one point sliding, " in line
    )
    assert line.endswith("friction following the load), +2.4 % (lying on smooth ground), +135.8 % (stuck)")
    fold = shift_remark(resonance_shift(Posture(contact=0.1, base_angle=1.4), 1))
    assert "by unstable (on an edge), −" in fold
    flutter = shift_remark(resonance_shift(Posture(contact=0.8, base_angle=1.2, friction=10), 2))
    assert "unstable (one point sliding, friction following the load)" in flutter


def told(modes, base_angle):
    posture = Posture(contact=0.29, base_angle=base_angle)
    texture = Gaps(position=np.array([1e-3]), width=np.array([2e-4]))
    prediction = predict(WHISKER, posture, texture, Scan(speed=0.1, damping=0.1, modes=modes), n_modes=3)
    data = diagnostics(prediction, np.linspace(0, 0.02, 100))
    return data, [line for line in remarks(data) if "curved profile" in line]


def test_diagnostics_of_straight_modes_remark_the_shift():
    data, lines = told("straight", 1.2)
    expected = resonance_shift(Posture(contact=0.29, base_angle=1.2), 3)
    np.testing.assert_allclose(data.resonance_ratio, expected.resonance_ratio, rtol=1e-12)
    assert len(lines) == 1
    assert lines[0].startswith("the modes are the straight shaft's; about the curved profile")
    assert len(told("straight", 0.2)[1]) == 1  # however small it is
    assert told("curved", 1.2)[1][0].startswith("the modes are about the profile (curved); about the curved profile")


@pytest.mark.parametrize("modes", ["straight", "curved", "curved-coulomb", "curved-edge"])
def test_slip_is_the_speed_of_the_shaft_over_the_ground(modes):
    """From the predicted positions: after the gap the contact is on land, and all that moves it is the vibration."""
    posture = Posture(contact=0.29, base_angle=1.2)
    texture = Gaps(position=np.array([1e-3]), width=np.array([6e-4]))
    scan = Scan(speed=0.04, damping=0.02, modes=modes)
    prediction = predict(WHISKER, posture, texture, scan, n_modes=3)
    t = prediction.events.time[-1] + np.arange(1, 2000) * 1e-5
    x = prediction.position(t, np.linspace(0.29, 1, 300))[0][:, 0] * WHISKER.length
    slip = 1 + np.gradient(x, t) / 0.04
    data = diagnostics(prediction, t)
    assert float(data.least_slip) == pytest.approx(slip.min(), abs=2e-3)
    assert float(data.slip_reversed) == pytest.approx(np.mean(slip <= 0), abs=2e-3)
    assert 0.02 < float(data.slip_reversed) < 0.5
    assert any("reverse the slip of the contact" in line for line in remarks(data))
    fast = diagnostics(predict(WHISKER, posture, texture, Scan(speed=0.5, damping=0.1, modes=modes), n_modes=3), t)
    assert 0.5 < float(fast.least_slip) < 1
    assert not any("reverse the slip" in line for line in remarks(fast))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: curved_eigenmodes(Posture(contact=0.95, base_angle=1.2)), ("range", "contact")),
        (lambda: curved_eigenmodes(POSTURE, 0), ("range", "number of modes")),
        (lambda: curved_eigenmodes(POSTURE, 41), ("range", "number of modes")),
        (lambda: curved_eigenmodes(POSTURE, s=[0.1, 0.5]), ("range", "s")),
    ],
)
def test_bad_requests_are_refused(call, message):
    with refusal(*message):
        call()
