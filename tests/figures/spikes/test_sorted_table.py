"""The table of units in a real browser, from a file and without a network: a click on a heading sorts it."""

import numpy as np
import pytest
from real_browser import real_browser

from vibrissa.neural.coupling.analysis import NOT_MEASURED
from vibrissa.neural.coupling.carrier import ELSEWHERE
from vibrissa.quantities import dataset, stacked
from vibrissa.study.report.pages import FigurePage, write_html
from vibrissa.study.report.unit_table import unit_table

NAMES = ["u10", "u2", '<img src=x onerror="document.title=1">', "u1"]


def units():
    """Four units: thresholds of two are known, one is negative, as of a stimulus in decibels."""
    rows = [dict(NOT_MEASURED) for _ in NAMES]
    for row, threshold in zip(rows, (9e-6, np.nan, 1.2e-5, -3e-6), strict=True):
        row |= {"threshold": threshold, "reason": "few" if np.isnan(threshold) else ""}
    rows[0] |= {
        "threshold_low": 8e-6,
        "threshold_high": 11e-6,
        "reason": f"{ELSEWHERE} -40 ms, outside the lags tested",
    }
    known = {name: np.array([0.5, 1e-3, np.nan, 2e-12]) for name in ("p_value", "tail_p_value", "adjusted_p_value")}
    verdict = np.array(["envelope", "", "phase", "both"])
    return dataset(
        {"null": "circular", "level": 0.01},
        unit_name=NAMES,
        unit_rate=[8.0, 30.0, 100.0, 9.0],
        peak_lag=[-0.04, 0.05, np.nan, 0.01],
        envelope_correlation=[0.1, -0.2, np.nan, 0.3],
        significant=verdict != "",
        envelope_verdict=verdict,
        **known,
        **stacked(rows),
    )


def column(head):
    table = unit_table(units(), range(4), {0: "#unit-0001"})
    return [row[table["heads"].index(head)] for row in table["rows"]]


def test_cells_hold_what_is_read_and_what_is_sorted():
    assert [cell.text for cell in column("threshold [µm]")] == ["9", "", "12", "-3"]
    assert [cell.order for cell in column("threshold [µm]")] == ["9", "", "12", "-3"]
    assert [cell.order for cell in column("p")] == ["0.5", "0.001", "", "2e-12"]
    assert [cell.interval for cell in column("threshold [µm]")] == ["[8, 11]", "", "", ""]
    assert [cell.text for cell in column("lag of its peak [ms]")] == ["-40", "", "", ""]
    assert [cell.link for cell in column("unit")] == ["#unit-0001", "", "", ""]
    assert [cell.text for cell in column("follows")] == ["envelope", "nothing found", "phase", "both"]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    where = tmp_path_factory.mktemp("page")
    first = FigurePage("", "four units", "caption", "<svg></svg>")
    write_html(where / "units.html", unit_table(units(), range(4)), first, [], [])
    with real_browser(where) as browser:
        page = browser.new_page()
        page.goto(f"file://{where}/units.html")
        yield page


def clicked(page, head):
    page.click(f"th button:text-is('{head}')")
    return page.evaluate("Array.from(document.querySelectorAll('tbody tr'), (row) => row.cells[0].textContent)")


def test_numbers_sort_as_numbers_and_what_is_absent_stays_last(page):
    odd = NAMES[2]
    assert clicked(page, "threshold [µm]") == ["u1", "u10", odd, "u2"]
    assert clicked(page, "threshold [µm]") == [odd, "u10", "u1", "u2"]
    assert clicked(page, "p") == ["u1", "u2", "u10", odd]
    assert clicked(page, "rate [Hz]") == ["u10", "u1", "u2", odd]


def test_names_sort_by_their_numbers_and_none_is_run_as_html(page):
    assert clicked(page, "unit")[1:] == ["u1", "u2", "u10"]
    assert page.get_attribute("th:first-child", "aria-sort") == "ascending"
    assert page.evaluate("document.querySelectorAll('[aria-sort]').length") == 1
    assert clicked(page, "unit")[:3] == ["u10", "u2", "u1"]
    assert page.title() == "four units – vibrissa"
    assert not page.query_selector("img")


def test_the_table_fits_a_window_of_1280_pixels_and_scrolls_by_itself_in_a_narrow_one(page):
    over = "document.querySelector('.wide').scrollWidth - document.querySelector('.wide').clientWidth"
    page.set_viewport_size({"width": 1280, "height": 800})
    assert page.evaluate(over) == 0
    page.set_viewport_size({"width": 400, "height": 800})
    assert page.evaluate(over) > 0
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
