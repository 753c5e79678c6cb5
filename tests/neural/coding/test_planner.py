"""Trials needed: information by closed form, plans that hold on simulated units, and units no plan can help."""

import numpy as np
import pytest
from populations import ringing
from refusals import refusal

from vibrissa.neural.coding.planner import Wanted, covariance, expected_of, information, no_answer, plan_trials
from vibrissa.neural.coupling.presentation import Presentation
from vibrissa.neural.coupling.threshold_linear import BinnedDrive, Hinge, HingeGrid
from vibrissa.neural.coupling.tuning import forward_fit, predicted
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
from vibrissa.quantities import dataset

WIDTH = 0.01


@pytest.fixture(scope="module")
def drive():
    time, displacement = ringing(np.random.default_rng(1))
    return Presentation.of(dataset(time=time, point_displacement=displacement)).drive()


def hinge(unit):
    return Hinge(unit.threshold, unit.slope, unit.latency, unit.baseline)


def ramp():
    """BinnedDrive by an envelope that rises evenly from 0 to 1 in 1 s."""
    time = np.linspace(-0.5, 1.5, 40_001)
    return BinnedDrive(
        time=time, envelope=np.clip(time, 0, 1), edges=np.linspace(0.1, 0.9, 801), valid=np.ones(800, bool)
    )


def test_information_of_a_ramp_is_the_integral():
    unit = ThresholdLinearUnit(threshold=0.4, slope=50.0, baseline=5.0, latency=0.0101)
    found = information(ramp(), unit)
    above = np.linspace(0, 0.9 - 0.4 - 0.0101, 200_001)  # A − θ while it is driven
    rate = 5 + 50 * above
    step = above[1]
    weigh = np.trapezoid
    entries = {
        (0, 0): weigh(50**2 / rate, dx=step),
        (0, 1): weigh(-50 * above / rate, dx=step),
        (1, 1): weigh(above**2 / rate, dx=step),
        (0, 2): weigh(50 * 50 / rate, dx=step),  # on a ramp of slope 1 a later response is a higher threshold
        (0, 3): weigh(-50 / rate, dx=step),
        (3, 3): weigh(1 / rate, dx=step) + (0.8 - above[-1]) / 5,
    }
    for place, value in entries.items():
        assert found[place] == pytest.approx(value, rel=0.01), place
    np.testing.assert_allclose(found, found.T)
    assert no_answer(ramp(), unit) == "this stimulus does not separate threshold, slope, latency and baseline"


def test_information_is_the_curvature_of_the_likelihood(drive):
    unit = ThresholdLinearUnit()
    rate = predicted(drive, hinge(unit))

    def lost(slope, baseline):
        expected = WIDTH * (baseline + slope * drive.hinged(unit.threshold, unit.latency))
        return np.sum(expected - WIDTH * rate * np.log(expected))

    h = 2.5e3
    bend = (lost(2.5e5 + h, 5) - 2 * lost(2.5e5, 5) + lost(2.5e5 - h, 5)) / h**2
    assert information(drive, unit)[1, 1] == pytest.approx(bend, rel=1e-3)


@pytest.mark.parametrize(
    ("unit", "wanted", "gain_sd"),
    [
        (ThresholdLinearUnit(), Wanted(threshold=4e-6), 0.0),
        (ThresholdLinearUnit(baseline=1.0), Wanted(slope=0.1), 0.3),
    ],
)
def test_planned_trials_give_the_interval_that_was_wanted(drive, unit, wanted, gain_sd):
    n = int(plan_trials(drive, [unit], wanted, gain_sd=gain_sd).trials_needed.item())
    grid, rate, sigma = HingeGrid.of(drive), predicted(drive, hinge(unit)), np.sqrt(np.log1p(gain_sd**2))
    fits = []
    for seed in range(50):
        rng = np.random.default_rng([3, seed])
        gain = np.exp(sigma * rng.standard_normal(n) - sigma**2 / 2).sum()
        fits.append(forward_fit(grid, rng.poisson(rate * WIDTH * gain).astype(float), n * WIDTH))
    name, k = ("threshold", 0) if wanted.threshold else ("slope", 1)
    target = wanted.threshold or wanted.slope * unit.slope
    error = np.array(fits)[:, k] - getattr(unit, name)
    assert np.sum(np.abs(error) <= target) > 43  # 95 % of 50, less two and a half standard deviations
    assert 0.8 < 1.96 * error.std(ddof=1) / target < 1.25  # not more trials than needed, either


