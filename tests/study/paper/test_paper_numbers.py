"""The table paper | here | same?: no number without a verdict, and the verdicts right on sweeps of known truth."""

import json
import re

import numpy as np
import pytest
import xarray as xr
from scipy.stats import fisher_exact, pearsonr

from vibrissa.exact import cone_kappa
from vibrissa.stats import RANGES, share_interval
from vibrissa.study.paper import paper_numbers as module
from vibrissa.study.paper.paper_columns import MODEL, OWN, ROD, own_sweeps
from vibrissa.study.paper.paper_numbers import ComparedNumber, compare, paper_numbers
from vibrissa.study.paper.paper_rule import RULE, verdict
from vibrissa.study.paper.paper_table import headings, html_rows, page_of, tally
from vibrissa.study.paper.sweep_measures import MeasuredNumber

PAPER_E, NOMINAL_E = 3.74e9, 3.74e9
VERDICTS = {"same", "differs", "cannot tell", "put in", "not comparable", "not measured"}


def simulated(*, modulus=PAPER_E, angle_gain=2.0, virtual=True, seed=1):
    """Table of sweeps straight from the closed forms: 4 animals, 3 whiskers each, 6 conditions, 4 textures."""
    rng = np.random.default_rng(seed)
    animal, name, condition, texture = (np.ravel(one) for one in np.meshgrid(
        ["r1", "r2", "r3", "r4"], ["beta", "C1", "C2"], np.arange(6), np.arange(4), indexing="ij"))  # fmt: skip
    whisker = np.unique([f"{a} {b}" for a, b in zip(animal, name, strict=True)], return_inverse=True)[1]
    n, place = len(animal), 6 * whisker + condition
    contact, angle = rng.uniform(0.12, 0.5, 72)[place], rng.uniform(0.8, 1.4, 72)[place]
    length = rng.normal(0.04, 0.004, 12)[whisker]
    timescale = 2 * length / 1.5e-3 * np.sqrt(1140 / NOMINAL_E)
    kappa = np.array([cone_kappa(float(e), 3) for e in contact])
    frequency = kappa * np.sqrt(modulus / NOMINAL_E) / (2 * np.pi * timescale[:, None])
    frequency *= np.exp(0.05 * rng.normal(size=(n, 3)))
    damping = 0.11 * np.exp(0.2 * rng.normal(size=(n, 3)))
    share = np.array([0.66, 0.19, 0.06]) + 0.01 * rng.normal(size=(n, 3))
    rms = 2.6e-3 * angle_gain ** ((angle - 1.1) / 0.6) * np.exp(0.05 * rng.normal(size=n))
    one = {
        "animal": animal, "whisker_name": name, "condition": condition, "texture": texture, "contact": contact,
        "base_angle": angle, "scan_speed": rng.choice([0.1, 0.15, 0.2], n), "base_height": rng.uniform(0.014, 0.033, n),
        "length": length, "cone_angle": np.full(n, 1.5e-3), "timescale": timescale, "accepted": np.ones(n, bool),
        "profile_r2": np.full(n, 0.99), "contact_travel": np.full(n, 0.01),
        **({"contact_true": contact} if virtual else {}),
    }  # fmt: skip
    by_mode = {
        "resonant_frequency_white": frequency, "resonant_frequency": frequency * 1.05,
        "damping": damping, "damping_white": damping,
        "fit_r2_white": np.full((n, 3), 0.65), "variance_explained": share, "mode_rms": rms[:, None] * [1, 0.5, 0.2],
        "mode_rms_model": rms[:, None] * [1, 0.5, 0.2] * 2.0 ** (angle - 1.1)[:, None],
    }  # fmt: skip
    table = {key: ("sweep", values) for key, values in one.items()}
    table |= {key: (("sweep", "mode"), values) for key, values in by_mode.items()}
    told = {"laboratory": json.dumps({"camera": {"frame_rate": 2000.0}, "friction": 0.4})}
    return xr.Dataset(table, {"sweep": np.arange(n), "mode": [1, 2, 3]}, told if virtual else {})


