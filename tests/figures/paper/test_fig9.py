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
    return fig9.compute(units_of(truth), rng=RNG(2), truth=truth)


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


def test_table_shows_both_readings_and_what_was_printed(data):
    table = data.table_text.values.tolist()
    text = "\n".join(" | ".join(row) for row in table)
    for told in ("170 (Results), 143 (Methods)", "344 (Results), 289 (Methods)", "printed 44 %", "45.6 % [40.5–50.9]"):
        assert told in text
    assert "31.5 % [24.4–39.5]" in text
    assert "p = 0.73" in text


def test_shares_by_sessions_are_told_only_where_resampling_tells_something(truth):
    driven = np.array([True, True, False, True])
    low, high = fig9._by_session(driven, np.array([0, 0, 1, 1]), RNG(0))
    assert low == 0.5
    assert high == 1.0
    for alike, session in ((np.ones(4, bool), [0, 0, 1, 1]), (~np.ones(4, bool), [0, 0, 1, 1]), (driven, [0, 0, 0, 0])):
        assert np.isnan(fig9._by_session(alike, np.array(session), RNG(0))).all()


def test_caption_says_that_units_are_simulated_only_where_they_are(truth, data):
    assert data.attrs["caption"].startswith("Simulated units")
    assert "Simulated" not in fig9.compute(units_of(truth), rng=RNG(2)).attrs["caption"]


def test_unidentified_units_count_as_driven_but_not_in_the_means(truth):
    units = units_of(truth)
    first = int(np.flatnonzero(units.significant & (units.unit_quality == "SU"))[0])
    units.identified[first], units.threshold[first] = False, 1.0
    data = fig9.compute(units, rng=RNG(0))
    assert data.units_driven.sel(source="here", quality="SU") == 45
    assert data.threshold_mean.sel(source="here", quality="SU") < 50e-6
    assert "202 units that pass the test, 201 have" in data.attrs["caption"]


def test_sessions_that_agree_in_nothing_widen_the_interval(truth):
    units = units_of(truth)
    units["significant"] = ("unit", units.unit_session.values < 5)  # all units of some sessions, none of the others
    table = fig9.compute(units, rng=RNG(0)).table_text.values.tolist()
    row = next(row for row in table if row[0] == "share, 95 % by sessions")
    low, high = (float(end) for end in row[2].strip("[]").split("–"))
    assert high - low > 35  # Wilson's is 14 wide


def test_a_population_of_one_quality_has_dashes_and_no_share_is_off_the_axis(truth):
    mine = np.flatnonzero(truth.unit_quality == "SU")
    units = units_of(truth).isel(unit=mine)
    units["significant"] = ("unit", np.ones(len(mine), bool))
    data = fig9.compute(units, rng=RNG(0), truth=truth.isel(unit=mine))
    assert not any("nan" in cell for row in data.table_text.values.tolist() for cell in row)
    row = next(row for row in data.table_text.values.tolist() if row[0].startswith("share of N, Results"))
    assert row[2].startswith("100.0 %")
    assert row[4] == "–"
    shares = next(axis for axis in fig9.draw(data).axes if axis.get_title(loc="left").startswith("E"))
    assert shares.get_ylim()[1] > 100


def test_the_legend_of_the_correlations_lies_above_their_bars(data):
    figure = fig9.draw(data)
    figure.draw_without_rendering()
    axis = next(axis for axis in figure.axes if axis.get_title(loc="left").startswith("D"))
    tallest = max(bar.get_height() for bar in axis.patches if hasattr(bar, "get_height"))
    outline = max(patch.get_xy()[:, 1].max() for patch in axis.patches if not hasattr(patch, "get_height"))
    top = axis.transData.transform((0, max(tallest, outline)))[1]
    assert axis.get_legend().get_window_extent().y0 > top


def test_nobody_driven_is_drawn_too(truth):
    units = units_of(truth)
    units["significant"] = ("unit", np.zeros(514, bool))
    fig9.draw(fig9.compute(units, rng=RNG(0))).savefig(io.BytesIO())


def test_missing_columns_and_strange_qualities_are_refused(truth):
    units = units_of(truth)
    with refusal("missing", "table of units"):
        fig9.compute(units.drop_vars("slope"), rng=RNG(0))
    with refusal("unknown", "unit_quality", value="['noise']"):
        fig9.compute(units.assign(unit_quality=("unit", ["noise"] * 514)), rng=RNG(0))
    with refusal("unknown", "truth"):
        fig9.compute(units.isel(unit=slice(3)), rng=RNG(0), truth=truth)


def test_drawing_labels_every_axis(data):
    figure = fig9.draw(data)
    figure.savefig(io.BytesIO())
    assert len(figure.axes) == 7
    for axis in figure.axes[:6]:
        assert axis.get_ylabel()
        assert axis.get_title(loc="left")


def test_caption_counts_what_passes_without_being_driven(truth):
    units = units_of(truth)
    units["significant"] = ("unit", units.significant.values | (truth.driven_by == "carrier").values)
    n = int((truth.driven_by == "carrier").sum())
    caption = fig9.compute(units, rng=RNG(0), truth=truth).attrs["caption"]
    assert f"Driven units that pass the test: 202 of 202. Driven by something else, and passing: {n} of {n}" in caption
    assert "Units locked to the carrier pass where the motion is lopsided" in caption


def test_note_ends_the_caption(truth):
    units = units_of(truth).assign_attrs(note=" Stimulus: none.")
    assert fig9.compute(units, rng=RNG(0)).attrs["caption"].endswith(" Stimulus: none.")
