"""A base signal of known truth: resonance and damping, envelope, and the right texture told from a wrong one."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.scan.follicle import follicle_signals
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.sensor.base_response import analyse_base_signal, predicted_signal
from vibrissa.mechanics.sensor.base_signal import read_base_signal
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.quantities import dataset
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
TIME = np.arange(6000) / 4000


def prediction(seed=1, damping=0.11):
    texture = random_grating(0.16, rng=np.random.default_rng(seed))
    return predict(WHISKER, POSTURE, texture, Scan(speed=0.1, damping=damping), n_modes=6)


@pytest.fixture(scope="module")
def truth():
    return prediction()


@pytest.fixture(scope="module")
def measured(truth, tmp_path_factory):
    """The model's moment, 20 ms late, with noise, through a bridge of 2e-7 N m per V and a table."""
    path = tmp_path_factory.mktemp("base") / "moment.csv"
    moment = follicle_signals(truth, TIME - 0.02)["base_moment"]
    noise = 0.05 * moment.std() * np.random.default_rng(2).normal(size=TIME.size)
    rows = [f"{t:.6f},{v:.8g}" for t, v in zip(TIME, (moment + noise) / 2e-7, strict=True)]
    path.write_text("time,bridge\n" + "\n".join(rows) + "\n")
    return read_base_signal(path, kind="moment", unit="V", calibration=2e-7)


@pytest.mark.parametrize("name", ["base_moment", "base_curvature", "transverse_force"])
def test_predicted_signals_are_the_follicles(truth, name):
    np.testing.assert_allclose(predicted_signal(truth, name, TIME), follicle_signals(truth, TIME)[name], rtol=1e-10)


def test_resonance_and_damping_come_back(truth, measured):
    # a guess 4 % off, and a prediction whose damping is not the true one: only its texture is relied upon
    guess = 1.04 * truth.omega[:2] / (2 * np.pi)
    found = analyse_base_signal(measured, guess, prediction=prediction(damping=0.2))
    resonance, white = found["resonance"], found["resonance_white"]
    np.testing.assert_allclose(resonance.resonant_frequency, truth.omega[:2] / (2 * np.pi), rtol=0.008)
    assert resonance.damping.values[0] == pytest.approx(0.11, rel=0.1)
    error = np.abs(resonance.resonant_frequency.values[0] / (truth.omega[0] / (2 * np.pi)) - 1)
    assert error < np.abs(white.resonant_frequency.values[0] / (truth.omega[0] / (2 * np.pi)) - 1)


def test_the_right_texture_agrees_and_a_wrong_one_does_not(truth, measured):
    guess = truth.omega[:1] / (2 * np.pi)
    right = analyse_base_signal(measured, guess, prediction=truth)["agreement"]
    wrong = analyse_base_signal(measured, guess, prediction=prediction(seed=5))["agreement"]
    assert right.correlation.item() > 0.95
    assert right.best_lag.item() == pytest.approx(0.02, abs=5e-4)
    assert right.rms_ratio.item() == pytest.approx(1, abs=0.05)
    assert wrong.correlation.item() < 0.5


def oscillator(f, zeta, t, rng):
    """An oscillator under white noise."""
    rate = 1 / t[1]
    a1, a2 = (
        2 * np.exp(-zeta * 2 * np.pi * f / rate) * np.cos(2 * np.pi * f / rate),
        -np.exp(-4 * np.pi * zeta * f / rate),
    )
    x = np.zeros(t.size)
    kick = rng.normal(size=t.size)
    for i in range(2, t.size):
        x[i] = a1 * x[i - 1] + a2 * x[i - 2] + kick[i]
    return x


def test_with_white_forcing_modes_above_the_first_have_no_interval(truth, measured):
    """Of two oscillators the flank of the first is fitted as width of the second, whose interval would not hold it."""
    t, rng = np.arange(40_000) / 4000, np.random.default_rng(0)
    x = sum(one / one.std() for one in (oscillator(80.0, 0.08, t, rng), oscillator(230.0, 0.05, t, rng)))
    white = analyse_base_signal(dataset(time=t, transverse_force=1e-6 * x), [80.0, 230.0])["resonance_white"]
    assert white.resonant_frequency_low[0] < 80 < white.resonant_frequency_high[0]
    assert white.resonant_frequency[1] == pytest.approx(230, rel=0.1)
    for name in ("resonant_frequency", "damping"):
        assert np.isfinite([white[name + end][0] for end in ("_low", "_high")]).all()
        assert np.isnan([white[name + end][1] for end in ("_low", "_high")]).all()
    known = analyse_base_signal(measured, truth.omega[:2] / (2 * np.pi), prediction=truth)["resonance"]
    assert np.isfinite(known.damping_high).all()  # the texture's forcing separates the modes


def test_white_fit_and_envelope_of_a_driven_oscillator():
    f, zeta, t = 90.0, 0.05, np.arange(40_000) / 4000
    x = oscillator(f, zeta, t, np.random.default_rng(3))
    found = analyse_base_signal(dataset(time=t, transverse_force=1e-6 * x), [85.0])
    white = found["resonance_white"]
    assert white.resonant_frequency.item() == pytest.approx(f, rel=0.02)
    assert white.damping.item() == pytest.approx(zeta, rel=0.25)
    envelope = found["envelope"].transverse_force_envelope.values[0]
    assert np.mean(envelope**2) == pytest.approx(2e-12 * x.var(), rel=0.15)  # ⟨A²⟩ = 2⟨x²⟩ of a carrier
    assert "resonance" not in found


@pytest.mark.parametrize("guess", [[0.0], [200.0, 100.0], [1500.0]])
def test_impossible_guesses_are_refused(measured, guess):
    with refusal("range", "guess"):
        analyse_base_signal(measured, guess)


def test_nothing_to_analyse_is_said():
    with refusal("missing", "follicle"):
        analyse_base_signal(dataset(time=TIME), [90.0])
    with refusal("too-few", "base_moment"):
        analyse_base_signal(dataset(time=TIME, base_moment=0 * TIME), [90.0])
