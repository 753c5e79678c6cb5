"""Figure 9: the paper's shares as it should have printed them, and the made-up units that come back."""

import io

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.figures.paper import fig9
from vibrissa.neural.simulated.population import draw_population

RNG = np.random.default_rng


def units_of(truth):
    """A table of units as a perfect analysis would give it."""
    driven = (truth.driven_by == "envelope").values
    columns = {name: np.where(driven, truth[f"true_{name}"], np.nan) for name in ("threshold", "slope", "latency")}
    columns |= {"baseline": truth.true_baseline.values, "significant": driven, "identified": driven.copy()}
    columns |= {"envelope_correlation": np.where(driven, 0.7, 0.05), "unit_session": truth.unit_session.values}
    columns["unit_quality"] = truth.unit_quality.values
    return xr.Dataset({name: ("unit", values) for name, values in columns.items()})


@pytest.fixture(scope="module")
def truth():
    return draw_population(rng=RNG(1))


@pytest.fixture(scope="module")
def data(truth):
    return fig9.compute(units_of(truth), truth=truth)


@pytest.mark.parametrize(
    ("source", "quality", "share", "low", "high"),
    [
        ("paper, N of Results", "SU", 26.5, 20.4, 33.6),
        ("paper, N of Results", "MU", 45.6, 40.5, 50.9),  # printed as 44 %
        ("paper, N of Methods", "SU", 31.5, 24.4, 39.5),
        ("paper, N of Methods", "MU", 54.3, 48.6, 60.0),
    ],
)
def test_shares_of_both_counts_have_their_wilson_intervals(data, source, quality, share, low, high):
    one = data.sel(source=source, quality=quality)
    found = [100 * one.share_driven, 100 * one.share_driven_low, 100 * one.share_driven_high]
    np.testing.assert_allclose(found, [share, low, high], atol=0.05)


def test_a_population_put_in_comes_out(data):
    here, paper = data.sel(source="here"), data.sel(source="paper, N of Results")
    np.testing.assert_array_equal(here.units_kept, [170, 344])
    np.testing.assert_array_equal(here.units_driven, paper.units_driven)
    for name in ("threshold", "slope"):
        assert np.all(np.abs(here[f"{name}_mean"] - paper[f"{name}_mean"]) < 0.5 * paper[f"{name}_sem"])
        np.testing.assert_allclose(here[f"{name}_sem"], paper[f"{name}_sem"], rtol=0.2)


def test_caption_has_the_numbers_of_the_paper(data):
    caption = data.attrs["caption"]
    assert "(paper 42.3 ± 2.1)" in caption
    assert "(paper 0.25 ± 0.05)" in caption
    assert "by ranks (paper 0.73)" in caption
    assert "beside both counts of the paper" in caption


def test_caption_says_that_units_are_simulated_only_where_they_are(truth, data):
    assert data.attrs["caption"].startswith("Figure 9. Simulated units")
    assert "Simulated" not in fig9.compute(units_of(truth)).attrs["caption"]


def test_unidentified_units_count_as_driven_but_not_in_the_means(truth):
    units = units_of(truth)
    first = int(np.flatnonzero(units.significant & (units.unit_quality == "SU"))[0])
    units.identified[first], units.threshold[first] = False, 1.0
    data = fig9.compute(units)
    assert data.units_driven.sel(source="here", quality="SU") == 45
    assert data.threshold_mean.sel(source="here", quality="SU") < 50e-6
    assert "each of the 201 units, of 202 that pass," in data.attrs["caption"]


def test_a_population_of_one_quality_has_no_numbers_of_the_other_and_no_share_is_off_the_axis(truth):
    mine = np.flatnonzero(truth.unit_quality == "SU")
    units = units_of(truth).isel(unit=mine)
    units["significant"] = ("unit", np.ones(len(mine), bool))
    data = fig9.compute(units, truth=truth.isel(unit=mine))
    assert "nan" not in data.attrs["caption"]
    assert "MU not determined (paper 43.5 ± 0.9)" in data.attrs["caption"]
    shares = next(axis for axis in fig9.draw(data).axes if axis.get_title(loc="left").startswith("F"))
    assert shares.get_ylim()[1] > 100


