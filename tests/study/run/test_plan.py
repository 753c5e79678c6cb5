"""A plan tells what a run comes to, before it is run: held against runs that were made."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import tifffile
from refusals import refusal

from vibrissa.study.run import study as study_module
from vibrissa.study.run.plan import plan_study
from vibrissa.study.run.plan_summary import duration, parts_lines, plan_dataset, plan_lines, size
from vibrissa.study.run.study import run_study
from vibrissa.study.spec.comparison import Comparison
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.spec.parts import GIVES, absent, given, inputs, refuse_missing
from vibrissa.study.spec.settings import MovieFile, Study, read_study
from vibrissa.study.stages.prices import START
from vibrissa.study.stages.stages import expected
from vibrissa.study.sweeps.laboratory import plan as planned_sweeps
from vibrissa.study.sweeps.sweeps import study_jobs
from vibrissa.video.io.movie import write_movie

EXAMPLES = Path(__file__).parents[3] / "examples"


def small(n_frames):
    study = read_study()
    return dataclasses.replace(
        study, laboratory=None, cortex=None, film=dataclasses.replace(study.film, n_frames=n_frames)
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run without its report, whose figures cost most."""
    out = tmp_path_factory.mktemp("plan") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_module, "write_report", lambda *_, **__: None)
        run_study(small(400), out)
    return out


def test_a_run_comes_to_the_datasets_and_figures_that_the_plan_names(run):
    study = small(400)
    assert {path.stem for path in run.glob("*.nc")} == expected(study)
    assert [number for number, _ in plan_study(study).figures] == ["1", "3", "4", "5", "6", "8"]  # as its report has


def test_what_is_written_is_about_what_the_plan_says(run):
    found = sum(path.stat().st_size for path in run.iterdir())
    assert 0.6 * found < plan_study(small(400)).written < 1.6 * found
    movie = (run / "movie.mkv").stat().st_size
    filming = next(stage for stage in plan_study(small(400)).stages if stage.name == "filming")
    np.testing.assert_allclose(filming.cost.written, movie, rtol=0.1)


def test_sweeps_are_those_that_the_laboratory_draws():
    laboratory = Laboratory(
        truth="modes", animals=1, conditions=2, textures=(2, 3), n_frames="plate", speeds=(0.1, 0.2)
    )
    plan = plan_study(Study(name="x", laboratory=laboratory), workers=4)
    sweeps = next(stage for stage in plan.stages if stage.name == "sweeps")
    drawn = planned_sweeps(laboratory)[0]
    assert sweeps.cost.tasks == len(drawn) == laboratory.n_sweeps
    assert sweeps.cost.frames == sum(int(2000 * 0.35 / one.scan.speed + 0.5) for one in drawn)
    assert plan.unstored == sweeps.cost.frames * 500 * 450


def test_kept_sweeps_and_more_workers_take_time_away():
    study = Study(name="x", laboratory=Laboratory(truth="modes", animals=1, whiskers=("C1",), textures=5))
    alone, four = plan_study(study), plan_study(study, workers=4)
    shared = sum(stage.cost.seconds for stage in alone.stages if stage.cost.shared)
    np.testing.assert_allclose(alone.seconds - four.seconds, 0.75 * shared)
    assert four.memory > alone.memory
    half, whole = plan_study(study, kept=5), plan_study(study, kept=10)
    assert "sweeps" not in [stage.name for stage in whole.stages]
    stages = dict(half.stages)
    np.testing.assert_allclose(stages["sweeps"].seconds * 2, dict(alone.stages)["sweeps"].seconds)
    assert stages["sweeps"].tasks == 5
    assert any("5 sweeps are there already" in line for line in plan_lines(half))


def test_sweeps_of_the_rod_are_made_with_the_model_too():
    few = {"animals": 1, "whiskers": ("C1",), "textures": 5}
    by_modes = Study(name="x", laboratory=Laboratory(truth="modes", **few))
    by_rod, third = (Study(name="x", laboratory=Laboratory(**few), comparison=Comparison(modes=n)) for n in (0, 3))
    tasks = [dict(plan_study(study).stages)["sweeps"].tasks for study in (by_modes, by_rod, third)]
    assert tasks == [10, 10, 14]
    seconds = [dict(plan_study(study).stages)["sweeps"].seconds for study in (by_modes, by_rod, third)]
    assert seconds[0] < seconds[1] < seconds[2]
    assert dict(plan_study(by_rod).stages)["comparison"].tasks == 20
    assert plan_study(third, kept=14).kept == len(study_jobs(third)) == 14


