"""Paper | here | same? of neurons: verdicts right on units of the paper's own numbers, reasons where there are none."""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import t

from vibrissa.study.paper.paper_neurons import MEASURES, NO_UNITS, pooled
from vibrissa.study.paper.paper_numbers import NO_SWEEPS, compare, paper_numbers
from vibrissa.study.paper.paper_table import html_rows

COUNTS = {"SU": (170, 45, 42.3e-6, 14.1e-6), "MU": (344, 157, 43.5e-6, 11.3e-6)}


def drawn(*, threshold=1.0, share=1.0, simulated=True, seed=1):
    """Units with the paper's shares, thresholds and slopes, straight from the printed means and spreads."""
    rng, parts = np.random.default_rng(seed), []
    for quality, (n, k, mean, sd) in COUNTS.items():
        driven = np.arange(n) < round(share * k)
        rest = rng.uniform(2, 20, n)
        columns = {
            "unit_quality": np.full(n, quality),
            "significant": driven,
            "identified": driven,
            "threshold": np.where(driven, threshold * rng.normal(mean, sd, n), np.nan),
            "slope": np.where(driven, 0.25e6 * rng.lognormal(-0.3, 0.78, n), np.nan),
            "latency": np.where(driven, 0.01, np.nan),
            "baseline": np.where(driven, 5.0, np.nan),
            "unit_rate": rng.uniform(1.2, 9, n),
            "tuning_r_squared": np.where(driven, rng.normal(0.71, 0.15, n), np.nan),
            "envelope_correlation": rng.uniform(0, 1, n),
            "spontaneous_rate": rest,
            "sub_threshold_rate": np.where(driven, rest + rng.normal(0, 0.7, n), np.nan),
            "unit_session": rng.integers(15, size=n),
        }
        if simulated:
            columns["driven_by"] = np.where(driven, "envelope", "nothing")
        parts.append(xr.Dataset({name: ("unit", values) for name, values in columns.items()}))
    told = {"n_trials": 80, "bin_width": 0.01, "level": 0.01, "null": "circular", "lag_low": 0, "lag_high": 3}
    return xr.concat(parts, "unit").assign_attrs(told)


def by_id(rows):
    return {row.paper.id: row for row in rows}


@pytest.fixture(scope="module")
def rows():
    return by_id(compare({"units": drawn()}))


def test_units_of_the_papers_numbers_are_the_same(rows):
    for name in (
        *("driven_su", "driven_mu", "driven_mu_printed", "threshold_su", "threshold_mu"),
        *("envelope_r2_su", "envelope_r2_mu", "threshold_difference", "slope_difference"),
    ):
        assert rows[name].verdict == "same", (name, rows[name])
    for name in ("slope_su", "slope_mu"):  # the paper's own interval, of 15 sessions, reaches beyond half
        assert rows[name].verdict == "cannot tell", (name, rows[name])
    assert rows["driven_su"].here.value == 45 / 170
    assert rows["driven_su"].why == "45 of 170 pass; driven, as put in: 45, of which 45 pass"
    assert rows["threshold_mu"].here.n == 157
    assert rows["threshold_su"].origin == rows["driven_mu"].origin == "recovered"
    assert rows["envelope_r2_su"].origin == "result"
    assert rows["presentations"].why == ""
    assert rows["presentations_caption"].why == "other than the paper's"


def test_every_row_of_neurons_has_a_measure_or_a_reason():
    neural = [number for number in paper_numbers() if number.is_neural]
    assert {number.figure for number in neural} == {"8", "9"}
    assert {number.id for number in neural if not number.why} == set(MEASURES)


def test_means_and_shares_are_those_printed(rows):
    threshold = rows["threshold_su"].paper
    half = t.ppf(0.975, 14) * 2.1e-6 * np.sqrt(45 / 15)  # sessions, not units
    np.testing.assert_allclose(threshold.interval, (42.3e-6 - half, 42.3e-6 + half), rtol=1e-5)
    assert rows["driven_su"].paper.value == 45 / 170
    assert rows["driven_mu"].paper.value == 157 / 344
    for name in ("envelope_r2_mu", "slope_mu", "threshold_mu"):
        paper = rows[name].paper
        sem = {"envelope_r2_mu": 0.01, "slope_mu": 0.02e6, "threshold_mu": 0.9e-6}[name]
        assert paper.sd / np.sqrt(paper.n) == pytest.approx(sem, rel=1e-3)


