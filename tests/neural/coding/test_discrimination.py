"""Which texture was it: each code finds what was put in for it, and says when it cannot tell."""

import numpy as np
import pytest
from refusals import refusal
from scipy.stats import poisson, skellam

from vibrissa.neural.coding.decoder import CODES
from vibrissa.neural.coding.discrimination import (
    CANNOT,
    TELLS,
    Discrimination,
    _accuracy_interval,
    accuracy_by_units,
    discriminate,
)
from vibrissa.neural.coupling.response import trial_counts
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.stats import wilson_interval

QUICK = {"n_permutations": 99, "n_partitions": 1}


def presented(rng, n_textures, n_each):
    label = np.repeat(np.arange(n_textures), n_each)
    rng.shuffle(label)
    return label, [f"texture {k}" for k in label]


def drawn(rng, expected, label):
    """Poisson counts (T, U, B) of expectations (K, U, B)."""
    return rng.poisson(np.asarray(expected)[label]).astype(float)


# One unit of three mean rates: the best decoder's share of right answers and the areas are sums over Poisson counts

RATES = np.array([4.0, 7.0, 11.0])
N = np.arange(80)
BEST = poisson.pmf(N[:, None], RATES).max(1).sum() / 3
AREA = np.sum(poisson.pmf(N, 7) * (poisson.cdf(N - 1, 4) + poisson.pmf(N, 4) / 2))