def test_trials_go_with_the_square_of_the_interval(drive):
    units = [ThresholdLinearUnit(slope=1e5)]
    wide, narrow = (plan_trials(drive, units, Wanted(threshold=a, slope=0.1, latency=a * 250)) for a in (4e-6, 2e-6))
    ratio = (narrow.trials_for_threshold / wide.trials_for_threshold).item()
    assert ratio == pytest.approx(4, rel=0.02)
    assert narrow.trials_for_slope == wide.trials_for_slope
    assert narrow.trials_needed == max(narrow[f"trials_for_{name}"] for name in ("threshold", "slope", "latency"))
    half = wide.threshold_within.values[0]
    np.testing.assert_allclose(half[:-1] / half[1:], np.sqrt(2))


def test_weaker_units_need_more_and_never_fewer_than_can_be_resampled(drive):
    units = [ThresholdLinearUnit(slope=s) for s in (1e6, 2.5e5, 5e4)]
    found = plan_trials(drive, units, Wanted(slope=0.3))
    assert np.all(np.diff(found.trials_needed) >= 0)
    assert found.trials_needed[2] > 5 * found.trials_needed[0] == 5 * 8
    silent = plan_trials(drive, [ThresholdLinearUnit(baseline=0.0)], Wanted(threshold=4e-6))
    assert np.isfinite(silent.trials_needed).all()


def test_gain_from_trial_to_trial_costs_slope_and_not_threshold(drive):
    steady, varying = (covariance(drive, ThresholdLinearUnit(), gain_sd=sd) for sd in (0.0, 0.5))
    assert varying[0, 0] == steady[0, 0]
    assert varying[1, 1] - steady[1, 1] == pytest.approx((0.5 * 2.5e5) ** 2)


@pytest.mark.parametrize(
    ("unit", "why"),
    [
        (ThresholdLinearUnit(slope=0.0), "slope 0"),
        (ThresholdLinearUnit(threshold=300e-6), "threshold above the envelope's range"),
        (ThresholdLinearUnit(threshold=1e-6), "threshold below the envelope's range"),
        (ThresholdLinearUnit(latency=0.05), "latency not within"),
    ],
)
def test_where_no_number_of_trials_will_do_it_says_why(drive, unit, why):
    found = plan_trials(drive, [unit, ThresholdLinearUnit()], Wanted(threshold=4e-6))
    assert np.isnan(found.trials_needed[0])
    assert np.isnan(found.threshold_within[0]).all()
    assert str(found.reason.values[0]).startswith(why)
    assert found.trials_needed[1] > 0
    assert found.reason.values[1] == ""


def test_plans_of_nothing_are_refused(drive):
    with refusal("unknown", "interval"):
        Wanted()
    with refusal("range", "interval wanted"):
        Wanted(slope=-0.1)
    for change, fields in (
        ({"units": [], "at": (8,)}, ("missing", "plan", "0 units, (8,)")),
        ({"gain_sd": -1.0}, ("range", "gain_sd", "-1.0")),
        ({"at": (0,)}, ("missing", "plan", "1 units, (0,)")),
    ):
        with refusal(*fields):
            plan_trials(drive, **{"units": [ThresholdLinearUnit()], "wanted": Wanted(slope=0.1), **change})


def test_variable_counts_need_as_many_more_trials(drive):
    unit, wanted = ThresholdLinearUnit(), Wanted(threshold=3e-6)
    plain, twice = (plan_trials(drive, [unit], wanted, fano_factor=one) for one in (1.0, 2.0))
    assert twice.trials_needed.item() == pytest.approx(2 * plain.trials_needed.item(), abs=1)
    each = plan_trials(drive, [unit, unit], wanted, fano_factor=[1.0, 2.0])
    assert each.trials_needed.values.tolist() == [plain.trials_needed.item(), twice.trials_needed.item()]
    for wrong, kind in ((0.0, "range"), ([1.0], "shape")):
        with refusal(kind):
            plan_trials(drive, [unit, unit], wanted, fano_factor=wrong)


def test_plans_take_units_as_the_analysis_found_them(drive):
    nan = np.nan
    columns = {"threshold": [4e-5, nan], "slope": [2e5, nan], "latency": [0.012, nan], "baseline": [5.0, nan]}
    table = dataset(**{name: np.array(one) for name, one in columns.items()}, fano_factor=np.array([1.4, nan]),
                    trial_gain_sd=np.array([0.2, nan]), unit_name=np.array(["MU1", "MU2"]))  # fmt: skip
    units, gain, fano, names = expected_of(table)
    assert names == ["MU1"]
    assert [unit.threshold for unit in units] == [4e-5]
    assert (gain.tolist(), fano.tolist()) == ([0.2], [1.4])
    with refusal("missing", "table of units"):
        expected_of(table.isel(unit=[1]))
