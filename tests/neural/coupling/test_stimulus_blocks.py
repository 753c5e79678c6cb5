"""Blocks of the stimulus: how long, what they share with trials, and intervals that count what else a unit answers."""

import numpy as np
import pytest
from populations import BINS, WIDTH, ringing, wander

from vibrissa.neural.coupling.repeatability import explainable_variance, r_squared_ceiling, variability
from vibrissa.neural.coupling.stimulus_blocks import block_starts, memory, over_both, own_share
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge, HingeGrid
from vibrissa.neural.coupling.tuning import ENDS, bootstrap_fits, forward_fit, predicted
from vibrissa.signals.envelope import analytic_envelope

TRUTH = Hinge(42.3e-6, 2.5e5, 0.012, 5.0)


def presented(rng):
    time, displacement = ringing(rng)
    bins = np.arange(BINS)
    edges = WIDTH * np.arange(BINS + 1)
    valid = (bins >= 100) & (bins < BINS - 5)
    return BinnedDrive(time=time, envelope=analytic_envelope(displacement)[0], edges=edges, valid=valid)


def test_noise_has_no_memory_and_a_moving_mean_that_of_its_window():
    rng = np.random.default_rng(0)
    noise = rng.normal(size=4000)
    assert memory(noise) == 0
    smooth = np.convolve(noise, np.ones(20), "valid")  # its autocorrelation ends at lag 19
    assert 12 <= memory(smooth) <= 20
    assert memory(np.ones(50)) == 0


def test_blocks_cover_the_bins_and_are_no_fewer_than_twelve():
    rng = np.random.default_rng(1)
    assert np.diff(block_starts(rng.normal(size=900))).max() <= 6
    slow = np.cumsum(rng.normal(size=900))
    starts = block_starts(slow)
    assert starts.size == 12
    assert starts[0] == 0


def test_what_trials_have_for_themselves_is_told_from_what_they_share():
    rng = np.random.default_rng(2)
    slopes, weights, starts = rng.normal(size=(2, 400)), np.ones(400), 10 * np.arange(40)
    alone = own_share(slopes, weights, rng.normal(size=(300, 400)), starts)
    np.testing.assert_allclose(alone, 1, atol=0.25)
    shared = own_share(slopes, weights, rng.normal(size=(300, 1)) * slopes[0] + rng.normal(size=(300, 400)), starts)
    assert shared[0] < 0.1
    assert shared[1] > 0.7


def test_variances_of_crossed_clusters_add_less_what_both_contain():
    rng = np.random.default_rng(3)
    trials, blocks = 2 * rng.normal(size=(1, 40000)), 3 * rng.normal(size=(1, 40000))
    free = 10**6
    for share, variance in ((1.0, 9.0), (0.0, 13.0), (0.25, 12.0)):
        assert over_both(trials, blocks, np.array([share]), free).var() == pytest.approx(variance, rel=0.05)
    assert over_both(3 * trials, blocks, np.array([1.0]), free).var() == pytest.approx(
        36, rel=0.05
    )  # never below either


def test_repeated_variance_is_that_of_the_rate_without_its_noise():
    rng = np.random.default_rng(4)
    rate = 3 + np.sin(np.arange(2000) / 20)
    counts = rng.poisson(rate, (30, 2000)).astype(float)
    assert explainable_variance(counts) == pytest.approx(rate.var(), rel=0.1)
    assert r_squared_ceiling(counts) == pytest.approx(rate.var() / (rate.var() + rate.mean() / 30), abs=0.03)
    assert np.isnan(explainable_variance(counts[:1]))


def test_fano_factor_and_gain_are_those_put_in():
    rng = np.random.default_rng(5)
    rate = np.full((400, 500), 0.2)
    plain = variability(rng.poisson(rate))
    assert plain.fano_factor == pytest.approx(1, abs=0.02)
    assert plain.gain_sd < 0.06
    gain = rng.gamma(1 / 0.3**2, 0.3**2, (400, 1))
    assert variability(rng.poisson(rate * gain)).gain_sd == pytest.approx(0.3, abs=0.03)
    doubled = variability(2 * rng.poisson(rate))  # spikes in pairs
    assert doubled.fano_factor == pytest.approx(2, abs=0.04)


def test_intervals_hold_where_the_unit_answers_something_else_in_every_trial_alike():
    held = []
    for seed in range(30):
        rng = np.random.default_rng([6, seed])
        drive = presented(rng)
        other = np.exp(0.4 * wander((BINS,), 0.05, rng)[-int(drive.valid.sum()) :] - 0.08)
        counts = rng.poisson(predicted(drive, TRUTH) * other * WIDTH, (40, other.size)).astype(float)
        grid = HingeGrid.of(drive, n_thresholds=25, n_latencies=11)
        fit = forward_fit(grid, counts.sum(0), 40 * WIDTH)
        low, high = np.quantile(bootstrap_fits(grid, counts, WIDTH, fit, n_resamples=200, rng=rng), ENDS, axis=1)
        held.append((low <= TRUTH) & (high >= TRUTH))
    # over trials alone, 85 % of the thresholds and 63 % of the slopes were held
    assert np.mean(held, axis=0)[:2].min() >= 0.86
