"""Predicted and measured envelopes: a known lag is found, and what of their correlation is chance."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.mechanics.across.comparison import compare_envelopes, pearson_p, predicted_envelopes
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.signals.correlation import best_correlation
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.04, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.25, base_angle=1.1)
SCAN = Scan(speed=0.1, damping=0.11)
RATE = 1000.0
TIME = 0.1 + np.arange(1500) / RATE
LAG = 50


@pytest.fixture(scope="module")
def pool():
    """Envelopes of both modes over 240 gratings, (240, 2, T)."""
    rng = np.random.default_rng(11)
    textures = [random_grating(0.17, rng=rng) for _ in range(240)]
    return predicted_envelopes(WHISKER, POSTURE, SCAN, textures, TIME)


def test_measurement_that_comes_late_has_its_lag_found_and_correlates_wholly(pool):
    late = 23
    found, predicted = 3 * pool[0, :, :-late], pool[0, :, late:]
    told = compare_envelopes(found, predicted, RATE)
    np.testing.assert_allclose(told.best_lag, late / RATE)
    np.testing.assert_allclose(told.correlation, 1, atol=1e-9)
    assert np.all(told.unlagged_correlation < 0.9)


def test_pearson_p_is_that_of_scipy():
    from scipy.stats import pearsonr

    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((2, 60))
    reference = pearsonr(a, b)
    assert pearson_p(np.array([reference.statistic]), np.array([60]))[0] == pytest.approx(reference.pvalue, rel=1e-9)


def test_batch_predicts_what_one_texture_alone_does(pool):
    first = random_grating(0.17, rng=np.random.default_rng(11))
    alone = analytic_envelope(predict(WHISKER, POSTURE, first, SCAN).mode_displacement(TIME))[0][:2]
    np.testing.assert_allclose(pool[0], alone, rtol=1e-6, atol=1e-9)


def test_of_unrelated_textures_pearson_finds_most_significant_and_the_pseudo_textures_one_in_twenty(pool):
    """1000 null cases: measurement of one grating, prediction of another, 19 others for chance."""
    rng = np.random.default_rng(3)
    pearson, pseudo, rho = np.empty(1000), np.empty(1000), np.empty(1000)
    for case in range(1000):
        found, *others = rng.choice(len(pool), 21, replace=False)
        lag, each = best_correlation(pool[found, 0], pool[others, 0], LAG)
        rho[case], pseudo[case] = each[0], (1 + (each[1:] >= each[0]).sum()) / 20
        pearson[case] = pearson_p(each[:1], np.array([len(TIME) - abs(lag[0])]))[0]
    assert 0.03 < np.mean(pseudo <= 0.05) < 0.07  # 0.05 ± 3 standard errors
    assert np.mean(pearson < 0.05) > 0.8
    assert rho.mean() > 0.05


def test_true_texture_is_told_from_others_through_noise(pool):
    rng = np.random.default_rng(4)
    clean = predict(WHISKER, POSTURE, random_grating(0.17, rng=np.random.default_rng(11)), SCAN)
    motion = clean.mode_displacement(TIME)[:2]
    noisy = motion + motion.std(axis=1, keepdims=True) * rng.standard_normal(motion.shape)
    told = compare_envelopes(analytic_envelope(noisy)[0], pool[0], RATE, pool[1:100])
    assert np.all(told.pseudo_p == 0.01)
    assert np.all(told.correlation > told.chance_mean + 2 * told.chance_sd)


def test_constant_envelope_is_refused():
    with refusal("too-few", "signals"):
        compare_envelopes(np.ones((1, 100)), np.ones((1, 100)), 1000.0)