def by_id(rows) -> dict[str, ComparedNumber]:
    return {row.paper.id: row for row in rows}


def only(results, *names) -> dict[str, ComparedNumber]:
    """Compare these numbers alone: each has its row to itself, and all of them take seconds."""
    numbers = [number for number in paper_numbers() if number.id in names]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "paper_numbers", lambda: numbers)
        return by_id(compare(results))


@pytest.fixture(scope="module")
def rows():
    return by_id(compare({"sweeps": simulated()}))


def test_every_number_has_its_own_name_and_a_verdict(rows):
    assert len(rows) == len(paper_numbers()) == len({number.id for number in paper_numbers()})
    for found in (compare({}), rows.values(), compare({"sweeps": simulated().isel(sweep=[0])})):
        for row in found:
            assert row.verdict in VERDICTS
            assert row.why or row.verdict not in ("not comparable", "not measured"), row.paper.id
    assert {number.figure for number in paper_numbers()} == set("123456789")


@pytest.mark.parametrize(
    ("these", "those"),
    [
        ("modulus", "modulus_bracket"),  # 3.74 and 3.68 GPa
        ("collapse_r2_1", "collapse_r2_1_caption"),  # 0.98, N = 502; 0.63, N = 582
        ("collapse_r2_2", "collapse_r2_2_caption"),
    ],
)
def test_both_readings_stand_where_the_paper_disagrees_with_itself(rows, these, those):
    assert rows[these].paper.value != rows[those].paper.value
    assert rows[these].paper.reading
    assert rows[those].paper.reading
    assert rows[these].here == rows[those].here


def test_numbers_are_those_of_the_paper(rows):
    assert rows["significant_1"].paper.value == 161 / 165
    assert rows["significant_2"].paper.value == 186 / 192
    mean = rows["variance_1"].paper
    half = 2.17881 * 0.107 / np.sqrt(13)  # t of 12 degrees of freedom, whiskers and not sweeps
    np.testing.assert_allclose(mean.interval, (0.664 - half, 0.664 + half), rtol=1e-5)
    shares = sum(rows[f"variance_{mode}"].paper.value for mode in (1, 2, 3))
    assert shares == pytest.approx(rows["variance_sum"].paper.value, abs=1e-9)


def test_sweeps_made_of_the_papers_numbers_are_the_same(rows):
    for name in ("modulus", "damping_1", "variance_1", "variance_sum", "collapse_least", "kappa_air_1",
                 "kappa_air_2", "frequency_contact_1", "gain_angle", "gain_angle_two", "gain_ratio"):  # fmt: skip
        assert rows[name].verdict == "same", (name, rows[name].here)
    assert rows["modulus"].here.value == pytest.approx(PAPER_E, rel=0.01)
    assert 0.95 < rows["collapse_r2_1"].here.value < 0.995  # of the scatter put in
    assert rows["gain_ratio"].here.low < 2 < rows["gain_ratio"].here.high
    assert rows["speeds"].here[:3] == pytest.approx((0.15, 0.1, 0.2))
    assert (rows["whiskers"].here.value, rows["textures"].here.value) == (12, 4)
    assert rows["frame_rate"].here.value == 2000


def test_another_whisker_material_or_gain_differs():
    names = ("modulus", "modulus_bracket", "gain_ratio")
    other = only({"sweeps": simulated(modulus=1.3 * PAPER_E, angle_gain=5.0)}, *names)
    assert other["modulus"].here.value == pytest.approx(1.3 * PAPER_E, rel=0.01)
    for name in names:
        assert other[name].verdict == "differs", name
    falling = only({"sweeps": simulated(angle_gain=0.5)}, "gain_angle")
    assert falling["gain_angle"].here.value < 1e-15
    assert falling["gain_angle"].verdict == "differs"  # as clear as the paper's, but the other way
    flat = only({"sweeps": simulated(angle_gain=1.0)}, "gain_ratio")
    assert flat["gain_ratio"].verdict == "differs"


