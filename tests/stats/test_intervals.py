"""Many tests, shares and clusters: by hand, against SciPy, and by their laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal
from scipy.stats import binomtest, t

from vibrissa.stats import (
    RANGES,
    adjusted_p_values,
    jackknife_interval,
    share_interval,
    wilson_interval,
)


def test_adjusted_p_values_by_hand():
    # sorted p·m/rank: 0.01·4/1, 0.02·4/2, 0.03·4/3, 0.5·4/4, then the running minimum from the largest
    np.testing.assert_allclose(adjusted_p_values(np.array([0.02, 0.5, 0.01, 0.03])), [0.04, 0.5, 0.04, 0.04])


def test_tests_not_made_do_not_count():
    found = adjusted_p_values(np.array([0.02, np.nan, 0.5, 0.01, 0.03]))
    np.testing.assert_allclose(found, [0.04, np.nan, 0.5, 0.04, 0.04])
    assert np.isnan(adjusted_p_values(np.array([np.nan]))).all()
    with refusal("range", "p-values"):
        adjusted_p_values(np.array([0.01, np.inf]))


def test_false_discoveries_stay_at_their_share():
    rng = np.random.default_rng(1)
    false, found = 0.0, []
    for _ in range(400):
        p = np.concatenate([rng.uniform(size=80), rng.beta(0.05, 5, 20)])
        rejected = adjusted_p_values(p) <= 0.1
        false += rejected[:80].sum() / max(rejected.sum(), 1)
        found.append(rejected[80:].mean())
    assert false / 400 <= 0.1 * 80 / 100 + 3 * np.sqrt(0.08 * 0.92 / 400)
    assert np.mean(found) > 0.5


@settings(deadline=None, derandomize=True, max_examples=40)
@given(n=st.integers(1, 400), share=st.floats(0, 1), level=st.sampled_from([0.9, 0.95, 0.99]))
def test_wilson_interval_is_scipys(n, share, level):
    k = round(share * n)
    peer = binomtest(k, n).proportion_ci(level, method="wilson")
    np.testing.assert_allclose(wilson_interval(k, n, level=level), (peer.low, peer.high), atol=1e-12)


def test_wilson_interval_of_the_papers_units():
    np.testing.assert_allclose(wilson_interval(45, 170), (0.204, 0.336), atol=5e-4)
    np.testing.assert_allclose(wilson_interval(157, 344), (0.405, 0.509), atol=5e-4)


def test_jackknife_of_a_mean_of_equal_clusters_is_students_interval_of_their_means():
    rng = np.random.default_rng(4)
    values, clusters = rng.normal(size=60), np.repeat(np.arange(6), 10)
    peer = t(5, *norm_of(values.reshape(6, 10).mean(axis=1))).interval(0.95)
    np.testing.assert_allclose(jackknife_interval(values, clusters=clusters), peer)
    assert np.isnan(jackknife_interval(values, clusters=np.zeros(60))).all()


def norm_of(means):
    return means.mean(), means.std(ddof=1) / np.sqrt(means.size)


def test_jackknife_holds_the_truth_as_often_as_it_says():
    rng, clusters = np.random.default_rng(5), np.repeat(np.arange(6), 8)
    jackknife = []
    for _ in range(400):
        values = rng.normal(0, 1, 6)[clusters] + rng.normal(0, 0.3, 48)
        low, high = jackknife_interval(values, clusters=clusters)
        jackknife.append(low <= 0 <= high)
    assert abs(np.mean(jackknife) - 0.95) < 3 * np.sqrt(0.95 * 0.05 / 400)


def test_jackknife_of_a_correlation_is_students_interval_of_the_logarithm_that_fisher_takes():
    """Of one value in each cluster and the geometric mean of (1 + r)/(1 − r): z is a mean, its jackknife exact."""
    r = np.array([0.2, 0.7, 0.9, 0.97, 0.5])

    def middle(values):
        odds = np.exp(np.mean(np.log((1 + values) / (1 - values))))
        return (odds - 1) / (odds + 1)

    low, high = t(4, *norm_of(np.arctanh(r))).interval(0.95)
    found = jackknife_interval(r, middle, clusters=np.arange(5), scale="correlation")
    np.testing.assert_allclose(found, (np.tanh(low), np.tanh(high)))


@settings(deadline=None, derandomize=True, max_examples=60)
@given(
    values=st.lists(st.floats(0.01, 0.9999), min_size=4, max_size=12, unique=True),
    scale=st.sampled_from(["correlation", "share", "r2"]),
)
def test_no_interval_leaves_the_range_of_its_statistic(values, scale):
    low, high = jackknife_interval(np.array(values), clusters=np.arange(len(values)), scale=scale)
    assert RANGES[scale][0] <= low <= np.mean(values) * (1 + 1e-12)
    assert np.mean(values) * (1 - 1e-12) <= high <= RANGES[scale][1]


def test_at_an_end_of_the_range_no_interval_is_known():
    assert np.isnan(jackknife_interval(np.ones(6), clusters=np.arange(6), scale="correlation")).all()
    assert np.isnan(jackknife_interval(np.zeros(6), clusters=np.arange(6), scale="share")).all()


def test_on_a_scale_that_fits_the_interval_holds_the_truth_more_often():
    """Means of twelve correlations whose z is Gaussian: skewed, so that neither holds it in 95 %."""
    rng = np.random.default_rng(7)
    truth = np.tanh(rng.normal(1.5, 0.6, 400_000)).mean()
    held = {"plain": 0, "correlation": 0}
    for _ in range(1000):
        values = np.tanh(rng.normal(1.5, 0.6, 12))
        for scale in held:
            low, high = jackknife_interval(values, clusters=np.arange(12), scale=scale)
            held[scale] += low <= truth <= high
    assert held["plain"] + 20 < held["correlation"] < 960


@pytest.mark.parametrize(("truth", "alike", "clusters", "size"), [(0.45, 0.05, 15, 23), (0.97, 0.02, 13, 12)])
def test_a_share_by_cluster_holds_the_truth_as_often_as_it_says(truth, alike, clusters, size):
    """Beta-binomial cases, alike within a cluster; without the clusters Wilson's interval is too narrow."""
    rng, label = np.random.default_rng(8), np.repeat(np.arange(clusters), size)
    shape, held, naive = 1 / alike - 1, 0, 0
    for _ in range(1000):
        own = rng.beta(truth * shape, (1 - truth) * shape, clusters)
        passed = (rng.uniform(size=label.size) < own[label]).astype(float)
        low, high = share_interval(passed, clusters=label)
        held += low <= truth <= high
        low, high = wilson_interval(passed.sum(), passed.size)
        naive += low <= truth <= high
    assert abs(held / 1000 - 0.95) < 3 * np.sqrt(0.95 * 0.05 / 1000)
    assert naive < held


