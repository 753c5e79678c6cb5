"""Units of one whisker: drawn as the paper found them, or from a table; their rates are the hinge."""

import numpy as np
import pytest
from refusals import refusal

from vibrissa.neural.simulated.driven import draw_driven, fire, read_driven, write_driven
from vibrissa.neural.simulated.population import THRESHOLD
from vibrissa.signals.envelope import analytic_envelope

TIME = np.arange(0, 2.0, 1 / 5000)
MOTION = 60e-6 * (1 + 0.9 * np.sin(2 * np.pi * 1.5 * TIME)) * np.sin(2 * np.pi * 90 * TIME)
TABLE = "unit,threshold_um,slope_per_um,baseline,latency_ms\n"


def test_the_paper_s_thresholds_are_met_by_any_number_of_units():
    units = draw_driven(202, rng=np.random.default_rng(1))
    assert (units.unit_quality == "SU").sum() == 45
    for quality, (mean, sd) in THRESHOLD.items():
        own = units.true_threshold.values[units.unit_quality == quality]
        np.testing.assert_allclose([own.mean(), own.std()], [mean, sd], rtol=0.02)  # cut at 0: little is lost
    assert set(units.driven_by.values) == {"envelope"}
    assert draw_driven(1, rng=np.random.default_rng(1)).sizes["unit"] == 1


def expected_rate(units, k):
    """The formula, written out once more."""
    envelope = analytic_envelope(MOTION)[0]
    late = np.interp(TIME - float(units.true_latency[k]), TIME, envelope, left=0.0)
    drive = np.maximum(late - float(units.true_threshold[k]), 0)
    return float(units.true_baseline[k]) + float(units.true_slope[k]) * drive


def test_rates_are_the_hinge_of_the_envelope_over_fifty_seeds():
    units = draw_driven(12, rng=np.random.default_rng(2))
    units["unit_quality"] = ("unit", np.repeat("MU", 12))  # Poisson: the counts' variance is their mean
    bins, trials, seeds = np.linspace(0, TIME[-1], 11), 20, 50
    count = np.zeros((12, 10))
    for seed in range(seeds):
        spikes = fire(units, TIME, MOTION, trials, seed=seed)
        count += np.histogram2d(spikes.spike_unit, spikes.spike_time, [np.arange(13) - 0.5, bins])[0]
    for k in range(12):
        rate = expected_rate(units, k)
        whole = np.append(0, np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(TIME)))
        expected = trials * seeds * np.diff(np.interp(bins, TIME, whole))
        z = (count[k] - expected) / np.sqrt(expected)
        assert (z**2).sum() < 35  # chi squared of 10 bins: 1e-4


def test_single_units_rest_and_keep_their_mean_rate():
    units = draw_driven(1, rng=np.random.default_rng(3))
    units["unit_quality"] = ("unit", ["SU"])
    spikes = fire(units, TIME, MOTION, 2000, seed=1)
    same = np.diff(spikes.spike_trial.values) == 0
    assert np.diff(spikes.spike_time.values)[same].min() >= 1e-3
    expected = np.trapezoid(expected_rate(units, 0), TIME) / TIME[-1]
    assert float(spikes.unit_rate[0]) == pytest.approx(expected, rel=0.02)


def test_the_share_of_time_above_threshold_is_told():
    units = draw_driven(3, rng=np.random.default_rng(4))
    units["true_threshold"] = ("unit", [0.0, 60e-6, 1e-3])
    found = fire(units, TIME, MOTION, 1).time_above_threshold.values
    np.testing.assert_allclose(found, [1.0, 0.5, 0.0], atol=0.01)


def test_equal_seeds_give_equal_spikes():
    units = draw_driven(5, rng=np.random.default_rng(5))
    one, other, third = (fire(units, TIME, MOTION, 3, seed=seed) for seed in (7, 7, 8))
    assert one.identical(other)
    assert one.sizes["spike"] != third.sizes["spike"]


def test_a_table_of_units_comes_back_to_the_last_bit(tmp_path):
    units = draw_driven(9, rng=np.random.default_rng(6))
    write_driven(units, tmp_path / "u.csv")
    found = read_driven(tmp_path / "u.csv")
    assert found.identical(units)


def test_a_table_in_the_paper_s_units(tmp_path):
    (tmp_path / "u.csv").write_text(TABLE + "a,42.3,0.25,5,12\nb,10,0,0,0\n")
    found = read_driven(tmp_path / "u.csv")
    np.testing.assert_allclose(found.true_threshold, [42.3e-6, 10e-6])
    np.testing.assert_allclose(found.true_slope, [2.5e5, 0])
    np.testing.assert_allclose(found.true_latency, [0.012, 0])
    assert found.unit_quality.values.tolist() == ["MU", "MU"]


BAD = {
    "no unit": (TABLE, ("too-few", "u.csv", "none")),
    "no name": (TABLE + ",42.3,0.25,5,12\n", ("format", "u.csv, line 2, unit", "''")),
    "twice": (TABLE + "a,42.3,0.25,5,12\na,42.3,0.25,5,12\n", ("format", "u.csv, line 3, unit", "'a'")),
    "no number": (TABLE + "a,x,0.25,5,12\n", ("format", "u.csv, line 2, threshold_um", "'x'")),
    "negative": (TABLE + "a,42.3,-1,5,12\n", ("format", "u.csv, line 2, slope_per_um", "'-1'")),
    "µm for m": (
        TABLE.replace("_um,s", ",s") + "a,42.3,0.25,5,12\n",
        ("format", "u.csv, line 2, threshold", "'42.3'"),
        "a column threshold_um takes µm",
    ),
    "per µm for per m": (
        TABLE.replace("_per_um", "") + "a,42.3,0.25,5,12\n",
        ("format", "u.csv, line 2, slope", "'0.25'"),
        "a column slope_per_um",
    ),
    "ms for s": (
        TABLE.replace("_ms", "") + "a,42.3,0.25,5,12\n",
        ("format", "u.csv, line 2, latency", "'12'"),
        "a column latency_ms takes ms",
    ),
    "column": (
        "unit,threshold\na,1e-5\n",
        ("missing", "u.csv, line 1", "'unit,threshold'"),
        "must have a column slope",
    ),
    "quality": (
        TABLE.replace("\n", ",quality\n") + "a,42.3,0.25,5,12,good\n",
        ("format", "u.csv, line 2, quality", "'good'"),
    ),
    "both": (
        "threshold," + TABLE + "1,a,42.3,0.25,5,12\n",
        ("missing", "u.csv, line 1"),
        "must have one column threshold",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_table_of_units_is_one_line(name, tmp_path):
    text, fields, *rule = BAD[name]
    (tmp_path / "u.csv").write_text(text)
    with refusal(*fields) as caught:
        read_driven(tmp_path / "u.csv")
    assert all(part in caught.value.rule for part in rule)


@pytest.mark.parametrize("count", [0, -3, 10**6])
def test_a_bad_number_of_units_is_refused(count):
    with refusal("range", "number of units"):
        draw_driven(count, rng=np.random.default_rng(0))
