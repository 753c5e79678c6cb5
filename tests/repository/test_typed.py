"""What README and the first page give to type runs as typed, in order, in a clean clone; clone and home stay clean."""

import importlib.util
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest

from vibrissa.cli.shared.display.progress import BETWEEN
from vibrissa.study.run.plan import plan_study
from vibrissa.study.spec.settings import read_study

ROOT = Path(__file__).parents[2]
SET_UP = "python3 run.py"  # which does the main job too
MAIN_JOB = "vibrissa run"
EXPERIMENT = Path("src/vibrissa/data/experiment.toml")
FEWER = {  # sweeps, units, trials and frames of the main job, which has every part all the same; .ci/run does it whole
    "animals = 2": "animals = 1",
    'whiskers = ["beta", "C1", "C2"]': 'whiskers = ["C1", "C2"]',
    "conditions = 2": "conditions = 1",
    "repeats = 2": "repeats = 1",
    "n_frames = 1750": "n_frames = 600",
    "gratings = 24": "gratings = 20",
    "every = 6": "every = 24",
    "n_trials = 40": "n_trials = 20",
    "n_frames = 3500": "n_frames = 1500",
}
TYPED = re.compile(r"(?:vibrissa|python3|\.venv/bin/\S+) ")
STAGE = re.compile(r"vibrissa: (\d+):(\d\d):(\d\d) (.+?)(?: \((\d+) of (\d+)\))?")


def blocks(text):
    """Give the indented blocks of a page."""
    return [
        re.sub(r"^ {4}", "", block, flags=re.MULTILINE) for block in re.findall(r"(?:^ {4}.*\n)+", text, re.MULTILINE)
    ]


def lines(text):
    """Give what a page has to type: each command in one line, each block of Python whole; not what commands print."""
    for block in blocks(text):
        if re.match(r"import |from ", block):
            yield block
        elif TYPED.match(block):
            yield from (" ".join(line.split()) for line in block.replace("\\\n", " ").splitlines())


README = (ROOT / "README.md").read_text(encoding="utf-8")
THREE_MINUTES = list(lines(README.partition("\n## Three minutes\n")[2].partition("\n## ")[0]))
FIRST_PAGE = (ROOT / "docs" / "getting-started.md").read_text(encoding="utf-8")
STARTED = [MAIN_JOB if line == SET_UP else line for line in lines(FIRST_PAGE)]
ALL = list(dict.fromkeys([*STARTED, *THREE_MINUTES]))


class Clone:
    """A clean clone, an environment in it with what this one has, and an empty home."""

    def __init__(self, folder):
        self.folder, self.home, self.done = folder / "clone", folder / "home", []
        self.home.mkdir(parents=True)
        copy_shipped(self.folder)
        make_environment(self.folder / ".venv")
        given = {name: word for name, word in os.environ.items() if name not in ("XDG_CACHE_HOME", "MPLCONFIGDIR")}
        given["PYTHONPATH"] = str(self.folder / "src")
        path = f"{self.folder / '.venv' / 'bin'}{os.pathsep}{os.environ['PATH']}"
        self.env = given | {"HOME": str(self.home), "PATH": path, "BROWSER": "true", "COLUMNS": "80"}
        self.env["RUSTUP_HOME"] = str(folder)  # pip asks rustc for its version, and rustup settles in any home

    def keep(self):
        """Do what run.py does so that caches are kept inside."""
        spec = importlib.util.spec_from_file_location("run", self.folder / "run.py")
        run = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(run)
        run.keep()

    def call(self, *command):
        return subprocess.run(command, cwd=self.folder, env=self.env, capture_output=True, text=True)

    def changes(self):
        return self.call("git", "status", "--porcelain").stdout

    def type(self, line):
        if re.match(r"import |from ", line):
            return self.call(".venv/bin/python", "-c", line)
        return self.call("bash", "-c", line)

    def at_home(self):
        return sorted(str(path.relative_to(self.home)) for path in self.home.rglob("*"))


