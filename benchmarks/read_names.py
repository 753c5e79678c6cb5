"""Names of linked lines against three readings: whiskers that were followed by eye through a recorded movie.

    vibrissa track test_video2.mp4 --frame-rate 200 --pixel-size "0.1 mm" --tracking link --segments lines.nc
    .venv/bin/python benchmarks/read_names.py lines.nc
    .venv/bin/python benchmarks/read_names.py lines.nc --pictures test_video2.mp4 FOLDER

``read_names.csv`` holds runs of lines, the linker's tracklets of at least four: frames, angle at 80 px from the pad in
each frame [°], and the letters that three readers gave them. Each was an image-reading language model that worked alone
with pictures of 30 strips of 75 frames, 15 of them those of the strip before: grey level over angle and time at two
distances from the pad, and at a third with the runs drawn in and numbered. ``--pictures`` draws them; those that were
read also showed all shorter runs in grey, longer lines by larger marks, and came with a table of the runs' frames,
median angles and lengths. ``A+B`` is a run in
which two whiskers lie on one another; an empty letter is a line that the reader could not tell. Where a reader began a
whisker anew after doubtful frames and called it probably the same, it has one letter.

A whisker is a letter of the first reading and the letters of the others that share most lines with it. Two readings
agree on it in the share of lines that both call so, of those that either does. Its lines are those that two of three
readings call so. The name of these in most frames is the whisker's; a line with that name is wrong if two readings
know it and none calls it so.
"""

import argparse
import csv
from itertools import combinations
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from marked_names import Named, read_lines
from scipy.ndimage import gaussian_filter1d, map_coordinates

from vibrissa.video.io.movie import read_blocks

PAD, RADIUS = (0.0, 195.0), 80.0  # column and row from which angles are read, and distance at which [px]
SAME = 1.0  # difference of angle of the same line [°]
READINGS, FEWEST = ("one", "two", "three"), 400  # lines of a whisker in the first reading
LEVELS = 0.0, 0.7
STRIP, BEFORE, ANGLES, BESIDE = 60, 15, np.arange(-65, 50, 0.25), (60.0, 110.0)
COLUMNS = "whisker", "angle [°]", "frames", "readings agree [%]", "each reading, wrong [%]"
COLUMNS += "under its name [%]", "name wrong [%]"

Runs = list[dict[str, str]]


def angle_of(lines: Named) -> np.ndarray:
    """Angle of each line (S,) where it is nearest to the distance at which runs are given [°]."""
    x, y = (lines.points[k] - PAD[k] for k in range(2))
    off, angle = np.abs(np.hypot(x, y) - RADIUS), np.rad2deg(np.arctan2(y, x))
    return np.array([angle[a:b][off[a:b].argmin()] for a, b in zip(lines.ends, lines.ends[1:], strict=False)])


def angles(run: dict[str, str]) -> tuple[np.ndarray, np.ndarray]:
    """Frames in which a run has a line, and its angles there [°]."""
    every = [float(one or "nan") for one in run["angle"].split(";")]
    frame, angle = int(run["first"]) + np.arange(len(every)), np.array(every)
    return frame[np.isfinite(angle)], angle[np.isfinite(angle)]


def read(runs: Runs, lines: Named) -> np.ndarray:
    """Letters that the readings give each line (3, S), joined by +; empty where no run is."""
    out, at = np.full((len(READINGS), lines.frame.size), "", dtype=object), angle_of(lines)
    first = np.searchsorted(lines.frame, np.arange(lines.frame.max() + 2))
    for run in runs:
        for frame, angle in zip(*angles(run), strict=True):
            here = np.arange(first[frame], first[frame + 1])
            near = here[np.abs(at[here] - angle) < SAME]
            if near.size:
                out[:, near[np.abs(at[near] - angle).argmin()]] = [run[one] for one in READINGS]
    return out


def said(letters: np.ndarray) -> dict[str, np.ndarray]:
    """Which lines (S,) a reading gives each of its letters."""
    sets = [set(one.split("+")) - {""} for one in letters]
    return {letter: np.array([letter in one for one in sets]) for letter in sorted(set().union(*sets))}


def alike(one: np.ndarray, other: np.ndarray) -> float:
    """Share of the lines that both have, of those that either has."""
    return float((one & other).sum() / max((one | other).sum(), 1))


def whiskers(letters: np.ndarray, fewest: int = FEWEST) -> dict[str, np.ndarray]:
    """Which lines are each whisker's by each reading (3, S), those agreed upon best first; each has so many lines."""
    first, *others = (said(one) for one in letters)
    found = {
        letter: np.stack([mine, *(max(other.values(), key=lambda its: alike(mine, its)) for other in others)])
        for letter, mine in first.items()
        if mine.sum() >= fewest
    }
    return dict(sorted(found.items(), key=lambda item: -agreement(item[1])))


def agreement(calls: np.ndarray) -> float:
    """Mean over the pairs of readings."""
    return float(np.mean([alike(one, other) for one, other in combinations(calls, 2)]))


