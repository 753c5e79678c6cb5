"""The example of each kind of user runs by the command that stands at its top, and comes to what its plan says."""

import dataclasses
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from vibrissa.cli import app
from vibrissa.netcdf import load
from vibrissa.study.forward import model_figures
from vibrissa.study.movie.virtual import film_motion, lay_out, predicted_motion
from vibrissa.study.spec.settings import read_study
from vibrissa.study.stages.stages import expected
from vibrissa.video.io.movie import write_movie

EXAMPLES = Path(__file__).parents[3] / "examples"
USERS = ("movies.toml", "spikes.toml", "surface-file.toml", "robot.toml")


def commands(path):
    """Commands in the comment at the top of a study file."""
    head = path.read_text(encoding="utf-8").split("\nname =")[0]
    text = re.sub(r"^# ?", "", head, flags=re.MULTILINE).replace("\\\n", " ")
    return [shlex.split(line)[1:] for line in re.findall(r"^ {4}(vibrissa .+)$", text, re.MULTILINE)]


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A folder with the examples in it, as a clone has them; without the figures of the model, which cost most."""
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(model_figures, "model_results", lambda *_: {})
    return tmp_path


def run(vibrissa, clone, name):
    (words,) = [words for words in commands(EXAMPLES / name) if words[:2] == ["run", f"examples/{name}"]]
    code, out, err = vibrissa(*words)
    assert code == 0, err
    return out, clone / words[words.index("--out") + 1]


@pytest.mark.parametrize("name", USERS)
def test_commands_at_the_top_are_such_as_the_program_takes(name):
    found = commands(EXAMPLES / name)
    assert found
    for words in found:
        app.parse_args(words, print_error=False, exit_on_error=False)


def test_only_movies(vibrissa, clone):
    """The first command films 1,000 frames; forty of the same film are enough here."""
    study = read_study(EXAMPLES / "surface.toml")
    film = dataclasses.replace(study.film, n_frames=40)
    motion = predicted_motion(study)
    (clone / "surface").mkdir()
    write_movie(clone / "surface" / "movie.mkv", film_motion(motion, film, lay_out(motion, film)), playback_rate=25)
    out, folder = run(vibrissa, clone, "movies.toml")
    assert out.split()[-3:-1] == ["40", "40"]  # frames, and frames followed
    assert {path.stem for path in folder.glob("*.nc")} == expected(read_study(clone / "examples" / "movies.toml"))


def test_only_spikes(vibrissa, clone):
    _, folder = run(vibrissa, clone, "spikes.toml")
    units = load(folder / "units.nc")
    told = dict(zip(units.unit_name.values.tolist(), range(3), strict=True))
    lines = (EXAMPLES / "spikes-units.csv").read_text(encoding="utf-8").split()
    true = {line.split(",")[0]: [float(cell) for cell in line.split(",")[2:]] for line in lines[1:]}
    one = units.isel(unit=told["MU001"])
    assert bool(one.identified)
    assert float(one.threshold_low) < true["MU001"][0] < float(one.threshold_high)
    assert float(one.slope_low) < true["MU001"][1] < float(one.slope_high)
    assert expected(read_study(EXAMPLES / "spikes.toml")) <= {path.stem for path in folder.glob("*.nc")}


def test_only_a_surface(vibrissa, clone):
    out, folder = run(vibrissa, clone, "surface-file.toml")
    scan = load(folder / "scan.nc")
    period = 1e-3 / 0.1  # [s] a ridge every millimetre
    drops = scan.time.values[1:][np.diff(scan.excursion.values) < -0.5 * np.ptp(scan.excursion.values)]
    np.testing.assert_allclose(np.diff(drops)[:8], period, rtol=0.01)  # the last is the end of the file
    assert "123.1" in out
    names = {path.stem for path in folder.glob("*.nc")}
    assert names == expected(read_study(EXAMPLES / "surface-file.toml")) - {"gap", "gaps", "gain_map"}


def test_a_robots_base_signal_alone(vibrissa, clone):
    _, folder = run(vibrissa, clone, "robot.toml")
    found = load(folder / "base_signal_1.nc")
    study = read_study(EXAMPLES / "robot.toml")
    assert {path.stem for path in folder.glob("*.nc")} == expected(study)
    np.testing.assert_allclose(float(found.resonant_frequency[0]), 123.1, rtol=0.02)  # of surface-file.toml's whisker
    assert float(found.correlation[0]) > 0.98
