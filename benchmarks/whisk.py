"""The movies of ``tracking_truth.py`` through WHISK [Clack2012], and a dense real field beside it.

.venv/bin/python benchmarks/whisk.py FOLDER TRACE [SEEDS, 20 if not given]
.venv/bin/python benchmarks/whisk.py field MOVIE WHISKERS

The first traces some of those movies, writes FOLDER/<cell>.whisk.csv, whose cells it does not run again, and prints
docs/validation/whisk.csv. TRACE is WHISK's program ``trace`` (PyPI: whisk-janelia 1.2.5), which needs
``default.parameters`` beside it; it loads FFmpeg 6 even for TIFF files, which a wheel of PyAV 12 brings. Its segments
have no names: one is given to the whisker it runs along, within 2 px in the median over its columns, the longest
first. As WHISK places a point by what it sees over 17 px along the line, the default estimator's rows are given
smoothed over as many, too.

The second reads, in every twentieth frame of a recorded movie, each column-wise line of more than 80 columns that WHISK
traced there (its .whiskers file), from one seed in the middle of that line, and says how far from it what is read lies.
"""

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np
import tifffile
from scipy.signal import savgol_filter
from tracking_movies import COLUMNS, FRAMES, Scene, cells, film
from tracking_truth import found_by, score, tables, write

from vibrissa.errors import InputError
from vibrissa.video.follow.following import centrelines
from vibrissa.video.follow.search import Search
from vibrissa.video.foreign.whisk_files import Segment, read_whiskers
from vibrissa.video.io.movie import read_blocks
from vibrissa.video.kernel.estimator_table import ESTIMATORS, Estimator

CHOSEN = ("contrast", "noise 5 contrast 75", "speed 2", "whiskers 5", "all")
ALONG = 2.0  # [px]
SUPPORT = 17  # columns, WHISK's 2 TLEN + 1
LONG, EVERY, REACH = 80, 20, 10
HOP = 2.0  # [px]


def rows_of(segment: Segment, columns: np.ndarray) -> np.ndarray:
    """Rows of a segment in pixel columns, NaN beyond its ends."""
    order = np.argsort(segment.x)
    return np.interp(columns, segment.x[order], segment.y[order], left=np.nan, right=np.nan)


def traced(scenes: list[Scene], trace: Path) -> tuple[list[Segment], float]:
    """Segments of all scenes' frames, one after another, and the seconds of processor time they took."""
    frames = np.concatenate([scene.frames for scene in scenes])
    with tempfile.TemporaryDirectory() as folder:
        for path in (*trace.parent.glob("default.parameters"), *trace.parent.glob("*.detectorbank")):
            (Path(folder) / path.name).symlink_to(path)
        tifffile.imwrite(Path(folder) / "movie.tif", frames, photometric="minisblack")
        before = os.times()
        subprocess.run([trace, "movie.tif", "movie.whiskers"], cwd=folder, check=True, capture_output=True)
        seconds = os.times().children_user - before.children_user
        return read_whiskers(Path(folder) / "movie.whiskers"), seconds


def assigned(scene: Scene, segments: list[Segment], first_frame: int) -> np.ndarray:
    """Rows (whisker, frame, column) of the segments that run along each whisker."""
    truth = scene.truth
    found = np.full(truth.shape, np.nan)
    for segment in sorted(segments, key=lambda one: -np.ptp(one.x)):
        frame = segment.frame - first_frame
        if not 0 <= frame < FRAMES:
            continue
        row = rows_of(segment, COLUMNS)
        seen = ~np.isnan(row)
        if not seen.any():
            continue
        off = np.median(np.abs(row - truth[:, frame])[:, seen], axis=1)
        w = int(np.argmin(off))
        if off[w] < ALONG:
            found[w, frame] = np.where(np.isnan(found[w, frame]), row, found[w, frame])
    return found


def by_whisk(scenes: list[Scene], trace: Path) -> list[dict[str, object]]:
    """Scores of WHISK's segments."""
    segments, seconds = traced(scenes, trace)
    rows: list[dict[str, object]] = []
    for seed, scene in enumerate(scenes):
        found = assigned(scene, segments, seed * FRAMES)
        no_sd = np.full(found.shape, np.nan)
        rows.append({"seed": seed, "by": "WHISK", "seconds": seconds / len(scenes), **score(scene, found, no_sd)})
    return rows


