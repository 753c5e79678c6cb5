"""The first lines of a report: what share of the predicted jumps the free end allows."""

import numpy as np

from vibrissa.mechanics.scan.free_end import free_end_facts
from vibrissa.quantities import dataset
from vibrissa.study.report.report_sweeps import sweeps_of
from vibrissa.study.report.validity import allowed_jumps, validity
from vibrissa.study.sweeps.sweep_table import sweep_table


def row(number, count, allowed):
    what = {"animal": "a", "whisker_name": "C1", "texture": 0, "condition": number, "run": 0}
    return what | {"jump_count": count, "jumps_allowed": allowed, "accepted": True, "rejected": ""}


def film(count, allowed):
    return dataset(**free_end_facts(9.6e-3, np.arange(count) < allowed))


def test_the_share_is_given_of_the_motion_shown_and_of_all_sweeps():
    sweeps = sweep_table([row(0, 600, 0), row(1, 400, 3)])
    shown = {"apparatus": film(583, 0), "posture": dataset({"sweep": 1})}
    first, second, third = validity({"sweeps": sweeps, **shown})
    assert "a real free end, 9.6 mm long in the sweep that is shown, would bridge every gap" in first
    assert "(0 of 583 jumps are possible): the model's amplitudes are up to 30 times too large" in first
    assert "over 2 sweeps the free end allows 3 of 1000 predicted jumps (0.3 %; 0 % to 0.75 % in a sweep)" in second
    assert "30 is the largest ratio" in third
    assert allowed_jumps(sweeps) == "3 of 1000"


def test_one_film_is_a_scan_and_a_free_end_that_allows_all_has_no_consequence():
    (line,) = validity({"apparatus": film(20, 20)})
    assert line == "Validity: in the scan the free end (9.6 mm) allows all 20 predicted jumps."


def test_where_nothing_is_predicted_nothing_is_said():
    unknown = sweep_table([row(0, np.nan, np.nan)])
    assert validity({"sweeps": unknown}) == []
    assert validity({"posture": dataset({"sweep": 1})}) == []
    assert allowed_jumps(unknown) == ""


def test_the_table_of_sweeps_has_the_share_of_each_condition():
    lacking = np.full(3, np.nan)
    rows = [row(0, 600, 0) | {"mode_rms": lacking}, row(1, 400, 3)]
    assert [cells[-1] for cells in sweeps_of({"sweeps": sweep_table(rows)})["conditions"]] == ["0 of 600", "3 of 400"]
