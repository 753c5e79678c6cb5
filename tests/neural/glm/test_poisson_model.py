"""Kernels of whiskers and own past: what was put in comes out."""

from functools import cache

import numpy as np
import pytest
from refusals import refusal
from test_surround import NAMES, copies

from vibrissa.neural.glm.bases import raised_cosines
from vibrissa.neural.glm.kernel_columns import Columns, KernelAnalysis, unit_design
from vibrissa.neural.glm.poisson_model import whisker_kernels
from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.neural.io.tables.stimuli import labelled_stimulus

TRIALS, RATE = 30, 25.0
HOW = KernelAnalysis(reach=0.03, shapes=4, past=0.05)
PAST = np.array([-2, -0.8, -0.3, -0.1])  # of ln(rate), in the bins after a spike
SHARE = np.array([0, 0.2, 0.07, 0, -0.05, 0, 0, 0])  # height of the kernels, in ln(rate) per SD of the envelope


def kernels():
    """True kernels (whisker, lag), within reach of the shapes."""
    lags = HOW.lags()[0]
    bump = np.exp(-0.5 * ((lags - 0.012) / 0.008) ** 2)
    shapes = raised_cosines(lags, HOW.shapes)
    return SHARE[:, None] * (shapes @ np.linalg.lstsq(shapes, bump, rcond=None)[0])


@cache
def recorded(seed, units=5, driven=True, past=True):
    """Kernels of units whose rates are drawn bin by bin, and the columns."""
    command, _ = copies(seed)
    columns = Columns.of(command, HOW)
    shapes = raised_cosines(HOW.lags()[0], HOW.shapes)
    b = np.linalg.lstsq(shapes, kernels().T, rcond=None)[0].T.ravel() if driven else np.zeros(8 * HOW.shapes)
    drive = np.zeros(len(columns.valid))
    drive[columns.valid] = columns.shared[:, 1:] @ b
    rng, own = np.random.default_rng([seed, driven]), PAST if past else 0 * PAST
    counts = np.zeros((units, TRIALS, len(drive)))
    for k in range(len(drive)):
        before = counts[..., max(k - len(own), 0) : k][..., ::-1]
        counts[..., k] = rng.poisson(HOW.bin_width * RATE * np.exp(drive[k] + before @ own[: before.shape[-1]]))
    unit, trial, column = (np.repeat(one, counts[counts > 0].astype(int)) for one in np.nonzero(counts))
    time = (column + 0.5) * HOW.bin_width
    spikes = spike_table(time, unit, [f"u{k}" for k in range(units)], trial=trial)
    return whisker_kernels(spikes, command, TRIALS, HOW), columns.spread


def test_kernels_come_out_and_intervals_hold_them():
    held, effects, error = [], [], []
    for seed in range(10):  # 50 units
        found, spread = recorded(seed)
        truth = kernels() / spread
        held.append((found.whisker_kernel_low <= truth) & (truth <= found.whisker_kernel_high))
        whole = truth.sum(1)
        effects.append((found.whisker_effect_low <= whole) & (whole <= found.whisker_effect_high))
        error.append(found.whisker_kernel.values - truth)
    held, effects = np.array(held), np.array(effects)
    assert 0.9 <= held.mean() <= 0.99
    assert held[:, :, 1].mean() >= 0.85  # of the principal whisker, which the weak penalty shrinks most
    assert 0.9 <= effects.mean() <= 0.99
    np.testing.assert_allclose(np.mean(error, (0, 1)) * spread, 0, atol=0.02)


def test_whiskers_that_matter_are_found():
    matters = np.concatenate([recorded(seed)[0].whisker_matters.values for seed in range(10)])
    assert matters[:, 1].all()
    assert matters[:, [2, 4]].mean() > 0.8
    assert matters[:, SHARE == 0].mean() < 0.05


def test_whiskers_that_matter_are_named():
    found = recorded(0)[0]
    for unit, text in enumerate(found.whiskers_that_matter.values):
        chosen = set(found.whisker.values[found.whisker_matters.values[unit]].tolist())
        assert set(text.split(", ")) == chosen


def test_a_spike_holds_the_next_one_off():
    past = np.concatenate([recorded(seed)[0].past_kernel.values for seed in range(10)]).mean(0)
    np.testing.assert_allclose(past[:3], np.exp(PAST[:3]), atol=0.1)
    np.testing.assert_allclose(past[5:], 1, atol=0.15)
    without = recorded(0, units=3, past=False)[0].past_kernel.values.mean(0)
    np.testing.assert_allclose(without, 1, atol=0.15)


