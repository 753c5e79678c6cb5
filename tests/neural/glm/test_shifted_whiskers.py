"""Chance of a whisker's weight: sums of squares by least squares at every node, and stimuli that were not played."""

import numpy as np
import pytest
from test_one_presentation import NAMES, mapped, rolled, stimulus, summed

from vibrissa.neural.glm.delayed_envelopes import Copies
from vibrissa.neural.glm.shifted_whiskers import ShiftedWhiskers
from vibrissa.neural.glm.surround import SurroundAnalysis, surround_map
from vibrissa.neural.glm.whisker_weights import SurroundGrid

HOW = SurroundAnalysis(level=0.01)
NODES = (2, 3)  # thresholds, latencies


@pytest.fixture(scope="module")
def few():
    """A grid of few nodes over three whiskers for 3 s, and a rate."""
    command = stimulus(0).isel(time=slice(0, 6000))
    grid = SurroundGrid(Copies.of(command), n_thresholds=NODES[0], n_latencies=NODES[1])
    rate = np.random.default_rng(0).normal(size=grid.centred.shape[-1]) + 0.3e6 * grid.hinges[1, 1, 0]
    return grid, rate


def by_least_squares(columns, rate):
    """Sum of squares that columns and a constant explain."""
    design = np.column_stack([np.ones(rate.size), *columns])
    fitted = design @ np.linalg.lstsq(design, rate, rcond=None)[0]
    return float(((fitted - rate.mean()) ** 2).sum())


@pytest.mark.parametrize("shift", [0, 1, 50, 111])
def test_what_a_shifted_whisker_adds_is_that_of_least_squares_at_the_best_nodes(few, shift):
    grid, rate = few
    found = ShiftedWhiskers(grid, 0.01).explained(rate)[:, shift]
    for whisker in range(len(NAMES)):
        together, others = [], []
        for node in np.ndindex(*NODES):
            columns = grid.hinges[node]
            rest = np.delete(columns, whisker, axis=0)
            others.append(by_least_squares(rest, rate))
            together.append(by_least_squares([*rest, np.roll(columns[whisker], shift)], rate))
        assert found[whisker] == pytest.approx(max(together) - max(others), rel=1e-6, abs=1e-9)


def test_a_whisker_that_never_passes_a_threshold_adds_nothing(few):
    _, rate = few
    command = stimulus(0).isel(time=slice(0, 6000)).copy(deep=True)
    command.command.values[2] *= 1e-3
    grid = SurroundGrid(Copies.of(command), n_thresholds=2, n_latencies=3)
    assert not grid.hinges[1, :, 2].any()
    found = ShiftedWhiskers(grid, 0.01).explained(rate)
    assert np.isfinite(found).all()


def test_a_rolled_stimulus_is_not_called_in_more_than_one_whisker_of_a_hundred():
    found = [surround_map(summed(k), rolled(k, 0.5), 1, HOW) for k in range(3)]
    p = np.concatenate([one.surround_shift_p_value.values for one in found])
    assert np.mean(p < 0.05) < 0.1  # of 60 units, 20 alike before each of three stimuli
    called = np.concatenate([one.surround_verdict.values for one in found])
    assert np.isin(called, ["drives", "suppresses"]).mean() <= 0.01


def test_the_choice_of_threshold_and_latency_costs_a_weak_whisker_little():
    found = [mapped(k).surround_shift_p_value.values for k in range(2)]
    assert (np.concatenate(found)[:, 2] < 0.01).mean() > 0.95
