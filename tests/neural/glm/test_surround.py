"""Surround maps: weights put in come out, their intervals hold them, and copies too alike are said to be."""

from functools import cache

import numpy as np
import pytest
from populations import ringing
from refusals import refusal

from vibrissa.neural.glm.delayed_envelopes import Copies, condition_number, inflation
from vibrissa.neural.glm.surround import SurroundAnalysis, surround_map
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes
from vibrissa.neural.simulated.wandering import SlowState, unrelated_feature
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.stimulus.array import replay_command
from vibrissa.stimulus.waveform import PointMotion

NAMES = ("C1", "C2", "C3", "D1", "D2", "B1", "B2", "E1")
SLOPE, THRESHOLD, LATENCY, BASELINE, TRIALS = 2.5e5, 42.3e-6, 0.012, 8.0, 40
TRUTH = np.array([0, 1, 0.3, 0, 0.15, 0, -0.2, 0])  # of the slope


@cache
def copies(seed, delays=None, duration=6.0):
    """Copies of one ringing motion on eight whiskers, and their envelopes."""
    time, motion = ringing(np.random.default_rng(seed), duration=duration)
    late = np.arange(8) * duration / 8 if delays is None else np.array(delays)
    shifts = np.round(late * 2000).astype(int)
    envelope = analytic_envelope(motion)[0]
    command = dataset(
        whisker=np.array(NAMES), time=time, command=np.array([np.roll(motion, shift) for shift in shifts])
    )
    return command, np.array([np.roll(envelope, shift) for shift in shifts])


class Sum:
    """A unit that adds up hinges of several whiskers."""

    def __init__(self, weights, slope=SLOPE):
        self.weights, self.slope = weights, slope

    def rate(self, time, envelopes):
        one = ThresholdLinearUnit(threshold=THRESHOLD, slope=self.slope, baseline=0.0, latency=LATENCY)
        driven = sum(weight * one.rate(time, own) for weight, own in zip(self.weights, envelopes, strict=True))
        return np.maximum(BASELINE + driven + np.zeros(len(time)), 0)


def recorded(weights, seeds, *, stimulus=0, state=None, delays=None, trials=TRIALS, slope=SLOPE):
    """Map of one unit for each seed."""
    command, envelopes = copies(stimulus, delays)
    time, unit = command.time.values, Sum(weights, slope)
    tables = {}
    for seed in seeds:
        rng = np.random.default_rng([seed, stimulus])
        gain = state.draw(trials, time[-1] - time[0], rng=rng) if state else None
        tables[f"u{seed}"] = simulate_spikes(unit, time, envelopes, trials, rng=rng, gain=gain)
    return surround_map(join_units(tables), command, trials)


@cache
def fifty():
    return [recorded(TRUTH, range(10), stimulus=stimulus) for stimulus in range(5)]


def together(name):
    return np.concatenate([found[name].values for found in fifty()])


def test_weights_come_out_and_intervals_hold_them():
    weight, low, high = (together(f"surround_weight{end}") for end in ("", "_low", "_high"))
    error = weight / SLOPE - TRUTH
    np.testing.assert_allclose(error.mean(0), 0, atol=0.03)
    held = (low < TRUTH * SLOPE) & (high > TRUTH * SLOPE)
    assert 0.9 <= held.mean() <= 0.99
    assert held.mean(0).min() >= 0.8  # of each whisker alone, 50 units
    np.testing.assert_allclose(together("threshold").mean(), THRESHOLD, atol=2e-6)
    np.testing.assert_allclose(together("latency").mean(), LATENCY, atol=5e-4)


def test_verdicts_are_those_of_the_truth():
    verdict = together("surround_verdict")
    assert (verdict[:, TRUTH >= 0.3] == "drives").mean() > 0.97
    assert (verdict[:, TRUTH == 0.15] == "drives").mean() > 0.7  # of 0.15 ± 0.05
    assert (verdict[:, TRUTH < 0] == "suppresses").mean() > 0.7
    assert np.isin(verdict[:, TRUTH == 0], ["drives", "suppresses"]).mean() < 0.05
    assert (verdict[:, TRUTH == 0] == "no").mean() > 0.85
    assert set(together("strongest_whisker")) == {"C2"}


def test_whiskers_are_named_by_what_they_do_the_strongest_first():
    found = recorded(TRUTH, range(1))
    names, weight = found.whisker.values, found.surround_weight.values
    for said, column in (("drives", "driving_whiskers"), ("suppresses", "suppressing_whiskers")):
        assert any(found[column].values)
        for unit, text in enumerate(found[column].values):
            chosen = np.flatnonzero(found.surround_verdict.values[unit] == said)
            order = chosen[np.argsort(-np.abs(weight[unit, chosen]))]
            assert text == ", ".join(names[order])


