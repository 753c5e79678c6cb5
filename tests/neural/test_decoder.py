"""Decoders: likelihoods by hand, what each code is blind to, trials that never teach and are asked at once."""

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import multinomial, poisson

from vibrissa.errors import InputError
from vibrissa.neural import decoder


def normal_share(distance):
    """Right answers of the best decoder of two normal distributions so many standard deviations apart."""
    return ndtr(distance / 2)


def one_hot(label):
    return (label == np.arange(label.max() + 1)[:, None]).astype(float)


def test_expected_counts_worked_by_hand():
    counts, label = np.array([4.0, 2.0, 9.0, 0.0])[:, None, None], np.array([0, 0, 1, 1])
    common = 15.5 / 4
    found = decoder.mean_counts(counts, one_hot(label))
    np.testing.assert_allclose(found.ravel(), [(6 + common) / 3, (9 + common) / 3])
    assert np.all(decoder.mean_counts(0 * counts, one_hot(label)) > 0)


def test_scores_are_poisson_and_multinomial_log_likelihoods():
    rng = np.random.default_rng(1)
    counts, label = rng.poisson(3.0, (12, 2, 4)).astype(float), np.arange(12) % 3
    expected = decoder.mean_counts(counts, one_hot(label))
    found = decoder.poisson_scores(counts, one_hot(label), counts)
    truth = np.array([[poisson.logpmf(n, of).sum() for of in expected] for n in counts])
    np.testing.assert_allclose(np.diff(found, axis=1), np.diff(truth, axis=1), rtol=1e-9)
    found = decoder.pattern_scores(counts, one_hot(label), counts)
    total = np.array([counts[label == k].sum(0) + 0.5 / 4 for k in range(3)])
    share = total / total.sum(-1, keepdims=True)
    share = (share + share.mean(0) / 4) / (1 + 1 / 4)  # one trial beside four
    truth = [[sum(multinomial.logpmf(n[u], n[u].sum(), of[u]) for u in range(2)) for of in share] for n in counts]
    np.testing.assert_allclose(np.diff(found, axis=1), np.diff(np.array(truth), axis=1), rtol=1e-9)


def test_pattern_is_blind_to_the_rate_of_a_texture():
    counts, label = np.random.default_rng(2).poisson(20.0, (30, 3, 6)).astype(float), np.arange(30) % 2
    louder = counts * np.where(label == 1, 1000.0, 1.0)[:, None, None]
    plain = decoder.pattern_scores(1000 * counts, one_hot(label), counts)
    np.testing.assert_allclose(decoder.pattern_scores(louder, one_hot(label), counts), plain, rtol=1e-4)


def test_discriminant_of_normal_values_reaches_the_best_there_is():
    rng, label = np.random.default_rng(3), np.arange(4000) % 2
    covariance = np.array([[2.0, 1.5], [1.5, 2.0]])
    apart = np.array([1.0, -0.5])
    values = rng.multivariate_normal([0, 0], covariance, label.size) + np.outer(label, apart)
    scores = decoder.gaussian_scores(values[:2000, None], one_hot(label[:2000]), values[2000:, None])
    best = np.sqrt(apart @ np.linalg.solve(covariance, apart))  # Mahalanobis
    right = np.mean(scores.argmax(1) == label[2000:])
    assert right == pytest.approx(normal_share(best), abs=0.025)
    assert normal_share(np.linalg.norm(apart) / np.sqrt(2)) < right - 0.05  # the diagonal alone is worse


def test_discriminant_stands_more_values_than_trials():
    values, label = np.random.default_rng(4).normal(size=(20, 50, 1)), np.arange(20) % 2
    values[label == 1, :5] += 3
    scores = decoder.gaussian_scores(values[:10], one_hot(label[:10]), values[10:])
    assert np.mean(scores.argmax(1) == label[10:]) > 0.8
    constant = decoder.gaussian_scores(np.ones((20, 3, 1)), one_hot(label), np.ones((20, 3, 1)))
    np.testing.assert_allclose(constant[:, 0], constant[:, 1], atol=1e-9)


def test_variance_of_the_rate_is_free_of_poisson_noise():
    rate = np.array([0.2, 0.4, 1.6, 3.0, 0.1])
    counts = np.random.default_rng(5).poisson(rate, (200_000, 1, 5))
    assert decoder.rate_variance(counts).mean() == pytest.approx(rate.var(ddof=1), rel=0.02)
    assert decoder.mean_rate(counts).mean() == pytest.approx(rate.sum(), rel=0.01)


def test_folds_spread_every_texture():
    label = np.repeat([0, 1, 2], [10, 13, 5])
    fold = decoder.stratified_folds(label, 5, rng=np.random.default_rng(6))
    for k in range(3):
        per_fold = np.bincount(fold[label == k], minlength=5)
        assert np.ptp(per_fold) <= 1
    with pytest.raises(InputError, match="no more than the trials of any texture"):
        decoder.stratified_folds(label, 6, rng=np.random.default_rng(6))


def test_no_trial_is_read_by_a_decoder_that_has_seen_it():
    label, asked = np.arange(12) % 2, []

    def spy(seen, weights, unseen):
        taught = seen[weights.sum(0) > 0].ravel()
        assert not set(taught) & set(unseen.ravel())
        assert set(taught) | set(unseen.ravel()) == set(range(12))
        asked.extend(unseen.ravel())
        return np.zeros((len(unseen), 2))

    folds = np.array([decoder.stratified_folds(label, 3, rng=np.random.default_rng(seed)) for seed in (0, 1)])
    decoder.held_out_scores(np.arange(12.0)[:, None, None], label, folds, spy)
    assert sorted(asked) == sorted([*range(12), *range(12)])
