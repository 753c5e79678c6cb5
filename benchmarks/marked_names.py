"""Names of linked lines in a recorded movie against whiskers that were followed from marks.

    vibrissa run examples/mouse-field.toml --out mouse
    vibrissa track test_video2.mp4 --frame-rate 200 --pixel-size "0.1 mm" --tracking link --segments lines.nc
    .venv/bin/python benchmarks/marked_names.py mouse/profile.nc lines.nc [--pictures FOLDER --movie test_video2.mp4]

A line is at a whisker of the study if it runs beside it for 15 px and 70 % of these points are within 2 px across. The
whisker's name is the one that lines at it have in most frames; a line with that name that is at the whisker in no part
contradicts the study, in frames in which the study has the whisker. Who is wrong there was judged by eye in
``judged_names.csv``, from pictures of the grey level over angle and time at three distances from the base, as
``--pictures`` draws them for each contradiction that has no judgement: ``name``, ``study``, or nothing where it cannot
be told. Frames that were judged by eye for the study's marks count as the study says. The last rows are of the frames
in which the study's whisker lies apart: half of it is farther than 4 px from every line that is not at it.
"""

import argparse
import csv
import json
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from scipy.ndimage import gaussian_filter1d, map_coordinates
from scipy.spatial import cKDTree
from whiskers_apart import FAR, HALF

from vibrissa.netcdf import load
from vibrissa.video.io.movie import read_blocks

NEAR, SHARE, BESIDE = 2.0, 0.7, 15
LEVELS = 0.0, 0.5, 0.7
JUDGED = Path(__file__).with_name("judged_names.csv")
RADII, ANGLES, AROUND = (55.0, 95.0, 140.0), np.deg2rad(np.arange(-75, 75, 0.25)), 12
COLUMNS = "whisker", "frames", "at least so sure", "frames with its name [%]", "contradict the study [%]"
COLUMNS += "name wrong [%]", "study wrong [%]", "cannot be told [%]", "not judged"
BASE = 15.0, 140.0  # column and row from which the pictures look [px]


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


def contradictions(lines: Named, at: np.ndarray, frames: np.ndarray, least: float) -> tuple[int, int, np.ndarray]:
    """Of some frames (T,): those in which the whisker has its name, those with lines of that name, and those that
    contradict."""
    known = (lines.name >= 0) & (lines.sure >= least)
    pairs = np.unique(np.stack([lines.name, lines.frame])[:, at & known], axis=1)
    mine = known & (lines.name == np.bincount(pairs[0]).argmax())
    every = np.unique(lines.frame[mine & frames[lines.frame]])
    right = np.intersect1d(lines.frame[mine & at], np.flatnonzero(frames))
    return right.size, every.size, np.setdiff1d(every, right)


def judgements(whisker: str) -> dict[int, str]:
    """What was judged of the frames of a whisker."""
    rows = [row for row in csv.DictReader(JUDGED.read_text().splitlines()) if row["whisker"] == whisker]
    return {frame: row["wrong"] for row in rows for frame in range(int(row["first"]), int(row["last"]) + 1)}


def picture(movie: np.ndarray, study: Study, lines: Named, whisker: int, frame: int, path: Path) -> None:
    """Grey level over angle and time; the study as crosses, names as dots of their colours."""
    first, last = max(frame - AROUND, 0), min(frame + AROUND, len(movie))
    figure, axes = plt.subplots(len(RADII), 1, figsize=(10, 12), sharex=True, layout="constrained")
    brightest = movie.max(axis=0)
    for axis, radius in zip(axes, RADII, strict=True):
        where = [BASE[1] + radius * np.sin(ANGLES), BASE[0] + radius * np.cos(ANGLES)]
        grey = np.array([map_coordinates(one - brightest, where, order=1) for one in movie[first:last]]).T
        grey -= gaussian_filter1d(grey, 30, axis=0)
        axis.imshow(grey, cmap="gray", aspect="auto", extent=(first - 0.5, last - 0.5, 75, -75))
        shown: list[float] = []
        for t in range(first, last):
            for angle in crossings(study.column[whisker, t], study.row[whisker, t], radius):
                axis.plot(t, angle, "x", color="yellow")
                shown.append(angle)
            for segment in np.flatnonzero((lines.frame == t) & (lines.name >= 0)):
                points = lines.points[:, lines.ends[segment] : lines.ends[segment + 1]]
                for angle in crossings(*points, radius):
                    axis.plot(t, angle, "o", mfc="none", color=f"C{lines.name[segment] % 10}")
        axis.set_ylim(max(shown, default=55) + 20, min(shown, default=-55) - 20)
        axis.set_ylabel(f"angle [°] at {radius:g} px")
    axes[-1].set_xlabel("frame")
    figure.suptitle(f"{study.names[whisker]}, frame {frame}: crosses, the study; circles, names by colour")
    figure.savefig(path, dpi=80)
    plt.close(figure)


def crossings(column: np.ndarray, row: np.ndarray, radius: float) -> np.ndarray:
    """Angles at which a line crosses a circle about the base [°]."""
    x, y = column - BASE[0], row - BASE[1]
    far, angle = np.hypot(x, y) - radius, np.rad2deg(np.arctan2(y, x))
    k = np.flatnonzero(far[:-1] * far[1:] <= 0)
    k = k[far[k] != far[k + 1]]
    return angle[k] + far[k] / (far[k] - far[k + 1]) * (angle[k + 1] - angle[k])


def main() -> None:
    """Print the table, and draw what has not been judged."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("study", type=Path)
    words.add_argument("lines", type=Path)
    words.add_argument("--pictures", type=Path)
    words.add_argument("--movie", type=Path)
    asked = words.parse_args()
    study, lines = read_study(asked.study), read_lines(asked.lines)
    movie = None
    if asked.pictures is not None:
        asked.pictures.mkdir(parents=True, exist_ok=True)
        movie = np.concatenate([block.astype(float) for block in read_blocks(asked.movie)])
    print("| " + " | ".join(COLUMNS) + " |", len(COLUMNS) * "|---" + "|", sep="\n")
    for whisker, name in enumerate(study.names):
        followed = np.isfinite(study.row[whisker]).any(axis=1)
        at, judged = at_whisker(lines, study.column[whisker], study.row[whisker]), judgements(name)
        apart = lies_apart(lines, at, study.column[whisker], study.row[whisker])
        for frames, least in ((frames, least) for frames in (followed, apart) for least in LEVELS):
            right, every, against = contradictions(lines, at, frames, least)
            verdict = [judged.get(frame) for frame in against]
            shares = [100 * verdict.count(one) / every for one in ("name", "study", "")]
            entries = [f"{one:.1f}" for one in (100 * right / frames.sum(), 100 * against.size / every, *shares)]
            row = [name, str(frames.sum()), f"{least:g}", *entries, str(verdict.count(None))]
            print("| " + " | ".join(row) + " |")
        if movie is not None:
            against = contradictions(lines, at, followed, 0.0)[2]
            for frame in against[[judged.get(one) is None for one in against]]:
                picture(movie, study, lines, whisker, int(frame), asked.pictures / f"{name}-{frame}.png")


if __name__ == "__main__":
    main()
