"""Pictures from which it can be judged, blind, who is right where a name contradicts a marked study.

    .venv/bin/python benchmarks/blind_pictures.py mouse/profile.nc lines.nc test_video2.mp4 FOLDER

The inputs are those of ``marked_names.py``. For each run of frames of contradiction FOLDER/caseNN.png shows the grey
level over angle and time at five distances from the base, and FOLDER/caseNN-frames.png the frames: plain on the left;
on the right green marks where the study has the whisker before and after, and in the frames of the case two candidates,
A and B: the study and the name, in an order that is drawn by lot, as is that of the cases. ``FOLDER.csv`` is the key.
"""

import argparse
import csv
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from marked_names import Named, Study, at_whisker, contradictions, name_of, read_lines, read_study
from matplotlib.axes import Axes
from scipy.ndimage import gaussian_filter1d, map_coordinates

from vibrissa.video.io.movie import read_blocks

BASE = 15.0, 140.0  # column and row from which the pictures look [px]
RADII, ANGLES, AROUND = (55.0, 75.0, 95.0, 115.0, 135.0), np.arange(-75, 75, 0.25), 12
GAP, ROOM, SEED = 3, 35, 7
CANDIDATES = {"A": "red", "B": "cyan"}


class Case(NamedTuple):
    """A whisker of the study, the name that its lines have, frames in which they contradict, and who is called A."""

    whisker: int
    name: int
    frames: list[int]
    first: str


def cases_of(study: Study, lines: Named) -> list[Case]:
    """Runs of frames of contradiction, in an order by lot."""
    lot, found = np.random.default_rng(SEED), []
    for whisker in range(len(study.names)):
        at = at_whisker(lines, study.column[whisker], study.row[whisker])
        followed = np.isfinite(study.row[whisker]).any(axis=1)
        against = contradictions(lines, at, followed, 0.0)[2]
        runs = np.split(against, np.flatnonzero(np.diff(against) > GAP) + 1)
        found += [(whisker, name_of(lines, at), run.tolist()) for run in runs if run.size]
    return [Case(*found[k], ("name", "study")[lot.integers(2)]) for k in lot.permutation(len(found))]


def paths(study: Study, lines: Named, case: Case, frame: int) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    """Columns and rows of what is drawn in a frame: candidates in the frames of the case, else what is green."""
    known = np.isfinite(study.row[case.whisker, frame])
    marked = [(study.column[case.whisker, frame, known], study.row[case.whisker, frame, known])] if known.any() else []
    own = np.flatnonzero((lines.frame == frame) & (lines.name == case.name))
    named = [tuple(lines.points[:, lines.ends[one] : lines.ends[one + 1]]) for one in own]
    if frame not in case.frames:
        return {"green": marked or named}
    pair = (named, marked) if case.first == "name" else (marked, named)
    return dict(zip(CANDIDATES, pair, strict=True))


def crossings(column: np.ndarray, row: np.ndarray, radius: float) -> np.ndarray:
    """Angles at which a line crosses a circle about the base [°]."""
    x, y = column - BASE[0], row - BASE[1]
    far, angle = np.hypot(x, y) - radius, np.rad2deg(np.arctan2(y, x))
    k = np.flatnonzero((far[:-1] * far[1:] <= 0) & (far[:-1] != far[1:]))
    return angle[k] + far[k] / (far[k] - far[k + 1]) * (angle[k + 1] - angle[k])


