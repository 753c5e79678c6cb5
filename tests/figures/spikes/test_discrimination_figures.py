"""Figures of discrimination and of plans: what they draw agrees with what was found."""

import io

import numpy as np
import pytest

from vibrissa.figures.spikes import discrimination as discrimination_figure
from vibrissa.figures.spikes import planner as planner_figure
from vibrissa.neural.coding.discrimination import Discrimination, accuracy_by_units, discriminate
from vibrissa.neural.coding.planner import Wanted, plan_trials
from vibrissa.neural.coupling.threshold_linear import BinnedDrive
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit


@pytest.fixture(scope="module")
def found():
    rng = np.random.default_rng(1)
    label = rng.permutation(np.arange(60) % 3)
    counts = rng.poisson(rng.gamma(2.0, 0.3, (3, 4, 8))[label]).astype(float)
    how, names = Discrimination(n_permutations=79, n_partitions=1), [f"grating {k}" for k in label]
    return discriminate(counts, names, how), accuracy_by_units(counts, names, [1, 4], how, n_draws=3)


def labelled(figure, panels):
    figure.savefig(io.BytesIO())  # a warning would be an error
    titled = [axis for axis in figure.axes if axis.get_title(loc="left")]
    assert len(titled) == panels
    assert all(axis.get_ylabel() for axis in titled)


def test_curves_hold_the_areas(found):
    data = discrimination_figure.compute({"discrimination": found[0]})
    area = np.trapezoid(data.roc_true, data.roc_false, axis=-1)
    np.testing.assert_allclose(area, data.auc.mean("contrast"), atol=0.05)  # pooled over folds, and between steps
    assert data.attrs["best"] == str(data.code.values[np.argmax(data.accuracy.values)])
    for code in data.code.values:
        assert str(code) in data.attrs["caption"]
    labelled(discrimination_figure.draw(data), 4)


def test_pairs_are_drawn_where_no_numbers_of_units_were_tried(found):
    with_units = found[0].merge(found[1], combine_attrs="override")
    data = discrimination_figure.compute({"discrimination": with_units})
    assert "D: accuracy from so many units" in data.attrs["caption"]
    labelled(discrimination_figure.draw(data), 4)
    assert "D: d′ of each pair" in discrimination_figure.compute({"discrimination": found[0]}).attrs["caption"]


def test_map_is_that_of_the_plans():
    time = np.arange(0, 4, 1 / 2000)
    envelope = 60e-6 * (1 + np.sin(2 * np.pi * 1.3 * time) * np.cos(2 * np.pi * 3.1 * time))
    drive = BinnedDrive(time=time, envelope=envelope, edges=np.linspace(0.1, 3.9, 381), valid=np.ones(380, bool))
    wanted, unit = Wanted(threshold=5e-6, slope=0.2), ThresholdLinearUnit()
    data = planner_figure.compute(drive, unit, wanted)
    i, j = 12, 10
    one = ThresholdLinearUnit(threshold=float(data.planned_threshold[j]), slope=float(data.planned_slope[i]))
    assert data.trials_map[i, j] == plan_trials(drive, [one], wanted).trials_needed[0]
    assert np.isnan(data.trials_map[:, 0]).all()  # below the envelope's range
    assert np.all(data.trials_map[0, 1:-2] >= data.trials_map[-1, 1:-2])  # weak units need more
    assert "threshold within 5 µm, slope within 20 %" in data.attrs["caption"]
    labelled(planner_figure.draw(data), 4)