def test_one_unit_is_the_single_one_whose_fit_explains_most(truth):
    units, count = units_of(truth), truth.sizes["unit"]
    classes = np.linspace(5e-6, 95e-6, 10)
    units["tuning_r_squared"] = ("unit", RNG(3).uniform(0.2, 0.8, count))
    rate = 5 + units.slope.values[:, None] * np.maximum(classes - units.threshold.values[:, None], 0)
    units["response_envelope"] = (("unit", "envelope_class"), np.tile(classes, (count, 1)))
    units["response_rate"] = (("unit", "envelope_class"), rate)
    units["response_rate_se"] = (("unit", "envelope_class"), np.full(rate.shape, 0.3))
    data = fig9.compute(units)
    able = (units.significant & (units.unit_quality == "SU")).values
    best = int(np.argmax(np.where(able, units.tuning_r_squared, 0)))
    np.testing.assert_allclose(data.class_rate, rate[best])
    assert data.attrs["shown_threshold"] == float(units.threshold[best])
    assert f"threshold {1e6 * data.attrs['shown_threshold']:.1f} µm" in data.attrs["caption"]
    assert "its spontaneous rate is not known" in data.attrs["caption"]
    assert fig9.draw(data).axes[0].has_data()


def test_rates_below_the_threshold_are_held_against_the_spontaneous_ones(truth, data):
    units, count = units_of(truth), truth.sizes["unit"]
    rest = RNG(4).uniform(1, 9, count)
    units["spontaneous_rate"], units["sub_threshold_rate"] = ("unit", rest), ("unit", rest + RNG(5).normal(0, 1, count))
    found = fig9.compute(units)
    some = (units.significant & (units.unit_quality == "MU")).values
    expected = np.corrcoef(rest[some], units.sub_threshold_rate.values[some])[0, 1] ** 2
    assert float(found.rest_r2.sel(quality="MU")) == pytest.approx(expected)
    assert f"MU {expected:.2f} (paper 0.67)" in found.attrs["caption"]
    assert "D" in [axis.get_title(loc="left")[0] for axis in fig9.draw(found).axes]
    assert "D, rate below" not in data.attrs["caption"]


def test_nobody_driven_is_drawn_too(truth):
    units = units_of(truth)
    units["significant"] = ("unit", np.zeros(514, bool))
    data = fig9.compute(units)
    fig9.draw(data).savefig(io.BytesIO())
    assert "of each of the 0 units, of 0 that pass" in data.attrs["caption"]
    assert "SU not determined" in data.attrs["caption"]


def test_missing_columns_and_strange_qualities_are_refused(truth):
    units = units_of(truth)
    with refusal("missing", "table of units"):
        fig9.compute(units.drop_vars("slope"))
    with refusal("unknown", "unit_quality", value="['noise']"):
        fig9.compute(units.assign(unit_quality=("unit", ["noise"] * 514)))
    with refusal("unknown", "truth"):
        fig9.compute(units.isel(unit=slice(3)), truth=truth)


def test_drawing_labels_every_axis(data):
    figure = fig9.draw(data)
    figure.savefig(io.BytesIO())
    assert [axis.get_title(loc="left")[0] for axis in figure.axes] == list(
        "ABCEFG"
    )  # D only where rates at rest are known
    assert all(axis.get_ylabel() for axis in figure.axes if axis.axison)


def test_caption_counts_what_passes_without_being_driven(truth):
    units = units_of(truth)
    units["significant"] = ("unit", units.significant.values | (truth.driven_by == "carrier").values)
    n = int((truth.driven_by == "carrier").sum())
    caption = fig9.compute(units, truth=truth).attrs["caption"]
    others = int((truth.driven_by != "envelope").sum())
    assert f"The envelope drives 202 units, of which 202 pass the test; of the {others} others {n} pass" in caption


def test_note_ends_the_caption(truth):
    units = units_of(truth).assign_attrs(note=" Stimulus: none.")
    assert fig9.compute(units).attrs["caption"].endswith(" Stimulus: none.")
