"""What cannot be analysed is told, the rest goes on, and the exit code says so; a study of a surface alone."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from refusals import refusal

from vibrissa.cli.studies.run import leave
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.mechanics.scan.sampled import scanned
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.netcdf import load
from vibrissa.quantities import dataset
from vibrissa.study.forward import model_figures
from vibrissa.study.report.report_sweeps import _lacking
from vibrissa.study.spec.settings import validated_study
from vibrissa.study.store.outcome import attempting, not_analysed, not_fitted
from vibrissa.texture.io import read_texture

EXAMPLES = Path(__file__).parents[3] / "examples"
BASE = """[[base_signal]]
path = "{}"
kind = "moment"
unit = "V"
calibration = 2e-7
guess = [120.0]
"""
SURFACE = """[whisker]
length = 0.04
cone_angle = 1.5e-3
tip = 0.05
[posture]
contact = 0.29
base_angle = 1.2
[scan]
speed = 0.1
damping = 0.11
[texture]
file = "{}"
"""


def study(text, folder=EXAMPLES):
    return validated_study(tomllib.loads('name = "x"\n' + text), "s.toml", folder)


def refuse(error):
    raise error


def test_a_part_that_fails_is_noted_and_the_others_go_on():
    failed = {}
    attempt = attempting(study(BASE.format("a.csv") + BASE.format("b.csv")), failed)
    assert attempt("first", lambda: refuse(InputError("a.csv", "must be a table"))) == {}
    assert attempt("second", lambda: {"found": 1}) == {"found": 1}
    attempt("third", lambda: refuse(ConvergenceError("x", 1.0, 3)))
    assert failed["first"] == "a.csv must be a table"
    assert list(failed) == ["first", "third"]
    with pytest.raises(ZeroDivisionError):  # a fault of the program is none of the input
        attempt("fourth", lambda: 1 / 0)


def test_the_error_of_a_study_s_only_part_is_raised():
    for text in (BASE.format("a.csv"), SURFACE.format("a.csv"), "[laboratory]\n"):
        with refusal("input", "a.csv"):
            attempting(study(text), {})("part", lambda: refuse(InputError("a.csv", "must be a table")))


def test_sweeps_of_one_reason_are_told_together():
    why = ["", "no whisker", "lost", "", *["no whisker"] * 7]
    sweeps = dataset(
        lead=("sweep",), sweep=np.arange(11), accepted=[not reason for reason in why], rejected=np.array(why, object)
    )
    lines = not_analysed({"sweeps": sweeps}, {"movie": "gone"})
    assert lines == ["movie: gone", "sweeps 1, 4, 5, 6, 7 and 3 more of 11: no whisker", "sweep 2 of 11: lost"]
    assert not_analysed({}, {}) == []


def test_a_signal_that_is_missing_is_told_and_the_exit_code_is_3(vibrissa, tmp_path):
    (tmp_path / "s.toml").write_text('name = "x"\n' + BASE.format(EXAMPLES / "robot.csv") + BASE.format("none.csv"))
    code, out, err = vibrissa("run", tmp_path / "s.toml", "--out", tmp_path / "out")
    assert code == 3
    assert "robot" in out
    line = f"base signal none: {tmp_path / 'none.csv'} must be an existing file"
    assert f"vibrissa: not analysed: {line}\n" in err
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"<li>{line}</li>" in page
    assert (tmp_path / "out" / "base_signal_1.nc").exists()
    assert not (tmp_path / "out" / "base_signal_2.nc").exists()


def test_where_none_could_be_analysed_the_exit_code_is_3_and_the_report_is_there(vibrissa, tmp_path):
    (tmp_path / "s.toml").write_text('name = "x"\n' + BASE.format("a.csv") + BASE.format("b.csv"))
    code, out, err = vibrissa("run", tmp_path / "s.toml", "--out", tmp_path / "out")
    assert (code, out) == (3, "")
    assert err.count("not analysed") == 2
    assert "Could not be analysed" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_one_signal_alone_that_is_missing_is_bad_input(vibrissa, tmp_path):
    (tmp_path / "s.toml").write_text('name = "x"\n' + BASE.format("a.csv"))
    code, out, err = vibrissa("run", tmp_path / "s.toml", "--out", tmp_path / "out")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


def test_rejected_sweeps_of_a_table_make_the_exit_code_3(vibrissa, tmp_path):
    header = "track,animal,whisker,texture,scan_speed,contact,base_angle\n"
    (tmp_path / "sweeps.csv").write_text(header + "a.nc,m,C2,unknown,0.1,0.3,1.2\nb.nc,m,C2,unknown,0.1,0.3,1.2\n")
    words = ("--out", tmp_path / "out", "--scheduler", "synchronous")
    code, _, err = vibrissa("recordings", tmp_path / "sweeps.csv", *words)
    assert code == 3
    assert "not analysed: sweep 0 of 2: " in err
    assert "not analysed: sweep 1 of 2: " in err


# A surface alone


def test_a_surface_alone_gives_what_the_model_says_of_it(vibrissa, tmp_path, monkeypatch):
    monkeypatch.setattr(model_figures, "model_results", lambda *_: {})
    (tmp_path / "s.toml").write_text('name = "x"\n' + SURFACE.format(EXAMPLES / "gap.csv"))
    code, out, err = vibrissa("run", tmp_path / "s.toml", "--out", tmp_path / "out", "--json")
    assert code == 0, err
    asked = study(SURFACE.format("gap.csv"))
    expected = scanned(
        predict(asked.whisker, asked.posture, read_texture(EXAMPLES / "gap.csv"), asked.scan, n_modes=3), 20_000.0
    )
    made = load(tmp_path / "out" / "scan.nc")
    for name in ("mode_displacement", "envelope", "base_moment", "linearity"):
        size = float(np.abs(expected[name]).max())  # the two runs sum in another order
        np.testing.assert_allclose(made[name].values, expected[name].values, rtol=0, atol=1e-9 * size)
    told = json.loads(out)
    np.testing.assert_allclose(told["resonant_frequency"], expected.resonant_frequency.values)
    assert "base_moment" not in told
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "What the surface does to the whisker" in page
    assert "From the surface to the follicle (model)" in page
    assert "would bridge every gap" in page[page.index("Validity: a real free end") :]
    assert page.index("Validity:") < page.index("<h2")


def test_a_surface_that_is_missing_is_bad_input(vibrissa, tmp_path):
    (tmp_path / "s.toml").write_text('name = "x"\n' + SURFACE.format("none.csv"))
    code, _, err = vibrissa("run", tmp_path / "s.toml", "--out", tmp_path / "out")
    assert code == 2
    assert err.endswith("none.csv must be an existing file\n")
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


def test_modes_without_a_fit_are_told_with_the_reason_and_the_run_is_whole(capsys):
    white = dataset(mode=[1, 2], damping=[0.1, np.nan]).assign_attrs(left_out="mode 2: resonance fit did not converge")
    lines = not_fitted({"resonance_white": white, "resonance": dataset(mode=[1, 2], damping=[0.1, 0.1])})
    assert lines == ["Not fitted with white forcing assumed: mode 2: resonance fit did not converge."]
    assert not not_fitted({})
    leave(dataset({"not_analysed": "[]", "not_fitted": json.dumps(lines)}, mode=[1]))  # no exit code
    told = capsys.readouterr().err
    assert told == "vibrissa: not fitted with white forcing assumed: mode 2: resonance fit did not converge\n"


def test_modes_that_sweeps_lack_are_counted():
    table = {"mode": ("mode", [1, 2]), "accepted": ("sweep", [True, True, False])}
    damping = ("sweep", "mode"), [[0.1, np.nan], [0.1, 0.1], [np.nan, np.nan]]
    assert "white forcing assumed: mode 2 in 1; the file" in _lacking(xr.Dataset(table | {"damping_white": damping}))
    assert _lacking(xr.Dataset(table | {"damping_white": damping}).isel(sweep=[1])) == ""
