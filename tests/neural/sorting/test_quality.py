"""Quality of sorted units: refractoriness by hand, by the law of chance and beside SpikeInterface; what is kept."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.sorting.quality import contamination, unit_quality


def one(time):
    return spike_table(np.asarray(time, float), np.zeros(len(time), int), ["a"])


def violations(intervals, period=1e-3):
    return unit_quality(one(np.cumsum([0.0, *intervals])), 1e3, period=period).refractory_violations.item()


def test_violations_by_hand():
    assert violations([0.0009, 0.001, 0.5, 0.0001]) == 0.5  # the period itself is allowed
    assert np.isnan(violations([]))


@pytest.mark.parametrize("step", [1e-3, 1e-4, 1 / 30_000, 1 / 24_414.0625])  # of the clock [s]
@pytest.mark.parametrize("begin", [0.0, 12.345, 86_400.0])
def test_intervals_as_long_as_the_period_are_no_violations_on_any_clock(step, begin):
    ticks = np.cumsum(np.random.default_rng(5).integers(30, 40, 20_000))
    at_the_limit = unit_quality(one(begin + ticks * step), 1e6, period=30 * step)
    assert (at_the_limit.refractory_violations.item(), at_the_limit.contamination.item()) == (0, 0)
    a_tick_more = unit_quality(one(begin + ticks * step), 1e6, period=31 * step)
    assert a_tick_more.refractory_violations.item() == np.mean(np.diff(ticks) == 30)


def test_milliseconds_as_written_in_a_file_are_no_violations():
    time = np.array([float(f"{k / 1000:.3f}") for k in range(1, 2000)])
    assert time[10] - time[9] < 0.001  # 0.011 − 0.010, in binary numbers
    assert unit_quality(one(time), 1e3).refractory_violations.item() == 0
    assert unit_quality(one(time), 1e3, period=0.0011).refractory_violations.item() == 1


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
    assert found.contamination.item() == contamination(4, 3, 10.0)


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
    ours = unit_quality(one(ticks / rate), duration).contamination.item()
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
        (one([0.5]).assign(spike_trial=("spike", [0])), 1.0, ("unknown", "spikes", "spikes in trials")),
    ],
)
def test_impossible_measures_are_refused(spikes, duration, fields):
    with refusal(*fields):
        unit_quality(spikes, duration)
