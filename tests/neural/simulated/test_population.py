"""Populations: the paper's counts and spreads come in, and what was put in comes out."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.signal import lfilter

from vibrissa.neural.coupling.response import spike_counts
from vibrissa.neural.simulated.population import (
    LATENCY,
    SESSIONS,
    SURROUND_WHISKERS,
    draw_population,
    population_rate,
    record_population,
)
from vibrissa.neural.simulated.wandering import SlowState
from vibrissa.signals.envelope import analytic_envelope

TIME = np.arange(0, 4, 1e-3)


def ringing(time, seed):
    """Noise about 70 Hz that forgets itself in 20 ms: a ringing whisker."""
    memory = np.exp(-(time[1] - time[0]) / 0.02)
    kicks = np.random.default_rng(seed).standard_normal((2, time.size)) * np.sqrt(1 - memory**2)
    x, y = 45e-6 * lfilter([1], [1, -memory], kicks)
    return x * np.cos(2 * np.pi * 70 * time) + y * np.sin(2 * np.pi * 70 * time)


def pad(time=TIME, n_whiskers=24, seed=0):
    """One motion, shifted from whisker to whisker."""
    return np.array([np.roll(ringing(time, seed), k * time.size // n_whiskers) for k in range(n_whiskers)])


@pytest.fixture(scope="module")
def truth():
    return draw_population(rng=np.random.default_rng(1))


@pytest.mark.parametrize(
    ("counts", "quality", "n", "driven"),
    [("results", "SU", 170, 45), ("results", "MU", 344, 157), ("methods", "SU", 143, 45), ("methods", "MU", 289, 157)],
)
def test_counts_are_the_papers(counts, quality, n, driven):
    units = draw_population(counts, rng=np.random.default_rng(2))
    those = units.unit_quality == quality
    assert those.sum() == n
    assert (units.driven_by[those] == "envelope").sum() == driven


@pytest.mark.parametrize(
    ("quality", "threshold", "threshold_sem", "slope", "slope_sem", "n"),
    [("SU", 42.3e-6, 2.1e-6, 0.25e6, 0.05e6, 45), ("MU", 43.5e-6, 0.9e-6, 0.25e6, 0.02e6, 157)],
)
def test_thresholds_and_slopes_have_the_papers_means_and_errors(
    truth, quality, threshold, threshold_sem, slope, slope_sem, n
):
    driven = truth.isel(unit=(truth.unit_quality == quality) & (truth.driven_by == "envelope"))
    for values, mean, sem in ((driven.true_threshold, threshold, threshold_sem), (driven.true_slope, slope, slope_sem)):
        np.testing.assert_allclose(values.mean(), mean, atol=0.25 * sem)
        np.testing.assert_allclose(values.std(ddof=1) / np.sqrt(n), sem, rtol=0.2)  # the log-normal's tail is met once
        assert values.min() > 0


def test_units_are_spread_over_sessions_rats_and_neighbouring_whiskers(truth):
    assert np.unique(truth.unit_session).size == SESSIONS == 15
    assert np.unique(truth.unit_rat).size == 11
    assert len(set(truth.unit_name.values.tolist())) == 514
    for _, units in truth.groupby("unit_session"):
        assert np.unique(units.unit_rat).size == 1
        assert np.unique(units.unit_whisker).size <= 4
    assert truth.true_latency.min() >= LATENCY[0]
    assert truth.true_latency.max() <= LATENCY[1]
    assert truth.true_baseline.min() >= 1


def test_another_whisker_is_another_one(truth):
    other = truth.driven_by == "other whisker"
    assert other.sum() > 10
    assert np.all((truth.unit_whisker != truth.driving_whisker) == other)
    assert np.all(truth.true_slope.isnull() == np.isin(truth.driven_by, ["nothing", "onset", "carrier"]))


def test_envelope_units_follow_their_hinge(truth):
    envelope, phase = analytic_envelope(pad())
    k = int(np.flatnonzero((truth.driven_by == "envelope") & (truth.surround_gain == 0))[0])
    unit = truth.isel(unit=k)
    rate = population_rate(unit, TIME, envelope, phase, rng=np.random.default_rng(0))
    late = np.interp(TIME - float(unit.true_latency), TIME, envelope[int(unit.unit_whisker)], left=0)
    above = np.maximum(late - float(unit.true_threshold), 0)
    np.testing.assert_allclose(rate, float(unit.true_baseline) + float(unit.true_slope) * above)


def test_a_surround_answers_to_its_whiskers_and_to_no_other(truth):
    envelope, phase = analytic_envelope(pad())
    k = int(np.flatnonzero((truth.surround_gain > 0) & (truth.true_threshold < 60e-6))[0])
    unit = truth.isel(unit=k)
    rate = population_rate(unit, TIME, envelope, phase, rng=np.random.default_rng(0))
    late = [np.interp(TIME - float(unit.true_latency), TIME, one, left=0) for one in envelope]
    above = 1e6 * np.maximum(np.array(late) - float(unit.true_threshold), 0)
    found = np.linalg.lstsq(np.vstack([above, np.ones(TIME.size)]).T, rate)[0]
    expected = np.zeros(24)
    expected[[(int(unit.unit_whisker) + step) % 24 for step in SURROUND_WHISKERS]] = float(unit.surround_gain)
    expected[int(unit.unit_whisker)] = 1
    np.testing.assert_allclose(found[:24], 1e-6 * float(unit.true_slope) * expected, atol=1e-9)
    np.testing.assert_allclose(found[24], unit.true_baseline, rtol=1e-9)


def test_units_locked_elsewhere_do_not_follow_the_envelope(truth):
    envelope, phase = analytic_envelope(pad())
    for role in ("nothing", "onset", "slow feature", "other whisker", "carrier"):
        unit = truth.isel(unit=int(np.flatnonzero(truth.driven_by == role)[0]))
        rate = population_rate(unit, TIME, envelope, phase, rng=np.random.default_rng(3))
        own = envelope[int(unit.unit_whisker)]
        assert np.ptp(rate) == 0 or abs(np.corrcoef(rate, own)[0, 1]) < 0.35, role  # 4 s hold some 40 free values


@pytest.fixture(scope="module")
def small(truth):
    units = truth.isel(unit=slice(0, 514, 13))
    return units, record_population(units, TIME, pad(), 12, rng=np.random.default_rng(7))


def test_mean_counts_are_the_rates(small):
    units, _ = small
    envelope, phase = analytic_envelope(pad())
    steady = SlowState(depth=0.0, trial_sd=0.0)
    plain = record_population(units, TIME, pad(), 12, rng=np.random.default_rng(8), state=steady)
    for k in range(units.sizes["unit"]):
        unit = units.isel(unit=k)
        if str(unit.driven_by.values) == "slow feature":
            continue  # its feature is drawn on the way
        rate = population_rate(unit, TIME, envelope, phase, rng=np.random.default_rng(0))
        expected = np.trapezoid(rate, TIME) * 12
        found = int((plain.spike_unit == k).sum())
        assert abs(found - expected) < 4.5 * np.sqrt(expected) + 0.01 * expected


def test_single_units_rest_and_multi_units_do_not(small):
    units, spikes = small
    shortest = {"SU": np.inf, "MU": np.inf}
    for k, quality in enumerate(units.unit_quality.values.tolist()):
        own = spikes.isel(spike=spikes.spike_unit == k)
        interval = np.diff(own.spike_time)[np.diff(own.spike_trial) == 0]
        shortest[quality] = min(shortest[quality], interval.min())
    assert shortest["SU"] >= 1e-3 > 2e-4 > shortest["MU"]


def test_units_of_a_session_wander_together():
    truth = draw_population(rng=np.random.default_rng(4))
    quiet = np.isin(truth.driven_by, ["nothing"]) & (truth.unit_quality == "MU").values
    session = int(np.bincount(truth.unit_session.values[quiet]).argmax())
    units = truth.isel(unit=np.flatnonzero(quiet & (truth.unit_session == session).values)[:2])
    other = truth.isel(unit=np.flatnonzero(quiet & (truth.unit_session != session).values)[:1])
    three = xr.concat([units, other], "unit")
    state = SlowState(depth=0.6, timescale=0.15, trial_sd=0.0)
    spikes = record_population(three, TIME, pad(), 500, rng=np.random.default_rng(5), state=state)
    counts = [
        spike_counts(spikes.isel(spike=spikes.spike_unit == k), n_trials=500, start=0.0, n_bins=40, bin_width=0.1)
        for k in range(3)
    ]
    covariance = np.cov(np.reshape(counts, (3, -1)))
    tau, window = 0.15, 0.1
    shared = 0.36 * 2 * tau**2 * (window / tau - 1 + np.exp(-window / tau))
    rates = three.true_baseline.values
    np.testing.assert_allclose(covariance[0, 1], shared * rates[0] * rates[1], rtol=0.25)
    assert abs(covariance[0, 2]) < 0.2 * shared * rates[0] * rates[2]


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n_trials=st.integers(1, 4), first=st.integers(0, 500))
def test_equal_seeds_give_equal_spikes_in_order_and_in_the_window(seed, n_trials, first):
    def once():
        rng = np.random.default_rng(seed)
        units = draw_population(rng=rng).isel(unit=slice(first, first + 3))
        return record_population(units, TIME[:500], pad()[:, :500], n_trials, rng=rng)

    spikes = once()
    assert spikes.identical(once())
    unit, trial, when = (spikes[name].values for name in ("spike_unit", "spike_trial", "spike_time"))
    assert np.all(np.diff(unit) >= 0)
    assert np.all(np.diff(trial + n_trials * unit) >= 0)
    assert np.all(np.diff(when)[np.diff(trial + n_trials * unit) == 0] > 0)
    assert np.all((when >= TIME[0]) & (when <= TIME[499]))
    assert not trial.size or 0 <= trial.min() <= trial.max() < n_trials


def test_shifted_copies_are_nearly_uncorrelated():
    copies = pad(np.arange(0, 10, 1e-3), seed=6)
    assert np.abs(np.corrcoef(copies)[np.triu_indices(24, 1)]).max() < 0.1


def test_unknown_counts_few_whiskers_and_other_motions_are_refused(truth):
    with refusal("unknown", "counts", value="abstract"):
        draw_population("abstract", rng=np.random.default_rng(0))
    with refusal("range", "number of whiskers"):
        draw_population(n_whiskers=3, rng=np.random.default_rng(0))
    with refusal("shape", "displacement"):
        record_population(truth, TIME, pad()[:5], 2, rng=np.random.default_rng(0))