def test_unseen_trials_are_foreseen_only_where_whiskers_drive():
    assert (recorded(0)[0].deviance_explained > 0.05).all()
    none = recorded(0, driven=False, past=False)[0]
    assert (none.deviance_explained < 0.005).all()
    assert none.whisker_matters.values.mean() < 0.1


def test_penalty_is_chosen_where_none_is_given():
    command, _ = copies(0)
    columns = Columns.of(command, HOW)
    counts = np.random.default_rng(0).poisson(0.1, (TRIALS, len(columns.valid)))
    trial, column = (np.repeat(one, counts[counts > 0]) for one in np.nonzero(counts))
    spikes = spike_table((column + 0.5) * HOW.bin_width, 0 * trial, ["u"], trial=trial)
    how = KernelAnalysis(reach=0.03, shapes=4, past=0.0, penalty=None)
    found = whisker_kernels(spikes, command, TRIALS, how)
    assert found.penalty.item() == 1000  # nothing drives it: shrink as far as goes
    assert found.sizes["past_lag"] == 0


def test_own_past_does_not_hold_the_present():
    command, _ = copies(0)
    columns = Columns.of(command, HOW)
    counts = np.zeros((2, len(columns.valid)))
    at = np.flatnonzero(columns.valid)[50]
    counts[0, at] = 1
    own = unit_design(columns, counts, HOW).own
    shapes = raised_cosines(HOW.lags()[1], HOW.past_shapes, stretch=0.002)
    np.testing.assert_allclose(own[0, 50], 0, atol=1e-12)
    np.testing.assert_allclose(own[0, 51 : 51 + len(shapes)], shapes, atol=1e-12)
    np.testing.assert_allclose(own[1], 0, atol=1e-12)


def test_few_spikes_are_not_told():
    command, _ = copies(0)
    spikes = spike_table(np.linspace(1.2, 5, 40), np.zeros(40, int), ["u"], trial=np.arange(40) % TRIALS)
    found = whisker_kernels(spikes, command, TRIALS, HOW)
    assert found.reason.item().startswith("too few spikes")
    assert np.isnan(found.whisker_kernel.values).all()


def test_a_stimulus_of_one_channel_is_one_whisker():
    command, _ = copies(0)
    spikes = spike_table(np.linspace(1.2, 5, 40), np.zeros(40, int), ["u"], trial=np.arange(40) % TRIALS)
    alone = labelled_stimulus(command.time.values, command.command.values[0])
    found = whisker_kernels(spikes, alone, TRIALS, HOW)
    named = whisker_kernels(spikes, command.isel(whisker=[0]), TRIALS, HOW)
    assert found.whisker.values.tolist() == ["stimulus"]
    assert found.kernel_condition.item() == named.kernel_condition.item()


@pytest.mark.parametrize(
    ("wrong", "fields"),
    [
        ({"bin_width": 0.0}, ("range", "bin width", "0.0")),
        ({"reach": 0.01}, ("too-few", "reach", "0.01")),
        ({"past": 0.01}, ("too-few", "past", "0.01")),
        ({"skip": -1.0}, ("range", "skip", "-1.0")),
        ({"penalty": -1.0}, ("range", "penalty", "-1.0")),
    ],
)
def test_settings_are_checked(wrong, fields):
    with refusal(*fields):
        KernelAnalysis(**wrong)


def test_names_of_whiskers_are_those_of_the_command():
    assert tuple(recorded(0)[0].whisker.values) == NAMES


def test_whiskers_that_do_nothing_seldom_pass_the_test_of_few_trials():
    rng, trials, units, duration = np.random.default_rng(7), 10, 8, 6.0
    command, _ = copies(3)
    found = []
    for penalty in (0.0, 10.0):
        unit, trial = (one.ravel() for one in np.mgrid[:units, :trials])
        count = rng.poisson(15 * duration, unit.size)
        time = rng.uniform(0, duration, count.sum())
        spikes = spike_table(
            time, np.repeat(unit, count), [f"u{k}" for k in range(units)], trial=np.repeat(trial, count)
        )
        how = KernelAnalysis(penalty=penalty, past=0.0)
        found.append(whisker_kernels(spikes, command, trials, how).whisker_trial_p_value.values.ravel())
    share = np.mean(np.array(found) < 0.05, axis=1)
    assert np.all(share <= 0.15)
