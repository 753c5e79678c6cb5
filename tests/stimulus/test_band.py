"""The stimulator's band: against Bessel's polynomial, scipy, and endless repetition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.signal import freqz_sos, sosfilt
from scipy.special import factorial

from vibrissa.stimulus.band import RESONANCES, Band

RATE = 20000.0


def reverse_bessel(order, s):
    """Reverse Bessel polynomial of unit delay, by its coefficients."""
    k = np.arange(order + 1)
    weights = factorial(2 * order - k) / (2.0 ** (order - k) * factorial(k) * factorial(order - k))
    return np.polyval(weights[::-1], s), weights[0]


@pytest.mark.parametrize("order", [1, 2, 4, 8])
def test_well_above_its_lower_corner_the_filter_is_bessels_polynomial(order):
    f = np.array([20.0, 50.0, 69.0, 83.0, 88.0, 89.0])
    # the band-pass takes s → (s² + ω₁ω₂)/(s (ω₂ − ω₁)) of the prototype, whose delay here is 1/(ω₂ − ω₁)
    s = 1j * f
    p = (s**2 + 0.1 * 83) / (s * (83 - 0.1))
    value, at_rest = reverse_bessel(order, p)
    found = Band(order=order, norm="delay", causal=True).response(f, RATE)
    np.testing.assert_allclose(found, at_rest / value, atol=3e-4)  # the digital filter's warp at 89 of 20000 Hz


@pytest.mark.parametrize("norm", ["phase", "delay", "mag"])
@pytest.mark.parametrize("order", [1, 4, 6])
def test_the_response_is_that_of_scipys_sections(order, norm):
    band = Band(order=order, norm=norm, causal=True)
    f = np.geomspace(0.05, 5000, 300)
    expected = freqz_sos(band.sections(RATE), f, fs=RATE)[1]
    np.testing.assert_allclose(band.response(f, RATE), expected, rtol=1e-6, atol=1e-9)


def test_forwards_and_backwards_squares_the_gain_and_has_no_phase():
    f = np.geomspace(0.05, 5000, 100)
    once, both = (Band(causal=causal).response(f, RATE) for causal in (True, False))
    np.testing.assert_allclose(both, np.abs(once) ** 2)
    np.testing.assert_array_equal(Band(causal=False).group_delay(f, RATE), 0)


def test_the_low_pass_gains_of_the_resonances_are_those_known():
    # research note: Bessel low-pass of order 4 at 83 Hz: 0.56, 0.37 (phase) and 0.79, 0.67 (mag) at 69, 88 Hz
    f = np.array(RESONANCES[:2])
    for norm, expected in (("phase", [0.56, 0.37]), ("mag", [0.79, 0.67])):
        gain = np.abs(Band(norm=norm, causal=True).response(f, RATE))
        np.testing.assert_allclose(gain, expected, atol=0.006)


def test_group_delay_is_the_slope_of_the_phase():
    band, f = Band(causal=True), np.linspace(60, 90, 30001)
    slope = -np.gradient(np.unwrap(np.angle(band.response(f, RATE))), f) / (2 * np.pi)
    np.testing.assert_allclose(band.group_delay(f, RATE)[1:-1], slope[1:-1], rtol=1e-6)
    assert 2e-3 < band.group_delay(np.array([70.0]), RATE)[0] < 12e-3  # research note: 2.3 to 11.7 ms


@pytest.mark.parametrize("order", [2, 4])
def test_the_loop_is_filtered_as_after_long_repetition(order):
    rate, n, band = 500.0, 5000, Band(order=order, causal=True)
    loop = np.cumsum(np.random.default_rng(0).normal(size=n))
    loop -= np.linspace(0, 1, n) * (loop[-1] - loop[0])
    repeated = sosfilt(band.sections(rate), np.tile(loop, 12))
    found = band.filtered(loop, rate)
    np.testing.assert_allclose(found, repeated[-n:], atol=1e-6 * np.ptp(loop))
    assert np.abs(repeated[:n] - found).max() > 0.1 * np.ptp(found)  # a start from rest colours the record
    assert abs(found.mean()) < 1e-12 * np.ptp(loop)


@given(seed=st.integers(0, 99), a=st.floats(-3, 3), b=st.floats(-3, 3), shift=st.integers(0, 799))
@settings(max_examples=25, deadline=None)
def test_the_filter_is_linear_and_knows_no_beginning(seed, a, b, shift):
    x, y = np.random.default_rng(seed).normal(size=(2, 800))
    for band in (Band(low=1.0, causal=True), Band(low=1.0, causal=False)):
        fx, fy = band.filtered(x, 400.0), band.filtered(y, 400.0)
        np.testing.assert_allclose(band.filtered(a * x + b * y, 400.0), a * fx + b * fy, atol=1e-11)
        np.testing.assert_allclose(band.filtered(np.roll(x, shift), 400.0), np.roll(fx, shift), atol=1e-11)


def test_zero_phase_keeps_the_symmetry_of_a_pulse():
    x = np.zeros(2001)
    x[990:1011] = 1
    y = Band(low=1.0, causal=False).filtered(x, 1000.0)
    np.testing.assert_allclose(y, y[::-1], atol=1e-12)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"low": 0.0}, ("range", "band")),
        ({"low": 90.0}, ("range", "band")),
        ({"high": np.nan}, ("range", "band")),
        ({"order": 0}, ("range", "order")),
        ({"order": 11}, ("range", "order")),
        ({"norm": "flat"}, ("unknown", "norm")),
    ],
)
def test_bands_that_are_none_are_refused(values, words):
    with refusal(*words):
        Band(**values)


def test_a_sampling_rate_below_twice_the_band_is_refused():
    with refusal("range", "sampling_rate"):
        Band().sections(160.0)