def test_what_was_put_in_is_told_apart_from_what_came_out(rows):
    assert rows["modulus"].origin == "recovered"
    assert rows["frame_rate"].verdict == rows["frame_rate"].origin == "put in"
    assert rows["variance_1"].origin == "result"
    assert rows["textures"].why == "N conditions; other than the paper's"
    assert rows["animals"].why == "other than the paper's"  # 4, not 6
    assert rows["frame_rate"].why == rows["speeds"].why == ""
    own = only({"sweeps": simulated(virtual=False)}, "modulus")
    assert own["modulus"].origin == "result"


def test_a_recording_tells_its_rate_pixel_field_and_frames():
    profile = xr.Dataset(coords={"time": np.arange(3500) / 1000.0}, attrs={"pixel_size": 9e-5})
    still = xr.Dataset(coords={"image_column": np.arange(480), "image_row": np.arange(300)})
    names = ("frame_rate", "pixel", "field", "frames", "exposure")
    found = only({"sweeps": simulated(virtual=False), "profile": profile, "still": still}, *names)
    assert found["field"].here.text == "480 × 300 pixels"
    told = {name: found[name].here.value for name in names[:-1]}
    assert told == pytest.approx({"frame_rate": 1000, "pixel": 9e-5, "field": 480, "frames": 3500})
    assert found["pixel"].why.startswith("of the sweep shown")
    assert "not in the table" in found["exposure"].why
    tracks = only({"sweeps": simulated(virtual=False), "profile": profile.assign_attrs(pixel_size=np.nan)}, "pixel")
    assert "not in the table" in tracks["pixel"].why


def test_comparison_and_repeats_enter_where_they_are(rows):
    assert rows["agreement_1"].verdict == rows["repeats"].verdict == "not measured"
    sweeps, rng = simulated(), np.random.default_rng(2)
    n = sweeps.sizes["sweep"]
    columns = {name: (("sweep", "mode"), values) for name, values in {
        "correlation": 0.25 + 0.1 * rng.normal(size=(n, 2)), "pearson_p": np.full((n, 2), 1e-4),
        "pseudo_p": np.tile([0.01, 0.5], (n, 1))}.items()}  # fmt: skip
    held = xr.Dataset(columns | {"pseudo_count": ("sweep", np.full(n, 39))}, {"sweep": np.arange(n), "mode": [1, 2]})
    repeats = xr.Dataset({"run_correlation": (("repetition", "run"), 0.96 + 0.01 * rng.normal(size=(4, 5)))})
    names = ("agreement_1", "repeats", "significant_1", "significant_2", "agreement_contact")
    found = only({"sweeps": sweeps, "comparison": held, "repeats": repeats}, *names)
    assert found["agreement_1"].verdict == found["repeats"].verdict == "same"
    assert found["significant_1"].here.value == 1
    assert found["significant_1"].why == f"{n} of {n}; {n} of {n} against the predictions for new gratings"
    assert found["significant_2"].why.endswith(f"0 of {n} against the predictions for new gratings")
    too_few = held.assign(pseudo_count=("sweep", np.full(n, 19)), pseudo_p=(("sweep", "mode"), np.full((n, 2), 0.05)))
    why = only({"sweeps": sweeps, "comparison": too_few}, "significant_1")["significant_1"].why
    assert why.endswith("new gratings, at most 19, cannot reach that level")
    assert found["agreement_contact"].paper.kind == "p"
    assert 0 < found["agreement_contact"].here.value <= 1


def test_sweeps_not_accepted_do_not_count():
    sweeps = simulated()
    sweeps["accepted"] = sweeps.sweep < 100
    found = only({"sweeps": sweeps}, "variance_1")
    assert found["variance_1"].here.n == 100
    none = only({"sweeps": sweeps.assign(accepted=sweeps.accepted & False)}, "variance_1")
    assert none["variance_1"].verdict == "not measured"


