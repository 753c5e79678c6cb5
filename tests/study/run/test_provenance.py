"""Provenance: what it says made a number, makes it again from nothing but what it says it was made of."""

import hashlib
import importlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from vibrissa.netcdf import load
from vibrissa.study.forward import model_figures
from vibrissa.study.paper.paper_measures import MEASURES
from vibrissa.study.run.provenance import REPORT, results_made
from vibrissa.study.run.study import run_study
from vibrissa.study.spec.inputs import input_files
from vibrissa.study.spec.settings import read_study
from vibrissa.study.stages.stages import STAGES, outputs_of
from vibrissa.study.store.source import source_digest
from vibrissa.sweep.engine import Engine
from vibrissa.video.foreign.whisk_files import WHISKERS

STUDY = """
name = "small"
[laboratory]
animals = 1
whiskers = ["C1", "C2"]
conditions = 1
textures = 1
n_frames = 300
speeds = [0.15]
[comparison]
gratings = 3
repeats = 1
[[base_signal]]
path = "signal.csv"
kind = "moment"
unit = "N m"
guess = [90.0]
modes = 1
"""


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("provenance")
    (folder / "study.toml").write_text(STUDY)
    time = np.arange(0, 1, 5e-4)
    moment = np.random.default_rng(0).standard_normal(time.size) * 1e-7
    lines = [f"{t:.4f},{m:.6g}" for t, m in zip(time, moment, strict=True)]
    (folder / "signal.csv").write_text("time,moment\n" + "\n".join(lines) + "\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model_figures, "model_results", lambda *_: {})  # figures of the model alone, which take time
        run_study(read_study(folder / "study.toml"), folder / "out", engine=Engine(scheduler="synchronous"))
    return folder / "out"


@pytest.fixture(scope="module")
def told(out):
    return json.loads((out / "provenance.json").read_text(encoding="utf-8"))


def content(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_every_file_of_results_is_told_with_its_content(out, told):
    there = {path.name for path in out.iterdir() if path.is_file()} - {"provenance.json"}
    assert set(told["results"]) == there
    for name, entry in told["results"].items():
        assert entry["sha256"] == content(out / name), name
        assert entry["made_by"], name


def test_what_is_said_to_make_a_result_exists():
    outputs = {output.name: output for stage in STAGES for output in stage.outputs}
    told = results_made(read_study(), {f"{name}.nc": "" for name, _ in outputs_of(read_study()) if "." not in name})
    assert len(told) > 25
    for made_by in [REPORT[0], *(entry["made_by"] for entry in told.values())]:
        module, _, name = made_by.rpartition(".")
        assert hasattr(importlib.import_module(module), name), made_by
    for output in outputs.values():
        for source in set(output.made_from) - {"study", "inputs", "sweeps/", "comparison/"}:
            assert source in outputs, (output.name, source)


def test_sweeps_and_comparisons_are_told_by_the_hash_of_what_they_are_made_of(out, told):
    table = load(out / "sweeps.nc")
    assert set(told["stored"]) == {"sweeps", "comparison"}
    for folder in told["stored"]:
        for number, entry in told["stored"][folder].items():
            assert entry["sha256"] == content(out / entry["file"])
            attrs = load(out / entry["file"]).attrs
            assert entry["file"] == f"{folder}/{hashlib.sha256(attrs['made_of'].encode()).hexdigest()[:24]}.nc"
            if folder == "sweeps":
                assert str(table.address.values[int(number)]) in entry["file"]
            else:
                assert json.loads(attrs["made_of"])["comparison_of"] == str(table.address.values[int(number)])


def test_each_number_comes_again_from_what_it_is_said_to_come_from(out, told):
    some = [number for number in told["numbers"] if "id" in number and number["value"] is not None]
    assert len(some) > 25
    read = {name: load(out / f"{name}.nc") for name in {name for number in some for name in number["from"]}}
    for number in some:
        results = {name: read[name] for name in number["from"]}
        again = MEASURES[number["id"]](results)
        assert again.value == pytest.approx(number["value"], rel=1e-12), number["id"]


def test_rows_of_truth_and_found_are_the_files(out, told):
    rows = [number for number in told["numbers"] if "in" in number]
    verdict = load(out / "sweep_verdict.nc")
    assert [row["number"] for row in rows] == verdict.quantity.values.tolist()
    for row, value in zip(rows, verdict.error_median.values, strict=True):
        assert row["value"] == (None if np.isnan(value) else value)


def test_inputs_study_and_versions_are_told(out, told):
    assert told["inputs"] == {"signal.csv": content(out.parent / "signal.csv")}
    assert told["study"]["laboratory"]["n_frames"] == 300
    assert told["source_sha256"] == source_digest()
    assert {"numpy", "scipy", "numba", "xarray"} <= set(told["libraries"])
    assert "/" not in json.dumps(told["study"]["folder"])


def test_files_of_a_table_of_sweeps_are_inputs(tmp_path):
    head = "track,animal,whisker,texture,scan_speed_mm_s,length_mm,cone_angle_mrad"
    (tmp_path / "sweeps.csv").write_text(f"{head}\na.nc,rat,C1,plate.csv,100,40,1.5\n")
    (tmp_path / "study.toml").write_text('name = "mine"\nsweeps = "sweeps.csv"\n')
    assert set(input_files(read_study(tmp_path / "study.toml"))) == {"sweeps.csv", "a.nc", "plate.csv"}


def test_files_that_are_read_beside_others_are_inputs(tmp_path):
    head = "track,animal,whisker,texture,scan_speed_mm_s,length_mm,cone_angle_mrad"
    (tmp_path / "day").mkdir()
    (tmp_path / "day" / "sweeps.csv").write_text(f"{head}\na.whiskers,rat,C1,unknown,100,40,1.5\n")
    (tmp_path / "day" / "a.whiskers").write_bytes(WHISKERS)
    (tmp_path / "day" / "a.measurements").touch()
    (tmp_path / "m.mraw").touch()
    movie = '[movie]\npath = "m.cihx"\npixel_size = 1e-4\n'
    (tmp_path / "study.toml").write_text(f'name = "mine"\nsweeps = "day/sweeps.csv"\n{movie}')
    found = {path.relative_to(tmp_path) for path in input_files(read_study(tmp_path / "study.toml")).values()}
    sweeps = {Path("day", name) for name in ("sweeps.csv", "a.whiskers", "a.measurements")}
    assert found == sweeps | {Path("m.cihx"), Path("m.mraw")}


def changed(out, folder, name):
    """A folder of results, and the study that made them with all but the base signal taken away."""
    shutil.copytree(out, folder / "out")
    (folder / "out" / "notes.txt").write_text("the user's own")
    signal = STUDY[STUDY.index("[[base_signal]]") :]
    (folder / "study.toml").write_text(f'name = "{name}"\n' + signal)
    shutil.copy(out.parent / "signal.csv", folder)
    return read_study(folder / "study.toml")


def test_a_study_that_was_changed_leaves_nothing_of_its_former_results(out, tmp_path):
    run_study(changed(out, tmp_path, "small"), tmp_path / "out")
    there = {path.name for path in (tmp_path / "out").iterdir() if path.is_file()}
    assert there == {"base_signal_1.nc", "notes.txt", "provenance.json", "report.html"}


def test_the_results_of_another_study_are_not_replaced(out, tmp_path):
    study = changed(out, tmp_path, "another")
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir() if path.is_file()}
    with refusal("conflict", "out"):
        run_study(study, tmp_path / "out")
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir() if path.is_file()} == before
