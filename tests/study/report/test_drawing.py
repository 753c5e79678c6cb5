import pytest

from vibrissa.netcdf import save
from vibrissa.quantities import dataset
from vibrissa.study.report.drawing import Drawing, drawn
from vibrissa.study.report.stored_results import StoredResults
from vibrissa.study.stages.figure_table import FIGURES
from vibrissa.sweep.engine import Engine, each, staffed


@pytest.fixture
def folder(tmp_path):
    """Results of a study of two recordings; the second cannot be read."""
    save(dataset(contact=0.1), tmp_path / "posture.nc")
    save(dataset(contact=0.2), tmp_path / "units_1.nc")
    (tmp_path / "units_2.nc").write_text("no NetCDF")
    return tmp_path


def test_results_are_known_by_name_and_read_when_they_are_wanted(folder):
    results = StoredResults(folder)
    assert list(results) == ["posture", "units_1", "units_2"]
    assert float(results["posture"].contact) == 0.1
    assert results["posture"] is results["posture"]


def test_results_of_one_recording_are_known_by_plain_names(folder):
    results = StoredResults(folder, "_1")
    assert dict(results).keys() == {"units"}
    assert float(results["units"].contact) == 0.2


def test_what_cannot_be_drawn_gives_its_reason_whoever_draws(folder):
    drawings, told = [Drawing(number, "") for number in range(len(FIGURES))], []
    here = drawn(drawings, folder, folder, None, lambda *words: told.append(words))
    assert all(one.left_out and not one.svg for one in here)
    assert told[0] == ("report", 0, len(FIGURES))
    assert told[-1] == ("report", len(FIGURES), len(FIGURES))
    with staffed(Engine(workers=2)) as engine:
        each(abs, range(2), engine)
        assert drawn(drawings, folder, folder, engine, lambda *_: None) == here


def test_a_fault_in_one_figure_leaves_it_out(folder, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("a fault")

    monkeypatch.setattr("vibrissa.study.report.drawing.made", broken)
    only = drawn([Drawing(0, "")], folder, folder, None, lambda *_: None)
    assert only == [("", "", "it could not be drawn (ZeroDivisionError: a fault)")]
