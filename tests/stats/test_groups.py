"""The paper's tests between groups: by hand, and what the gate lets pass."""

import numpy as np
import pytest
from scipy.stats import chi2, f, norm

from vibrissa.errors import InputError
from vibrissa.stats import compare_groups, gated_comparison, normality


def test_anova_and_kruskal_by_hand():
    values = np.array([1.0, 2, 3, 4, 5, 6, 8, 9, 13])
    found = compare_groups(values, np.repeat(["a", "b", "c"], 3))
    # means 2, 5, 10 about 17/3; between 3·(121 + 4 + 169)/9 = 98, within 2 + 2 + 14 = 18: F = (98/2)/(18/6)
    assert found.anova_f == pytest.approx(49 / 3)
    assert found.anova_p == pytest.approx(f.sf(49 / 3, 2, 6))
    # ranks 6, 15, 24: H = 12/90 · (36 + 225 + 576)/3 − 30
    assert found.kruskal_h == pytest.approx(7.2)
    assert found.kruskal_p == pytest.approx(chi2.sf(7.2, 2))
    assert [(pair.first, pair.second, pair.difference) for pair in found.pairs] == [
        ("a", "b", -3),
        ("a", "c", -8),
        ("b", "c", -5),
    ]
    assert np.isnan(found.ks_p)


def test_kolmogorov_smirnov_of_two_groups_by_hand():
    found = compare_groups([1.0, 2, 3, 2.5, 4, 5], ["a"] * 3 + ["b"] * 3)
    assert found.ks_d == pytest.approx(2 / 3)  # at 2, where all but one of a and none of b have come


def test_tukey_of_two_groups_is_the_t_test():
    rng = np.random.default_rng(1)
    found = compare_groups(rng.normal(size=40), np.tile(["a", "b"], 20))
    assert found.pairs[0].p == pytest.approx(found.anova_p, abs=1e-6)


def test_values_not_measured_are_left_out():
    values, groups = np.array([1.0, 2, 4, 3, 5, 7]), np.repeat(["a", "b"], 3)
    with_gap = compare_groups(np.append(values, np.nan), np.append(groups, "c"))
    assert with_gap == compare_groups(values, groups)


def test_the_gate_on_many_values_never_closes():
    rng = np.random.default_rng(2)
    p = [normality(rng.normal(size=60))[1] for _ in range(400)]
    assert np.min(p) > 0.05  # a test of level 5 % would reject 20 of 400
    name, p_small = normality(rng.exponential(size=25))
    assert name == "Shapiro–Wilk"
    assert p_small < 0.05


def test_the_gate_chooses_the_test():
    normal = norm.ppf((np.arange(50) + 0.5) / 50)
    groups = np.tile(["a", "b"], 25)
    for values, name in ((normal, "ANOVA"), (np.exp(normal), "Kruskal–Wallis")):
        both = compare_groups(values, groups)
        wanted = both.anova_p if name == "ANOVA" else both.kruskal_p
        assert gated_comparison(values, groups) == (name, pytest.approx(wanted))


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: normality([1.0, 1, 1]), "values"),
        (lambda: compare_groups([1.0, 2], ["a"]), "as many"),
        (lambda: compare_groups([1.0, 2, 3], ["a", "a", "b"]), "at least two"),
        (lambda: gated_comparison([1.0, 2, 3], ["a", "a", "a"]), "at least two"),
    ],
)
def test_impossible_comparisons_are_refused(call, rule):
    with pytest.raises(InputError, match=rule):
        call()
