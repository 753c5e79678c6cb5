"""The first lines of a report: eleven at most, numbers with their digits, the dates of the data, and the contents."""

import os

import numpy as np
import xarray as xr

from vibrissa.quantities import dataset
from vibrissa.study.report.headlines import done, driven
from vibrissa.study.report.overview import MOST, anchored, coverage, data_date, overview, seeds_of
from vibrissa.study.report.validity import BIASED, validity
from vibrissa.study.spec.settings import read_study
from vibrissa.study.sweeps.sweep_table import sweep_table


def sweeps():
    row = {"animal": "a", "whisker_name": "C1", "texture": 0, "run": 0, "accepted": True, "rejected": ""}
    rows = [
        row | {"condition": k, "contact": 0.2 + k / 50, "base_angle": 1.0, "resonant_frequency": np.full(3, 100.0 + k),
               "damping": np.full(3, 0.11), "timescale": 0.03}
        for k in range(4)
    ]  # fmt: skip
    return {"sweeps": sweep_table(rows)}


def test_eleven_lines_at_most_say_what_was_done_and_how_far_to_trust_it():
    top = overview(read_study(), sweeps(), ["Validity: none.", "Consequence."], "Same: 3.", 2)
    assert top.done == "4 of 4 sweeps analysed."
    assert 2 + len(top.rows) + len(top.remarks) <= MOST
    assert top.remarks == [
        "Validity: none.",
        "Same: 3.",
        "2 parts of the study could not be analysed; see below.",
    ]
    assert "resonant frequency, mode 1, median [Hz]" in [row["quantity"] for row in top.rows]


def test_simulated_units_that_pass_are_told_from_those_that_are_driven():
    columns = {"significant": [True, True, False, True], "driven_by": ["envelope", "phase", "envelope", "nothing"]}
    units = xr.Dataset({name: ("unit", values) for name, values in columns.items()})
    assert done({"units": units}) == "3 of 4 units pass"
    assert driven({"units": units}) == "Of 2 units that the envelope drives, 1 pass its test; 2 others pass too"
    recorded = {"units": units.drop_vars("driven_by")}
    assert (done(recorded), driven(recorded), driven({})) == ("3 of 4 units pass", "", "")


def test_a_study_of_nothing_but_a_surface_has_no_remark_of_the_paper():
    scan = dataset({"whisker_length": 0.04}, mode=[1], resonant_frequency=[123.4567], mode_sd=[1e-3], linearity=[0.8])
    top = overview(read_study(), {"scan": scan}, [], "", 0)
    assert top.remarks == []
    line = {"quantity": "resonant frequency, mode 1 [Hz]", "truth": "", "found": "123.457", "note": ""}
    assert top.rows[0] == line


def verdict(contact_held):
    """Contact and damping of mode 1, of twelve sweeps."""
    rows = {"row_key": ["contact", "damping_1"], "error_unit": ["L", "1"], "error_median": [-0.003, -0.339]}
    ends = {"covered_low": [0.0, 0.25], "covered_high": [0.24 if not contact_held else 1.0, 0.75]}
    held = {"covered": [contact_held, 0.5], "quantity": ["contact ε", "damping ratio, mode 1, texture known"]}
    return dataset(**rows, **ends, **held, error_spread=[0.001, 0.8], entry_count=[12, 12])


def test_the_coverage_of_many_sweeps_and_a_bias_are_named():
    words = coverage({"sweep_verdict": verdict(0.0)})
    assert words == (
        "Over the sweeps the 95 % interval holds the truth: contact ε in 0 of 12; damping ratio, mode 1 in 6 of 12 "
        "(median error −34 %)."
    )
    assert coverage({}) == ""
    assert validity({"sweep_verdict": verdict(0.0)}) == [BIASED]
    assert validity({"sweep_verdict": verdict(1.0)}) == []


def test_seeds_of_a_study_are_listed_by_their_place():
    assert "cortex.texture_seed 1" in seeds_of(read_study())


def test_the_date_of_the_data_is_that_of_the_files_that_are_read(tmp_path):
    study = read_study()
    assert data_date(study) == "All data are simulated, from the seeds of the study; there is no recording."
    for k, name in enumerate(("spikes.csv", "stimulus.csv")):
        (tmp_path / name).write_text("x")
        os.utime(tmp_path / name, (1399420800 + 86400 * k,) * 2)  # 7 and 8 May 2014, UTC
    (tmp_path / "study.toml").write_text(
        'name = "one"\n[[neural]]\nspikes = "spikes.csv"\nstimulus = "stimulus.csv"\ntrials = 3\n'
    )
    recorded = read_study(tmp_path / "study.toml")
    assert data_date(recorded) == "Data: 2 files, last changed 2014-05-07 to 2014-05-08."


def test_every_section_is_in_the_contents_and_can_be_reached():
    body, contents = anchored("<h2>First</h2><p>a</p><h2>Of <i>b</i></h2>")
    assert contents == [("section-1", "First"), ("section-2", "Of <i>b</i>")]
    for name, heading in contents:
        assert f'<h2 id="{name}">{heading} <a class="up" href="#contents"' in body