def test_intervals_hold_where_excitability_wanders():
    found = recorded(TRUTH, range(30), stimulus=1, state=SlowState(depth=0.4, trial_sd=0.3))
    low, high = found.surround_weight_low.values, found.surround_weight_high.values
    assert 0.88 <= np.mean((low < TRUTH * SLOPE) & (high > TRUTH * SLOPE)) <= 0.99


def test_a_unit_that_no_whisker_drives_says_so():
    found = recorded(np.zeros(8), range(20))
    called = np.isin(found.surround_verdict.values, ["drives", "suppresses"]).any(1)
    assert called.mean() <= 0.2
    assert "no whisker drives it beyond chance" in found.reason.values
    assert np.isnan(found.threshold.values[~called]).all()


def test_a_unit_that_answers_something_else_names_no_whisker():
    command, _ = copies(2)
    time, rng = command.time.values, np.random.default_rng(0)
    tables = {}
    for k in range(20):
        feature = unrelated_feature(time, mean=55e-6, timescale=0.05, rng=rng)
        tables[f"u{k}"] = simulate_spikes(ThresholdLinearUnit(), time, feature, TRIALS, rng=rng)
    found = surround_map(join_units(tables), command, TRIALS)
    assert np.isin(found.surround_verdict.values, ["drives", "suppresses"]).mean() < 0.08
    assert np.mean(found.strongest_whisker.values == "") >= 0.8


def test_weak_weights_of_few_trials_are_not_told():
    found = recorded(TRUTH, range(10), trials=8, slope=2e4)
    assert (found.surround_verdict.values[:, 2:] == "cannot tell").mean() > 0.8


def test_two_copies_without_a_delay_between_them_cannot_be_told():
    found = recorded(TRUTH, [0], delays=(0, 1, 1, 2, 2.7, 3.4, 4.1, 4.8))
    alike = np.isin(NAMES, ["C2", "C3"])
    assert (found.surround_verdict.values[0, alike] == "cannot tell").all()
    assert np.isnan(found.surround_weight.values[0, alike]).all()
    assert found.condition_number.item() > 1e5
    assert np.isinf(found.weight_inflation.values[alike]).all()
    assert found.reason.item().startswith("cannot tell C2 from C3")
    others = found.surround_weight_low.values[0, ~alike], found.surround_weight_high.values[0, ~alike]
    truth = TRUTH[~alike] * SLOPE
    assert ((others[0] < truth) & (truth < others[1])).mean() >= 0.8


def test_a_delay_within_the_latencies_searched_cannot_be_told():
    found = recorded(TRUTH, [0], delays=(0, 1, 1.015, 2, 2.7, 3.4, 4.1, 4.8))
    assert found.copy_likeness.values[1] > 0.95
    assert (found.surround_verdict.values[0, 1:3] == "cannot tell").all()
    assert found.likest_whisker.values[1:3].tolist() == ["C3", "C2"]


def test_design_is_told_by_closed_forms():
    rng = np.random.default_rng(0)
    a, b = np.linalg.qr(rng.normal(size=(500, 3)) - 0.0)[0].T[:2]
    a, b = a - a.mean(), b - b.mean()
    b = b - a * (a @ b) / (a @ a)
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    r = 0.6
    columns = np.array([a, r * a + np.sqrt(1 - r**2) * b])
    assert condition_number(columns) == pytest.approx(np.sqrt((1 + r) / (1 - r)))
    np.testing.assert_allclose(inflation(columns), 1 / (1 - r**2))
    assert condition_number(np.array([a, a])) == np.inf
    assert np.isinf(inflation(np.array([a, a, b]))).tolist() == [True, True, False]


def test_the_stimulator_s_even_delays_make_a_good_design():
    _, motion = ringing(np.random.default_rng(3), duration=10.1)
    command = replay_command(
        [PointMotion(displacement=motion, sampling_rate=2000.0, source="ringing")], sampling_rate=2000.0
    )
    assert command.sizes["whisker"] == 24
    shown = Copies.of(command)
    columns = shown.hinged(float(np.median(shown.drives[0].envelope)), 0.0)
    assert condition_number(columns) < 4
    assert shown.likeness()[0].max() < 0.3


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda c: (c.isel(whisker=[0]), TRIALS), ("range", "whiskers")),
        (lambda c: (c.assign(command=c.command.where(c.whisker != "D1", 0.0)), TRIALS), ("range", "whisker D1")),
        (lambda c: (c.isel(time=slice(0, 4000)), TRIALS), ("range", "spike_time")),
    ],
)
def test_bad_input_is_told_in_one_line(change, match):
    command, envelopes = copies(0)
    spikes = simulate_spikes(Sum(TRUTH), command.time.values, envelopes, 5, rng=np.random.default_rng(0))
    with refusal(*match) as told:
        surround_map(join_units({"u": spikes}), *change(command))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("wrong", [{"bin_width": 0.0}, {"skip": -1.0}, {"level": 1.0}])
def test_settings_are_checked(wrong):
    with refusal("range"):
        SurroundAnalysis(**wrong)