def test_sixty_virtual_sweeps_take_what_they_took():
    """8 min 34 s of processor time, 4 min 43 s on two cores, for 60 sweeps of 3,500 frames."""
    plan = plan_study(read_study(EXAMPLES / "laboratory.toml"), workers=2)
    np.testing.assert_allclose(sum(stage.cost.seconds for stage in plan.stages), 514, rtol=0.05)
    np.testing.assert_allclose(plan.seconds, 283, rtol=0.05)


def test_a_surface_alone_is_planned_with_its_file(tmp_path):
    for name in ("surface-file.toml", "ridges.csv"):
        shutil.copy(EXAMPLES / name, tmp_path)
    study = read_study(tmp_path / "surface-file.toml")
    assert given(study) == ["whisker", "posture", "scan", "texture"]
    assert {"movie", "laboratory", "base_signal"} <= set(absent(study))
    (file,) = inputs(study)
    assert (file.name, file.size, file.problem) == ("ridges.csv", (EXAMPLES / "ridges.csv").stat().st_size, "")
    refuse_missing(inputs(study))
    assert "the vibration that is predicted" in "\n".join(parts_lines(study))
    (tmp_path / "ridges.csv").unlink()
    with refusal("missing", "ridges.csv"):
        refuse_missing(plan_study(study).inputs)


def test_missing_files_are_counted(tmp_path):
    signal = "[[base_signal]]\npath = '{}.csv'\nkind = 'moment'\nunit = 'V'\nguess = [90.0]\n"
    (tmp_path / "s.toml").write_text('name = "x"\n' + "".join(map(signal.format, "abc")))
    (tmp_path / "a.csv").write_text("x\n")
    with refusal("missing", "b.csv"):
        refuse_missing(inputs(read_study(tmp_path / "s.toml")))


def test_every_part_says_what_it_gives():
    optional = {
        field.name
        for field in dataclasses.fields(Study)
        if field.name not in ("assumptions", "folder") and (field.default is None or field.default == ())
    }
    assert optional <= set(GIVES)


def test_a_plan_for_a_program_has_the_same_numbers():
    plan = plan_study(small(400), workers=2)
    data = plan_dataset(plan)
    assert float(data.wall_time) == plan.seconds
    assert data.processor_time.values[0] == START
    assert data.processor_time.attrs["units"] == "s"
    assert data.memory_needed.attrs["units"] == "byte"
    assert list(data.left_out.values[: len(plan.figures)]) == [""] * len(plan.figures)
    assert json.dumps(data.work.values.tolist())


@pytest.mark.parametrize(("start", "stop", "frames"), [(0, None, 30), (0, 20, 20), (5, None, 25), (5, 20, 15)])
def test_only_the_part_of_a_movie_that_is_tracked_is_planned(tmp_path, start, stop, frames):
    write_movie(tmp_path / "m.avi", [np.zeros((30, 40, 60), np.uint8)])
    movie = MovieFile(path="m.avi", pixel_size=1e-4, start=start, stop=stop)
    stages = dict(plan_study(Study(name="part", movie=movie, folder=tmp_path)).stages)
    assert stages["tracking"].frames == frames


def test_the_plan_counts_missing_frames_as_tracking_does(tmp_path):
    for number in (*range(10), *range(15, 30)):  # 25 pictures of 30 frames
        tifffile.imwrite(tmp_path / f"{number:03d}.tif", np.zeros((40, 60), np.uint8))
    movie = MovieFile(path=".", pixel_size=1e-4, frame_rate=100.0, start=12, stop=28, drop_frames="nan")
    study = Study(name="part", movie=movie, folder=tmp_path)
    assert dict(plan_study(study).stages)["tracking"].frames == 16
    whole = dataclasses.replace(study, movie=dataclasses.replace(movie, start=0, stop=None))
    assert dict(plan_study(whole).stages)["tracking"].frames == 30


def test_sizes_and_times_read_well():
    assert [size(n) for n in (0, 12, 4e3, 5.18e3, 3.5e6, 6.69e11)] == [
        "",
        "12 B",
        "4 kB",
        "5.18 kB",
        "3.5 MB",
        "669 GB",
    ]
    assert [duration(s) for s in (1.5, 24, 99, 120, 5940, 6600)] == [
        "1.5 s",
        "24 s",
        "99 s",
        "2 min",
        "99 min",
        "1 h 50 min",
    ]
