"""Chance of a whisker's term: sums of squares by least squares, and units that something else drives."""

import numpy as np
import pytest
from test_surround import TRIALS, copies

from vibrissa.neural.glm.kernel_columns import KernelAnalysis
from vibrissa.neural.glm.poisson_model import whisker_kernels
from vibrissa.neural.glm.shift_null import _explained, shift_p_values
from vibrissa.neural.io.tables.spikes import join_units
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit, simulate_spikes


@pytest.mark.parametrize("shift", [0, 1, 37, 199])
def test_explained_at_every_shift_is_that_of_least_squares(shift):
    rng = np.random.default_rng(0)
    n, weights = 200, rng.uniform(0.5, 2, 200)
    own, others, response = (
        rng.normal(size=(2, n)),
        np.vstack([np.ones(n), rng.normal(size=(3, n))]),
        rng.normal(size=n),
    )
    root = np.sqrt(weights)

    def misfit(columns):
        return np.linalg.lstsq((columns * root).T, response * root, rcond=None)[1].item()

    gain = misfit(others) - misfit(np.vstack([others, np.roll(own, shift, axis=1)]))
    assert _explained(own, others, response, weights)[0][shift] == pytest.approx(gain, rel=1e-4)


def test_chance_values_are_even_and_a_driving_whisker_is_beyond_them():
    rng = np.random.default_rng(1)
    found = []
    for _ in range(60):
        columns = rng.normal(size=(3, 2, 400))
        found.append(shift_p_values(columns, rng.normal(size=400), np.ones(400), 5))
    assert np.mean(found) == pytest.approx(0.5, abs=0.07)
    driven = columns[1, 0] + rng.normal(size=400)
    p = shift_p_values(columns, driven, np.ones(400), 5)
    assert p[1] < 1e-4
    assert min(p[0], p[2]) > 0.01


def test_units_driven_by_a_motion_that_was_not_played_name_no_whisker():
    command, _ = copies(3)
    time, rng = command.time.values, np.random.default_rng(2)
    tables = {
        f"u{k}": simulate_spikes(ThresholdLinearUnit(), time, copies(60 + k)[1][0], TRIALS, rng=rng) for k in range(12)
    }
    found = whisker_kernels(join_units(tables), command, TRIALS, KernelAnalysis(level=0.01))
    assert found.whisker_matters.values.any(1).sum() <= 1
    by_trials = found.whisker_trial_p_value.values.min(1) * 8 <= 0.01
    assert by_trials.sum() >= 4  # of 12 units, as the test that has trials alone for draws would have it: 0.1 by chance
