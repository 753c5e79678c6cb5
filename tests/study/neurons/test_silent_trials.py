"""Trials without a spike of any unit: named where they are rare by chance, not where they are ordinary."""

import numpy as np
import pytest

from vibrissa.neural.io.tables.spikes import spike_table
from vibrissa.study.neurons.silent_trials import silent_trials


def counted(counts, **about):
    trial = np.repeat(np.arange(len(counts)), counts)
    return spike_table(np.linspace(0, 1, trial.size), 0 * trial, ["a"], trial=trial, **about)


def said(counts, **about):
    return silent_trials(counted(counts, **about), len(counts))


@pytest.mark.parametrize(
    ("lost", "names"),
    [
        ([5, 6, 11, 12, 13], "trials 5, 6 and 11 to 13 hold"),
        ([4], "trial 4 holds"),
        ([4, 7], "trials 4 and 7 hold"),
        (range(3, 9), "trials 3 to 8 hold"),
        (range(1, 19, 2), "9 trials between others (1, 3, 5, 7, 9, 11, …) hold"),
    ],
)
def test_lost_trials_are_named(lost, names):
    counts = np.random.default_rng(0).poisson(40, 20)
    counts[list(lost)] = 0
    (line,) = said(counts)
    assert line.startswith(f"{names} no spike of any unit: w")


def test_the_first_and_the_last_trials_are_named_however_few_the_spikes():
    first, last = said([0, 1, 0, 1, 0])[::-1]
    assert first == "trial 0 holds no spike of any unit; trials count from 0"
    assert last == "the last 1 of 5 trials hold no spike of any unit: were they presented?"
    assert said([1]) == said([1, 1]) == said([30, 1, 30]) == []


@pytest.mark.parametrize("shape", [np.inf, 3.0, 1.0])
@pytest.mark.parametrize("mean", [1, 3, 6, 10, 30])
def test_trials_that_are_silent_by_chance_are_hardly_ever_named(mean, shape):
    """Of Poisson counts, and of rates that vary from trial to trial by a gamma distribution of this shape."""
    rng = np.random.default_rng(1)
    named = 0
    for _ in range(400):
        gain = 1.0 if np.isinf(shape) else rng.gamma(shape, 1 / shape, 40)
        counts = rng.poisson(mean * gain, 40)
        counts[[0, -1]] = mean
        named += bool(said(counts))
    assert named <= 0.03 * 400


def test_trials_in_which_units_were_not_observed_are_no_silent_ones():
    counts = np.full(20, 40)
    counts[[5, 9]] = 0
    seen = np.ones((1, 20), bool)
    seen[0, 5] = False
    assert said(np.r_[0, 9, 9, 0], unit_observed=[[False, True, True, False]]) == []
    assert said(counts, unit_observed=seen) == ["trial 9 holds no spike of any unit: was it presented?"]
