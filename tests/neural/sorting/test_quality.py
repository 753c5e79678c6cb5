"""Quality of sorted units: refractoriness by hand, by the law of chance and beside SpikeInterface; what is kept."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.sorting.quality import Inclusion, remarks_on_quality, unit_quality
from vibrissa.neural.sorting.refractory import contamination, dead_time, violating_pairs


def one(time):
    return spike_table(np.asarray(time, float), np.zeros(len(time), int), ["a"])


def violations(intervals, period=1e-3):
    return unit_quality(
        one(np.cumsum([0.0, *intervals])), 1e3, rules=Inclusion(refractory_period=period)
    ).refractory_violations.item()


def test_violations_by_hand():
    assert violations([0.0009, 0.001, 0.5, 0.0001]) == 0.5  # the period itself is allowed
    assert np.isnan(violations([]))


@pytest.mark.parametrize("step", [1e-3, 1e-4, 1 / 30_000, 1 / 24_414.0625])  # of the clock [s]
@pytest.mark.parametrize("begin", [0.0, 12.345, 86_400.0])
def test_intervals_as_long_as_the_period_are_no_violations_on_any_clock(step, begin):
    ticks = np.cumsum(np.random.default_rng(5).integers(30, 40, 20_000))
    at_the_limit = unit_quality(one(begin + ticks * step), 1e6, rules=Inclusion(refractory_period=30 * step))
    assert (at_the_limit.refractory_violations.item(), at_the_limit.contamination.item()) == (0, 0)
    a_tick_more = unit_quality(one(begin + ticks * step), 1e6, rules=Inclusion(refractory_period=31 * step))
    assert a_tick_more.refractory_violations.item() == np.mean(np.diff(ticks) == 30)


def test_milliseconds_as_written_in_a_file_are_no_violations():
    time = np.array([float(f"{k / 1000:.3f}") for k in range(1, 2000)])
    assert time[10] - time[9] < 0.001  # 0.011 − 0.010, in binary numbers
    assert unit_quality(one(time), 1e3).refractory_violations.item() == 0
    assert unit_quality(one(time), 1e3, rules=Inclusion(refractory_period=0.0011)).refractory_violations.item() == 1


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3])
def test_contamination_is_found_again(share):
    rng = np.random.default_rng(3)
    duration, n = 20_000.0, 200_000
    own = np.cumsum(0.002 + rng.exponential(duration / ((1 - share) * n) - 0.002, int((1 - share) * n)))
    time = np.sort(np.concatenate([own, rng.uniform(0, own[-1], int(share * n))]))
    assert unit_quality(one(time), own[-1]).contamination.item() == pytest.approx(share, abs=0.02)


def test_poisson_train_is_all_contamination():
    n, duration, period = 1000, 100.0, 1e-3
    assert contamination(n, round(n**2 * period / duration), duration, period) == 1
    assert contamination(n, n, duration, period) == 1
    assert contamination(n, 0, duration, period) == 0
    assert np.isnan(contamination(0, 0, duration, period))


def test_pairs_need_not_be_neighbours():
    found = unit_quality(one([1.0, 1.0004, 1.0008, 5.0]), 10.0)
    assert found.refractory_violations.item() == pytest.approx(2 / 3)
    assert found.contamination.item() == contamination(4, 3, 10.0, 1e-3)


@pytest.mark.parametrize(("dead", "equal"), [(40, True), (30, False)], ids=["no interval of 1 ms", "intervals of 1 ms"])
def test_spikeinterface_gives_the_same_but_where_an_interval_is_as_long_as_the_period(dead, equal):
    metrics = pytest.importorskip(
        "spikeinterface.metrics.quality.misc_metrics", reason="the extra sorting is not installed"
    )
    rate, ticks = 30_000, np.cumsum(np.random.default_rng(6).integers(dead, 3000, 20_000))
    ticks = np.sort(np.append(ticks, ticks[::100] + 7))
    duration = (ticks[-1] + 1) / rate
    pairs = metrics._compute_nb_violations_numba(ticks, 30)
    theirs = metrics._compute_rp_contamination_one_unit(pairs, ticks.size, ticks[-1] + 1, 0, 30)
    counted = violating_pairs(ticks / rate, dead_time(1e-3, 1 / rate))
    ours = contamination(ticks.size, counted, duration, 1e-3)
    assert (ours == pytest.approx(theirs, rel=1e-9)) == equal
    assert ours <= theirs


def test_reasons_by_hand():
    fast = np.arange(0.05, 10, 0.1)
    times = [fast, [1.0, 2.0], np.append(fast, 5.0505), []]
    index = np.repeat(np.arange(4), [len(part) for part in times])
    found = unit_quality(spike_table(np.concatenate(times), index, ["fast", "slow", "close", "mute"]), 10.0)
    np.testing.assert_allclose(found.unit_rate, [10, 0.2, 10.1, 0])
    assert found.kept.values.tolist() == [True, False, False, False]
    assert found.reason.values.tolist() == [
        "",
        "rate 0.2 Hz is not above 1 Hz",
        "1 % of intervals below 1 ms, more than 0 %",
        "rate 0 Hz is not above 1 Hz",
    ]
    assert found.attrs["window"] == "session"


@pytest.mark.parametrize(
    ("spikes", "duration", "fields"),
    [
        (one([0.5]), 0.0, ("range", "duration", "0.0")),
        (one([0.5, 1500.0]), 1.5, ("range", "duration", "1.5")),
        (one([0.5]).assign(spike_trial=("spike", [0])), 1.0, ("unknown", "spikes", "spikes in trials")),
    ],
)
def test_impossible_measures_are_refused(spikes, duration, fields):
    with refusal(*fields):
        unit_quality(spikes, duration)


SPREAD = np.arange(0.05, 100, 0.1)  # of 10 Hz, no interval below 1 ms


def classed(labels, times, **about):
    index = np.repeat(np.arange(len(times)), [len(part) for part in times])
    names = [f"u{k}" for k in range(len(times))]
    return spike_table(np.concatenate(times), index, names, unit_label=np.array(labels), **about)


def test_multi_units_and_unlabelled_ones_are_classes_of_their_own():
    close = np.sort(np.append(SPREAD, SPREAD[:50] + 5e-4))
    labels = ["good", "SU", "mua", "MU", "unsorted", "", "noise"]
    found = unit_quality(classed(labels, [close, SPREAD, close, [1.0], SPREAD, close, SPREAD]), 100.0)
    assert found.unit_class.values.tolist() == ["good", "good", "mua", "mua", "unlabelled", "unlabelled", "noise"]
    assert found.kept.values.tolist() == [False, True, True, False, True, False, False]
    broken = "4.77 % of intervals below 1 ms, more than 0 %"
    slow = "rate 0.01 Hz is not above 1 Hz"
    assert found.reason.values.tolist() == [broken, "", "", slow, "", broken, "labelled noise"]
    assert (
        remarks_on_quality(found)[0] == "kept: 1 of 2 good, 1 of 2 mua, 1 of 2 unlabelled, 0 of 1 noise (42.9 % of all)"
    )
    allowed = unit_quality(classed(labels[:1], [close]), 100.0, rules=Inclusion(most_violations=0.05))
    assert allowed.kept.item()


def test_what_is_not_measured_leaves_no_unit_out_unless_asked():
    spikes = classed(["good"] * 3, [SPREAD] * 3, unit_snr=[8.0, 2.0, np.nan])
    found = unit_quality(spikes, 100.0)
    assert found.kept.values.all()
    assert any("below 3.1, the least of the paper's: 1;" in line for line in remarks_on_quality(found))
    assert any("SNR is not measured: 1;" in line for line in remarks_on_quality(found))
    asked = unit_quality(spikes, 100.0, rules=Inclusion(least_snr=3.1))
    assert asked.reason.values.tolist() == ["", "SNR 2 is below 3.1", ""]
    strict = unit_quality(spikes, 100.0, rules=Inclusion(least_snr=3.1, need_measured=True))
    assert strict.reason.values.tolist() == ["", "SNR 2 is below 3.1", "SNR is not measured"]


def test_a_drifting_unit_is_left_out_when_asked():
    fading = SPREAD[np.random.default_rng(0).uniform(size=SPREAD.size) < 1 - SPREAD / 100]
    amplitude = np.concatenate([np.full(SPREAD.size, 50.0), 50 - 0.3 * fading])
    lost = SPREAD[SPREAD < 40]
    amplitude = np.append(amplitude, np.full(lost.size, 50.0))
    spikes = classed(["good"] * 3, [SPREAD, fading, lost], amplitude=amplitude)
    found = unit_quality(spikes, 100.0, rules=Inclusion(least_presence=0.9, most_change=0.5))
    np.testing.assert_allclose(found.rate_change, [0, -2, -3.6], atol=0.25)
    np.testing.assert_allclose(found.amplitude_change, [0, -0.75, 0], atol=0.05)
    assert found.presence_ratio.values.tolist() == [1, 1, 0.4]
    first, second, third = found.reason.values.tolist()
    assert first == ""
    assert second.startswith("rate changes by -")
    assert "amplitude changes by -" in second
    assert third.startswith("fires in 40 % of the recording, less than 90 %")


def test_counts_in_bins_coarser_than_the_period_are_not_judged_by_it():
    spikes = classed(["good"], [np.repeat(SPREAD, 2)]).assign_attrs(counted_bin=0.01)
    found = unit_quality(spikes, 100.0)
    assert np.isnan(found.refractory_violations.item())
    assert np.isnan(found.contamination.item())
    assert found.kept.item()
    assert any("too coarse" in line for line in remarks_on_quality(found))


@pytest.mark.parametrize(
    ("rule", "fields"),
    [
        ({"refractory_period": 0.0}, ("range", "refractory_period", "0.0")),
        ({"refractory_period": 1.0}, ("range", "refractory_period", "1.0")),
        ({"most_violations": 5.0}, ("range", "most_violations", "5.0")),
        ({"least_snr": -1.0}, ("range", "least_snr", "-1.0")),
    ],
)
def test_impossible_rules_are_refused(rule, fields):
    with refusal(*fields):
        Inclusion(**rule)
