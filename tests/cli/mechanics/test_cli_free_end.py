"""The fast model with the free end at the command line, and how a scan chooses its model."""

import json

import pytest

from vibrissa.netcdf import load

SCAN = ["--contact", "0.29", "--speed", "100mm/s"]
CONE = ["--whisker.length", "40mm", "--whisker.cone-angle", "1.5e-3"]


@pytest.fixture
def scanned(tmp_path, vibrissa):
    path = tmp_path / "grating.csv"
    path.write_text("position_mm,width_mm\n1,0.1\n2,0.2\n3,0.6\n")
    return lambda *words, angle="1.0": vibrissa("scan", str(path), *SCAN, "--base-angle", angle, *CONE, *words)


@pytest.mark.parametrize("model", ["free-end", "auto"])
def test_a_scan_says_how_many_jumps_the_free_end_allows_and_what_it_bridges(scanned, model, tmp_path):
    code, out, err = scanned("--whisker.tip", "0.278", "--model", model, "--json", "--out", str(tmp_path / "scan.nc"))
    assert code == 0
    assert err.startswith("vibrissa: usable: ")
    assert "fast model of a straight whisker with its free end, which allows 1 of 3 jumps" in err.splitlines()[0]
    assert json.loads(out)["jumps_allowed"] == 1
    data = load(tmp_path / "scan.nc")
    assert data.attrs["model"] == "free-end"
    assert data.mode_displacement.dims == ("mode", "time")


def test_the_single_contact_says_which_model_has_the_free_end(scanned):
    first = scanned("--whisker.tip", "0.27", "--json")[2].splitlines()[0]
    assert "single contact, take model auto" in first
    assert "single contact" not in scanned("--whisker.tip", "0.289", "--json")[2].splitlines()[0]


@pytest.mark.parametrize("model", ["modes", "auto"])
def test_a_scan_without_a_tip_says_so_in_its_first_line(scanned, model):
    assert "no tip was given, so the cone is sharp" in scanned("--model", model)[2].splitlines()[0]


def test_where_neither_is_valid_the_rod_is_named_and_not_run(scanned):
    first = scanned("--whisker.tip", "0.289", "--model", "auto", angle="1.4")[2].splitlines()[0]
    assert first.startswith("vibrissa: outside the model: base angle 1.4 is above 0.8 rad for this free end")
    assert "the model needed is the rod" in first


@pytest.mark.parametrize(
    ("words", "option"),
    [(("--jump", "paper2014"), "--jump"), (("--response", "linear"), "--response"), (("--thick",), "--thick")],
)
def test_forms_of_other_models_are_refused(scanned, words, option):
    code, _, err = scanned("--whisker.tip", "0.28", "--model", "free-end", *words)
    assert code != 0
    assert option in err
