"""Simulated units: their rate by hand, their spikes by the laws of Poisson."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.stats import kstest

from vibrissa.neural.coupling.response import spike_counts
from vibrissa.neural.simulated.refractoriness import Refractoriness
from vibrissa.neural.simulated.virtual import PhaseUnit, ThresholdLinearUnit, draw_spikes, simulate_spikes
from vibrissa.neural.simulated.wandering import SlowState, unrelated_feature
from vibrissa.signals.correlation import lagged_correlation

UNIT = ThresholdLinearUnit(threshold=40e-6, slope=2.5e5, baseline=5.0, latency=0.0)


def test_rate_is_a_hinge_of_the_envelope():
    time = np.arange(4.0)
    rate = UNIT.rate(time, np.array([0, 40e-6, 60e-6, 140e-6]))
    np.testing.assert_allclose(rate, [5, 5, 10, 30])  # 0.25 AP/s per µm above 40 µm


def test_rate_follows_the_envelope_after_the_latency():
    unit = ThresholdLinearUnit(threshold=0.0, slope=1e6, baseline=2.0, latency=0.01)
    time = np.arange(6) * 0.005
    rate = unit.rate(time, np.array([1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6]))
    np.testing.assert_allclose(rate, [2, 2, 3, 4, 5, 6])


def test_counts_have_the_mean_and_the_variance_of_poisson():
    time = np.linspace(0, 1, 2001)
    envelope = 80e-6 * (1 + np.sin(2 * np.pi * 3 * time))
    n_trials, n_bins = 4000, 20
    spikes = simulate_spikes(UNIT, time, envelope, n_trials, rng=np.random.default_rng(1))
    counts = spike_counts(spikes, n_trials=n_trials, start=0.0, n_bins=n_bins, bin_width=0.05)
    rate = UNIT.rate(time, envelope)
    area = np.concatenate([[0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(time))])
    expected = np.diff(area[::100])
    np.testing.assert_allclose((counts.mean(0) - expected) / np.sqrt(expected / n_trials), 0, atol=4)
    np.testing.assert_allclose(counts.var(0) / counts.mean(0), 1, atol=4 * np.sqrt(2 / n_trials) * 2)
    between = np.corrcoef(counts.T)[np.triu_indices(n_bins, 1)]
    assert np.abs(between).max() < 4.5 / np.sqrt(n_trials)  # bins know nothing of each other


def test_steady_rate_gives_exponential_intervals():
    time = np.linspace(0, 400, 5)
    spikes = simulate_spikes(UNIT, time, np.full(5, 100e-6), 1, rng=np.random.default_rng(2))
    assert kstest(np.diff(spikes.spike_time), "expon", (0, 1 / 20)).pvalue > 1e-3


def test_spikes_are_sorted_by_trial_then_time_and_repeat_with_the_seed():
    time = np.linspace(2.0, 3.0, 100)
    one, same = (simulate_spikes(UNIT, time, np.full(100, 1e-4), 7, rng=np.random.default_rng(3)) for _ in range(2))
    assert one.identical(same)
    trial, when = one.spike_trial.values, one.spike_time.values
    assert np.all(np.diff(trial + (when - 2) / 2) > 0)
    assert 2.0 <= when.min() <= when.max() <= 3.0
    assert one.spike_time.attrs["units"] == "s"


def test_silent_unit_fires_nothing():
    unit = ThresholdLinearUnit(baseline=0.0)
    spikes = simulate_spikes(unit, np.arange(3.0), np.zeros(3), 5, rng=np.random.default_rng(0))
    assert spikes.spike_time.size == 0


@pytest.mark.parametrize("name", ["threshold", "slope", "baseline", "latency"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_impossible_units_are_refused(name, value):
    with refusal("range", f"ThresholdLinearUnit.{name}", str(value)):
        ThresholdLinearUnit(**{name: value})


def test_at_least_one_trial_is_needed():
    with refusal("range", "number of trials"):
        simulate_spikes(UNIT, np.arange(3.0), np.zeros(3), 0, rng=np.random.default_rng(0))


# Locked to the carrier, slow states, adaptation

TIME = np.linspace(0, 2, 4001)


def test_vector_strength_of_a_phase_unit_is_half_its_depth():
    unit = PhaseUnit(baseline=20.0, depth=0.6, preferred=1.0, latency=0.0)
    phase = np.angle(np.exp(2j * np.pi * 70 * TIME))  # wrapped, as the analytic signal gives it
    spikes = simulate_spikes(unit, TIME, phase, 500, rng=np.random.default_rng(4))
    strength = np.exp(2j * np.pi * 70 * spikes.spike_time.values).mean()
    error = 1 / np.sqrt(spikes.sizes["spike"])
    np.testing.assert_allclose(strength, 0.3 * np.exp(1j), atol=4 * error)


def test_phase_unit_keeps_its_mean_rate_and_waits_for_its_latency():
    rate = PhaseUnit(baseline=7.0, latency=0.5).rate(TIME, 2 * np.pi * 10 * TIME)
    np.testing.assert_allclose(rate.mean(), 7.0, rtol=1e-3)
    np.testing.assert_array_equal(rate[TIME < 0.5], 7.0)
    assert np.ptp(rate) > 11


def test_slow_state_has_mean_one_and_the_covariance_stated():
    state = SlowState(depth=0.6, timescale=0.1, trial_sd=0.3)
    gain = state.draw(4000, 1.0, rng=np.random.default_rng(5))
    assert gain.shape == (4000, 1000)
    np.testing.assert_allclose(gain.mean(), 1, atol=0.03)
    for lag in (0, 50, 300):
        found = np.mean(gain[:, : 1000 - lag] * gain[:, lag:]) - 1
        np.testing.assert_allclose(found, (1 + 0.3**2) * (1 + 0.6**2 * np.exp(-lag * 1e-3 / 0.1)) - 1, atol=0.03)


def test_units_that_share_a_slow_state_covary_by_it_alone():
    state, n_trials, window = SlowState(depth=0.7, timescale=0.15, trial_sd=0.0), 3000, 0.5
    rng = np.random.default_rng(6)
    gain = state.draw(n_trials, 2.0, rng=rng)
    flat = np.full(TIME.size, 60.0)
    counts = []
    for shared in (gain, gain, state.draw(n_trials, 2.0, rng=rng)):
        when, trial = draw_spikes(TIME, flat, n_trials, rng=rng, gain=shared)
        counts.append(np.bincount(trial[when < window], minlength=n_trials))
    # twice the integral of (window − lag) rate² depth² exp(−lag/τ)
    tau = state.timescale
    expected = (60 * 0.7) ** 2 * 2 * tau**2 * (window / tau - 1 + np.exp(-window / tau))
    found = np.cov(counts)
    np.testing.assert_allclose(found[0, 1], expected, rtol=0.12)  # sd of the estimate is 2–3 %
    np.testing.assert_allclose(found[0, 0], expected + 60 * window, rtol=0.12)
    assert abs(found[0, 2]) < 0.12 * expected


def test_gain_leaves_the_mean_rate():
    gain = SlowState(depth=0.8, trial_sd=0.2).draw(800, 2.0, rng=np.random.default_rng(7))
    when, _ = draw_spikes(TIME, np.full(TIME.size, 10.0), 800, rng=np.random.default_rng(8), gain=gain)
    np.testing.assert_allclose(when.size, gain.mean() * 10 * 2 * 800, rtol=4 / np.sqrt(16000))


def test_unrelated_feature_has_the_moments_of_rayleigh_and_its_timescale():
    time = np.arange(400_000) * 1e-3
    feature = unrelated_feature(time, mean=50e-6, timescale=0.05, rng=np.random.default_rng(9))
    np.testing.assert_allclose(feature.mean(), 50e-6, rtol=0.03)
    np.testing.assert_allclose(feature.std() / feature.mean(), np.sqrt(4 / np.pi - 1), rtol=0.03)
    power = feature**2 - np.mean(feature**2)
    np.testing.assert_allclose(power[50:] @ power[:-50] / (power @ power), np.exp(-1), atol=0.04)


def test_latency_is_where_the_spikes_follow_the_envelope():
    rng = np.random.default_rng(10)
    envelope = unrelated_feature(TIME, mean=60e-6, timescale=0.02, rng=rng)
    unit = ThresholdLinearUnit(threshold=30e-6, latency=0.017)
    spikes = simulate_spikes(unit, TIME, envelope, 2000, rng=rng)
    counts, _ = np.histogram(spikes.spike_time, bins=2000, range=(0, 2))  # 1 ms
    _, r = lagged_correlation(counts.astype(float), np.interp((np.arange(2000) + 0.5) * 1e-3, TIME, envelope), 40)
    assert abs(np.argmax(r) - 40 - 17) <= 1


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n_trials=st.integers(1, 8),
    start=st.floats(-5, 5),
    relative=st.sampled_from([0.0, 2e-3]),
)
def test_spikes_are_in_order_in_the_window_and_the_seeds(seed, n_trials, start, relative):
    time = start + np.linspace(0, 0.5, 51)
    rate = 50 * np.random.default_rng(seed).random(51)

    def draw():
        rng = np.random.default_rng(seed)
        gain = SlowState().draw(n_trials, 0.5, rng=rng)
        return draw_spikes(time, rate, n_trials, rng=rng, gain=gain, refractoriness=Refractoriness(relative=relative))

    when, trial = draw()
    np.testing.assert_array_equal(when, draw()[0])
    assert np.all(np.diff(trial) >= 0)
    assert np.all((when >= time[0]) & (when <= time[-1]))
    same = np.diff(trial) == 0
    assert np.all(np.diff(when)[same] >= 1e-3)
    assert not trial.size or 0 <= trial.min() <= trial.max() < n_trials


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: PhaseUnit(depth=1.2), ("range", "PhaseUnit.depth")),
        (lambda: PhaseUnit(baseline=-1), ("range", "PhaseUnit.baseline")),
        (lambda: SlowState(depth=1.0), ("range", "SlowState.depth")),
        (lambda: SlowState(timescale=0.0), ("range", "SlowState.timescale")),
        (lambda: SlowState(trial_sd=np.nan), ("range", "SlowState.trial_sd")),
        (lambda: draw_spikes(TIME[:1], TIME[:1], 1, rng=np.random.default_rng(0)), ("too-few", "time")),
        (lambda: draw_spikes(TIME, -TIME, 1, rng=np.random.default_rng(0)), ("range", "rate and gain")),
        (lambda: draw_spikes(TIME, TIME, 2, rng=np.random.default_rng(0), gain=np.ones((1, 3))), ("shape", "gain")),
    ],
)
def test_bad_input_is_one_line(make, match):
    with refusal(*match):
        make()


def test_uneven_and_even_grids_tell_the_same_rate():
    even = np.linspace(0, 2, 201)
    uneven = np.sort(np.append(even, 1.003))
    rate = 20 * np.abs(np.sin(even))
    when, trial = draw_spikes(even, rate, 50, rng=np.random.default_rng(11))
    same, of = draw_spikes(uneven, np.interp(uneven, even, rate), 50, rng=np.random.default_rng(11))
    np.testing.assert_array_equal(when, same)
    np.testing.assert_array_equal(trial, of)
