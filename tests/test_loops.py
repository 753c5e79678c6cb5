"""Compiled loops that are kept: used again as they are, and made anew when what they call has changed."""

import subprocess
import sys
from pathlib import Path

import pytest

CALLED = """
from vibrissa.loops import njit

OFFSET = {offset}

@njit(cache=True)
def called(x):
    return {value} * x
"""
CALLER = """
from numba.core.event import Listener, install_listener
from vibrissa.loops import njit
from called import OFFSET, called

class Compiled(Listener):
    on_end = lambda self, event: None
    on_start = lambda self, event: print("compiled")

@njit(cache=True)
def caller(x):
    return called(x) + OFFSET

with install_listener("numba:compile", Compiled()):
    print(caller(1.0))
"""


def said(folder: Path, value: float, offset: float) -> list[str]:
    """What a loop prints that calls another one in a file of its own, and whether it had to be compiled."""
    for name, text in (("called", CALLED.format(value=value, offset=offset)), ("caller", CALLER)):
        path = folder / f"{name}.py"
        if not path.is_file() or path.read_text() != text:
            path.write_text(text)
    run = subprocess.run([sys.executable, "-B", "caller.py"], cwd=folder, capture_output=True, text=True, check=True)
    return run.stdout.split()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with compiled loops: 2 x + 3."""
    assert said(tmp_path, 2.0, 3.0)[-1] == "5.0"
    return tmp_path


def test_a_loop_is_compiled_once(folder: Path) -> None:
    """The second process finds what the first has kept."""
    assert said(folder, 2.0, 3.0) == ["5.0"]


def test_a_loop_is_made_anew_when_one_that_it_calls_has_changed(folder: Path) -> None:
    """Though its own file is the same."""
    assert said(folder, 7.0, 3.0)[-1] == "10.0"


def test_a_loop_is_made_anew_when_a_number_in_it_has_changed(folder: Path) -> None:
    """A number that it takes from another file is compiled in."""
    assert said(folder, 2.0, 4.0)[-1] == "6.0"


RECORDED = """
from typing import NamedTuple
from vibrissa.loops import njit

class {name}(NamedTuple):
    value: float

made = {name}
"""
READER = """
from vibrissa.loops import njit
from recorded import made

@njit(cache=True)
def read(record):
    return 2.0 * record.value

print(read(made(1.0)))
"""


def test_a_loop_is_made_anew_when_the_class_that_it_was_kept_for_has_another_name(tmp_path: Path) -> None:
    """Its own file is the same, and what was kept names a class that is no longer there."""
    tmp_path.joinpath("reader.py").write_text(READER)
    for name in ("First", "Second", "Second"):
        tmp_path.joinpath("recorded.py").write_text(RECORDED.format(name=name))
        run = subprocess.run([sys.executable, "-B", "reader.py"], cwd=tmp_path, capture_output=True, text=True)
        assert run.stdout.split() == ["2.0"], run.stderr
    assert len(list(tmp_path.glob("__pycache__/reader.read*.nbc"))) == 1
