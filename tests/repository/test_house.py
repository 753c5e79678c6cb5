"""The house stands as told: locks that fit, a set-up that is done once, citations that resolve."""

import ast
import importlib.util
import re
import socket
import subprocess
import sys
import time
import tomllib
from collections import Counter
from pathlib import Path

import pytest
import yaml
from packaging.markers import default_environment
from packaging.requirements import Requirement

import choose_fast
import vibrissa

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
CORE, DEV = ROOT / "requirements.lock", ROOT / "requirements-dev.lock"
SORTING = ROOT / "requirements-sorting.lock"
ALONE = ("all", "sorting")  # the former is the others, the latter does not go with them

EQUATIONS = range(1, 20)  # of [Boubenec2014]_


@pytest.fixture
def run():
    """Give run.py as a module."""
    spec = importlib.util.spec_from_file_location("run", ROOT / "run.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# Locks


def locked(path):
    """List what a lock pins, each with its marker."""
    return [Requirement(line.rstrip(" \\")) for line in path.read_text().splitlines() if re.match(r"\w", line)]


def place(python, platform, machine):
    """Give the environment in which markers are judged."""
    return default_environment() | {
        "python_version": python,
        "python_full_version": f"{python}.1",
        "sys_platform": platform,
        "platform_system": platform.capitalize(),
        "platform_machine": machine,
    }


def holding(requirements, environment):
    """Keep the requirements that hold in an environment."""
    return [one for one in requirements if one.marker is None or one.marker.evaluate(environment)]


def pins(path, environment):
    """Give the versions a lock means in one environment."""
    chosen = holding(locked(path), environment)
    assert len({one.name for one in chosen}) == len(chosen)
    return {one.name: str(one.specifier).removeprefix("==") for one in chosen}


def asked(*lists):
    """List what the project asks for, by lists of pyproject.toml."""
    return [Requirement(text) for one in lists for text in one if isinstance(text, str)]


@pytest.mark.parametrize(
    ("platform", "machine"), [("linux", "x86_64"), ("linux", "aarch64"), ("darwin", "arm64")], ids=str
)
@pytest.mark.parametrize("python", ["3.11", "3.12", "3.13", "3.14"])
def test_locks_satisfy_what_the_project_asks_for(python, platform, machine):
    project, groups = PROJECT["project"], PROJECT["dependency-groups"]
    extras = [texts for name, texts in project["optional-dependencies"].items() if name not in ALONE]
    here = place(python, platform, machine)
    core, dev = pins(CORE, here), pins(DEV, here)
    for one in holding(asked(project["dependencies"], groups["build"]), here):
        assert one.specifier.contains(core[one.name.lower()]), one
    for one in holding(asked(*extras, groups["dev"], groups["docs"], groups["test"]), here):
        assert one.specifier.contains(dev[one.name.lower()]), one
    assert core.items() <= dev.items()
    sorting = pins(SORTING, here)
    for one in holding(asked(project["optional-dependencies"]["sorting"], groups["test"]), here):
        assert one.specifier.contains(sorting[one.name.lower()]), one


@pytest.mark.parametrize("path", [CORE, DEV, SORTING], ids=lambda path: path.name)
def test_locks_are_the_ones_made_from_this_project_and_hold_hashes_alone(run, path):
    text = path.read_text()
    assert text == run.sealed(run.body(path))
    assert text.replace("==1", "==2", 1) != run.sealed(run.body(path).replace("==1", "==2", 1))
    assert "://" not in text
    assert "torch" not in {one.name for one in locked(path)}
    entries = re.split(r"\n(?=\w)", run.body(path).strip())
    assert all("--hash=sha256:" in entry for entry in entries)


# Set-up


@pytest.fixture
def set_up(run, monkeypatch, tmp_path):
    """Give run.py with an environment elsewhere, and the list of the commands it would run."""
    commands = []

    def pretend(command, **_):
        commands.append([str(word) for word in command])
        (tmp_path / ".venv/lib/python3/site-packages").mkdir(parents=True, exist_ok=True)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(run, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(run.subprocess, "run", pretend)
    return run, commands


def test_set_up_is_done_once(set_up):
    run, commands = set_up
    run.install(run.CORE)
    assert "--clear" in commands[0]
    assert all("--no-deps" in command for command in commands[1:-1])
    assert "--require-hashes" in commands[1]
    assert commands[-1][-2:] == ["-m", "vibrissa.warm"]
    before = len(commands)
    run.install(run.CORE)
    assert len(commands) == before


def test_loops_are_compiled_when_first_asked_for(set_up):
    run, commands = set_up
    run.install(run.DEV, compiled=False)
    assert not [command for command in commands if command[-1] == "vibrissa.warm"]
    commands.clear()
    run.install(run.CORE)
    run.install(run.CORE)
    assert [command[-1] for command in commands] == ["vibrissa.warm"]


def test_the_tools_are_added_to_what_is_there_and_hold_what_the_main_job_needs(set_up):
    run, commands = set_up
    run.install(run.CORE)
    commands.clear()
    run.install(run.DEV)
    run.install(run.CORE)
    assert len(commands) == 2
    assert not any("--clear" in command for command in commands)


def test_half_made_set_up_is_made_anew(set_up, monkeypatch):
    run, commands = set_up
    run.install(run.CORE)
    (run.VENV / "installed").unlink()
    commands.clear()
    run.install(run.CORE)
    assert "--clear" in commands[0]


def test_whatever_starts_from_the_environment_is_given_places_for_caches_in_the_folder(set_up, monkeypatch):
    run, _ = set_up
    run.install(run.CORE)
    (line,) = run.VENV.rglob("vibrissa-caches.pth")
    for name in run.CACHES:
        monkeypatch.delenv(name, raising=False)
    exec(line.read_text(encoding="ascii"))  # as Python does
    assert all(Path(run.os.environ[name]).is_relative_to(run.ROOT) for name in ("XDG_CACHE_HOME", "MPLCONFIGDIR"))


def test_loops_that_cannot_be_compiled_beforehand_do_not_stop_the_set_up(set_up, monkeypatch, capsys):
    run, _ = set_up
    pretend = run.subprocess.run

    def fail_to_compile(command, **how):
        return subprocess.CompletedProcess(
            command, int(command[-1] == "vibrissa.warm") or pretend(command, **how).returncode
        )

    monkeypatch.setattr(run.subprocess, "run", fail_to_compile)
    run.install(run.CORE)
    assert "the commands that need them do it" in capsys.readouterr().err
    assert (run.VENV / "installed").exists()


def test_failed_set_up_leaves_no_record(set_up, monkeypatch):
    run, _ = set_up
    run.install(run.CORE)
    monkeypatch.setattr(run, "fingerprint", lambda _: "another")
    monkeypatch.setattr(run.subprocess, "run", lambda command, **_: subprocess.CompletedProcess(command, 1))
    with pytest.raises(SystemExit, match="set-up failed"):
        run.install(run.CORE)
    assert not (run.VENV / "installed").exists()


@pytest.fixture
def lonely(run, monkeypatch, tmp_path):
    """Give run.py with this environment's pip, and a lock of a package that is not there."""
    for name in [name for name in run.os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", run.os.devnull)
    monkeypatch.setenv("PIP_RETRIES", "0")
    monkeypatch.setattr(run, "BIN", Path(sys.executable).parent)
    monkeypatch.setattr(run, "VENV", tmp_path)
    (tmp_path / "lock").write_text(f"no-such-package==1 --hash=sha256:{'0' * 64}\n")
    return run, ("--require-hashes", "--only-binary=:all:", "-r", tmp_path / "lock")


def test_without_a_network_the_set_up_names_the_network(lonely, monkeypatch):
    run, words = lonely
    with socket.socket() as closed:  # bound, and not listening: whoever calls is refused
        closed.bind(("127.0.0.1", 0))
        monkeypatch.setenv("PIP_INDEX_URL", f"http://127.0.0.1:{closed.getsockname()[1]}/")
        with pytest.raises(SystemExit) as stop:
            run.pip(*words)
    assert re.fullmatch(r"run\.py: the set-up failed: pip cannot reach a package registry.*", stop.value.code)
    assert "Python" not in stop.value.code


def test_without_a_wheel_the_set_up_names_this_python_and_where_pip_looked(lonely, monkeypatch):
    run, words = lonely
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(SystemExit) as stop:
        run.pip(*words)
    assert re.fullmatch(
        r"run\.py: the set-up failed: .*PIP_NO_INDEX.* no wheel for Python 3\.\d+\.\S+ on .*", stop.value.code
    )
    assert run.LOCKED_FOR in stop.value.code


def test_a_failure_of_another_kind_is_not_explained(run):
    assert run.cause("ERROR: [Errno 28] No space left on device") == "see above"


LOG = """10:00:00 Collecting numpy==2.4.6 (from -r requirements.lock (line 3))
10:00:01 Processing /wheels/docstring_parser-0.18.0-py3-none-any.whl (from -r requirements.lock (line 9))
10:00:02   Collecting markdown-it-py==4.3.0 (from -r requirements.lock (line 15))
"""


def test_set_up_says_every_few_seconds_how_far_pip_is(run, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(run, "VENV", tmp_path)
    monkeypatch.setattr(run, "EVERY", 0.01)
    (tmp_path / "pip.log").write_text(LOG)
    with run.followed(80):
        err, end = "", time.monotonic() + 60
        while not err and time.monotonic() < end:
            err = capsys.readouterr().err
    assert err.splitlines()[0] == "run.py: fetching package 3 of at most 80: markdown-it-py"
    assert run.doing("", 80, 2) == "starting pip"
    unpacking = LOG + "10:00:03 Installing collected packages: numpy, docstring-parser, markdown-it-py\n"
    assert run.doing(unpacking, 80, 2) == "unpacking 3 packages, 2 are there"


@pytest.mark.parametrize(("words", "passed"), [([], ["run"]), (["modes", "--json"], ["modes", "--json"])])
def test_words_go_to_vibrissa(run, monkeypatch, words, passed):
    called = []
    monkeypatch.setattr(run, "install", lambda _: None)
    monkeypatch.setattr(run.os, "execv", lambda _, command: called.extend(command))
    run.main(words)
    assert called == ["vibrissa", *passed]


def test_fast_leaves_out_what_is_slow_and_the_other_words_go_to_pytest(set_up, monkeypatch):
    run, _ = set_up
    called, checked = [], []
    monkeypatch.setattr(run, "say", checked.append)
    monkeypatch.setattr(run.os, "execv", lambda _, command: called.extend(command))
    run.main(["test", "--fast", "-k", "modes"])
    assert called[called.index("-m") + 1] == "not slow"
    assert called[-2:] == ["-k", "modes"]
    assert "--fast" not in called
    assert checked
    assert "mypy" not in checked


def test_the_fast_tests_are_the_quickest_that_fit_the_budget():
    taken = {"quick": 1.0, "long": choose_fast.BUDGET, "middling": choose_fast.BUDGET / 2}
    assert choose_fast.slow(taken, before=["not run", "quick"]) == ["long", "not run"]


def test_slow_tests_are_tests_that_are_there():
    names = choose_fast.SLOW.read_text().split()
    assert names == sorted(set(names))
    for file in {name.partition("::")[0] for name in names}:
        tests = {node.name for node in ast.parse((ROOT / file).read_text()).body if isinstance(node, ast.FunctionDef)}
        assert {name.partition("::")[2] for name in names if name.startswith(f"{file}::")} <= tests


def test_old_python_is_told_so(run, monkeypatch):
    ast.parse((ROOT / "run.py").read_text(), feature_version=(3, 6))  # it can be read that far back
    monkeypatch.setattr(run.sys, "version_info", (3, 9, 6))
    with pytest.raises(SystemExit, match=r"needs Python 3\.11"):
        run.main([])


def test_missing_venv_names_the_remedy(run, monkeypatch):
    monkeypatch.setattr(run.importlib.util, "find_spec", lambda name: None if name == "ensurepip" else name)
    with pytest.raises(SystemExit, match="apt install python3-venv"):
        run.main([])


# Citations


def docstrings():
    """Give every docstring of the package as one line, with its place."""
    for path in sorted((ROOT / "src").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                yield path.name, " ".join((ast.get_docstring(node) or "").split())


def bibliography():
    return dict(re.findall(r"@\w+\{(\w+),.*?doi *= \{(.*?)\}", (ROOT / "docs/references.bib").read_text(), re.DOTALL))


def test_every_citation_is_in_the_bibliography():
    for place, text in docstrings():
        missing = set(re.findall(r"\[(\w+)\]_", text)) - set(bibliography())
        assert not missing, f"{place}: {missing}"


def test_every_equation_of_the_paper_is_cited_once():
    cited = Counter()
    for _, text in docstrings():
        for numbers in re.findall(r"Eqs?\. ((?:\(\d+\)(?:, | and )?)+) of \[Boubenec2014\]_", text):
            cited.update(map(int, re.findall(r"\d+", numbers)))
    assert cited == Counter(EQUATIONS)


def test_citation_file_names_this_version_and_the_paper():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == vibrissa.__version__
    assert citation["license"] == PROJECT["project"]["license"]
    assert [reference["doi"] for reference in citation["references"]] == [bibliography()["Boubenec2014"]]
