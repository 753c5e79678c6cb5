"""Names of linked lines against three readings, in a movie of a head that moves.

    vibrissa track moving-head.mp4 --frame-rate 500 --pixel-size "0.1 mm" --tracking link --segments lines.nc
    .venv/bin/python benchmarks/read_moving.py lines.nc

``read_moving.csv`` holds runs of lines of each pad, the linker's tracklets of at least four: frames, a point of the
line in each [px], and the letters that three readers gave them. Each was an image-reading language model that worked
alone with pictures of 13 strips of 75 frames, 15 of them those of the strip before, in coordinates that move with the
head: grey level over angle and time at two distances from the pad, and at a third with the runs drawn in and numbered.
``A>B@f`` is a run that goes over from one whisker to another at frame f. The rest is as in ``read_names.py``.
"""

import csv
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from marked_names import Named, read_lines
from read_names import READINGS, table
from scipy.spatial import cKDTree

SAME, FEWEST = 1.5, 200  # px from a point of a line that is the same; lines of a whisker in the first reading
PADS = "right in the image", "left in the image"


def letter_in(letters: str, frame: int) -> str:
    """Letter of a run in a frame."""
    letter, *changes = letters.split(">")
    for change in changes:
        after, _, first = change.partition("@")
        letter = after if frame >= int(first) else letter
    return letter


def read(pad: str, lines: Named) -> np.ndarray:
    """Letters that the readings give each line (3, S) of a pad; empty where no run is."""
    out = np.full((len(READINGS), lines.frame.size), "", dtype=object)
    owner = np.repeat(np.arange(lines.frame.size), np.diff(lines.ends))
    starts = np.searchsorted(lines.frame[owner], np.arange(lines.frame.max() + 2))
    trees = [cKDTree(lines.points[:, a:b].T) if b > a else None for a, b in pairwise(starts)]
    for run in csv.DictReader(Path(__file__).with_suffix(".csv").read_text().splitlines()):
        for frame, point in enumerate(run["points"].split(";"), int(run["first"])):
            if run["pad"] != pad or not point or frame >= len(trees) or trees[frame] is None:
                continue
            far, at = trees[frame].query([float(one) for one in point.split()], distance_upper_bound=SAME)
            if np.isfinite(far):
                out[:, owner[starts[frame] + at]] = [letter_in(run[one], frame) for one in READINGS]
    return out


def angles(lines: Named) -> np.ndarray:
    """Angle of the middle half of each line (S,) in the image [°], down from the right."""
    out = np.empty(lines.frame.size)
    for k, (a, b) in enumerate(pairwise(lines.ends)):
        x, y = lines.points[:, b - 1 - (b - a) // 4] - lines.points[:, a + (b - a) // 4]
        out[k] = np.rad2deg(np.arctan2(y, x))
    return out


def main() -> None:
    """Print a table for each pad."""
    lines = read_lines(Path(sys.argv[1]))
    for number, name in enumerate(PADS):
        print(f"\n{name}\n")
        table(read(str(number), lines), angles(lines), lines, FEWEST)


if __name__ == "__main__":
    main()
