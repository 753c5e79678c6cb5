"""Every reader reads changed files or refuses them in one line: no fault, no crash, no hang, within limits of memory.

The changes are the same every time; ``python tests/helpers/fuzzing.py --seed N --times N --keep`` looks further, and
adds what fails to the corpus (``tests/corpus``), which is read here again.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import vibrissa

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
HELPERS = Path(__file__).parent / "helpers"
SOURCE = Path(vibrissa.__file__).parent
ELSEWHERE = {  # readers that call others of the list, or of data that is no file
    "known_sweep": "opens a movie or tracks, and a texture",
    "open_movie": "with read_blocks",
    "open_results": "datasets",
    "open_tracks": "datasets, a movie, edits",
    "read_binned": "counts",
    "read_columns": "with read_texture",
    "read_deeplabcut": "with read_tracks",
    "read_gaps": "with read_texture",
    "read_height_profile": "with read_texture",
    "read_json": "with read_sorted_folder",
    "read_keypoints": "with read_tracks",
    "read_knutsen": "with read_tracks",
    "read_line": "pixels",
    "read_measurements": "with read_tracks",
    "read_npy": "arrays of every kind",
    "read_npz": "with read_sorted_folder",
    "read_numpy_folder": "with read_sorted_folder",
    "read_out": "pixels",
    "read_recording": "spikes and a stimulus",
    "read_results": "datasets",
    "read_segments": "with read_tracks",
    "read_series": "datasets",
    "read_session": "spikes and a stimulus",
    "read_stimulus": "a stimulus",
    "read_surface": "with read_texture",
    "read_table": "tables of every kind",
    "read_topography": "with read_texture",
    "read_units": "spikes",
    "read_wav": "a sound, and a command",
    "read_whiskiwrap": "with read_tracks",
    "read_zarr": "with read_sorted_folder",
}


def test_changed_files_are_read_or_refused_in_one_line():
    done = subprocess.run(
        [sys.executable, HELPERS / "fuzzing.py"], capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]


def test_every_reader_is_fuzzed():
    text = "\n".join(path.read_text() for path in SOURCE.rglob("*.py"))
    readers = set(re.findall(r"^def ((?:read|open)_\w+)\(", text, re.MULTILINE))
    used = set(re.findall(r"\b(?:read|open)_\w+", (HELPERS / "fuzzed_readers.py").read_text()))
    assert readers - used - ELSEWHERE.keys() == set()