def scores(lines: Named, calls: np.ndarray, known: np.ndarray, least: float) -> tuple[float, float]:
    """Share of a whisker's frames under its name, and share of the frames with that name in which it is wrong [%]."""
    named = (lines.name >= 0) & (lines.sure >= least)
    own = calls.sum(axis=0) >= 2
    frames = np.unique(lines.frame[own])
    pairs = np.unique(np.stack([lines.name, lines.frame])[:, own & named], axis=1)
    if not pairs.size:
        return 0.0, np.nan
    mine = named & (lines.name == np.bincount(pairs[0]).argmax())
    right = np.unique(lines.frame[mine & own])
    wrong = np.unique(lines.frame[mine & known & ~calls.any(axis=0)])
    return 100 * right.size / frames.size, 100 * wrong.size / np.unique(lines.frame[mine]).size


def by_others(lines: Named, calls: np.ndarray, known: np.ndarray, one: int) -> tuple[float, float]:
    """What :func:`scores` gives for a reading, by the two others: ``known`` (3, S) lines that each can tell."""
    both = np.delete(calls, one, axis=0)
    own, told = both.all(axis=0), np.delete(known, one, axis=0).all(axis=0)
    frames, mine = np.unique(lines.frame[own]).size, np.unique(lines.frame[calls[one]]).size
    right = np.unique(lines.frame[calls[one] & own]).size
    wrong = np.unique(lines.frame[calls[one] & told & ~both.any(axis=0)]).size
    return 100 * right / frames, 100 * wrong / mine


def table(letters: np.ndarray, at: np.ndarray, lines: Named, fewest: int = FEWEST) -> None:
    """Print the whiskers of letters (3, S); ``at`` is the angle of each line."""
    told = letters != ""
    known = told.sum(axis=0) >= 2
    print("| " + " | ".join(COLUMNS) + " |", len(COLUMNS) * "|---" + "|", sep="\n")
    for letter, calls in whiskers(letters, fewest).items():
        own = calls.sum(axis=0) >= 2
        shares = np.array([scores(lines, calls, known, least) for least in LEVELS]).T
        entries = [", ".join(f"{one:.0f}" for one in some) for some in shares]
        frames = np.unique(lines.frame[own]).size
        readings = "; ".join("{:.0f}, {:.0f}".format(*by_others(lines, calls, told, one)) for one in range(len(calls)))
        cells = [letter, f"{np.median(at[own]):.0f}", str(frames), f"{100 * agreement(calls):.0f}", readings, *entries]
        print("| " + " | ".join(cells) + " |")


def grey(movie: np.ndarray, radius: float) -> np.ndarray:
    """Grey level over angle and time (angle, frame) at a distance from the pad, without what varies slowly."""
    turned = np.deg2rad(ANGLES)
    where = [PAD[1] + radius * np.sin(turned), PAD[0] + radius * np.cos(turned)]
    level = np.array([map_coordinates(one, where, order=1, mode="nearest") for one in movie]).T
    return np.asarray(level - gaussian_filter1d(level, 30, axis=0))


def strip(runs: Runs, movie: np.ndarray, first: int, start: int, folder: Path) -> None:
    """Draw both pictures of a strip whose new frames begin at ``start``."""
    look = {"cmap": "gray", "vmin": -14, "vmax": 8, "aspect": "auto", "interpolation": "nearest"}
    look["extent"] = (first - 0.5, first + len(movie) - 0.5, ANGLES[-1], ANGLES[0])
    plain, axes = plt.subplots(2, figsize=(15, 14), layout="constrained")
    for axis, radius in zip(axes, BESIDE, strict=True):
        axis.imshow(grey(movie, radius), **look)
        axis.set(ylabel=f"angle at {radius:g} px [°]", xlabel="frame")
    drawn, axis = plt.subplots(figsize=(15, 10.5), layout="constrained")
    axis.imshow(grey(movie, RADIUS), alpha=0.45, **look)
    for run in runs:
        frame, angle = angles(run)
        here = (frame >= first) & (frame < first + len(movie))
        for colour in [f"C{int(run['run']) % 10}"] if here.any() else []:
            axis.plot(frame[here], angle[here], marker="_", color=colour)
            axis.annotate(run["run"], (frame[here][0], angle[here][0]), color=colour, weight="bold")
    axis.axvline(start - 0.5, color="m")
    axis.set(ylabel=f"angle at {RADIUS:g} px [°]", xlabel="frame", ylim=(ANGLES[-1], ANGLES[0]))
    for figure, name in ((plain, "g"), (drawn, "s")):
        figure.savefig(folder / f"{name}{start // STRIP:02d}.png", dpi=80)
    plt.close("all")


def main() -> None:
    """Print the table, or draw the pictures."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("lines", type=Path)
    words.add_argument("--pictures", type=Path, nargs=2, metavar=("MOVIE", "FOLDER"))
    asked = words.parse_args()
    runs = list(csv.DictReader(Path(__file__).with_suffix(".csv").read_text().splitlines()))
    if asked.pictures is None:
        lines = read_lines(asked.lines)
        return table(read(runs, lines), angle_of(lines), lines)
    movie = np.concatenate([block.astype(float) for block in read_blocks(asked.pictures[0])])
    asked.pictures[1].mkdir(parents=True, exist_ok=True)
    for start in range(0, len(movie), STRIP):
        first = max(start - BEFORE, 0)
        strip(runs, movie[first : start + STRIP], first, start, asked.pictures[1])
    return None


if __name__ == "__main__":
    main()
