"""Information: closed forms for Poisson units, and how far corrections mend what few trials spoil."""

import numpy as np
import pytest
from refusals import refusal
from scipy.stats import poisson

from vibrissa.neural.coding.information import (
    count_information,
    information_rate,
    spike_information,
    unit_information,
)
from vibrissa.neural.io.tables.spikes import spike_table

WIDTH, BINS = 0.01, 300


def tone(depth):
    """Bits for each spike of a rate 1 + depth·sin, in closed form."""
    root = np.sqrt(1 - depth**2)
    return (1 - root + np.log((1 + root) / 2)) / np.log(2)


def told_by_counts(expected):
    """Bits of a Poisson count about the bin it is in, summed over all counts that occur."""
    p = poisson.pmf(np.arange(80), expected[:, None])

    def entropy(q):
        q = q[q > 0]
        return -np.sum(q * np.log2(q))

    return entropy(p.mean(0)) - np.mean([entropy(one) for one in p])


def modulated(rate, depth, *, cycles=5):
    """Expected count in each bin."""
    return rate * WIDTH * (1 + depth * np.sin(2 * np.pi * cycles * (np.arange(BINS) + 0.5) / BINS))


def runs(expected, n_trials, measure, seeds=50):
    found = [measure(np.random.default_rng(k).poisson(expected, (n_trials, BINS))) for k in range(seeds)]
    return np.array(found).T


@pytest.mark.parametrize("depth", [0.3, 0.9, 1.0])
def test_bits_for_each_spike_of_a_tone_are_the_closed_form(depth):
    expected = modulated(1, depth)
    exact = np.round(1e8 * expected).astype(int)  # counts so many that they are the rate
    assert spike_information(exact[None]).plain == pytest.approx(tone(depth), abs=2e-4)


def test_two_rates_give_the_entropy_lost():
    counts = np.repeat([[30, 10, 0, 0]], 3, axis=0)
    expected = 2 + 0.75 * np.log2(0.75) + 0.25 * np.log2(0.25)
    assert spike_information(counts).plain == pytest.approx(expected)


@pytest.mark.parametrize(("n_trials", "rate"), [(40, 10.0), (60, 5.0), (60, 20.0)])
def test_corrections_take_the_bias_of_few_trials_away(n_trials, rate):
    truth = tone(0.9)
    plain, corrected, extrapolated, low, high = runs(modulated(rate, 0.9), n_trials, spike_information)
    bias = plain.mean() - truth
    assert bias > 3 * plain.std() / np.sqrt(len(plain))  # without correction: too high beyond chance
    assert abs(corrected.mean() - truth) < 0.1 * bias
    assert abs(extrapolated.mean() - truth) < 0.1 * bias
    assert np.mean((low < truth) & (truth < high)) >= 0.9


@pytest.mark.parametrize(("n_trials", "rate"), [(40, 20.0), (60, 10.0)])
def test_bits_of_the_count_lie_between_the_two_corrections(n_trials, rate):
    expected = modulated(rate, 0.9)
    truth = told_by_counts(expected)
    plain, corrected, extrapolated, low, high = runs(expected, n_trials, count_information)
    assert plain.mean() > 1.5 * truth
    assert corrected.mean() == pytest.approx(truth, rel=0.1)
    assert extrapolated.mean() == pytest.approx(truth, rel=0.2)
    assert np.mean((low < truth) & (truth < high)) >= 0.9


def test_a_steady_rate_tells_nothing():
    plain, corrected, _, low, high = runs(modulated(20, 0.0), 40, spike_information)
    assert plain.mean() > 0.05
    assert abs(corrected.mean()) < 0.005
    assert np.mean((low < 0) & (high > 0)) >= 0.9


@pytest.mark.parametrize(("n_trials", "rate"), [(40, 15), (60, 15), (150, 5)])
def test_the_interval_of_a_steady_units_count_holds_nothing(n_trials, rate):
    """Where the two corrections alone are above 0 by more than their interval in a third to half of the units."""
    rng = np.random.default_rng(1)
    found = [count_information(rng.poisson(0.01 * rate, (n_trials, 300))) for _ in range(60)]
    assert np.mean([one.low <= 0 <= one.high for one in found]) >= 0.95


def test_information_about_classes_is_less_than_about_every_bin():
    expected = modulated(20, 0.9)
    classes = np.argsort(np.argsort(expected)) * 8 // BINS
    truth = told_by_counts(np.repeat([expected[classes == k].mean() for k in range(8)], 1))
    found = runs(expected, 40, lambda counts: count_information(counts, classes))
    assert found[1].mean() == pytest.approx(truth, rel=0.03)
    assert found[0].mean() - found[1].mean() < 0.005  # cases are many: little to correct


