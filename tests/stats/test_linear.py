"""Linear models: against statsmodels, in closed form, and how often chance alone is taken for an effect."""

import numpy as np
import pandas
import pytest
import statsmodels.formula.api as formula
from refusals import refusal
from scipy.stats import f_oneway
from statsmodels.stats.anova import anova_lm

from vibrissa.stats import clustered_model, linear_model


def sweeps(seed, n=120):
    rng = np.random.default_rng(seed)
    whisker = np.array(["β", "C1", "C2"])[rng.integers(0, 3, n)]
    speed, contact = rng.choice([0.1, 0.15, 0.2], n), rng.uniform(0.1, 0.5, n)
    y = 80 + 200 * contact + 10 * (whisker == "C2") + rng.normal(0, 8, n)
    return y, {"speed": speed, "contact": contact, "whisker": whisker}


def test_type_ii_tests_are_those_of_statsmodels():
    y, terms = sweeps(1)
    peer = formula.ols("y ~ speed + contact + C(whisker)", pandas.DataFrame({"y": y, **terms})).fit()
    table = anova_lm(peer, typ=2).loc[["speed", "contact", "C(whisker)"]]
    found = linear_model(y, terms)
    np.testing.assert_allclose([one.f for one in found], table["F"], rtol=1e-9)
    np.testing.assert_allclose([one.p for one in found], table["PR(>F)"], rtol=1e-7)
    assert [one.df for one in found] == [1, 1, 2]
    for one, name in zip(found[:2], ("speed", "contact"), strict=True):
        np.testing.assert_allclose(one.slope, peer.params[name], rtol=1e-9)
        np.testing.assert_allclose((one.low, one.high), peer.conf_int().loc[name], rtol=1e-9)


def test_one_term_of_names_is_the_anova():
    y, terms = sweeps(2)
    (found,) = linear_model(y, {"whisker": terms["whisker"]})
    peer = f_oneway(*(y[terms["whisker"] == name] for name in ("β", "C1", "C2")))
    assert (found.f, found.p) == (pytest.approx(peer.statistic), pytest.approx(peer.pvalue))


def test_jackknife_is_the_one_written_out():
    y, terms = sweeps(3, 60)
    clusters = np.repeat(np.arange(6), 10)
    found = clustered_model(y, {"contact": terms["contact"]}, clusters)[0]
    slopes = [np.polyfit(terms["contact"][clusters != g], y[clusters != g], 1)[0] for g in range(6)]
    whole = np.polyfit(terms["contact"], y, 1)[0]
    variance = 5 / 6 * np.sum((slopes - whole) ** 2)
    assert found.slope == pytest.approx(whole)
    assert found.f == pytest.approx(whole**2 / variance)
    assert found.high - found.slope == pytest.approx(2.5705818 * np.sqrt(variance))  # t of 5 degrees of freedom


def test_jackknife_is_that_of_statsmodels():
    y, terms = sweeps(8)
    clusters = np.arange(120) % 13
    peer = formula.ols("y ~ speed + contact + C(whisker)", pandas.DataFrame({"y": y, **terms})).fit(
        cov_type="cluster-crv3", cov_kwds={"groups": clusters}, use_t=True
    )
    speed, contact, whisker = clustered_model(y, terms, clusters)
    for one, name in ((speed, "speed"), (contact, "contact")):
        np.testing.assert_allclose((one.low, one.high), peer.conf_int().loc[name], rtol=1e-10)
        assert one.p == pytest.approx(peer.pvalues[name], rel=1e-10)
    theirs = float(peer.f_test("C(whisker)[T.C2] = 0, C(whisker)[T.β] = 0").fvalue)
    assert whisker.f == pytest.approx(theirs * 11 / 12, rel=1e-10)  # Hotelling's, of two columns and 12 degrees


def test_rows_not_measured_are_left_out_and_counted():
    y, terms = sweeps(4)
    y[:7] = np.nan
    terms["contact"][7:9] = np.nan
    found = linear_model(y, terms)
    cut = linear_model(y[9:], {name: values[9:] for name, values in terms.items()})
    assert found[0].n == 111
    np.testing.assert_allclose([one.f for one in found], [one.f for one in cut], rtol=1e-10)


def test_what_stands_with_one_cluster_is_not_told():
    y, terms = sweeps(5)
    by_whisker = clustered_model(y, terms, terms["whisker"])
    assert [np.isfinite(one.p) for one in by_whisker] == [True, True, False]


def rejected(n_repeats, test, *, whisker_sd, seed):
    rng, p = np.random.default_rng(seed), []
    whisker = np.repeat(np.arange(13), 12)
    for _ in range(n_repeats):
        angle = rng.normal(1.2, 0.15, 13)[whisker] + rng.normal(0, 0.02, whisker.size)
        y = rng.normal(0, whisker_sd, 13)[whisker] + rng.normal(size=whisker.size)
        p.append(test(y, {"angle": angle}, whisker))
    return np.mean(np.array(p) < 0.05)


def test_pooled_sweeps_take_chance_for_an_effect_and_clusters_do_not():
    def pooled(y, terms, _):
        return linear_model(y, terms)[0].p

    def clustered(y, terms, whisker):
        return clustered_model(y, terms, whisker)[0].p

    assert rejected(400, pooled, whisker_sd=1, seed=6) > 0.4
    assert rejected(400, clustered, whisker_sd=1, seed=6) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / 400)
    assert abs(rejected(400, pooled, whisker_sd=0, seed=7) - 0.05) < 3 * np.sqrt(0.05 * 0.95 / 400)


@pytest.mark.parametrize(
    ("terms", "rule"),
    [
        ({"a": np.arange(4.0)}, ("shape", "term a")),
        ({"a": np.ones(6)}, ("too-few", "terms")),
        ({"a": np.full(6, "x")}, ("too-few", "terms")),
        ({"a": np.arange(6.0), "b": 2 * np.arange(6.0)}, ("range", "terms")),
        ({"a": np.array([1, 2, *[np.nan] * 4])}, ("too-few", "response")),
    ],
)
def test_impossible_models_are_refused(terms, rule):
    with refusal(*rule):
        linear_model(np.arange(6.0) ** 2, terms)


def test_clusters_must_be_as_many():
    with refusal("shape", "clusters"):
        clustered_model(np.arange(6.0), {"a": np.arange(6.0) ** 2}, np.arange(5))