def test_a_table_without_a_column_says_which():
    found = only({"sweeps": simulated().drop_vars("fit_r2_white")}, "lorentzian_r2_1")
    assert found["lorentzian_r2_1"].verdict == "not measured"
    assert "fit_r2_white" in found["lorentzian_r2_1"].why


def test_table_for_the_report(rows):
    shown = html_rows(list(rows.values()))
    assert len(shown) == len(rows)
    assert "GPa" in next(one["here"] for one in shown if "3.74" in one["paper"])
    assert {row.verdict for row in rows.values()} <= VERDICTS


def test_the_table_of_the_report_holds_every_row_the_rule_and_the_counts(rows):
    page = page_of(list(rows.values()))
    assert len(page["paper"]) == len(rows)
    assert page["paper_rule"] is RULE
    unknown = [row for row in rows.values() if row.verdict == "cannot tell"]
    assert sum(one["class"] == "unknown" for one in page["paper"]) == len(unknown)


def test_a_quantity_of_several_readings_counts_once_and_conditions_apart(rows):
    words = tally(
        [rows[name] for name in ("modulus", "modulus_bracket", "modulus_literature", "variance_1", "animals")]
    )
    assert words.startswith("Quantities of the paper, several readings of one counted once: 2 same. ")
    assert words.endswith("1 conditions were put in, 0 of them not comparable.")


def test_a_standard_deviation_has_the_unit_of_its_row_and_the_papers_interval_is_printed(rows):
    number = rows["threshold_su"]._replace(here=MeasuredNumber(51.9e-6, 46.7e-6, 57.1e-6, 4, sd=3.24e-6))
    (shown,) = html_rows([number])
    assert "SD 3.2 µm" in shown["why"]
    assert shown["paper_interval"] == "[34.5, 50.1] µm"  # 42.3 ± 2.1 of 45 units in 15 sessions
    (small,) = html_rows([rows["gain_mean"]._replace(here=MeasuredNumber(4.3e-5, 1.1e-5, 7.5e-5, 12))])
    assert small["here"] == "0.043 [0.011, 0.075] × 10⁻³, N = 12"


def test_a_range_of_settings_is_no_interval(rows):
    shown = {one["paper"]: one["here"] for one in html_rows(list(rows.values()))}
    assert re.fullmatch(r"median 150, 100 to 200 mm/s, N = 288", shown["scanning speeds 100–200 mm/s"])
    assert shown["frame rate 2 kHz"] == "2 kHz"
    exact = rows["shadow"]._replace(here=MeasuredNumber(0.0))
    assert html_rows([exact])[0]["here"] == "0 mm"


def test_p_values_have_two_digits(rows):
    (shown,) = html_rows([rows["gain_speed"]._replace(here=MeasuredNumber(0.80491, n=12))])
    assert shown["here"] == "p = 0.80, N = 12"
    (small,) = html_rows([rows["gain_speed"]._replace(here=MeasuredNumber(0.0007066, n=12))])
    assert small["here"] == "p = 0.00071, N = 12"


def test_an_interval_too_wide_to_differ_cannot_tell():
    """A gain of 2.1 to 18 holds nothing against the paper's 2, and says nothing for it."""
    two = next(number for number in paper_numbers() if number.id == "gain_ratio")
    assert verdict(two, MeasuredNumber(6.1, 2.1, 18, 12, draws=6)) == (
        "cannot tell",
        "the interval here reaches 8 of the paper's number away from it",
    )
    assert verdict(two, MeasuredNumber(2.0, 1.6, 2.4, 12, draws=6))[0] == "same"
    assert verdict(two, MeasuredNumber(4.2, 3.7, 4.8, 12, draws=6))[0] == "differs"
    assert verdict(two, MeasuredNumber(9.0, 2.6, 31, 12, draws=6))[0] == "differs"  # wide, and yet without the paper's
    collapse = next(number for number in paper_numbers() if number.id == "collapse_r2_1")  # 0.98
    assert verdict(collapse, MeasuredNumber(0.966, 0.40, 0.998, 12, draws=6))[0] == "cannot tell"
    assert verdict(collapse, MeasuredNumber(0.976, 0.95, 0.99, 12, draws=6))[0] == "same"