def test_bits_a_second_are_bits_a_spike_times_the_rate():
    counts = np.random.default_rng(0).poisson(modulated(20, 0.9), (40, BINS))
    spike, second = spike_information(counts), information_rate(counts, WIDTH)
    assert second.corrected == pytest.approx(spike.corrected * counts.mean() / WIDTH)
    found = runs(modulated(20, 0.9), 40, lambda counts: information_rate(counts, WIDTH))
    truth = 20 * tone(0.9)
    assert np.mean((found[3] < truth) & (truth < found[4])) >= 0.9


@pytest.mark.parametrize(
    ("counts", "fields"),
    [
        (np.zeros((5, 9), int), ("too-few", "counts", "0")),
        (np.ones((5, 9)), ("format", "counts", "float64 (5, 9)")),
        (np.ones((5, 1), int), ("range", "bins", "1")),
        (-np.ones((5, 9), int), ("format", "counts", "int64 (5, 9)")),
    ],
)
def test_what_are_no_counts_is_refused(counts, fields):
    for measure in (spike_information, count_information):
        with refusal(*fields):
            measure(counts)


def test_classes_must_fit_the_bins():
    with refusal("shape", "classes"):
        count_information(np.ones((5, 9), int), np.zeros(8, int))


# Units of a recording


def recorded(rates, n_trials, seed=0):
    """Table of spikes of units with expected counts (U, K)."""
    counts = np.random.default_rng(seed).poisson(rates[:, None], (len(rates), n_trials, BINS))
    unit, trial, column = (np.repeat(index, counts[counts > 0]) for index in np.nonzero(counts))
    time = (column + np.random.default_rng(seed + 1).random(column.size)) * WIDTH
    return spike_table(time, unit, [f"u{k}" for k in range(len(rates))], trial=trial)


def test_units_are_told_apart_by_what_their_spikes_tell():
    rates = np.array([modulated(20, 0.9), modulated(20, 0.0), modulated(1, 0.9), np.zeros(BINS)])
    found = unit_information(recorded(rates, 40), 40, window=(0, BINS * WIDTH), bin_width=WIDTH)
    assert found.informative.values.tolist() == [True, False, False, False]
    assert found.reason.values[0] == ""
    assert found.reason.values[2].startswith("cannot tell")
    assert np.isnan(found.spike_information.values[3])
    assert found.spike_information_low[0] < tone(0.9) < found.spike_information_high[0]
    np.testing.assert_allclose(found.unit_rate[:2], 20, rtol=0.1)
    few = unit_information(recorded(rates[:1], 12), 12, window=(0, BINS * WIDTH), bin_width=WIDTH)
    assert "12 trials" in few.reason.item()
    assert (few.informative.item(), few.spike_reason.item()) == (True, "")  # that are too few for the count alone
    assert few.spike_information_low.item() > 0
    assert not few.count_informative.item()
    assert found.count_informative.values.tolist() == [True, False, False, False]


def test_one_trial_is_refused():
    with refusal("range", "number of trials"):
        unit_information(recorded(modulated(20, 0.9)[None], 1), 1, window=(0, 3), bin_width=WIDTH)


def test_a_window_without_any_spike_is_refused():
    rates = np.array([modulated(20, 0.9)])
    with refusal("range", "spikes"):
        unit_information(recorded(rates, 4), 4, window=(90, 91), bin_width=WIDTH)


def test_trials_in_which_a_unit_was_not_observed_are_no_silence():
    rng = np.random.default_rng(5)
    counts = rng.poisson(modulated(20, 0.9), (40, BINS))
    trial, column = (np.repeat(place, counts[np.nonzero(counts)]) for place in np.nonzero(counts))
    seen = np.array([np.arange(40) < 20, np.zeros(40, bool)])
    own = trial < 20
    some = spike_table((column[own] + 0.5) * WIDTH, np.zeros(own.sum(), int), ["a", "b"], trial=trial[own])
    how = {"window": (0.0, BINS * WIDTH), "bin_width": WIDTH}
    found = unit_information(some.assign(unit_observed=(("unit", "trial"), seen)), 40, **how)
    alone = unit_information(some, 20, **how).isel(unit=0)
    for name in ("unit_rate", "spike_information", "information_rate", "count_information", "reason"):
        np.testing.assert_equal(found[name].values[0], alone[name].values, err_msg=name)
    assert "20 trials, fewer than 32" in str(found.reason.values[0])
    assert np.isnan(found.unit_rate[1])
    assert "observed in no trial" in str(found.reason.values[1])
