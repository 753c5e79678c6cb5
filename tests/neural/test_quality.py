"""Quality of units: two signals to noise told apart, refractoriness by hand and by the law of chance, inclusion."""

import numpy as np
import pytest

from vibrissa.errors import InputError
from vibrissa.neural.quality import (
    Inclusion,
    contamination,
    refractory_violations,
    snr_mean,
    snr_smallest,
    unit_quality,
)
from vibrissa.neural.spikes import spike_table

SHAPE = np.array([0, -3.0, 1.0, 0])  # peak-to-peak 4


def noise(size=100_000, seed=1):
    return np.random.default_rng(seed).normal(0, 0.5, size)


def test_smallest_waveform_over_rms_by_hand():
    trace = np.array([0.5, -0.5, 0.5, -0.5])
    assert snr_smallest([SHAPE, 0.5 * SHAPE, 2 * SHAPE], trace) == 4  # the half: 2/0.5


def test_mean_waveform_over_mad_by_hand():
    trace = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # MAD 0.5
    assert snr_mean([SHAPE, 0.5 * SHAPE, 1.5 * SHAPE], trace) == pytest.approx(4 / (0.5 / 0.6745))


def test_the_two_agree_on_waveforms_all_alike_in_normal_noise():
    waves = np.tile(SHAPE, (50, 1))
    assert snr_mean(waves, noise()) == pytest.approx(snr_smallest(waves, noise()), rel=0.02)


def test_noisy_waveforms_part_the_two():
    rng = np.random.default_rng(2)
    waves = SHAPE * rng.uniform(0.3, 1.7, (400, 1))
    assert snr_mean(waves, noise()) / snr_smallest(waves, noise()) == pytest.approx(1 / 0.3, rel=0.05)


def test_spikes_left_in_the_trace_hardly_move_the_median():
    trace = noise()
    with_spikes = trace.copy()
    with_spikes[::100] += 30
    waves = np.tile(SHAPE, (5, 1))
    assert snr_mean(waves, with_spikes) == pytest.approx(snr_mean(waves, trace), rel=0.03)
    assert snr_smallest(waves, with_spikes) < 0.3 * snr_smallest(waves, trace)


def test_no_waveform_no_ratio():
    assert np.isnan(snr_smallest(np.zeros((0, 4)), noise(9)))
    assert np.isnan(snr_mean([SHAPE], np.zeros(0)))


def test_violations_by_hand():
    assert refractory_violations([0.0009, 0.001, 0.5, 0.0001]) == 0.5  # the period itself is allowed
    assert np.isnan(refractory_violations([]))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3])
def test_contamination_is_found_again(share):
    rng = np.random.default_rng(3)
    duration, n = 20_000.0, 200_000
    own = np.cumsum(0.002 + rng.exponential(duration / ((1 - share) * n) - 0.002, int((1 - share) * n)))
    time = np.sort(np.concatenate([own, rng.uniform(0, own[-1], int(share * n))]))
    found = unit_quality(spike_table(time, np.zeros(time.size, int), ["a"]), own[-1], window="session")
    assert found.contamination.item() == pytest.approx(share, abs=0.02)


def test_poisson_train_is_all_contamination():
    n, duration, period = 1000, 100.0, 1e-3
    assert contamination(n, round(n**2 * period / duration), duration, period) == 1
    assert contamination(n, n, duration, period) == 1
    assert contamination(n, 0, duration, period) == 0
    assert np.isnan(contamination(0, 0, duration, period))


def test_pairs_need_not_be_neighbours():
    spikes = spike_table(np.array([1.0, 1.0004, 1.0008, 5.0]), np.zeros(4, int), ["a"])
    found = unit_quality(spikes, 10.0, window="session")
    assert found.refractory_violations.item() == pytest.approx(2 / 3)
    assert found.contamination.item() == contamination(4, 3, 10.0)


