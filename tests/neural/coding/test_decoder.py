"""Decoders: likelihoods by hand, what each code is blind to, trials that never teach and are asked at once."""

import numpy as np
import pytest
from refusals import refusal
from scipy.special import ndtr
from scipy.stats import multinomial, poisson

from vibrissa.neural.coding import decoder


def normal_share(distance):
    """Right answers of the best decoder of two normal distributions so many standard deviations apart."""
    return ndtr(distance / 2)


def one_hot(label):
    return (label == np.arange(label.max() + 1)[:, None]).astype(float)


def test_rates_are_drawn_to_their_mean_as_far_as_chance_spreads_them_worked_by_hand():
    rate, n = np.array([[[1.0, 5.0]], [[3.0, 3.0]]]), np.array([[4.0], [4.0]])
    # means 2 and 4, spread (1 + 1 + 1 + 1)/6 less noise 1/4: a prior of 2.4 trials, and half a spike in 16 bins
    common = np.array([2.0, 4.0]) + 0.5 / 16
    a = 1 / (4 / common.sum() - 1 / 4)
    found = decoder.shrunk_rates(rate, n)
    np.testing.assert_allclose(found[0, 0], (4 * rate[0, 0] + a * common) / (4 + a))
    assert np.all(decoder.shrunk_rates(0 * rate, n) > 0)


@pytest.mark.parametrize("trials", [0.5, 8.0, 80.0])
def test_the_weight_of_the_prior_is_found(trials):
    rng, n = np.random.default_rng(7), 20.0
    rate = rng.gamma(trials * 0.3, 1 / trials, (3, 1, 4000)).clip(1e-9)  # mean 0.3, variance 0.3/trials
    seen = rng.poisson(n * rate) / n
    found = decoder.shrunk_rates(seen, np.full((3, 1), n))
    best = (n * seen + trials * 0.3) / (n + trials)
    assert np.mean((found - rate) ** 2) < np.mean((seen - rate) ** 2)
    # the mean over three textures is known to a third of the noise, that of the best to none
    assert np.mean((found - rate) ** 2) < np.mean((best - rate) ** 2) + 1.5 * 0.3 * (1 / n + 1 / trials) / 3


def test_scores_are_poisson_and_multinomial_log_likelihoods():
    rng = np.random.default_rng(1)
    counts, label = rng.poisson(3.0, (12, 2, 4)).astype(float), np.arange(12) % 3
    expected = decoder.mean_counts(counts, one_hot(label))
    found = decoder.poisson_scores(counts, one_hot(label), counts)
    truth = np.array([[poisson.logpmf(n, of).sum() for of in expected] for n in counts])
    np.testing.assert_allclose(np.diff(found, axis=1), np.diff(truth, axis=1), rtol=1e-9)
    found = decoder.pattern_scores(counts, one_hot(label), counts)
    total = np.array([counts[label == k].sum(0) + 0.5 / 4 for k in range(3)])
    usual = total.sum(-1).mean(0) / 4
    rates = total / total.sum(-1, keepdims=True) * usual[:, None]
    share = decoder.shrunk_rates(rates, total.sum(-1) / usual)
    share /= share.sum(-1, keepdims=True)
    truth = [[sum(multinomial.logpmf(n[u], n[u].sum(), of[u]) for u in range(2)) for of in share] for n in counts]
    np.testing.assert_allclose(np.diff(found, axis=1), np.diff(np.array(truth), axis=1), rtol=1e-9)


def test_pattern_is_blind_to_the_rate_of_a_texture():
    counts, label = np.random.default_rng(2).poisson(20.0, (30, 3, 6)).astype(float), np.arange(30) % 2
    louder = counts * np.where(label == 1, 1000.0, 1.0)[:, None, None]
    plain = decoder.pattern_scores(1000 * counts, one_hot(label), counts)
    # a louder texture is known better, and so drawn less to the mean: that is all
    np.testing.assert_allclose(decoder.pattern_scores(louder, one_hot(label), counts), plain, rtol=5e-3)


def test_units_that_tell_nothing_do_not_drown_those_that_do():
    rng, label = np.random.default_rng(8), np.arange(60) % 3
    informative, others = (
        rng.gamma(4.0, 0.05, (3, 8, 20)),
        np.broadcast_to(rng.gamma(4.0, 0.05, (100, 20)), (3, 100, 20)),
    )
    shares = []
    for rates in (informative, np.concatenate([informative, others], axis=1)):
        counts = rng.poisson(rates[np.tile(label, 10)]).astype(float)
        scores = decoder.poisson_scores(counts[:60], one_hot(label), counts[60:])
        shares.append(np.mean(scores.argmax(1) == np.tile(label, 9)))
    assert shares[0] > 0.7
    assert shares[1] > shares[0] - 0.12


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


@pytest.mark.parametrize(("trials", "values"), [(60, 4), (20, 50)])
def test_discriminant_is_the_one_written_out(trials, values):
    rng, label = np.random.default_rng(9), np.arange(trials) % 2
    x = rng.normal(size=(trials, values)) @ rng.normal(size=(values, values))
    scaled = x / x.std(0)
    means = np.array([scaled[label == k].mean(0) for k in (0, 1)])
    centred = scaled - means[label]
    sample, each = centred.T @ centred / trials, np.einsum("ti,tj->tij", centred, centred)
    target = np.trace(sample) / values * np.eye(values)
    # Ledoit and Wolf: the share of the target is the error of S over its distance from the target
    share = min(1, np.sum((each - sample) ** 2) / trials**2 / np.sum((sample - target) ** 2))
    axes = np.linalg.solve((1 - share) * sample + (share + 1e-9) * target, means.T)
    truth = scaled @ axes - np.sum(means.T * axes, 0) / 2
    found = decoder.gaussian_scores(x[:, None], one_hot(label), x[:, None])
    np.testing.assert_allclose(found, truth, rtol=1e-8, atol=1e-8)


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
    with refusal("range", "folds"):
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
