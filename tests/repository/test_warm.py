import re
import subprocess
import sys
from pathlib import Path

import pytest

import vibrissa
from vibrissa.warm import loops

SOURCES = Path(vibrissa.__file__).parent

# Loops of what few do: marks with a fan, packed movies, and estimators that must be asked for
LATER = {
    "video/find/curvature_maps.py",  # one of its loops is a part of those that call it
    "video/identity/whisker_fan.py",
    "video/identity/identity_linking.py",
    "video/identity/common_motion.py",
    "video/io/photron.py",
    "video/kernel/estimators.py",
    "video/kernel/band.py",
}

COMMANDS = """
import sys
from pathlib import Path
from vibrissa.warm import _printed, _run, _write_inputs
_write_inputs("movies")
said = sys.stdout
with _printed(said):
    for words in {commands!r}:
        _run(words)
"""
SCAN = "--contact 0.31 --base-angle 1.1 --speed 0.05 --whisker.length 0.05 --whisker.cone-angle 1.2e-3"
TYPED = (
    f"scan gaps.csv {SCAN} --node 0.005 --out scan.nc",
    f"scan heights.csv {SCAN}",
    "gap --contact 0.4 --base-angle 0.9 --gap-width 0.01",
    "profile --contact 0.4 --base-angle 0.9",
    f"map --texture gaps.csv {SCAN.replace('0.31', '0.2:0.4:3').replace('1.1', '0.9,1.1')} --scheduler synchronous",
    "track movie.mkv --frame-rate 2000 --pixel-size 9.5e-5",
    "track movie.mkv --frame-rate 2000 --pixel-size 9.5e-5 --tracking link",
    "neural --spikes spikes.csv --stimulus stimulus.csv --trials 20 --null paper2014",
)


@pytest.fixture(scope="module")
def warmed():
    """Loops as the set-up leaves them; where there was none, they are compiled now."""
    if not {file for (file, _), there in cached(SOURCES).items() if not there} <= LATER:
        done = subprocess.run([sys.executable, "-m", "vibrissa.warm"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def cached(folder):
    """Functions of this package whose compiled form is kept, with their files."""
    names = {path.name for path in folder.rglob("*.nbi")}
    found = {}
    for path in SOURCES.rglob("*.py"):
        for name in re.findall(r"^@(?:numba\.)?njit\(cache=True.*\ndef (\w+)\(", path.read_text("utf-8"), re.M):
            kept = any(one.startswith(f"{path.stem}.{name}-") for one in names)
            found[str(path.relative_to(SOURCES)), name] = kept
    return found


def test_the_loops_are_counted():
    assert loops() == len(cached(Path("nowhere")))


def test_after_it_every_loop_is_kept_but_those_that_few_need(warmed):
    assert {file for (file, _), there in cached(SOURCES).items() if not there} <= LATER


def test_after_it_commands_compile_nothing(warmed, tmp_path):
    code = COMMANDS.format(commands=TYPED)
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