def units():
    """Fast and clean; slow; two spikes too close; nothing; the same fault in a multi-unit."""
    fast = np.arange(0.05, 10, 0.1)
    close = np.append(fast, 5.0505)
    times = [fast, [1.0, 2.0], close, [], close]
    index = np.repeat(np.arange(5), [len(one) for one in times])
    quality = np.array(["SU", "SU", "SU", "SU", "MU"])
    return spike_table(np.concatenate(times), index, ["fast", "slow", "close", "mute", "many"], unit_quality=quality)


def labelled(label):
    return spike_table(np.zeros(0), np.zeros(0, int), ["a"], unit_quality=np.array([label]))


def test_reasons_by_hand():
    found = unit_quality(units(), 10.0, window="session")
    np.testing.assert_allclose(found.unit_rate, [10, 0.2, 10.1, 0, 10.1])
    assert found.kept.values.tolist() == [True, False, False, False, True]
    assert found.reason.values.tolist() == [
        "",
        "rate 0.2 Hz is not above 1 Hz",
        "1 % of intervals below 1 ms, more than 0 %",
        "rate 0 Hz is not above 1 Hz",
        "",
    ]
    assert np.isnan(found.snr_smallest).all()
    assert found.attrs["window"] == "session"


def test_rules_may_be_others():
    rules = Inclusion(min_rate=0.1, max_violations=0.02, min_snr=3.0)
    shapes = {"fast": ([SHAPE], noise()), "slow": ([10 * SHAPE], noise())}
    shapes["close"] = ([0.1 * SHAPE], noise())
    found = unit_quality(units(), 10.0, window="session", rules=rules, waveforms=shapes)
    assert found.kept.values.tolist() == [True, True, False, False, True]
    assert found.reason.values[2].startswith("signal to noise 0.8")


def test_rate_in_the_stimulus_differs_from_that_of_the_session():
    time = np.concatenate([np.linspace(0, 0.9, 10), np.linspace(5, 5.9, 2)])
    session = spike_table(time, np.zeros(12, int), ["a"])
    trials = spike_table(time[:10], np.zeros(10, int), ["a"], trial=np.arange(10) // 5, attrs={"n_trials": 4})
    assert unit_quality(session, 12.0, window="session").unit_rate == 1
    assert unit_quality(trials, 1.0, window="stimulus").unit_rate == 2.5


def test_intervals_do_not_reach_across_trials():
    trials = spike_table(np.array([0.5, 0.5]), np.zeros(2, int), ["a"], trial=np.array([0, 1]), attrs={"n_trials": 2})
    found = unit_quality(trials, 1.0, window="stimulus")
    assert np.isnan(found.refractory_violations)
    assert found.contamination == 0


def test_trials_not_observed_do_not_count():
    spikes = spike_table(np.array([0.5, 0.6]), np.zeros(2, int), ["a"], trial=np.zeros(2, int), attrs={"n_trials": 2})
    spikes = spikes.assign(unit_observed=(("unit", "trial"), [[True, False]]))
    assert unit_quality(spikes, 1.0, window="stimulus").unit_rate == 2


@pytest.mark.parametrize(
    ("call", "rule"),
    [
        (lambda: unit_quality(units(), 10.0, window="all"), "window must be 'session' or 'stimulus'"),
        (lambda: unit_quality(units(), 0.0, window="session"), "duration must be positive"),
        (lambda: unit_quality(units().assign(spike_trial=("spike", np.zeros(304, int))), 1, window="session"), "n_tr"),
        (
            lambda: unit_quality(labelled("good"), 1.0, window="session"),
            "quality of unit a must be SU or MU, got 'good'",
        ),
        (lambda: Inclusion(min_rate=-1), "Inclusion.min_rate"),
        (lambda: snr_smallest(SHAPE, [1.0]), "waveforms must be"),
        (lambda: snr_mean([SHAPE], [np.nan]), "noise must be"),
        (lambda: snr_mean([SHAPE], [1.0, 1.0]), "must not be flat"),
        (lambda: contamination(5, 0, 0.0), "must be positive"),
    ],
)
def test_impossible_measures_are_refused(call, rule):
    with pytest.raises(InputError, match=rule):
        call()
