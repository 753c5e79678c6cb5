"""What tests of several rooms share."""

import sys

import pytest

from vibrissa import cli


@pytest.fixture
def vibrissa(monkeypatch, capsys):
    """Run the command line in this process; give exit code, stdout, stderr."""

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["vibrissa", *map(str, words)])
        code = 0
        try:
            cli.main()
        except SystemExit as stop:
            code = stop.code or 0
        return code, *capsys.readouterr()

    return call
