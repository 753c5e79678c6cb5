"""The analytic envelope of signals whose envelope is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.signal import hilbert

from vibrissa.exact import am_tone
from vibrissa.signals.envelope import analytic_envelope, analytic_signal

RATE = 2000.0


def tone(seconds=2.0, carrier=120.0, modulation=7.0, depth=0.6):
    t = np.arange(round(seconds * RATE)) / RATE
    return t, *am_tone(t, carrier, modulation, depth)


def test_envelope_of_a_modulated_tone_is_exact_away_from_the_ends():
    t, signal, envelope = tone()
    found, _ = analytic_envelope(signal)
    inside = (t > 0.2) & (t < 1.8)
    np.testing.assert_allclose(found[inside], envelope[inside], atol=2e-3)  # the mirrored ends leak as 1/t


def test_envelope_holds_up_to_the_ends():
    t, signal, envelope = tone()
    found, _ = analytic_envelope(signal)
    edge = (t < 0.05) | (t > 1.95)
    assert np.abs(found[edge] - envelope[edge]).max() < 0.15  # the mirror has a corner there, not a step


def test_phase_is_that_of_the_carrier():
    t, signal, _ = tone(depth=0.3)
    phase = np.unwrap(analytic_envelope(signal)[1])
    inside = (t > 0.3) & (t < 1.7)
    carrier = 2 * np.pi * 120 * t
    offset = (phase - carrier)[inside]
    np.testing.assert_allclose(offset - np.round(offset.mean() / (2 * np.pi)) * 2 * np.pi, 0, atol=5e-3)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=st.integers(0, 10**6), gain=st.floats(0.01, 100), offset=st.floats(-50, 50))
def test_envelope_scales_with_the_signal_and_forgets_its_mean(seed, gain, offset):
    signal = np.random.default_rng(seed).normal(size=300)
    one, phase = analytic_envelope(signal)
    other, same = analytic_envelope(gain * signal + offset)
    np.testing.assert_allclose(other, gain * one, atol=1e-10 * (gain + abs(offset)))
    turn = np.exp(1j * (same - phase))
    np.testing.assert_allclose(turn[one > 1e-3], 1, atol=1e-7 * (1 + abs(offset) / gain))


@settings(deadline=None, derandomize=True, max_examples=25)
@given(seed=st.integers(0, 10**6))
def test_envelope_touches_the_signal_from_above_and_mirrors_in_time(seed):
    signal = np.random.default_rng(seed).normal(size=257)
    envelope, phase = analytic_envelope(signal)
    centred = signal - signal.mean()
    assert np.all(envelope >= np.abs(centred) - 1e-12)
    np.testing.assert_allclose(envelope * np.cos(phase), centred, atol=1e-12)
    np.testing.assert_allclose(analytic_envelope(signal[::-1])[0], envelope[::-1], atol=1e-12)


def test_modes_are_treated_one_by_one():
    _, signal, _ = tone(0.3)
    both = np.stack([signal, 3 * signal[::-1]])
    np.testing.assert_allclose(analytic_envelope(both)[0][1], analytic_envelope(both[1])[0], atol=1e-13)


def test_free_decay_has_an_exponential_envelope():
    t = np.arange(4000) / RATE
    zeta, omega = 0.02, 2 * np.pi * 90
    signal = np.exp(-zeta * omega * t) * np.cos(omega * t)
    found, _ = analytic_envelope(signal)
    inside = (t > 0.02) & (t < 0.2)
    np.testing.assert_allclose(found[inside], np.exp(-zeta * omega * t[inside]), rtol=0.03)  # ζ², and the mean


@pytest.mark.parametrize(("signal", "rule"), [(np.zeros(3), "4 samples"), (np.array([0, 1, np.nan, 1, 0.0]), "no NaN")])
def test_signals_without_an_envelope_are_refused(signal, rule):
    with refusal("too-few", "signal") as caught:
        analytic_envelope(signal)
    assert rule in str(caught.value)


@pytest.mark.parametrize("shape", [(1,), (2,), (5,), (3, 64), (2, 1001)])
def test_the_analytic_signal_is_that_of_scipy_to_the_bit(shape):
    signal = np.random.default_rng(0).normal(size=shape)
    np.testing.assert_array_equal(analytic_signal(signal), hilbert(signal, axis=-1))