def test_the_papers_own_interval_can_be_too_wide():
    slope = next(number for number in paper_numbers() if number.id == "slope_su")
    why = "the paper's own interval reaches 0.74 of the paper's number away from it"
    assert verdict(slope, MeasuredNumber(2.5e5, 2.4e5, 2.6e5, 45, draws=15)) == ("cannot tell", why)


@pytest.mark.parametrize("middle", [1.1, 1.6, 2.0, 2.4, 2.9])
@pytest.mark.parametrize("half", [0.05, 0.2, 0.5, 1.0])
def test_numbers_that_are_the_same_differ_by_less_than_half_of_the_papers(middle, half):
    two = next(number for number in paper_numbers() if number.id == "gain_ratio")
    found = verdict(two, MeasuredNumber(middle, middle - half, middle + half, 12, draws=6))[0]
    assert found != "same" or (middle - half >= 1 and middle + half <= 3)


def test_fewer_than_four_whiskers_cannot_tell():
    two = next(number for number in paper_numbers() if number.id == "gain_ratio")
    assert [verdict(two, MeasuredNumber(2, 1.9, 2.1, 9, draws=n))[0] for n in (2, 3, 4)] == ["cannot tell"] * 2 + [
        "same"
    ]
    assert verdict(two, MeasuredNumber(2, n=9, draws=1)) == ("cannot tell", "no interval: fewer than two whiskers")
    one = only({"sweeps": simulated().isel(sweep=slice(0, 4))}, "modulus")
    assert one["modulus"].verdict == "cannot tell"


def test_an_effect_that_few_sweeps_do_not_show_cannot_tell():
    """Of the paper's own test: p = 0.64 for the speed, p < 1e-15 for ε."""
    speed, contact = (
        next(number for number in paper_numbers() if number.id == f"frequency_{term}_1")
        for term in ("speed", "contact")
    )
    assert [verdict(speed, MeasuredNumber(0.3, n=n))[0] for n in (12, 84, 85)] == ["cannot tell", "cannot tell", "same"]
    assert [verdict(contact, MeasuredNumber(0.3, n=n, slope=1))[0] for n in (12, 500)] == ["cannot tell", "differs"]
    assert verdict(contact, MeasuredNumber(1e-4, n=12, slope=1))[0] == "same"
    assert verdict(contact, MeasuredNumber(1e-4, n=12, slope=-1))[0] == "differs"
    assert verdict(speed, MeasuredNumber(1e-4, n=12))[0] == "differs"


def test_85_cases_show_a_correlation_of_three_tenths_in_four_tests_of_five():
    rng = np.random.default_rng(6)
    x = rng.normal(size=(4000, 85))
    y = 0.3 * x + np.sqrt(1 - 0.3**2) * rng.normal(size=x.shape)
    power = np.mean([pearsonr(a, b).pvalue < 0.05 for a, b in zip(x, y, strict=True)])
    assert power == pytest.approx(0.8, abs=3 * np.sqrt(0.8 * 0.2 / 4000))


def test_a_bound_is_kept_by_the_whole_interval():
    bound = next(number for number in paper_numbers() if number.id == "contact_change")  # below 0.02
    ends = {(0.01, 0.015): "same", (0.015, 0.025): "cannot tell", (0.021, 0.03): "differs"}
    for (low, high), expected in ends.items():
        assert verdict(bound, MeasuredNumber((low + high) / 2, low, high, 100, draws=6))[0] == expected
    assert verdict(bound, MeasuredNumber(0.01))[0] == "same"  # no interval, none expected
    assert verdict(bound, MeasuredNumber(0.01, n=4, draws=1))[0] == "cannot tell"


