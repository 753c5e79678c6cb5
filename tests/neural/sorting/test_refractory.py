"""Refractory violations on the clock of a recording, and the contamination they imply, against simulated truth."""

import numpy as np
import pytest

from vibrissa.neural.sorting.refractory import (
    clock_step,
    contamination,
    contamination_interval,
    dead_time,
    violating_pairs,
    violating_share,
)

RNG = np.random.default_rng
PERIOD = 1e-3
GRIDS = {
    "1 ms": 1e-3,
    "0.5 ms": 5e-4,
    "0.1 ms": 1e-4,
    "30 kHz": 1 / 30_000,
    "TDT": 1 / 24_414.0625,
    "40 kHz": 1 / 40_000,
}


def refractory(n, rate, rest, seed=0):
    """Spikes of a unit that rests exactly so long after each."""
    return np.cumsum(rest + RNG(seed).exponential(1 / rate - rest, n))


@pytest.mark.parametrize("grid", GRIDS)
def test_a_unit_that_rests_for_the_period_never_violates_on_any_clock(grid):
    step = GRIDS[grid]
    time = np.round(refractory(20_000, 50.0, PERIOD) / step) * step
    found = clock_step(np.diff(time))
    assert found == pytest.approx(step, rel=1e-6)
    dead = dead_time(PERIOD, found)
    assert violating_share(time, dead) == 0
    assert violating_pairs(time, dead) == 0


def test_the_bare_period_would_call_that_unit_contaminated_on_an_odd_clock():
    step = GRIDS["TDT"]
    time = np.round(refractory(20_000, 50.0, PERIOD) / step) * step
    assert np.mean(np.diff(time) < PERIOD - 1e-8) > 2e-4


@pytest.mark.parametrize("grid", [None, *GRIDS])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.2])
def test_a_known_contamination_lies_within_its_interval(grid, share):
    n, rate = 60_000, 20.0
    own = refractory(int(n * (1 - share)), rate * (1 - share), 2 * PERIOD)
    duration = own[-1]
    time = np.sort(np.append(own, RNG(1).uniform(0, duration, int(n * share))))
    step = 0.0 if grid is None else GRIDS[grid]
    time = np.round(time / step) * step if step else time
    dead = dead_time(PERIOD, clock_step(np.diff(time)))
    known = (time.size, violating_pairs(time, dead), duration, dead.effective)
    low, high = contamination_interval(*known)
    assert low <= contamination(*known) <= high
    assert low - 0.01 < share < high + 0.01  # pairs share spikes, so they vary a little more than Poisson's
    assert contamination(*known) == pytest.approx(share, abs=0.03)


def test_intervals_cover_the_truth_as_often_as_they_say():
    share, inside = 0.1, 0
    for seed in range(200):
        own = refractory(1800, 9.0, 2 * PERIOD, seed)
        time = np.sort(np.append(own, RNG(seed + 1000).uniform(0, own[-1], 200)))
        low, high = contamination_interval(2000, violating_pairs(time, dead_time(PERIOD, 0.0)), own[-1], PERIOD)
        inside += low <= share <= high
    assert 0.92 <= inside / 200 <= 0.99


def test_few_spikes_say_nothing_of_contamination():
    assert contamination_interval(100, 0, 100.0, PERIOD) == (0.0, 1.0)
    low, high = contamination_interval(50_000, 0, 2500.0, PERIOD)
    assert (low, high) == (0.0, pytest.approx(3.6889 / 1000 / 2, rel=2e-3))  # of 1,000 by chance, at most 3.69


def test_times_on_no_clock_have_no_step():
    assert clock_step(np.diff(refractory(5000, 50.0, PERIOD))) == 0
    assert clock_step(np.full(100, 0.01)) == 0  # one interval gives no clock away
    assert clock_step(np.zeros(0)) == 0


def test_a_clock_coarser_than_the_period_measures_nothing():
    dead = dead_time(PERIOD, 2e-3)
    assert np.isnan(violating_share(np.array([0.0, 0.0, 0.002]), dead))
    assert np.isnan(contamination(3, 1, 1.0, dead.effective))
