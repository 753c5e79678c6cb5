"""Changed folders of raw samples are opened or refused in one line."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("spikeinterface", reason="the extra sorting is not installed")

from fuzzed_readers import READERS

FUZZING = Path(__file__).parents[2] / "helpers" / "fuzzing.py"


def test_changed_recordings_are_opened_or_refused_in_one_line():
    names = [name for name in READERS if name.startswith("recording, ")]
    done = subprocess.run([sys.executable, FUZZING, *names], capture_output=True, text=True, timeout=900, check=False)
    assert names
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
