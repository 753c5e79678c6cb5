"""A run that hangs when it is stopped ends all the same, in one line and in a limited time."""

import os
import signal
import subprocess
import sys
import time

import pytest

from vibrissa.study.run import study
from vibrissa.sweep.engine import Engine, each
from vibrissa.sweep.stops import without_stops

HANGS = {  # what a stop finds at work; each would hold the end of Python for 100 s
    "a thread": "with ThreadPoolExecutor(1) as pool: pool.submit(time.sleep, 100).result()",
    "threads of the engine": "each(time.sleep, [100, 100], Engine(scheduler='threads', workers=2))",
    "an interruption that is lost": "lost()",
    "cleaning": "clean()",
}
HEARD = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
"""  # whatever runs the tests may ignore them, as nohup does
RUN = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from vibrissa.cli.shared import stoppable
from vibrissa.sweep import stops
from vibrissa.sweep.engine import Engine, each

def lost():
    while True:
        try:
            time.sleep(100)
        except KeyboardInterrupt:
            pass

def clean():
    try:
        time.sleep(100)
    finally:
        time.sleep(100)

stoppable.LONGEST, stops.TO_END = 3.0, 1.0
with stoppable.stoppable(Path("out")):
    print("at work", flush=True)
    {hang}
"""


@pytest.mark.parametrize("hang", HANGS)
@pytest.mark.parametrize(("number", "code"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_nothing_that_hangs_holds_a_stop(hang, number, code):
    if not hasattr(signal, number):
        pytest.skip("this system has no such signal")
    words = [sys.executable, "-c", HEARD + RUN.format(hang=HANGS[hang])]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        assert run.stdout.readline() == "at work\n"
        run.send_signal(getattr(signal, number))
        try:
            _, err = run.communicate(timeout=30)
        finally:
            run.kill()
    assert run.returncode == code
    assert err == "vibrissa: stopped; finished work is kept in out, and the same command continues from there\n"


VERB = """
import sys, time
from pathlib import Path
from multiprocessing import get_context
from vibrissa import cli
from vibrissa.files import written_whole

def work(*_, **__):
    child = get_context("fork").Process(target=time.sleep, args=(100,))
    child.start()
    with written_whole("out.nc") as path:
        path.write_text("half")
        print(child.pid, flush=True)
        time.sleep(100)

cli.app = work
sys.argv = ["vibrissa", "scan"]
cli.main()
"""


@pytest.mark.parametrize(
    ("numbers", "code"), [(["SIGINT"], 130), (["SIGINT", "SIGINT"], 130), (["SIGTERM"], 143), (["SIGHUP"], 129)]
)
def test_every_verb_that_is_stopped_ends_in_one_line_and_leaves_nothing(tmp_path, numbers, code):
    if not hasattr(signal, numbers[0]) or not hasattr(os, "fork"):
        pytest.skip("this system has no such signal, or no fork")
    words = [sys.executable, "-c", HEARD + VERB]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as verb:
        child = int(verb.stdout.readline())
        for number in numbers:
            verb.send_signal(getattr(signal, number))
            time.sleep(0.05)
        try:
            _, err = verb.communicate(timeout=30)
        finally:
            verb.kill()
    assert (verb.returncode, err) == (code, "vibrissa: stopped before its end\n")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


@pytest.mark.parametrize("error", ["RuntimeError", "InputError('a.csv', 'must be read')", "SystemExit(1)"])
def test_an_interruption_that_a_library_turns_into_an_error_is_a_stop(error):
    """As Numba's compiler does."""
    code = f"""
import signal, sys
from vibrissa import cli
from vibrissa.errors import InputError

def work(*_, **__):
    try:
        signal.raise_signal(signal.SIGTERM)
    except KeyboardInterrupt:
        raise {error} from None

cli.app = work
sys.argv = ["vibrissa", "scan"]
cli.main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (143, "vibrissa: stopped before its end\n")


@pytest.mark.parametrize(
    ("before", "code", "says"),
    [
        ("atexit.register(signal.raise_signal, signal.SIGINT)", 0, ""),  # the command has ended, Python not yet
        ("sys.meta_path.insert(0, stopping)", 130, "vibrissa: stopped\n"),  # while it is loaded
    ],
)
def test_ctrl_c_before_and_after_the_work_is_no_traceback(before, code, says):
    run = f"""
import atexit, signal, sys
from types import SimpleNamespace
from vibrissa.__main__ import command

def find_spec(name, *_):
    if name.startswith("vibrissa.cli"):
        signal.raise_signal(signal.SIGINT)

stopping = SimpleNamespace(find_spec=find_spec)
{before}
sys.argv = ["vibrissa", "--version"]
command()
"""
    done = subprocess.run([sys.executable, "-c", HEARD + run], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (code, says)


def test_a_signal_that_is_ignored_stays_so():
    code = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n" + RUN.format(
        hang="signal.raise_signal(signal.SIGHUP); print('went on')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "at work\nwent on\n", "")


def test_a_stop_waits_for_what_must_not_be_cut_in_two():
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, _: heard.append(number))
    try:
        with without_stops():
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGTERM)
            assert heard == []
        assert heard == [signal.SIGTERM]
        signal.raise_signal(signal.SIGTERM)
        assert len(heard) == 2
    finally:
        signal.signal(signal.SIGTERM, before)


def test_results_are_put_in_place_together(tmp_path, monkeypatch):
    (work := tmp_path / "work").mkdir()
    for name in "abc":
        (work / name).write_text(name)
    replace = os.replace

    def stopped(*names):
        signal.raise_signal(signal.SIGINT)
        replace(*names)

    monkeypatch.setattr(os, "replace", stopped)
    with pytest.raises(KeyboardInterrupt), without_stops():
        study._put_in_place(work, tmp_path / "out", set())
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a", "b", "c"]


def test_an_error_in_a_thread_gives_up_what_waits_and_is_raised():
    done = []

    def work(number):
        if number == 0:
            raise ValueError("refused")
        time.sleep(0.01)
        done.append(number)

    with pytest.raises(ValueError, match="refused"):
        each(work, range(1000), Engine(scheduler="threads", workers=2))
    assert len(done) < 500
