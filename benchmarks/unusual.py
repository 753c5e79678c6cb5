"""Inputs of unusual kinds for every verb: python benchmarks/unusual.py [--part files|paths|outs|options|studies] [WORD].

Files of unusual kinds (``unusual_files.py``), what is no file where a file is meant (a FIFO, a device, a folder, a loop
of links, a name too long, none), places that cannot be written, numbers that no machine can serve, and studies that ask
for them. What counts as a failure is as in ``malformed.py``. WORD: only cases whose name has it.
"""

# ruff: noqa: E501 (a case is one line)
from __future__ import annotations

import argparse
import os
import shlex
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parent))
import malformed
from malformed import AT, CONE, TRIALS, VERBS
from unusual_files import FILES


class Case(NamedTuple):
    """A command line, what is odd in it, and files that it makes all the same."""

    command: str
    what: str
    keeps: bool = True


READERS = {
    "gaps": [f"scan {{}} {AT} {CONE} --speed 100mm/s --out out.nc"],
    "heights": [f"scan {{}} {AT} {CONE} --speed 100mm/s --x-unit m --z-unit m --out out.nc"],
    "path": [f"whisking gaps.csv {{}} --speed 100mm/s {CONE} --out out.nc"],
    "wav": [
        "sensor {} --kind moment --signal-unit V --calibration 1 --guess 100Hz --out out.nc",
        f"neural --spikes spikes.csv --stimulus {{}} {TRIALS} --out out.nc",
    ],
    "movie": ["track {} --frame-rate 500 --pixel-size 1e-4 --out out.nc"],
    "profile": [f"decompose {{}} {CONE} --contact 0.29 --out out.nc", "show {}"],
    "tracks": ["import-tracks {} --frame-rate 500 --pixel-size 1e-4 --out out.nc"],
    "spikes": [f"neural --spikes {{}} --stimulus stimulus.csv {TRIALS} --out out.nc"],
    "counts": [f"neural --spikes {{}} --stimulus stimulus.csv {TRIALS} --counted-bin 10ms --out out.nc"],
    "stimulus": [f"neural --spikes spikes.csv --stimulus {{}} {TRIALS} --out out.nc"],
    "command": [f"surround --spikes spikes.csv --command {{}} {TRIALS} --out out.nc"],
    "table": ["recordings {} --out out"],
    "diameters": ["whisker {}"],
}
MORE_PATHS = (  # beside the readers of malformed.py
    "track movie.mkv --frame-rate 500 --pixel-size 1e-4 --mark-file {} --out out.nc",
    "export {} --out archive --subject a --age P90D --sex U --session-start 2014-05-07T09:30:00Z",
    "figure 3 --results {} --out out.png",
    f"neural --spikes spikes.csv --stimulus stimulus.csv {TRIALS} --trial-table {{}} --out out.nc",
    f"neural --spikes spikes.csv --stimulus stimulus.csv {TRIALS} --kept {{}} --out out.nc",
    "replay {} --out out.wav",
    "kinematics profile.nc --marks {} --out out.nc",
    "posture {} --atlas C2",
    f"whisking gaps.csv {{}} --speed 100mm/s {CONE} --model rod --out out.nc",
    f"map --texture {{}} --contact 0.2:0.4:2 --base-angle 1:1.2:2 --speed 0.1 {CONE} --out out.nc",
)
LONG_NAME = "n" * 300
NO_FILES = (
    "fifo",
    "/dev/zero",
    "/dev/full",
    "folder",
    "loop",
    LONG_NAME,
    "''",
    "socket",
    "/proc/self/mem",
    "nowhere/x.csv",
)
WRITERS = (
    f"scan grating.csv {AT} {CONE} --speed 100mm/s --out {{}}",
    "track movie.mkv --frame-rate 500 --pixel-size 1e-4 --out out.nc --segments {}",
    "track movie.mkv --frame-rate 500 --pixel-size 1e-4 --out out.nc --preview {}",
    f"modes --contact 0.3 {CONE} --out {{}}",
    f"modes --contact 0.3 {CONE} --picture {{}}",
    "replay motion.nc --duration 4s --sampling-rate 2kHz --max-travel 5mm --out {}",
    "run small.toml --out {}",
    "study --schema --out {}",
    f"gap --contact 0.29 --base-angle 1.2 --gap-width 0.6mm {CONE} --model rod --movie {{}} --scan-speed 0.1",
    f"map --texture gaps.csv --contact 0.2:0.4:2 --base-angle 1:1.2:2 --speed 0.1 {CONE} --out {{}}",
    "figure 3 --results motion.nc --out {}",
)
NO_PLACES = (
    "fifo",
    "/dev/full",
    "folder",
    "loop",
    LONG_NAME + ".nc",
    "''",
    "/",
    "/proc/x.nc",
    "nowhere/x.nc",
    "socket",
    "gaps.csv/x.nc",
)
MANY = "1000000000000"
SCAN, NEURAL = (
    f"scan grating.csv {AT} {CONE} --speed 0.1",
    f"neural --spikes spikes.csv --stimulus stimulus.csv {TRIALS}",
)
TRACK = "track movie.mkv --frame-rate 500 --pixel-size 1e-4 --out out.nc"
MAP = f"map {CONE} --base-angle 1.2 --speed 0.1 --contact 0.3"
OPTIONS = (
    *[f"{SCAN} --n-modes {n}" for n in (MANY, "-1", "0", "41")],
    *[f"{SCAN} --sampling-rate {n}" for n in ("1e30", "1e-30", "-5", "nan", "inf")],
    *[f"{SCAN} --damping {n}" for n in ("0", "1", "5", "-1", "nan", "1e-300")],
    *[f"{SCAN} --friction {n}" for n in ("-3", "1e300", "nan", "3")],
    *[f"{SCAN} --node {n}" for n in ("1e300", "-1", "nan", "0")],
    *[f"scan grating.csv {AT} {CONE} --speed {n}" for n in ("0", "-1", "1e300", "1e-300", "inf")],
    *[f"{SCAN} --model rod --sampling-rate {n}" for n in ("1e9", "0.001")],
    *[f"modes --contact {n} {CONE}" for n in ("0", "1", "nan", "-0.1", "1e-300", "0.9999999999")],
    f"modes --contact 0.3 {CONE} --n-modes {MANY}",
    f"modes --contact 0.3 {CONE} --about profile --base-angle 1.2 --n-modes {MANY}",
    f"profile --contact 0.3 --base-angle nan {CONE}",
    f"gap --contact 0.29 --base-angle 1.2 --gap-width 1e300 {CONE}",
    f"gap --contact 0.29 --base-angle 1.2 --gap-width 1e-300 {CONE}",
    f"{MAP} --seeds 0:1e9:{MANY}",
    f"{MAP} --seeds -1",
    f"{MAP} --seeds 1:3:3 --grating-length 1e12",
    f"{MAP} --seeds 1:3:3 --mean-period 1e-12",
    f"map {CONE} --texture gaps.csv --base-angle 0.8:1.4:100000 --contact 0.2:0.4:100000 --speed 0.1:0.2:1000",
    f"{MAP} --texture gaps.csv --friction -1,0.4,3",
    f"{MAP} --texture gaps.csv --workers {MANY}",
    f"{MAP} --texture gaps.csv --workers 0",
    f"{MAP} --texture gaps.csv --workers -4",
    f"{MAP} --texture gaps.csv --scheduler tcp://127.0.0.1:1",
    f"{MAP} --texture gaps.csv --scheduler nonsense",
    *[NEURAL.replace(TRIALS, f"--trials {n}") for n in (MANY, "0", "-1", "1e9")],
    *[f"{NEURAL} --seed {n}" for n in ("-1", MANY * 9)],
    *[f"{NEURAL} --window {n}" for n in ("0 1e300", "4 0", "nan 1")],
    f"{NEURAL} --bin-width 1e-300",
    f"{NEURAL} --bin-width 0",
    f"neural --spikes counts.npy --stimulus stimulus.csv {TRIALS} --counted-bin 1e-300",
    f"neural --spikes counts.npy --stimulus stimulus.csv {TRIALS} --counted-bin 0",
    *[f"track movie.mkv --frame-rate {n} --pixel-size 1e-4 --out out.nc" for n in ("0", "1e300", "nan", "1e-300")],
    *[f"track movie.mkv --frame-rate 500 --pixel-size {n} --out out.nc" for n in ("-1", "1e300", "1e-300")],
    *[f"{TRACK} --seed-point {n}" for n in ("1e9,1e9", "nan,1", "-5,3", "1")],
    *[f"{TRACK} --search {n}" for n in (MANY, "0", "-1")],
    *[f"{TRACK} --node-spacing {n}" for n in ("1e-300", "0", "1e300")],
    f"{TRACK} --start {MANY}",
    f"{TRACK} --start 5 --stop 5",
    f"{TRACK} --region 0,0,0,0",
    f"{TRACK} --region -9,-9,1e9,1e9",
    f"replay motion.nc --out out.wav --duration {MANY}",
    "replay motion.nc --out out.wav --duration -1 --sampling-rate 0",
    "replay motion.nc --out out.wav --sampling-rate 1e30",
    f"recordings sweeps.csv --out out --gratings {MANY}",
    f"recordings sweeps.csv --out out --jitter {MANY}",
    f"trials-needed --threshold 10um --slope 1e6 --rms 1e-5 --trials {MANY}",
    *[
        f"sensor robot.csv --kind moment --column moment --signal-unit N_m --guess {n}"
        for n in ("0", "-1", "1e300", "nan")
    ],
    "sensor robot.csv --kind moment --column moment --calibration 1 --signal-unit V --guess 100Hz,33Hz,66Hz,200Hz",
    "whisker diameters.csv --whisker.length -1",
    "atlas --whisker ''",
    "explore --port -1",
    "explore --port 99999999",
    "show gaps.csv gaps.csv",
    "figure 99 --results motion.nc --out out.png",
    f"figure {MANY} --results motion.nc --out out.png",
)
HELD = (
    "[whisker]\nlength = 0.04\ncone_angle = 1.5e-3\n[posture]\ncontact = 0.29\nbase_angle = 1.2\n[scan]\nspeed = 0.1\n"
)
GRATING = "[texture]\nlength = 0.02\nseed = 1\n"
FILM = "[film]\nn_frames = 20\nsubframes = 2\ncamera = { frame_rate = 2000.0, pixel_size = 2e-4, width = 220, height = 80 }\n"
NAMED = 'name = "a"\n'
LABORATORY = (
    NAMED
    + '[laboratory]\ntruth = "modes"\nanimals = 1\nwhiskers = ["C1"]\nconditions = 1\ntextures = 1\nn_frames = 400\n'
)
CORTEX = (
    NAMED
    + HELD
    + GRATING
    + FILM
    + "[recording]\nn_trials = 5\nunit = { threshold = 8e-6, slope = 2.5e6, baseline = 5.0, latency = 0.012 }\n"
)
ONE = NAMED + HELD + GRATING
STUDIES = {
    "byte-order mark": "\ufeff" + ONE,
    "ends of lines of old Macs": ONE.replace("\n", "\r"),
    "a whole number of 100,000 digits": ONE + "n_modes = " + "9" * 100_000,
    "10^30 frames": NAMED + HELD + GRATING + FILM.replace("= 20", "= 1" + "0" * 30),
    "10^12 frames": NAMED + HELD + GRATING + FILM.replace("= 20", f"= {MANY}"),
    "no frames": NAMED + HELD + GRATING + FILM.replace("= 20", "= 0"),
    "10^12 subframes": NAMED + HELD + GRATING + FILM.replace("subframes = 2", f"subframes = {MANY}"),
    "camera of 10^6 pixels": NAMED + HELD + GRATING + FILM.replace("width = 220", "width = 1000000").replace("height = 80", "height = 1000000"),
    "camera of no pixels": NAMED + HELD + GRATING + FILM.replace("width = 220", "width = 0"),
    "camera of 10^300 Hz": NAMED + HELD + GRATING + FILM.replace("2000.0", "1e300"),
    "10^12 modes": f"n_modes = {MANY}\n" + ONE,
    "10^12 animals": LABORATORY.replace("animals = 1", f"animals = {MANY}"),
    "10^12 conditions": LABORATORY.replace("conditions = 1", f"conditions = {MANY}"),
    "10^12 textures": LABORATORY.replace("textures = 1", f"textures = {MANY}"),
    "10^12 frames of sweeps": LABORATORY.replace("n_frames = 400", f"n_frames = {MANY}"),
    "negative animals": LABORATORY.replace("animals = 1", "animals = -1"),
    "10^12 gratings": LABORATORY + f"[comparison]\ngratings = {MANY}\n",
    "10^12 trials": CORTEX.replace("n_trials = 5", f"n_trials = {MANY}"),
    "no trials": CORTEX.replace("n_trials = 5", "n_trials = 0"),
    "negative seed": ONE.replace("seed = 1", "seed = -1"),
    "seed of 100 digits": ONE.replace("seed = 1", "seed = " + "9" * 100),
    "texture of 10^9 m": ONE.replace("length = 0.02", "length = 1e9"),
    "not a number": ONE.replace("0.29", "nan"),
    "date for a number": ONE.replace("0.29", "2014-05-07"),
    "table for a number": ONE.replace("0.29", "{ a = 1 }"),
    "keys nested 10,000 times": NAMED + ".".join(["a"] * 10_000) + " = 1\n",
    "lists nested 100,000 times": NAMED + "x = " + "[" * 100_000 + "]" * 100_000,
    "key twice": ONE + "[scan]\nspeed = 0.2\n",
    "name with ends of lines": ONE.replace('"a"', '"a\\n\\u001b[31mred"'),
    "name of 10 MB": ONE.replace('"a"', '"' + "a" * 10_000_000 + '"'),
    "texture in a FIFO": NAMED + HELD + '[texture]\nfile = "fifo"\n',
    "texture in /dev/zero": NAMED + HELD + '[texture]\nfile = "/dev/zero"\n',
    "movie in a FIFO": NAMED + HELD + '[movie]\nfile = "fifo"\nframe_rate = 500\npixel_size = 1e-4\n',
    "movie is a folder": NAMED + HELD + '[movie]\nfile = "folder"\nframe_rate = 500\npixel_size = 1e-4\n',
    "friction beyond": ONE.replace("base_angle = 1.2", "base_angle = 1.2\nfriction = 3.0"),
}  # fmt: skip