def copy_shipped(folder):
    """Make a repository of what git has of this one, and of what it would take."""
    shipped = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True)
    if shipped.returncode != 0:
        pytest.skip("not a clone: git does not know this folder")
    for name in filter(lambda name: (ROOT / name).is_file(), shipped.stdout.splitlines()):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, folder / name)
    for compiled in (ROOT / "src").rglob("*.nb?"):  # not anew: this environment has compiled the same files
        place = folder / compiled.relative_to(ROOT)
        place.parent.mkdir(exist_ok=True)
        shutil.copy2(compiled, place)
    experiment = (folder / EXPERIMENT).read_text(encoding="utf-8")
    for many, few in FEWER.items():
        assert many in experiment
        experiment = experiment.replace(many, few)
    (folder / EXPERIMENT).write_text(experiment, encoding="utf-8")
    for words in (["init", "-q"], ["add", "-A"], ["-c", "user.name=x", "-c", "user.email=x", "commit", "-qm", "all"]):
        subprocess.run(["git", *words], cwd=folder, check=True)


def make_environment(venv):
    """Make an environment that has the packages of this one without installing them."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", venv], check=True)
    (site,) = venv.glob("lib/python3*/site-packages")
    outer = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n"
    (site / "zz-outer.pth").write_text(outer)  # read last: the outer environment's places for caches do not come first
    for name, words in (("vibrissa", "-c 'from vibrissa.cli import main; main()'"), ("pip", "-m pip")):
        script = venv / "bin" / name
        script.write_text(f'#!/bin/sh\nexec "$(dirname "$0")/python" {words} "$@"\n')
        script.chmod(0o755)


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    made = Clone(tmp_path_factory.mktemp("typed"))
    made.keep()
    return made


@pytest.fixture(scope="module")
def main_job(clone):
    """The main job, once."""
    done = clone.type(MAIN_JOB)
    assert done.returncode == 0, done.stderr[-2000:]
    return done


def test_pages_are_read_whole():
    assert STARTED[0] == MAIN_JOB
    assert "vibrissa explore" in STARTED
    for page, text in ((THREE_MINUTES, README), (STARTED[1:], FIRST_PAGE)):
        typed = [line for line in page if line.startswith("vibrissa ")]
        assert len(typed) == len(re.findall(r"^ {4}vibrissa ", text, re.MULTILINE))
    page = "\n    vibrissa a \\\n        b\n    vibrissa c\n\n    mode 1   Hz\n\n    import os\n    os\n"
    assert list(lines(page)) == ["vibrissa a b", "vibrissa c", "import os\nos\n"]


@pytest.mark.parametrize("line", ALL)
def test_line_runs_as_typed(clone, main_job, line):
    if line == "vibrissa explore":
        code, said = stopped(clone, line)
        assert code == 130, said
    else:
        done = main_job if line == MAIN_JOB else clone.type(line)
        assert done.returncode == 0, done.stderr[-2000:]
    clone.done.append(line)


def test_every_stage_of_the_plan_has_one_line_each_half_minute_where_nobody_watches(clone, main_job):
    found = [line for line in map(STAGE.fullmatch, main_job.stderr.splitlines()) if line is not None]
    times = {}
    for line in found:
        hours, minutes, seconds = map(int, line.groups()[:3])
        times.setdefault(line[4], []).append(3600 * hours + 60 * minutes + seconds)
    assert all(np.diff(of_stage).min(initial=BETWEEN) >= BETWEEN - 1 for of_stage in times.values())  # whole seconds
    plan = [stage.name for stage in plan_study(read_study(clone.folder / EXPERIMENT)).stages]
    assert [stage for stage in plan if not any(name.startswith(stage) for name in times)] == []
    assert {"figures of the model", "recording one unit"} <= set(times)
    counted = {line[4]: int(line[6]) for line in found if line[6]}
    assert {"filming": 1500, "sweeps": 2, "jitter": 1, "repeated runs": 1}.items() <= counted.items()
    assert counted["report"] >= 9  # figures
    assert not re.search(r"[\r\x1b]", main_job.stdout + main_job.stderr)


def test_a_run_ends_in_about_ten_lines_with_five_numbers_and_their_truth(main_job):
    head, *rows = main_job.stdout.splitlines()
    assert head.split() == ["truth", "found", "95", "%", "interval"]
    assert len(rows) == 5
    assert rows[0].startswith("resonant frequency, mode 1 [Hz]")
    truth, found = map(float, rows[0].split("[Hz]")[1].split()[:2])
    assert truth == pytest.approx(123.15, abs=0.01)
    assert found == pytest.approx(truth, rel=0.05)
    assert [row.split()[0] for row in rows[1:3]] == ["damping", "correlation"]
    assert rows[3].startswith("Young's modulus, of 2 sweeps [GPa]")
    assert rows[4].startswith("threshold, mean of ")
    assert max(map(len, main_job.stdout.splitlines())) <= 80
    ends = [line for line in main_job.stderr.splitlines() if STAGE.fullmatch(line) is None]
    assert ends[0].startswith("vibrissa: 1500 frames tracked, 2 of 2 sweeps analysed, ")
    assert ends[1] == "vibrissa: the report is vibrissa-out/report.html; --json prints its whole table"
    assert len(main_job.stdout.splitlines()) + len(ends) <= 12


def stopped(clone, line):
    """Type a line that serves a page, and once it does press Ctrl-C."""
    hearing = (
        "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execvp(sys.argv[1], sys.argv[1:])"
    )
    words = [sys.executable, "-c", hearing, *line.split()]  # under nohup Ctrl-C would be ignored
    with subprocess.Popen(words, cwd=clone.folder, env=clone.env, stderr=subprocess.PIPE, text=True) as page:
        said = page.stderr.readline()
        page.send_signal(signal.SIGINT)
        said += page.stderr.read()
    return page.returncode, said


def test_units_of_the_example_are_found_as_they_were_put_in(clone, main_job):
    (line,) = [line for line in THREE_MINUTES if line.startswith("vibrissa neural ")]
    if line not in clone.done:
        pytest.skip("the lines above were left out")
    units = json.loads(clone.type(f"{line} --json").stdout)["units"]
    assert [unit["significant"] for unit in units] == [True, True, False]
    for unit, truth in zip(units[:2], (6e-6, 10e-6), strict=True):
        assert unit["threshold_low"] < truth < unit["threshold_high"]


def test_picture_of_the_first_page_is_there(clone):
    if not any("savefig" in line for line in clone.done):
        pytest.skip("the lines above were left out")
    assert (clone.folder / "envelope.png").read_bytes().startswith(b"\x89PNG")


def test_clone_is_clean_after_all_of_it(clone):
    if len(clone.done) < len(ALL):
        pytest.skip("the lines above were left out")
    assert clone.changes() == ""


def test_home_is_empty_after_all_of_it(clone):
    if len(clone.done) < len(ALL):
        pytest.skip("the lines above were left out")
    assert clone.at_home() == []


CACHING = """
import importlib.util
import matplotlib.pyplot, numba, scipy, xarray
for name in ("dask", "pynwb"):
    if importlib.util.find_spec(name):
        importlib.import_module(name)
"""


def test_libraries_keep_their_caches_in_the_folder(tmp_path):
    clone = Clone(tmp_path)
    clone.keep()
    done = clone.call(".venv/bin/python", "-c", CACHING)
    assert done.returncode == 0, done.stderr
    assert clone.at_home() == []
    assert (clone.folder / ".cache" / "matplotlib").is_dir()
    assert clone.changes() == ""
    clone.env["MPLCONFIGDIR"] = str(clone.home / "mine")
    clone.call(".venv/bin/python", "-c", "import matplotlib.pyplot")
    assert "mine" in clone.at_home()  # a place that the user has set is kept
