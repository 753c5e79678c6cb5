"""Compare every file that two commits write for the same commands, value by value.

    .venv/bin/python benchmarks/same_results.py BEFORE [AFTER] [--store FOLDER] [--only WORD ...] [--tolerance 1e-12]

BEFORE and AFTER name commits; AFTER is the working tree if left out. Each commit is laid out in a folder of its own,
runs the commands of ``COMMANDS`` there with this Python, and keeps what they write in FOLDER/COMMIT, so that a second
comparison with the same commit runs nothing again. The working tree is always run anew.

Files are compared by content: datasets variable by variable (values, dimensions, attributes), tables and JSON number by
number, everything else (WAV, PNG, movies) by bytes; provenance, which names sources and times, is left out, and so are
reports, which are drawn from the datasets. Files kept under an address, which changes with the sources, are paired by
their content: ``sweeps/#2`` is the third by the means of its variables. One line per file says ``bit`` (equal to the
bit), the largest relative difference, or what is missing. The exit code is 1 where a difference exceeds the tolerance.

The whole takes about ten minutes per commit on two cores; ``--only gap modes`` takes the commands that begin so.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections import defaultdict
from io import BytesIO
from itertools import zip_longest
from pathlib import Path
from time import perf_counter

import numpy as np
import xarray as xr

ROOT = Path(__file__).resolve().parents[1]
POSTURE = "--contact 0.29 --base-angle 1.2"
SCAN = f"{POSTURE} --speed 0.1"
WHISKER = "--whisker.length 0.04 --whisker.cone-angle 1.5e-3"
TRACK = "track study/movie.mkv --frame-rate 2000 --pixel-size 9.5e-5"

# Each in its order; "study" is the folder of the built-in experiment, and a result of one may be the input of another.
COMMANDS = {
    "run": "run --out study",
    "laboratory": "run laboratory.toml --out laboratory",
    "modes-json": "modes --contact 0.29 --json",
    "modes": f"modes --contact 0.3 --about profile --base-angle 1.2 {WHISKER} --out modes.nc",
    "profile": f"profile {POSTURE} --atlas C2 --out profile-of-eq1.nc",
    "gap": f"gap {POSTURE} --gap-width 0.015 --out gap.nc",
    "scan": f"scan examples/grating.csv {SCAN} --atlas C2 --node 0.005 --out scan.nc",
    "scan-linear": f"scan examples/grating.csv {SCAN} --response linear --jump paper2014 --atlas C2 --out linear.nc",
    "ridges": f"scan examples/ridges.csv {SCAN} --atlas C2 --out ridges.nc",
    "map": "map --texture examples/grating.csv --contact 0.2:0.4:5 --base-angle 0.8:1.4:7 --speed 0.1"
    " --quantity rms --atlas C2 --out map.nc",
    "replay": "replay scan.nc --out command.wav",
    "neural": "neural --spikes examples/spikes.csv --stimulus examples/spikes-stimulus.csv --out units.nc",
    "track": f"{TRACK} --skin 50.5,57 --out tracked.nc",
    "posture": f"posture tracked.nc {WHISKER} --out posture.nc",
    "decompose": f"decompose tracked.nc --contact 0.29 {WHISKER} --out modal.nc",
}
IGNORED = re.compile(r"provenance|report|\.(svg|html|log|lock)$|/\.")
ADDRESS = re.compile(r"[0-9a-f]{24}\.nc")
NAMES = {"version", "vibrissa_version", "sources", "source_digest"}  # attributes that name the program
ADDRESSES = {"address", "made_of", "row"}  # those that name addresses, or repeat numbers of the tables as text
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    words.add_argument("before")
    words.add_argument("after", nargs="?")
    words.add_argument("--store", type=Path, default=Path(tempfile.gettempdir()) / "vibrissa-same-results")
    words.add_argument("--only", nargs="+", default=[""])
    words.add_argument("--tolerance", type=float, default=1e-12)
    asked = words.parse_args()
    before, after = (results(commit, asked.store, asked.only) for commit in (asked.before, asked.after))
    worst = compare(before, after, asked.only)
    sys.exit(worst > asked.tolerance)


def results(commit: str | None, store: Path, only: list[str]) -> Path:
    """Run the chosen commands of one commit, those alone that its folder does not hold yet."""
    name = git("rev-parse", commit).strip() if commit else "tree"
    folder = store / name
    if commit is None and folder.exists():
        shutil.rmtree(folder)
    if not folder.exists():
        lay_out(commit, folder)
    for title, command in COMMANDS.items():
        if title.startswith(tuple(only)) and not (folder / "done" / title).exists():
            run(title, command, folder)
    return folder


def lay_out(commit: str | None, folder: Path) -> None:
    """Copy the sources and examples of a commit, or of the working tree, into a folder."""
    (folder / "done").mkdir(parents=True)
    if commit is None:
        for part in ("src", "examples"):
            shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        packed = subprocess.run(
            ["git", "-C", ROOT, "archive", commit, "src", "examples"], capture_output=True, check=True
        )
        with tarfile.open(fileobj=BytesIO(packed.stdout)) as archive:
            archive.extractall(folder, filter="data")
    third = (ROOT / "examples" / "laboratory.toml").read_text().replace("textures = 5 ", "textures = 2 ")
    (folder / "laboratory.toml").write_text(re.sub(r"n_frames = \d+", "n_frames = 1750", third))


def run(title: str, command: str, folder: Path) -> None:
    """Run one command where its inputs are, and keep what it prints with the files that it writes."""
    start, there = perf_counter(), {**os.environ, "PYTHONPATH": str(folder / "src"), "COLUMNS": "200"}
    program = [sys.executable, "-m", "vibrissa", *spelt(command, folder).split()]
    done = subprocess.run(program, cwd=folder, env=there, capture_output=True, text=True)
    (folder / f"{title}.out").write_text(done.stdout)
    if done.returncode:
        sys.exit(f"{folder.name[:8]}: vibrissa {command}\nexit code {done.returncode}\n{done.stderr[-2000:]}")
    (folder / "done" / title).touch()
    print(f"{folder.name[:8]} {title:<14}{perf_counter() - start:7.1f} s", flush=True)


def spelt(command: str, folder: Path) -> str:
    """The command as the sources of a folder take it: some verbs and options had other names."""
    if (folder / "src" / "vibrissa" / "cli" / "shared" / "renamed.py").exists():
        return command
    return command.replace("map --texture", "sweep --texture").replace("--speed", "--scan-speed")


def compare(before: Path, after: Path, only: list[str]) -> float:
    """Print one line per file, and give the largest relative difference (infinite where something is missing)."""
    titles = [title for title in COMMANDS if title.startswith(tuple(only))]
    files = [named(folder) for folder in (before, after)]
    paths = sorted({path for of in files for path in of})
    worst = 0.0
    for path in paths:
        if path.endswith(".out") and Path(path).stem not in titles:
            continue
        one, other = (of.get(path) for of in files)
        if one is None or other is None:
            off, what = np.inf, f"only {'before' if one else 'after'}"
        else:
            off, what = difference(one, other)
        worst = max(worst, off)
        print(f"{'bit' if off == 0 else f'{off:.1e}':<9}{path}{what and ': ' + what}")
    print(f"{len(paths)} files, largest relative difference {worst:.1e}")
    return worst


def named(folder: Path) -> dict[str, Path]:
    """Files of the results by name; those kept under an address, by their order among the addressed of their folder."""
    found, addressed = {}, defaultdict(list)
    for path in written(folder):
        if ADDRESS.fullmatch(path.name):
            addressed[path.parent].append(folder / path)
        else:
            found[str(path)] = folder / path
    for parent, files in addressed.items():
        found |= {f"{parent}/#{k}": path for k, path in enumerate(sorted(files, key=means))}
    return found


def means(path: Path) -> list[float]:
    """Means of the variables of a dataset, to four digits: they tell it from the others of its folder."""
    data = xr.load_dataset(path, engine="h5netcdf")
    floats = [data[name].values for name in sorted(map(str, data.variables)) if data[name].dtype.kind == "f"]
    return [
        float(f"{values[np.isfinite(values)].mean():.3e}") if np.isfinite(values).any() else 0.0 for values in floats
    ]


def written(folder: Path) -> list[Path]:
    """Paths of the results below a folder."""
    kept = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return [
        path for path in kept if path.parts[0] not in ("src", "examples", "done") and not IGNORED.search(f"/{path}")
    ]


def difference(one: Path, other: Path) -> tuple[float, str]:
    """Largest relative difference of two files, and where it is."""
    if one.read_bytes() == other.read_bytes():
        return 0.0, ""
    if one.suffix == ".nc":
        return of_datasets(one, other)
    if one.suffix in (".csv", ".json", ".out", ".txt", ".toml"):
        return of_texts(one.read_text(), other.read_text())
    return np.inf, "other bytes"


def of_datasets(one: Path, other: Path) -> tuple[float, str]:
    """Largest difference of any variable, over the largest size of that variable."""
    first, second = (
        xr.load_dataset(path, engine="h5netcdf").drop_vars("address", errors="ignore") for path in (one, other)
    )
    if set(first.variables) != set(second.variables):
        return np.inf, f"variables {sorted(set(first.variables) ^ set(second.variables))}"
    found = [(of_arrays(first[name].values, second[name].values), name) for name in first.variables]
    worst, name = max(found, key=lambda pair: pair[0], default=(0.0, ""))
    keys = {*first.attrs, *second.attrs} - NAMES - (ADDRESSES if ADDRESS.fullmatch(one.name) else set())
    odd = [key for key in keys if str(first.attrs.get(key)) != str(second.attrs.get(key))]
    return (worst, str(name)) if worst or not odd else (0.0, f"attributes {sorted(odd)}")


def of_arrays(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of two arrays over their largest size; infinite where shapes or holes differ."""
    if one.shape != other.shape or one.dtype.kind != other.dtype.kind:
        return np.inf
    if one.dtype.kind not in "fciub":
        return 0.0 if np.array_equal(one, other) else np.inf
    hole = np.isnan(one) if one.dtype.kind in "fc" else np.zeros(one.shape, bool)
    if one.dtype.kind in "fc" and not np.array_equal(hole, np.isnan(other)):
        return np.inf
    a, b = (np.asarray(values[~hole], complex) for values in (one, other))
    return 0.0 if np.array_equal(a, b) else float(np.max(np.abs(a - b)) / max(np.max(np.abs(a)), np.max(np.abs(b))))


def of_texts(one: str, other: str) -> tuple[float, str]:
    """Largest relative difference of the numbers of two texts; infinite where their words differ."""
    worst, where = 0.0, ""
    for number, (a, b) in enumerate(zip_longest(one.splitlines(), other.splitlines(), fillvalue=""), 1):
        if NUMBER.sub("#", a).split() != NUMBER.sub("#", b).split():
            return np.inf, f"line {number}: {a.strip()[:60]!r} → {b.strip()[:60]!r}"
        for x, y in zip(map(float, NUMBER.findall(a)), map(float, NUMBER.findall(b)), strict=True):
            off = abs(x - y) / (max(abs(x), abs(y)) or 1)
            worst, where = max((worst, where), (off, f"line {number}"))
    return worst, where


def git(*words: str) -> str:
    return subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    main()
