"""The first lines of a report: ten at most, numbers with their digits, the dates of the data, and the contents."""

import os

import numpy as np

from vibrissa.quantities import dataset
from vibrissa.study.report.overview import MOST, anchored, data_date, overview
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


def test_ten_lines_at_most_say_what_was_done_and_how_far_to_trust_it():
    counts = {"same": 3, "differs": 1}
    top = overview(read_study(), sweeps(), ["Validity: none.", "Consequence."], counts, 2)
    assert top.done == "4 of 4 sweeps analysed."
    assert 2 + len(top.rows) + len(top.remarks) <= MOST
    assert top.remarks == [
        "Validity: none.",
        "Of the paper's numbers: 3 same, 1 differs.",
        "2 parts of the study could not be analysed; see below.",
    ]
    assert "resonant frequency, mode 1, median [Hz]" in [row["quantity"] for row in top.rows]


def test_a_study_of_nothing_but_a_surface_has_no_remark_of_the_paper():
    scan = dataset({"whisker_length": 0.04}, mode=[1], resonant_frequency=[123.4567], mode_sd=[1e-3], linearity=[0.8])
    top = overview(read_study(), {"scan": scan}, [], {}, 0)
    assert top.remarks == []
    assert top.rows[0] == {"quantity": "resonant frequency, mode 1 [Hz]", "truth": "", "found": "123.457"}


def test_the_date_of_the_data_is_that_of_the_files_that_are_read(tmp_path):
    study = read_study()
    assert data_date(study) == "All data are simulated, from the seeds of the study; there is no recording with a date."
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
        assert f'<h2 id="{name}">{heading}</h2>' in body