def test_no_interval_leaves_the_range_of_its_number():
    """Of few whiskers, and values near 1: correlations, R² and shares, the paper's too."""
    sweeps = simulated().isel(sweep=slice(0, 120))  # five whiskers
    rng, n = np.random.default_rng(3), 120
    skewed = 1 - 0.3 * rng.exponential(size=(5, 1)) ** 3 * np.ones((5, 24))
    sweeps = sweeps.assign(
        profile_r2=("sweep", skewed.ravel()), fit_r2_white=(("sweep", "mode"), skewed.reshape(-1, 1) * np.ones(3))
    )
    rho = np.tanh(np.repeat(rng.exponential(3, 5), 24))
    columns = {"correlation": rho, "pearson_p": np.where(np.arange(n) < 118, 1e-9, 0.5), "pseudo_p": np.full(n, 0.02)}
    held = xr.Dataset(
        {name: (("sweep", "mode"), values[:, None] * np.ones(2)) for name, values in columns.items()}
        | {"pseudo_count": ("sweep", np.full(n, 39))},
        {"sweep": np.arange(n), "mode": [1, 2]},
    )
    repeats = xr.Dataset({"run_correlation": (("repetition", "run"), np.tile([[0.6], [0.99], [0.999], [0.999]], 5))})
    rows = compare({"sweeps": sweeps, "comparison": held, "repeats": repeats})
    bounded = [row for row in rows if row.paper.scale != "plain" and np.isfinite(row.here.low)]
    assert len(bounded) >= 14
    for row in bounded:
        least, most = RANGES[row.paper.scale]
        assert row.paper.kind == "bound" or least <= row.paper.interval[0] <= row.paper.interval[1] <= most, (
            row.paper.id
        )
        assert least < row.here.low < row.here.value < row.here.high < most, (row.paper.id, row.here)


def test_an_interval_near_one_is_not_shown_as_1_to_1(rows):
    near = rows["profile_r2"]._replace(here=MeasuredNumber(0.9999963, 0.9999951, 0.9999978, 12))
    assert html_rows([near])[0]["here"] == "0.9999963 [0.9999951, 0.9999978], N = 12"
    exact = rows["profile_r2"]._replace(here=MeasuredNumber(8.71925886, 8.71925886, 8.71925886))
    assert html_rows([exact])[0]["here"] == "8.719"


def test_a_share_that_the_paper_prints_in_percent_is_in_percent_here():
    rows = {row.paper.id: row for row in compare({})}
    row = rows["variance_1"]._replace(here=MeasuredNumber(0.9679, 0.9444, 0.9817, 6.0), beside={})
    assert html_rows([row])[0]["here"] == "96.8 [94.4, 98.2] %, N = 6"


def test_all_of_twelve_are_not_otherwise_than_161_of_165():
    """Fisher's exact test: p = 1."""
    number = next(one for one in paper_numbers() if one.id == "significant_1")
    ends = share_interval(np.ones(12), clusters=np.repeat(np.arange(6), 2))
    np.testing.assert_allclose(ends, (0.757, 1), atol=1e-3)
    assert fisher_exact([[161, 4], [12, 0]]).pvalue == pytest.approx(1)
    assert verdict(number, MeasuredNumber(1.0, *ends, 12, draws=6))[0] == "same"


def test_e_and_damping_are_shown_for_both_forcings_in_one_row(rows):
    here = rows["modulus"].here
    assert here.informed.value == pytest.approx(1.05**2 * here.value, rel=1e-9)
    assert rows["modulus"].why.endswith("with the texture's forcing: differs")
    shown = {one["paper"]: one["here"] for one in html_rows(list(rows.values()))}
    assert re.fullmatch(r"Eq. 5: 3.7.* GPa; texture: 4.* GPa, N = 288", shown["Young's modulus 3.74 GPa"])
    assert rows["damping_1"].here.informed.value == rows["damping_1"].here.value  # as simulated
    own = only({"sweeps": simulated().drop_vars("resonant_frequency")}, "modulus")["modulus"]
    assert own.here.informed is None