def over_time(axes: tuple[Axes, Axes], movie: np.ndarray, first: int, radius: float, drawn: list[dict]) -> None:
    """Grey level over angle and time at one distance, plain and with what is drawn in each frame."""
    turned = np.deg2rad(ANGLES)
    where = [BASE[1] + radius * np.sin(turned), BASE[0] + radius * np.cos(turned)]
    grey = np.array([map_coordinates(one, where, order=1) for one in movie]).T
    grey -= gaussian_filter1d(grey, 30, axis=0)
    marks = [
        (first + t, angle, kind)
        for t, frame in enumerate(drawn)
        for kind, lines in frame.items()
        for one in lines
        for angle in crossings(*one, radius)
    ]
    shown = [angle for _, angle, _ in marks] or [0.0]
    low, high = min(shown) - 10, max(shown) + 10
    dark, light = np.percentile(grey[np.abs(ANGLES - (low + high) / 2) < (high - low) / 2], [2, 92])
    for axis in axes:
        extent = (first - 0.5, first + len(movie) - 0.5, 75, -75)
        axis.imshow(grey, cmap="gray", aspect="auto", extent=extent, vmin=dark, vmax=light, interpolation="nearest")
        axis.set(ylim=(high, low), ylabel=f"angle at {radius:g} px [°]")
    for t, angle, kind in marks:
        look = (
            {"marker": f"${kind}$", "color": CANDIDATES[kind]} if kind in CANDIDATES else {"marker": "o", "mfc": "none"}
        )
        axes[1].plot(t, angle, ls="none", ms=9, **({"color": "lime"} | look))


def in_frame(axes: tuple[Axes, Axes], picture: np.ndarray, frame: int, drawn: dict) -> None:
    """One frame, plain and with what is drawn in it."""
    for axis in axes:
        axis.imshow(picture, cmap="gray")
        axis.set_title(f"frame {frame}")
    for kind, lines in drawn.items():
        for one in lines:
            axes[1].plot(*one, ":", color=CANDIDATES.get(kind, "lime"), lw=2, label=kind)
    if lines := [one for some in drawn.values() for one in some]:
        column, row = np.concatenate(lines, axis=1)
        for axis in axes:
            axis.set(xlim=(0, column.max() + ROOM), ylim=(row.max() + ROOM, row.min() - ROOM))
        axes[1].legend(loc="upper right", fontsize=16)


def draw(number: int, case: Case, movie: np.ndarray, study: Study, lines: Named, folder: Path) -> None:
    """Write both pictures of a case."""
    start, end = case.frames[0], case.frames[-1]
    first, last = max(start - AROUND, 0), min(end + AROUND + 1, len(movie))
    drawn = [paths(study, lines, case, frame) for frame in range(first, last)]
    figure, axes = plt.subplots(len(RADII), 2, figsize=(22, 30), layout="constrained", sharex=True)
    brightest = movie.max(axis=0)
    for pair, radius in zip(axes, RADII, strict=True):
        over_time(pair, movie[first:last] - brightest, first, radius, drawn)
    figure.suptitle(f"case {number}: frames {start} to {end}")
    figure.savefig(folder / f"case{number:02d}.png", dpi=50)
    shown = sorted({max(start - 2, 0), start, case.frames[len(case.frames) // 2], end, min(end + 2, len(movie) - 1)})
    frames, axes = plt.subplots(len(shown), 2, figsize=(20, 7.2 * len(shown)), layout="constrained")
    for pair, frame in zip(axes, shown, strict=True):
        in_frame(pair, movie[frame], frame, paths(study, lines, case, frame))
    frames.savefig(folder / f"case{number:02d}-frames.png", dpi=45)
    plt.close("all")


def main() -> None:
    """Draw all cases and write the key."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("study", "lines", "movie", "folder"):
        words.add_argument(name, type=Path)
    asked = words.parse_args()
    study, lines = read_study(asked.study), read_lines(asked.lines)
    movie = np.concatenate([block.astype(float) for block in read_blocks(asked.movie)])
    asked.folder.mkdir(parents=True, exist_ok=True)
    with asked.folder.with_suffix(".csv").open("w", newline="") as file:
        key = csv.writer(file, lineterminator="\n")
        key.writerow(["case", "whisker", "first", "last", "A"])
        for number, case in enumerate(cases_of(study, lines)):
            draw(number, case, movie, study, lines, asked.folder)
            key.writerow([number, study.names[case.whisker], case.frames[0], case.frames[-1], case.first])


if __name__ == "__main__":
    main()
