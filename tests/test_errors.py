"""An error is one line, in the process that meets it and in the one that hears of it."""

import pickle
import re
import shlex
import sys
import tomllib
from pathlib import Path

import pytest

from vibrissa.errors import ConvergenceError, InputError, MachineError, install

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (InputError("a\nb", "must be\nshort", [1, 2], "cut it"), "a b must be short, got [1, 2]; cut it"),
        (InputError("scan", "must end"), "scan must end"),
        (ConvergenceError("fit", 0.5, 3), "fit did not converge: residual 0.5 after 3 iterations"),
        (ConvergenceError("fit", 1.0, 9, "try less"), "fit did not converge: residual 1 after 9 iterations; try less"),
    ],
)
def test_an_error_is_one_line_that_survives_the_way_between_processes(error, line):
    there = pickle.loads(pickle.dumps(error))
    assert str(error) == str(there) == line
    assert type(there) is type(error)


@pytest.mark.parametrize("error", [InputError("a", "must be b"), MachineError("a", "must be b", 3, "try c")])
def test_an_error_keeps_its_fields_between_processes_and_under_another_name(error):
    there = pickle.loads(pickle.dumps(error))
    assert (there.quantity, there.rule) == ("a", "must be b")
    assert (there.value, there.remedy) == (("3", "try c") if isinstance(error, MachineError) else (None, ""))
    assert (there.code, there.renamed("d").code) == (error.code, error.code)
    assert str(there.renamed("d")) == "d" + str(error)[1:]


def test_the_remedy_for_an_extra_is_a_command_of_the_running_python(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/my rats/.venv/bin/python")
    words = shlex.split(install("page"))
    assert words == ["/my rats/.venv/bin/python", "-m", "pip", "install", "vibrissa[page]"]


def test_every_extra_that_is_asked_for_is_one_and_no_refusal_has_words_of_its_own():
    known = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    texts = {path: path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py")}
    asking = r"\b(?:install|optional_module)\((?:.+, )?[\"'](\w+)[\"']\)"
    asked = {extra for text in texts.values() for extra in re.findall(asking, text)}
    assert asked == set(known) - {"all"}
    assert [path.name for path, text in texts.items() if "pip install 'vibrissa" in text] == ["errors.py"]