def test_intervals_hold_the_best_decoder_of_poisson_counts():
    held, shares, areas = np.zeros(2), [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        label, names = presented(rng, 3, 40)
        counts = drawn(rng, np.repeat(RATES[:, None, None] / 5, 5, axis=2), label)
        found = discriminate(counts, names, Discrimination(codes=("mean rate",), n_permutations=19, n_partitions=1))
        shares.append(found.accuracy.item())
        areas.append(found.auc[0, 0].item())
        held[0] += found.accuracy_low.item() <= BEST <= found.accuracy_high.item()
        held[1] += found.auc_low[0, 0].item() <= AREA <= found.auc_high[0, 0].item()
    assert np.mean(shares) == pytest.approx(BEST, abs=0.015)
    assert np.mean(areas) == pytest.approx(AREA, abs=0.015)
    assert np.all(held >= 53)  # 95 % of 60, less two and a half standard deviations


# Rates that differ in one respect alone

FLAT = np.full((1, 12), 1.5)
STEPS = np.tile([0.5, 2.5], 6)[None]


def test_when_the_rate_is_high_is_found_by_the_time_course_alone():
    rng = np.random.default_rng(1)
    label, names = presented(rng, 2, 150)
    found = discriminate(drawn(rng, [STEPS, STEPS[:, ::-1]], label), names, Discrimination(n_partitions=1, level=0.01))
    verdict = dict(zip(found.code.values, found.code_verdict.values, strict=True))
    assert verdict == {"mean rate": CANNOT, "rate variance": CANNOT, "time course": TELLS, "pattern": TELLS}
    best = skellam.sf(0, 15, 3) + skellam.pmf(0, 15, 3) / 2  # more spikes in the bins that are high for this one
    for code in ("time course", "pattern"):
        assert found.accuracy.sel(code=code) == pytest.approx(best, abs=0.02)
        assert found.accuracy_gain_low.sel(code=code) > 0.3
    assert np.isnan(found.accuracy_gain.sel(code="mean rate"))


def test_how_much_the_rate_changes_is_found_by_its_variance_alone():
    rng = np.random.default_rng(2)
    label, names = presented(rng, 2, 100)
    shift = rng.integers(2, size=label.size)  # the steps begin high or low, at random: no time course
    steps = np.where(shift[:, None, None] == 1, STEPS, STEPS[:, ::-1])
    counts = rng.poisson(np.where(label[:, None, None] == 1, steps, FLAT)).astype(float)
    found = discriminate(counts, names, Discrimination(**QUICK))
    verdict = dict(zip(found.code.values, found.code_verdict.values, strict=True))
    assert verdict == {"mean rate": CANNOT, "rate variance": TELLS, "time course": CANNOT, "pattern": CANNOT}


def test_how_many_spikes_is_found_by_the_rate_and_not_by_the_pattern():
    rng = np.random.default_rng(3)
    label, names = presented(rng, 2, 100)
    found = discriminate(drawn(rng, [FLAT, 1.5 * FLAT], label), names, Discrimination(**QUICK))
    verdict = dict(zip(found.code.values, found.code_verdict.values, strict=True))
    assert verdict["mean rate"] == TELLS
    assert verdict["time course"] == TELLS
    assert verdict["pattern"] == CANNOT


def test_at_chance_it_cannot_tell_and_says_so_as_often_as_promised():
    p_values, told, shares = [], 0, []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        names = presented(rng, 3, 10)[1]
        how = Discrimination(codes=("mean rate", "time course"), n_permutations=39, n_partitions=1)
        found = discriminate(rng.poisson(0.8, (30, 3, 6)).astype(float), names, how)
        p_values.append(found.code_p_value.values)
        shares.append(found.chance_accuracy.values)
        told += np.any(found.code_verdict == TELLS).item()
    assert told <= 7  # 5 % of 60, and two and a half standard deviations
    np.testing.assert_allclose(np.mean(shares), 1 / 3, atol=0.02)
    assert 0.4 < np.mean(p_values) < 0.62  # even, or a little cautious: ties count against


@pytest.mark.parametrize("each", [(7, 7, 7, 7, 7, 7), (6, 7, 8, 9, 10, 7)])
@pytest.mark.parametrize("code", CODES)
def test_silent_trials_are_read_at_chance_where_folds_differ_in_size(each, code):
    label = np.repeat(np.arange(6), each)
    counts = np.where(label[:, None, None] == 5, np.random.default_rng(0).poisson(0.4, (label.size, 1, 30)), 0.0)
    how = Discrimination(codes=(code,), n_partitions=3, n_permutations=19)
    found = discriminate(counts, [f"texture {k}" for k in label], how)
    right = np.diag(found.confusion.values[0])
    assert right[:5].mean() == pytest.approx(0.2)  # of five textures without a spike


def test_tables_agree_with_the_scores():
    rng = np.random.default_rng(4)
    label, names = presented(rng, 3, 20)
    found = discriminate(drawn(rng, rng.uniform(0, 2, (3, 4, 10)), label), names, Discrimination(**QUICK))
    np.testing.assert_allclose(found.confusion.sum("answered"), 1)
    diagonal = np.diagonal(found.confusion.values, axis1=1, axis2=2).mean(1)
    np.testing.assert_allclose(diagonal, found.accuracy)
    answers = found.held_out_score.argmax("presented").values
    np.testing.assert_allclose((answers == label).mean(1), found.accuracy)
    assert found.contrast.values.tolist() == ["texture 0 | texture 1", "texture 0 | texture 2", "texture 1 | texture 2"]
    assert found.attrs["blocked"] == 0
    again = discriminate(
        drawn(np.random.default_rng(4), np.ones((3, 4, 10)), label),
        sorted(names),
        Discrimination(codes=("mean rate",), **QUICK),
    )
    assert again.attrs["blocked"] == 1  # one texture after the other: a drift would tell them apart


def test_more_units_tell_more():
    rng = np.random.default_rng(5)
    label, names = presented(rng, 4, 20)
    counts = drawn(rng, rng.uniform(0.2, 0.8, (4, 16, 10)), label)
    found = accuracy_by_units(counts, names, [1, 4, 16], Discrimination(**QUICK), n_draws=6)
    assert np.all(found.accuracy_by_units.sel(code="time course").diff("units_used") > 0.05)
    with refusal("range", "numbers of units"):
        accuracy_by_units(counts, names, [17])


def test_counts_are_those_of_units_seen_in_every_trial():
    spikes = spike_table(
        np.array([0.05, 0.15, 0.15, 0.31]), np.array([0, 0, 1, 1]), ["a", "b"], trial=np.array([0, 1, 1, 1])
    )
    counts, names = trial_counts(spikes, 3, (0.0, 0.3), 0.1)
    assert names == ["a", "b"]
    np.testing.assert_array_equal(counts[:, 0], [[1, 0, 0], [0, 1, 0], [0, 0, 0]])
    np.testing.assert_array_equal(counts[1, 1], [0, 1, 0])
    part = spikes.assign(unit_observed=(("unit", "trial"), [[True, True, True], [True, False, True]]))
    assert trial_counts(part, 3, (0.0, 0.3), 0.1)[1] == ["a"]
    with refusal("range", "bin width"):
        trial_counts(spikes, 3, (0.0, 0.3), 0.3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"codes": ("mean rate", "phase")}, ("unknown", "codes")),
        ({"n_permutations": 20}, ("range", "permutations")),
        ({"bin_width": 0.0}, ("range", "bin width")),
        ({"level": 1.0}, ("range", "level")),
        ({"n_folds": 1}, ("range", "n_folds")),
        ({"seed": -1}, ("range", "seed")),
    ],
)
def test_settings_that_make_no_sense_are_refused(change, message):
    with refusal(*message):
        Discrimination(**change)


def test_textures_that_do_not_fit_the_trials_are_refused():
    counts = np.ones((10, 1, 4))
    with refusal("shape", "textures"):
        discriminate(counts, ["a", "b"])
    with refusal("shape", "textures"):
        discriminate(counts, ["a"] * 10)
    with refusal("range", "folds"):
        discriminate(counts, ["a"] * 8 + ["b"] * 2)


@pytest.mark.parametrize("numbers", [(6, 94), (5, 45), (20, 20)])
def test_the_interval_of_the_accuracy_holds_it_where_textures_differ_in_number(numbers):
    rng, n_runs, share = np.random.default_rng(5), 2000, np.array([0.75, 0.9])
    label = np.repeat([0, 1], numbers)
    held = 0
    for _ in range(n_runs):
        low, high = _accuracy_interval(rng.uniform(size=label.size) < share[label], label)
        held += low <= share.mean() <= high
    assert 0.93 <= held / n_runs <= 0.99


def test_the_interval_of_the_accuracy_is_wilsons_where_all_textures_are_as_frequent():
    label = np.repeat([0, 1], 20)
    right = np.arange(40) % 4 > 0
    np.testing.assert_allclose(_accuracy_interval(right, label), wilson_interval(30, 40), rtol=1e-9)