def test_a_share_of_independent_cases_has_wilsons_interval_at_least():
    passed = np.tile([1.0, 0, 0, 1], 5)  # each cluster alike: less scatter than chance makes
    assert share_interval(passed, clusters=np.repeat(np.arange(5), 4)) == wilson_interval(10, 20)
    assert share_interval(np.ones(12), clusters=np.repeat(np.arange(6), 2)) == wilson_interval(12, 12)
    assert share_interval(np.ones(12), clusters=np.repeat(np.arange(6), 2))[0] == pytest.approx(0.757, abs=1e-3)
    assert np.isnan(share_interval(np.full(3, np.nan), clusters=np.arange(3))).all()


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: adjusted_p_values(np.array([1.2])), ("range", "p-values")),
        (lambda: wilson_interval(3, 2), ("too-few", "share")),
        (lambda: wilson_interval(0, 0), ("too-few", "share")),
        (lambda: wilson_interval(1, 2, level=1), ("range", "level")),
        (lambda: jackknife_interval(np.arange(3.0), clusters=np.arange(2)), ("shape", "clusters")),
        (lambda: share_interval(np.ones(3), clusters=np.arange(2)), ("shape", "clusters")),
    ],
)
def test_impossible_statistics_are_refused(call, rule):
    with refusal(*rule):
        call()