def test_the_model_over_estimates_the_range_of_gain(rows):
    """Simulated with twice the gain over 1 rad more in the model than in the sweeps."""
    assert rows["gain_ratio_model"].verdict == "same"
    assert rows["gain_ratio_model"].here.value == pytest.approx(2 ** (1 + 0.6), rel=0.02)
    alike = simulated().assign(mode_rms_model=(("sweep", "mode"), np.full((288, 3), 1e-3) + 1e-6 * np.arange(3)))
    assert only({"sweeps": alike}, "gain_ratio_model")["gain_ratio_model"].verdict == "differs"


def test_the_contact_moves_by_less_than_a_fiftieth_in_all_sweeps_and_not_in_the_one_shown(rows):
    assert rows["contact_change"].verdict == "same"
    assert "below 0.02 in 288 of 288 sweeps, at most 0.010" in rows["contact_change"].why
    sweeps = simulated()
    far = np.where(sweeps.whisker_name == "beta", 0.07, 0.01)
    found = only({"sweeps": sweeps.assign(contact_travel=("sweep", far))}, "contact_change")["contact_change"]
    assert found.here.value == pytest.approx(0.03)
    assert "below 0.02 in 192 of 288 sweeps, at most 0.070" in found.why
    assert found.verdict == "cannot tell"  # 0.012 to 0.048


def of_rods(**truth):
    """The simulated table with a truth of its own, as if of rods."""
    table = simulated()
    same = ("contact", "base_angle", "mode_rms", "variance_explained", "resonant_frequency", "damping")
    true = {f"{name}_true": table[name] for name in same} | {"friction_true": 0.4 + 0 * table.contact}
    rod = {"laboratory": json.dumps({"truth": "rod"})}
    return table.assign(true | {f"{name}_true": make(table[name]) for name, make in truth.items()}).assign_attrs(rod)


def test_sweeps_of_the_rod_have_three_columns():
    analysed = of_rods(mode_rms=lambda rms: rms / 2)
    both = {"sweeps": analysed, "sweeps_modes": simulated().assign(mode_rms=2 * analysed.mode_rms)}
    row = only(both, "gain_mean")["gain_mean"]
    assert set(row.beside) == {MODEL, OWN}
    assert row.beside[MODEL].here.value == pytest.approx(2 * row.here.value)
    assert row.beside[OWN].here.value == pytest.approx(row.here.value / 2)
    shown = html_rows([row])[0]
    assert [one["verdict"] for one in shown["columns"]] == [
        row.beside[MODEL].verdict, row.verdict, row.beside[OWN].verdict
    ]  # fmt: skip
    assert shown["columns"][1]["here"] == shown["here"]
    assert headings([row]) == [MODEL, ROD, OWN]


def test_columns_are_those_that_a_study_has():
    analysed = of_rods()
    assert set(only({"sweeps": analysed}, "gain_mean")["gain_mean"].beside) == {OWN}
    assert only({"sweeps": analysed, "sweeps_modes": simulated()}, "animals")["animals"].beside == {}
    alone = list(only({"sweeps": simulated()}, "gain_mean").values())
    assert headings(alone) == ["here"]
    assert len(html_rows(alone)[0]["columns"]) == 1


def test_the_rods_own_numbers_hold_nothing_of_an_analysis():
    analysed = of_rods(resonant_frequency=lambda frequency: 2 * frequency)
    own = own_sweeps(analysed)
    np.testing.assert_array_equal(own.resonant_frequency_white, 2 * analysed.resonant_frequency)
    assert not {"profile_r2", "fit_r2_white"} & set(own)
    found = only({"sweeps": analysed}, "modulus", "lorentzian_r2_1")
    assert found["lorentzian_r2_1"].beside[OWN].verdict == "not measured"
    assert found["modulus"].beside[OWN].here.value == pytest.approx(4 * found["modulus"].here.informed.value, rel=1e-6)
