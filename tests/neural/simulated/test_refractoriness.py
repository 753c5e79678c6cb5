"""Refractoriness: intervals by their law, and the mean rate that was asked for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refusal
from scipy.integrate import quad
from scipy.stats import kstest

from vibrissa.neural.simulated.refractoriness import Refractoriness, below
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, draw_spikes

TIME = np.linspace(0, 500, 3)


def survival(rest, age, hazard):
    """Probability that an interval is longer: exp(−h ∫₀ᵘ w), with w the hazard's recovery."""
    after = np.maximum(np.asarray(age) - rest.absolute, 0.0)
    recovered = -np.expm1(-after / rest.relative) if rest.relative else 0.0
    return np.exp(-hazard * (after - rest.relative * recovered))


@pytest.mark.parametrize(
    "rest", [Refractoriness(absolute=5e-3, relative=0), Refractoriness(), Refractoriness(relative=0.02)]
)
def test_intervals_follow_the_survival_and_the_rate_is_the_one_asked_for(rest):
    rate = 40.0
    when, _ = draw_spikes(TIME, np.full(3, rate), 1, rng=np.random.default_rng(1), refractoriness=rest)
    interval = np.diff(when)
    hazard = float(rest.hazard(rate))
    assert interval.min() >= rest.absolute
    assert kstest(interval, lambda u: 1 - survival(rest, u, hazard)).pvalue > 1e-3
    np.testing.assert_allclose(when.size / 500, rate, rtol=4 / np.sqrt(rate * 500))


@pytest.mark.parametrize("relative", [0.0, 1e-3, 0.03])
@pytest.mark.parametrize("hazard", [0.5, 30.0, 700.0])
def test_mean_interval_is_the_integral_of_the_survival(relative, hazard):
    rest = Refractoriness(absolute=2e-3, relative=relative)
    mean = rest.absolute + quad(lambda u: survival(rest, u, hazard), rest.absolute, 30 / hazard + 1, limit=500)[0]
    np.testing.assert_allclose(rest.firing_rate(hazard), 1 / mean, rtol=1e-6)


@given(rate=st.floats(0, 300), relative=st.floats(0, 5e-3))
def test_hazard_inverts_the_firing_rate(rate, relative):
    rest = Refractoriness(absolute=1e-3, relative=relative)
    hazard = rest.hazard(rate)
    np.testing.assert_allclose(rest.firing_rate(hazard), rate, rtol=1e-4, atol=1e-9)
    assert hazard >= rate * (1 - 1e-9)


def test_without_rest_nothing_changes():
    rest = Refractoriness(absolute=0.0, relative=0.0)
    np.testing.assert_allclose(rest.hazard([0, 3, 50]), [0, 3, 50], rtol=1e-12)
    plain, same = (
        draw_spikes(TIME, np.full(3, 5.0), 3, rng=np.random.default_rng(2), refractoriness=r) for r in (None, rest)
    )
    assert abs(plain[0].size - same[0].size) <= 1


def test_a_changing_rate_survives_refractoriness():
    time = np.linspace(0, 1, 1001)
    envelope = 100e-6 * (1 + np.sin(2 * np.pi * 2 * time)) / 2
    rate = ThresholdLinearUnit(slope=5e5, latency=0.0).rate(time, envelope)
    when, _ = draw_spikes(time, rate, 4000, rng=np.random.default_rng(3), refractoriness=Refractoriness())
    counts, _ = np.histogram(when, 20, (0, 1))
    expected = rate[:-1].reshape(20, 50).mean(axis=1) * 0.05 * 4000
    np.testing.assert_allclose(
        counts / expected, 1, atol=0.06
    )  # 4 sd of 10³ spikes in the leanest bins; bias below 1 %


def test_refractory_trains_are_more_regular_than_poisson():
    rest = Refractoriness(absolute=5e-3, relative=0.01)
    when, _ = draw_spikes(TIME, np.full(3, 60.0), 1, rng=np.random.default_rng(4), refractoriness=rest)
    interval = np.diff(when)
    assert interval.std() / interval.mean() < 0.7


@pytest.mark.parametrize("name", ["absolute", "relative"])
@pytest.mark.parametrize("value", [-1e-3, np.nan, np.inf])
def test_impossible_rests_are_refused(name, value):
    with refusal("range", f"Refractoriness.{name}", str(value)) as caught:
        Refractoriness(**{name: value})
    assert caught.value.rule == "must be zero or positive (s)"


def test_rates_beyond_reach_are_refused():
    with refusal("range", "firing rate"):
        Refractoriness(absolute=1e-3, relative=0).hazard(1001.0)


def test_silence_ends_after_the_absolute_period_whatever_the_rounding_of_the_times():
    rest = Refractoriness(absolute=1e-3, relative=0.0)
    time = np.array([float(f"{k / 1000:.3f}") for k in range(1, 2000)])  # 0.011 − 0.010 < 0.001 in binary numbers
    assert not below(np.diff(time), rest.absolute).any()
    assert rest.spare(time, np.zeros(time.size, int), np.zeros(time.size)).all()
