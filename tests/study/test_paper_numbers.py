"""The table paper | here | same?: no number without a verdict, and the verdicts right on sweeps of known truth."""

import csv
import json

import numpy as np
import pytest
import xarray as xr

from vibrissa.exact import cone_kappa
from vibrissa.study.paper_numbers import Row, compare, html_rows, paper_numbers, write_page, write_table

PAPER_E, NOMINAL_E = 3.74e9, 3.74e9
VERDICTS = {"same", "differs", "put in", "not comparable", "not measured"}


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
        "profile_r2": np.full(n, 0.99), **({"contact_true": contact} if virtual else {}),
    }  # fmt: skip
    by_mode = {
        "resonant_frequency_white": frequency, "damping": damping, "damping_white": damping,
        "fit_r2_white": np.full((n, 3), 0.65), "variance_explained": share, "mode_rms": rms[:, None] * [1, 0.5, 0.2],
    }  # fmt: skip
    table = {key: ("sweep", values) for key, values in one.items()}
    table |= {key: (("sweep", "mode"), values) for key, values in by_mode.items()}
    told = {"laboratory": json.dumps({"camera": {"frame_rate": 2000.0}, "friction": 0.4})}
    return xr.Dataset(table, {"sweep": np.arange(n), "mode": [1, 2, 3]}, told if virtual else {})


def by_id(rows) -> dict[str, Row]:
    return {row.paper.id: row for row in rows}


@pytest.fixture(scope="module")
def rows():
    return by_id(compare({"sweeps": simulated()}))


def test_every_number_has_its_own_name_and_a_verdict(rows):
    assert len(rows) == len(paper_numbers()) == len({number.id for number in paper_numbers()})
    for results in ({}, {"sweeps": simulated()}, {"sweeps": simulated().isel(sweep=[0])}):
        for row in compare(results):
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
    other = by_id(compare({"sweeps": simulated(modulus=1.3 * PAPER_E, angle_gain=5.0)}))
    assert other["modulus"].here.value == pytest.approx(1.3 * PAPER_E, rel=0.01)
    for name in ("modulus", "modulus_bracket", "gain_ratio"):
        assert other[name].verdict == "differs", name
    falling = by_id(compare({"sweeps": simulated(angle_gain=0.5)}))
    assert falling["gain_angle"].here.value < 1e-15
    assert falling["gain_angle"].verdict == "differs"  # as clear as the paper's, but the other way
    flat = by_id(compare({"sweeps": simulated(angle_gain=1.0)}))
    assert flat["gain_ratio"].verdict == "differs"


def test_what_was_put_in_is_told_apart_from_what_came_out(rows):
    assert rows["modulus"].origin == "recovered"
    assert rows["frame_rate"].verdict == rows["frame_rate"].origin == "put in"
    assert rows["variance_1"].origin == "came out"
    assert rows["textures"].why == "N conditions; other than the paper's"
    assert rows["animals"].why == "other than the paper's"  # 4, not 6
    assert rows["frame_rate"].why == rows["speeds"].why == ""
    own = by_id(compare({"sweeps": simulated(virtual=False)}))
    assert own["modulus"].origin == "came out"


def test_a_recording_tells_its_rate_pixel_field_and_frames():
    profile = xr.Dataset(coords={"time": np.arange(3500) / 1000.0}, attrs={"pixel_size": 9e-5})
    still = xr.Dataset(coords={"column": np.arange(480), "row": np.arange(300)})
    found = by_id(compare({"sweeps": simulated(virtual=False), "profile": profile, "still": still}))
    told = {name: found[name].here.value for name in ("frame_rate", "pixel", "field", "frames")}
    assert told == pytest.approx({"frame_rate": 1000, "pixel": 9e-5, "field": 480, "frames": 3500})
    assert found["pixel"].why.startswith("of the sweep shown")
    assert "not told" in found["exposure"].why
    tracks = by_id(compare({"sweeps": simulated(virtual=False), "profile": profile.assign_attrs(pixel_size=np.nan)}))
    assert "not told" in tracks["pixel"].why


def test_comparison_and_repeats_enter_where_they_are(rows):
    assert rows["agreement_1"].verdict == rows["repeats"].verdict == "not measured"
    sweeps, rng = simulated(), np.random.default_rng(2)
    n = sweeps.sizes["sweep"]
    columns = {name: (("sweep", "mode"), values) for name, values in {
        "correlation": 0.25 + 0.1 * rng.normal(size=(n, 2)), "pearson_p": np.full((n, 2), 1e-4),
        "pseudo_p": np.tile([0.01, 0.5], (n, 1))}.items()}  # fmt: skip
    held = xr.Dataset(columns, {"sweep": np.arange(n), "mode": [1, 2]})
    repeats = xr.Dataset({"run_correlation": (("repetition", "run"), 0.96 + 0.01 * rng.normal(size=(4, 5)))})
    found = by_id(compare({"sweeps": sweeps, "comparison": held, "repeats": repeats}))
    assert found["agreement_1"].verdict == found["repeats"].verdict == "same"
    assert found["significant_1"].here.value == 1
    assert "100 % against" in found["significant_1"].why
    assert "  0 %" not in found["significant_2"].why
    assert found["agreement_contact"].paper.kind == "p"
    assert 0 < found["agreement_contact"].here.value <= 1


def test_sweeps_not_accepted_do_not_count():
    sweeps = simulated()
    sweeps["accepted"] = sweeps.sweep < 100
    found = by_id(compare({"sweeps": sweeps}))
    assert found["variance_1"].here.n == 100
    none = by_id(compare({"sweeps": sweeps.assign(accepted=sweeps.accepted & False)}))
    assert none["variance_1"].verdict == "not measured"


def test_a_table_without_a_column_says_which():
    found = by_id(compare({"sweeps": simulated().drop_vars("fit_r2_white")}))
    assert found["lorentzian_r2_1"].verdict == "not measured"
    assert "fit_r2_white" in found["lorentzian_r2_1"].why


def test_table_as_csv_and_for_the_report(rows, tmp_path):
    write_table(list(rows.values()), tmp_path / "paper.csv")
    with open(tmp_path / "paper.csv", encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["id"] for line in lines] == [number.id for number in paper_numbers()]
    assert {line["same?"] for line in lines} <= VERDICTS
    modulus = next(line for line in lines if line["id"] == "modulus")
    assert float(modulus["here low"]) < float(modulus["here"]) < float(modulus["here high"])
    shown = html_rows(list(rows.values()))
    assert len(shown) == len(rows)
    assert "GPa" in next(one["here"] for one in shown if "3.74" in one["paper"])


def test_the_page_holds_every_row_and_the_rule(rows, tmp_path):
    write_page(list(rows.values()), tmp_path / "paper.html")
    page = (tmp_path / "paper.html").read_text(encoding="utf-8")
    assert page.count("<tr>") == len(rows) + 1
    assert "the 95 % intervals of the two overlap" in page
    counted = sum(row.verdict == "same" for row in rows.values())
    assert f"{counted} same," in page