def smoothed(scenes: list[Scene]) -> list[dict[str, object]]:
    """Scores of the default estimator's rows, smoothed along the line by a quadratic over as many columns as WHISK."""
    rows: list[dict[str, object]] = []
    for seed, scene in enumerate(scenes):
        start = process_time()
        found, _ = found_by(scene, Search().estimator)
        found = savgol_filter(found, SUPPORT, 2, mode="constant", cval=np.nan)  # NaN where any of them is
        seconds, no_sd = process_time() - start, np.full(found.shape, np.nan)
        name = f"{Search().estimator}, {SUPPORT} columns"
        rows.append({"seed": seed, "by": name, "seconds": seconds, **score(scene, found, no_sd)})
    return rows


def side_by_side(folder: Path, trace: Path, n_seeds: int) -> None:
    """Run what is missing, then print the table."""
    for cell in cells():
        if not cell.file.replace("_", " ").startswith(CHOSEN):
            continue
        scenes = [film(cell, seed) for seed in range(n_seeds)]
        for end, run in ((".smooth.csv", smoothed), (".whisk.csv", partial(by_whisk, trace=trace))):
            path = folder / f"{cell.file}{end}"
            if not path.is_file():
                write(run(scenes), path)
                print(path.name, file=sys.stderr)
    tables(folder, ".csv", ".smooth.csv", ".whisk.csv")


def long_lines(path: Path) -> list[Segment]:
    """WHISK's segments in the frames looked at that run from column to column."""
    return [
        one
        for one in read_whiskers(path)
        if one.frame % EVERY == 0 and np.ptp(one.x) > LONG and np.all(np.diff(one.x) > 0) | np.all(np.diff(one.x) < 0)
    ]


def roughness(rows: np.ndarray) -> np.ndarray:
    """Residual of rows (column,) to a quadratic fitted to each one's neighbours within 10 columns, itself included."""
    out = np.full(rows.size, np.nan)
    for k in np.flatnonzero(~np.isnan(rows)):
        near = np.arange(max(k - REACH, 0), min(k + REACH + 1, rows.size))
        near = near[~np.isnan(rows[near])]
        if near.size > REACH:
            out[k] = rows[k] - np.polyval(np.polyfit(near - k, rows[near], 2), 0)
    return out


def off_line(image: np.ndarray, segment: Segment, estimator: Estimator) -> tuple[np.ndarray, np.ndarray]:
    """Distance of what is read to the segment, column by column, and its scatter about a smooth curve."""
    columns = np.arange(image.shape[1])
    theirs = rows_of(segment, columns)
    middle = int(np.median(columns[~np.isnan(theirs)]))
    search = Search(estimator=estimator)
    lines = next(iter(centrelines([image[None]], seeds=[(middle, theirs[middle])], search=search)))
    ours = np.where(np.isnan(theirs), np.nan, lines.row[0, 0])
    return ours - theirs, roughness(ours)


def read_along(
    images: np.ndarray, lines: list[Segment], estimator: Estimator
) -> tuple[list[np.ndarray], list[np.ndarray], int]:
    """Distances and roughnesses of each line that is read, and how many seeds were refused."""
    off, rough, refused = [], [], 0
    for segment in lines:
        try:
            distance, residual = off_line(images[segment.frame], segment, estimator)
        except InputError:
            refused += 1
            continue
        off.append(distance[~np.isnan(distance)])
        rough.append(residual[~np.isnan(residual)])
    return off, rough, refused


def field(movie: Path, whiskers: Path) -> None:
    """Print how the lines of a recorded movie are read."""
    images, lines = np.concatenate(list(read_blocks(movie))), long_lines(whiskers)
    print(f"{len(lines)} lines in {len({one.frame for one in lines})} frames")
    print("| by | seeds refused | columns | to WHISK, median [px] | beyond 2 px [%] | other line [%] | scatter [px] |")
    print(7 * "|---" + "|")
    columns = np.arange(images.shape[2])
    theirs = np.median([np.nanstd(roughness(rows_of(one, columns))) for one in lines])
    print(f"| WHISK | – | {sum(np.ptp(one.x) for one in lines):.0f} | – | – | – | {theirs:.3f} |")
    for estimator in ESTIMATORS:
        off, rough, refused = read_along(images, lines, estimator)
        every = np.abs(np.concatenate(off))
        other = np.mean([np.median(np.abs(one)) > HOP for one in off if one.size])
        scatter = np.median([one.std() for one in rough if one.size])
        shares = f"{100 * np.mean(every > HOP):.2f} | {100 * other:.2f}"
        print(f"| {estimator} | {refused} | {every.size} | {np.median(every):.3f} | {shares} | {scatter:.3f} |")


if __name__ == "__main__":
    if sys.argv[1] == "field":
        field(Path(sys.argv[2]), Path(sys.argv[3]))
    else:
        side_by_side(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 20)