def files() -> Iterator[Case]:
    """Files of unusual kinds."""
    for kind, made in FILES.items():
        for what, name, make in made:
            path = Path("odd") / name
            try:
                path.parent.mkdir()
                make(path)
                for command in READERS[kind]:
                    yield Case(command.replace("{}", shlex.quote(str(path))), f"{kind}: {what} {name!r}")
            finally:
                shutil.rmtree(path.parent)


def paths() -> Iterator[Case]:
    """What is no file in place of each file."""
    for command in (*(command for command, _ in VERBS), *MORE_PATHS):
        for path in NO_FILES:
            yield Case(command.replace("{}", path), f"{path[:20]} as input")


def outs() -> Iterator[Case]:
    """Places that cannot be written."""
    for command in WRITERS:
        for path in NO_PLACES:
            yield Case(command.replace("{}", path), f"{path[:20]} as output")


def options() -> Iterator[Case]:
    """Numbers that cannot be served."""
    for command in OPTIONS:
        yield Case(command, command[:100].partition(" ")[2])


def studies() -> Iterator[Case]:
    """Studies that ask for what cannot be."""
    for what, text in STUDIES.items():
        Path("odd.toml").write_text(text, newline="")
        for command in ("run odd.toml --dry-run", "run odd.toml --out out"):
            yield Case(command, what)


PARTS = {one.__name__: one for one in (files, paths, outs, options, studies)}


def surroundings() -> None:
    """What the cases find beside the whole files."""
    import socket

    os.mkfifo("fifo")
    Path("folder").mkdir()
    Path("loop").symlink_to("loop")
    Path("small.toml").write_text(ONE)
    socket.socket(socket.AF_UNIX).bind("socket")


def main() -> None:
    """Print the cases that fail, and the counts."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("word", nargs="?", default="")
    asked.add_argument("--part", choices=list(PARTS), action="append")
    asked.add_argument("--all", action="store_true", help="print every case")
    given = asked.parse_args()
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        malformed.whole_files(Path(folder))
        surroundings()
        for part in given.part or PARTS:
            for case in PARTS[part]():
                if given.word in f"{case.command} {case.what}":
                    counts[malformed.judged(case.command, Path(), case.what, every=given.all)] += 1
    print(f"{sum(counts.values())} cases: {dict(counts)}")


if __name__ == "__main__":
    main()
