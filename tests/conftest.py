"""What tests of several rooms share."""

import gc
import signal
import sys
from pathlib import Path

import pytest

from vibrissa import cli
from vibrissa.cli.shared.display import progress

SLOW = Path(__file__).with_name("slow.txt")  # written by choose_fast.py


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark what ``python3 run.py test --fast`` leaves out."""
    names = set(SLOW.read_text().split())
    for item in items:
        if item.nodeid.partition("[")[0] in names:
            item.add_marker("slow")


def pytest_collection_finish():
    """Leave what the imports made to the end: the garbage collector need not walk it in every test."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


@pytest.fixture(scope="session", autouse=True)
def hears_ctrl_c():
    """Let what tests start hear Ctrl-C, also where the tests themselves do not (``nohup … &``): it is inherited."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def vibrissa(monkeypatch, capsys):
    """Run the command line in this process; give exit code, stdout, stderr, however slow the machine is."""
    monkeypatch.setattr(progress, "PATIENCE", 1e6)

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["vibrissa", *map(str, words)])
        code = 0
        try:
            cli.main()
        except SystemExit as stop:
            code = stop.code or 0
        return code, *capsys.readouterr()

    return call
