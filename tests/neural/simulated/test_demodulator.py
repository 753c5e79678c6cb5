"""The demodulator against the closed forms of a rectified, smoothed sine."""

import numpy as np
import pytest
from demodulator import Demodulator
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from vibrissa.signals.smoothing import low_pass

TIME = np.arange(0, 2, 1e-4)
LATE = TIME > 1
OMEGA = 2 * np.pi * 70


def tone(amplitude):
    return amplitude * np.sin(OMEGA * TIME)


def test_low_pass_of_a_step_and_of_a_ramp():
    step = low_pass(TIME, np.ones(TIME.size), 0.1)
    np.testing.assert_allclose(step, 1 - np.exp(-TIME / 0.1), atol=1e-12)
    ramp = low_pass(TIME, TIME, 0.1)
    np.testing.assert_allclose(ramp, TIME - 0.1 * (1 - np.exp(-TIME / 0.1)), atol=1e-12)


def test_a_steady_tone_gives_its_amplitude_and_the_ripple_of_its_second_harmonic():
    unit, amplitude = Demodulator(smoothing=0.01), 80e-6
    found = unit.demodulate(TIME, tone(amplitude))[LATE]
    np.testing.assert_allclose(found.mean(), amplitude, rtol=1e-3)  # (π/2)(2A/π)
    # |sin| = 2/π − (4/π) Σ cos(2kωt)/(4k² − 1)
    second = 2 * np.abs(np.mean(found * np.exp(2j * OMEGA * TIME[LATE])))
    np.testing.assert_allclose(second, 2 * amplitude / 3 / np.hypot(1, 2 * OMEGA * 0.01), rtol=1e-3)


@pytest.mark.parametrize("beat", [3.0, 10.0, 25.0])
def test_a_modulated_tone_gives_its_envelope_smoothed(beat):
    unit, depth = Demodulator(smoothing=0.01), 0.5
    swing = 2 * np.pi * beat
    displacement = tone(60e-6) * (1 + depth * np.cos(swing * TIME))
    found = unit.demodulate(TIME, displacement)[LATE]
    phasor = 2 * np.mean(found * np.exp(-1j * swing * TIME[LATE])) / 60e-6
    np.testing.assert_allclose(phasor, depth / (1 + 1j * swing * 0.01), rtol=0.01)


def test_rate_of_steady_tones_is_a_hinge_of_their_amplitude():
    unit = Demodulator(threshold=40e-6, slope=2.5e5, baseline=5.0, smoothing=0.05, adaptation=0.0)
    rates = [unit.rate(TIME, tone(a))[LATE].mean() for a in (20e-6, 36e-6, 60e-6, 100e-6)]
    np.testing.assert_allclose(rates, [5, 5, 10, 20], rtol=2e-3)


def test_adaptation_lowers_the_gain_by_its_share_and_only_slowly():
    unit = Demodulator(threshold=20e-6, slope=1e6, baseline=2.0, adaptation=0.4, adaptation_time=0.1, smoothing=0.02)
    rate = unit.rate(TIME, tone(100e-6))
    np.testing.assert_allclose(rate[LATE].mean(), 2 + 1e6 * (0.6 * 100e-6 - 20e-6), rtol=5e-3)
    assert rate[(TIME > 0.06) & (TIME < 0.09)].mean() > 1.2 * rate[LATE].mean()


def test_silence_keeps_the_baseline_and_the_latency_delays():
    unit = Demodulator(latency=0.02)
    np.testing.assert_array_equal(unit.rate(TIME, np.zeros(TIME.size)), unit.baseline)
    rate, prompt = unit.rate(TIME, tone(1e-4)), Demodulator(latency=0.0).rate(TIME, tone(1e-4))
    np.testing.assert_allclose(rate[200:], prompt[:-200], atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000), scale=st.floats(0.1, 10))
def test_sign_does_not_matter_and_scale_does(seed, scale):
    unit, x = Demodulator(), np.random.default_rng(seed).standard_normal(500) * 1e-5
    time = np.arange(500) * 1e-3
    found = unit.demodulate(time, x)
    np.testing.assert_allclose(unit.demodulate(time, -x), found)
    np.testing.assert_allclose(unit.demodulate(time, scale * x), scale * found)


@pytest.mark.parametrize(
    ("name", "value"), [("threshold", -1.0), ("smoothing", 0.0), ("adaptation", 1.0), ("adaptation_time", np.inf)]
)
def test_impossible_demodulators_are_refused(name, value):
    with refusal("range", f"Demodulator.{name}", str(value)):
        Demodulator(**{name: value})


def test_uneven_grids_are_refused():
    with refusal("range", "time"):
        low_pass(np.array([0, 1, 3.0]), np.zeros(3), 1.0)