def test_where_the_paper_disagrees_with_itself_both_readings_stand(rows):
    assert rows["driven_su"].paper.interval != rows["driven_su_methods"].paper.interval
    assert rows["units_mu"].paper.value == 344
    assert rows["units_mu_methods"].paper.value == 289
    assert rows["units_mu_methods"].why == "other than the paper's"
    for these, those in (("driven_su", "driven_su_methods"), ("driven_mu", "driven_mu_printed")):
        assert rows[these].here == rows[those].here
        assert rows[those].paper.reading


def test_other_thresholds_or_shares_differ():
    other = by_id(compare({"units": drawn(threshold=1.8, share=0.4)}))
    for name in ("threshold_su", "threshold_mu", "driven_mu", "driven_mu_methods"):
        assert other[name].verdict == "differs", (name, other[name].here)


def test_recorded_units_come_out_and_go_before_simulated_ones():
    own = by_id(compare({"units": drawn(), "units_1": drawn(simulated=False, seed=2)}))
    assert own["threshold_su"].origin == own["driven_su"].origin == "result"
    assert own["driven_su"].why.endswith("45 of 170 pass")
    assert own["stimulus_contact"].why == "not in the table of units"
    both = {"units_1": drawn(simulated=False), "units_2": drawn(simulated=False, seed=3)}
    assert pooled(both).sizes["unit"] == 2 * 514
    assert by_id(compare(both))["cortex_sessions"].here.value == 30


def test_the_rate_below_threshold_is_held_against_the_spontaneous_one(rows):
    assert rows["spontaneous_su"].here.value == pytest.approx(0.98, abs=0.01)
    assert rows["spontaneous_su"].verdict == "differs"  # not 0.66
    alike = by_id(compare({"units": drawn().assign(sub_threshold_rate=drawn().spontaneous_rate)}))["spontaneous_su"]
    assert (alike.here.value, alike.verdict) == (pytest.approx(1), "cannot tell")
    assert alike.why.startswith("no interval: the number lies at the end of its range")
    silent = drawn().assign(spontaneous_rate=("unit", np.full(514, np.nan)))
    found = by_id(compare({"units": silent}))["spontaneous_mu"]
    assert (found.verdict, found.why) == ("not measured", "no window without stimulus")


def test_half_a_study_tells_that_the_other_half_is_absent():
    without = by_id(compare({}))
    assert without["threshold_su"].why == without["presentations"].why == NO_UNITS
    assert without["threshold_su"].verdict == without["presentations"].verdict == "not measured"
    of_units = by_id(compare({"units": drawn()}))
    assert (of_units["variance_1"].verdict, of_units["variance_1"].why) == ("not measured", NO_SWEEPS)
    assert of_units["frame_rate"].verdict == "not measured"


def test_units_without_quality_say_what_they_lack():
    found = by_id(compare({"units": drawn(simulated=False).drop_vars("unit_quality")}))
    assert found["threshold_su"].verdict == "not measured"
    assert "give it a column quality" in found["threshold_su"].why


def test_a_single_session_has_no_interval():
    one = drawn().assign(unit_session=("unit", np.zeros(514, int)))
    found = by_id(compare({"units": one}))["threshold_su"]
    assert (found.verdict, found.why.split(";")[0]) == ("cannot tell", "no interval: fewer than two sessions")


def test_thresholds_are_shown_in_micrometres_and_slopes_in_the_papers_unit(rows):
    shown = {one["paper"]: one["here"] for one in html_rows(list(rows.values()))}
    assert "µm" in next(here for paper, here in shown.items() if paper.startswith("threshold of single"))
    assert "AP/s/µm" in next(here for paper, here in shown.items() if paper.startswith("slope of multi"))
