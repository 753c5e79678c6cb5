"""Many tests, shares and clusters: by hand, against SciPy, and by their laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest, t

from vibrissa.errors import InputError
from vibrissa.stats import adjusted_p_values, bootstrap_interval, jackknife_interval, wilson_interval


def test_adjusted_p_values_by_hand():
    # sorted p·m/rank: 0.01·4/1, 0.02·4/2, 0.03·4/3, 0.5·4/4, then the running minimum from the largest
    np.testing.assert_allclose(adjusted_p_values(np.array([0.02, 0.5, 0.01, 0.03])), [0.04, 0.5, 0.04, 0.04])


def test_tests_not_made_do_not_count():
    found = adjusted_p_values(np.array([0.02, np.nan, 0.5, 0.01, 0.03]))
    np.testing.assert_allclose(found, [0.04, np.nan, 0.5, 0.04, 0.04])
    assert np.isnan(adjusted_p_values(np.array([np.nan]))).all()


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


def test_bootstrap_holds_the_mean_as_often_as_it_says():
    rng = np.random.default_rng(2)
    ends = [bootstrap_interval(rng.normal(3, 1, 40), n_resamples=400, rng=rng) for _ in range(300)]
    covered = np.mean([low <= 3 <= high for low, high in ends])
    assert 0.88 <= covered <= 0.98


def test_units_of_one_session_are_one_draw():
    rng = np.random.default_rng(3)
    sessions = np.repeat(np.arange(15), 20)
    covered, naive = [], []
    for _ in range(120):
        values = np.repeat(rng.normal(0, 1, 15), 20) + rng.normal(0, 0.3, 300)
        for ends, clusters in ((covered, sessions), (naive, None)):
            low, high = bootstrap_interval(values, clusters=clusters, n_resamples=200, rng=rng)
            ends.append(low <= 0 <= high)
    assert np.mean(covered) > 0.82
    assert np.mean(naive) < 0.5  # what forgetting the sessions costs


def test_jackknife_of_a_mean_of_equal_clusters_is_students_interval_of_their_means():
    rng = np.random.default_rng(4)
    values, clusters = rng.normal(size=60), np.repeat(np.arange(6), 10)
    peer = t(5, *norm_of(values.reshape(6, 10).mean(axis=1))).interval(0.95)
    np.testing.assert_allclose(jackknife_interval(values, clusters=clusters), peer)
    assert np.isnan(jackknife_interval(values, clusters=np.zeros(60))).all()


def norm_of(means):
    return means.mean(), means.std(ddof=1) / np.sqrt(means.size)


def test_jackknife_holds_the_truth_as_often_as_it_says_and_percentiles_less_often():
    rng, clusters = np.random.default_rng(5), np.repeat(np.arange(6), 8)
    jackknife, percentiles = [], []
    for _ in range(400):
        values = rng.normal(0, 1, 6)[clusters] + rng.normal(0, 0.3, 48)
        low, high = jackknife_interval(values, clusters=clusters)
        jackknife.append(low <= 0 <= high)
        low, high = bootstrap_interval(values, clusters=clusters, n_resamples=200, rng=rng)
        percentiles.append(low <= 0 <= high)
    assert abs(np.mean(jackknife) - 0.95) < 3 * np.sqrt(0.95 * 0.05 / 400)
    assert np.mean(percentiles) < np.mean(jackknife)


def test_one_session_has_no_spread():
    ends = bootstrap_interval(np.arange(5.0), clusters=np.zeros(5), rng=np.random.default_rng(0))
    assert np.isnan(ends).all()


def test_interval_repeats_with_the_seed_and_leaves_out_what_was_not_measured():
    values = np.array([1.0, 2, 4, 8, 9])
    one = bootstrap_interval(values, np.median, rng=np.random.default_rng(5))
    assert one == bootstrap_interval(np.append(values, np.nan), np.median, rng=np.random.default_rng(5))
    assert 1 <= one[0] <= 4 <= one[1] <= 9


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: adjusted_p_values(np.array([1.2])), "p-values"),
        (lambda: wilson_interval(3, 2), "share"),
        (lambda: wilson_interval(0, 0), "share"),
        (lambda: wilson_interval(1, 2, level=1), "level"),
        (lambda: jackknife_interval(np.arange(3.0), clusters=np.arange(2)), "clusters"),
        (lambda: bootstrap_interval(np.arange(3.0), clusters=np.arange(2), rng=np.random.default_rng(0)), "clusters"),
    ],
)
def test_impossible_statistics_are_refused(call, rule):
    with pytest.raises(InputError, match=rule):
        call()
