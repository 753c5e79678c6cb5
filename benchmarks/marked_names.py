"""Names of linked lines in a recorded movie against whiskers that were followed from marks.

    vibrissa run examples/mouse-field.toml --out mouse
    vibrissa track test_video2.mp4 --frame-rate 200 --pixel-size "0.1 mm" --tracking link --segments lines.nc
    .venv/bin/python benchmarks/marked_names.py mouse/profile.nc lines.nc

A line is at a whisker of the study if it runs beside it for 15 px and 70 % of these points are within 2 px across. The
whisker's name is the one that lines at it have in most frames; a line with that name that is at the whisker in no part
contradicts the study, in frames in which the study has the whisker. Who is right there is in ``judged_names.csv``:
three verdicts, ``name``, ``study``, ``both`` (two parts of one whisker), ``neither``, or ``?`` where it cannot be
decided. They were given independently and blind, by an image-reading language model, from the pictures of
``blind_pictures.py``, which call the two A and B at random. What two of the three say counts. Frames in which the name
is right then count as followed. The last rows are of the frames in which the study's whisker lies apart: half of it is
farther than 4 px from every line that is not at it.
"""

import argparse
import csv
import json
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.spatial import cKDTree
from whiskers_apart import FAR, HALF

from vibrissa.netcdf import load

NEAR, SHARE, BESIDE = 2.0, 0.7, 15
LEVELS = 0.0, 0.5, 0.7
JUDGED, VERDICTS = Path(__file__).with_name("judged_names.csv"), ("one", "two", "three")
COLUMNS = "whisker", "frames", "at least so sure", "frames under its name [%]", "name wrong [%]", "study wrong [%]"
COLUMNS += "cannot be decided [%]", "not judged"


class Study(NamedTuple):
    """Whiskers that were followed: names, and columns and rows (whisker, frame, node) [px]."""

    names: list[str]
    column: np.ndarray
    row: np.ndarray


class Named(NamedTuple):
    """Linked lines: frame, name and probability of each (S,), its points (2, P) and their ends (S + 1,)."""

    frame: np.ndarray
    name: np.ndarray
    sure: np.ndarray
    points: np.ndarray
    ends: np.ndarray


def read_study(path: Path) -> Study:
    """The followed whiskers of a profile."""
    profile = load(path)
    place = (profile[axis].values / float(profile.attrs["pixel_size"]) for axis in ("x", "y"))
    return Study(json.loads(profile.attrs["names"]), *place)


def read_lines(path: Path) -> Named:
    """The linked lines of a movie."""
    lines = xr.load_dataset(path)
    points = np.stack([lines["column"].values, lines["row"].values]).astype(float)
    ends = np.append(lines["segment_start"].values, points.shape[1])
    names = (lines[f"segment_{one}"].values for one in ("frame", "whisker", "probability"))
    return Named(*names, points, ends)


def at_whisker(lines: Named, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Whether each line (S,) is at a whisker whose nodes in each frame are given (frame, node)."""
    out = np.zeros(lines.frame.size, bool)
    for segment, frame in enumerate(lines.frame):
        known = np.isfinite(row[frame])
        if known.sum() < 3:
            continue
        x, y = column[frame, known], row[frame, known]
        at, off = lines.points[:, lines.ends[segment] : lines.ends[segment + 1]]
        beside = (at >= x.min()) & (at <= x.max())
        slope = np.interp(at[beside], x, np.gradient(y, x))
        across = np.abs(off[beside] - np.interp(at[beside], x, y)) / np.hypot(1, slope)
        out[segment] = beside.sum() >= BESIDE and (across < NEAR).mean() >= SHARE
    return out


def lies_apart(lines: Named, at: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Whether a whisker whose nodes are given lies apart from the lines that are not at it, in each frame."""
    out = np.zeros(len(row), bool)
    for frame in np.flatnonzero(np.isfinite(row).any(axis=1)):
        known = np.isfinite(row[frame])
        x = np.arange(column[frame, known].min(), column[frame, known].max())
        own = np.stack([x, np.interp(x, column[frame, known], row[frame, known])], axis=1)
        others = [
            lines.points[:, lines.ends[s] : lines.ends[s + 1]] for s in np.flatnonzero((lines.frame == frame) & ~at)
        ]
        off = cKDTree(np.concatenate(others, axis=1).T).query(own)[0] if others else np.full(len(own), np.inf)
        out[frame] = (off > FAR).mean() >= HALF
    return out


def name_of(lines: Named, at: np.ndarray, least: float = 0.0) -> int:
    """Name that lines at a whisker have in most frames."""
    pairs = np.unique(np.stack([lines.name, lines.frame])[:, at & (lines.name >= 0) & (lines.sure >= least)], axis=1)
    return int(np.bincount(pairs[0]).argmax())


def contradictions(
    lines: Named, at: np.ndarray, frames: np.ndarray, least: float
) -> tuple[np.ndarray, int, np.ndarray]:
    """Of some frames (T,): those in which the whisker has its name, how many have lines of that name, and those that
    contradict."""
    mine = (lines.name == name_of(lines, at, least)) & (lines.sure >= least)
    every = np.unique(lines.frame[mine & frames[lines.frame]])
    right = np.intersect1d(lines.frame[mine & at], np.flatnonzero(frames))
    return right, every.size, np.setdiff1d(every, right)


def judgements(whisker: str) -> dict[int, str]:
    """What two of three verdicts say of frames of a whisker."""
    out = {}
    for row in csv.DictReader(JUDGED.read_text().splitlines()):
        (verdict, count), *_ = Counter(row[one] for one in VERDICTS).most_common()
        if row["whisker"] == whisker:
            out |= dict.fromkeys(range(int(row["first"]), int(row["last"]) + 1), verdict if count > 1 else "?")
    return out


def main() -> None:
    """Print the table."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("study", type=Path)
    words.add_argument("lines", type=Path)
    asked = words.parse_args()
    study, lines = read_study(asked.study), read_lines(asked.lines)
    print("| " + " | ".join(COLUMNS) + " |", len(COLUMNS) * "|---" + "|", sep="\n")
    for whisker, name in enumerate(study.names):
        followed = np.isfinite(study.row[whisker]).any(axis=1)
        at, judged = at_whisker(lines, study.column[whisker], study.row[whisker]), judgements(name)
        apart = lies_apart(lines, at, study.column[whisker], study.row[whisker])
        for frames, least in ((frames, least) for frames in (followed, apart) for least in LEVELS):
            right, every, against = contradictions(lines, at, frames, least)
            verdict = Counter(judged.get(frame) for frame in against)
            under = right.size + verdict["name"] + verdict["both"]
            shares = [
                100 * count / every for count in (verdict["study"] + verdict["neither"], verdict["name"], verdict["?"])
            ]
            entries = [f"{one:.1f}" for one in (100 * under / frames.sum(), *shares)]
            print("| " + " | ".join([name, str(frames.sum()), f"{least:g}", *entries, str(verdict[None])]) + " |")


if __name__ == "__main__":
    main()
