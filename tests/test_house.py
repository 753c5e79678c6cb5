"""The house stands as told: a light start, locks that fit, a set-up that is done once, citations that resolve."""

import ast
import importlib.util
import json
import re
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

import pytest
import yaml
from packaging.markers import default_environment
from packaging.requirements import Requirement

import vibrissa

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
CORE, DEV = ROOT / "requirements.lock", ROOT / "requirements-dev.lock"

# Equations of [Boubenec2014]_ that the package has: whoever builds one adds it here.
EQUATIONS = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19}


@pytest.fixture
def run():
    """Give run.py as a module."""
    spec = importlib.util.spec_from_file_location("run", ROOT / "run.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# Start-up

HELP = """
import json, sys
from vibrissa.cli import main
sys.argv = ["vibrissa", "--help"]
try:
    main()
finally:
    print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})), file=sys.stderr)
"""


def test_help_imports_nothing_heavy():
    done = subprocess.run([sys.executable, "-c", HELP], capture_output=True, text=True, check=True)
    heavy = {"scipy", "matplotlib", "xarray", "pandas", "numba", "dask", "av", "tifffile", "pydantic", "h5py"}
    assert not heavy & set(json.loads(done.stderr.splitlines()[-1]))
    assert "modes" in done.stdout


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
    extras = [texts for name, texts in project["optional-dependencies"].items() if name != "all"]
    here = place(python, platform, machine)
    core, dev = pins(CORE, here), pins(DEV, here)
    for one in holding(asked(project["dependencies"], groups["build"]), here):
        assert one.specifier.contains(core[one.name.lower()]), one
    for one in holding(asked(*extras, groups["dev"], groups["docs"]), here):
        assert one.specifier.contains(dev[one.name.lower()]), one
    assert core.items() <= dev.items()


@pytest.mark.parametrize("path", [CORE, DEV], ids=lambda path: path.name)
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
        (tmp_path / ".venv").mkdir(exist_ok=True)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(run, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(run.subprocess, "run", pretend)
    return run, commands


def test_set_up_is_done_once(set_up):
    run, commands = set_up
    run.install(run.CORE)
    assert "--clear" in commands[0]
    assert all("--no-deps" in command for command in commands[1:])
    assert "--require-hashes" in commands[1]
    before = len(commands)
    run.install(run.CORE)
    assert len(commands) == before


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


def test_failed_set_up_leaves_no_record(set_up, monkeypatch):
    run, _ = set_up
    run.install(run.CORE)
    monkeypatch.setattr(run, "fingerprint", lambda _: "another")
    monkeypatch.setattr(run.subprocess, "run", lambda command, **_: subprocess.CompletedProcess(command, 1))
    with pytest.raises(SystemExit, match="set-up failed"):
        run.install(run.CORE)
    assert not (run.VENV / "installed").exists()


@pytest.mark.parametrize(("words", "passed"), [([], ["run"]), (["modes", "--json"], ["modes", "--json"])])
def test_words_go_to_vibrissa(run, monkeypatch, words, passed):
    called = []
    monkeypatch.setattr(run, "install", lambda _: None)
    monkeypatch.setattr(run.os, "execv", lambda _, command: called.extend(command))
    run.main(words)
    assert called == ["vibrissa", *passed]


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


def test_every_equation_built_is_cited_once():
    cited = Counter()
    for _, text in docstrings():
        for numbers in re.findall(r"Eqs?\. ((?:\(\d+\)(?:, | and )?)+) of \[Boubenec2014\]_", text):
            cited.update(map(int, re.findall(r"\d+", numbers)))
    assert set(range(1, 20)) >= EQUATIONS
    assert cited == Counter(EQUATIONS)


def test_citation_file_names_this_version_and_the_paper():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == vibrissa.__version__
    assert citation["license"] == PROJECT["project"]["license"]
    assert [reference["doi"] for reference in citation["references"]] == [bibliography()["Boubenec2014"]]
