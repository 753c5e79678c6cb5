"""What is said of long work, in plain lines where nobody watches, in bars on a terminal; of a whole run: test_typed."""

import io
import re
import sys
import time
from contextlib import nullcontext

from refusals import refusal

from vibrissa.cli.shared.display import progress as module
from vibrissa.errors import InputError


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_shows_a_bar_for_each_stage_within_80_columns(monkeypatch):
    seen = Terminal()
    monkeypatch.setattr(sys, "stderr", seen)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "xterm")
    with module.progress_bars() as report:
        report("filming", 0, 3500)
        report("filming", 3500, 3500)
        report("report", 2, 12)
    last = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", seen.getvalue()).replace("\r", "\n").splitlines()
    assert any("filming" in line and "3500/3500" in line for line in last)
    assert any("report" in line and "2/12" in line for line in last)
    assert max(map(len, last)) <= 80


def test_short_work_has_no_lines_and_long_work_has_them_before_it_ends(capsys, monkeypatch):
    with module.stage("short"):
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(module, "PATIENCE", 0.0)
    with module.stage("long"):
        err, end = "", time.monotonic() + 60
        while not err and time.monotonic() < end:
            err += capsys.readouterr().err
    assert re.fullmatch(r"vibrissa: 0:00:\d\d long\n", err)


def test_long_stages_have_a_line_now_and_then(capsys, monkeypatch):
    """A clock of a second for each report: ten frames of a hundred, a line every 30 s."""
    clock = iter(range(1000))
    monkeypatch.setattr(module, "perf_counter", lambda: float(next(clock)))
    monkeypatch.setattr(module, "_compiling", lambda progress: nullcontext())
    with module.progress_bars(whole=True) as report:
        for done in range(100):
            report("find whiskers", done, 100)
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition("find whiskers ")[2] for line in lines] == [f"({k} of 100)" for k in (0, 30, 60, 90)]
    assert lines[1] == "vibrissa: 0:00:31 find whiskers (30 of 100)"


def test_a_refusal_is_one_line(capsys):
    def refuse():
        with module.progress_bars(whole=True) as report:
            report("start", 0, 0)
            raise InputError("texture", "must be a file")

    with refusal("input", "texture"):
        refuse()
    assert capsys.readouterr().err == ""  # the caller says it


def test_a_loop_that_is_compiled_is_a_stage_of_its_own(capsys):
    from numba import njit

    with module.progress_bars(whole=True) as report:
        report("map", 0, 0)
        njit(lambda x: x + 1)(1)
    assert [line.split(" ", 2)[2] for line in capsys.readouterr().err.splitlines()] == ["map", module.COMPILING]
