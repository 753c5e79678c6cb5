"""Track rendered movies whose centrelines are known: truth against found over contrast, noise, blur, speed, whiskers.

.venv/bin/python benchmarks/tracking_truth.py FOLDER [SEEDS, 50 if not given]

Every cell of ``tracking_movies.py`` is one kind of movie; every seed draws new whiskers, a new motion and new pixel
noise, filmed for 40 frames of 500 × 450 pixels. Cells whose CSV is already in FOLDER are not run again; two run at a
time. At the end the table docs/validation/tracking.csv is printed: means over seeds and their standard errors (_se).

Truth is the row of the true centreline in the middle of a pixel column, averaged over the exposure; what is found is
the tracker's raw row in that column, so that nothing between columns or nodes helps. Three columns at either end of a
whisker are left out. Clear columns have no other whisker within 6 rows; the rest, near another, are listed separately.
Errors above 2 px are counted as hops to another line, and left out of the other figures of clear columns.
"""

import csv
import itertools
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from time import process_time

import numpy as np
from tracking_movies import COLUMNS, FRAMES, Cell, Scene, bound, cells, film, others, seeds_of

from vibrissa.errors import InputError
from vibrissa.video.follow.following import centrelines
from vibrissa.video.follow.search import Search
from vibrissa.video.kernel.estimator_table import ESTIMATORS

INNER = slice(3, -3)
CLEAR = 6.0  # [px]
HOP = 2.0  # [px] an error beyond it is another line, not a bad reading of this one


def found_by(scene: Scene, estimator: str) -> tuple[np.ndarray, np.ndarray]:
    """Rows and their standard deviations (whisker, frame, column); all NaN if a seed is refused."""
    lost, search = np.full(scene.truth.shape, np.nan), Search(estimator=estimator, threshold=scene.cell.threshold)
    try:
        lines = next(iter(centrelines([scene.frames], seeds=seeds_of(scene), search=search)))
    except InputError:
        return lost, lost
    return lines.row[..., COLUMNS], lines.sd[..., COLUMNS]


def share(mask: np.ndarray, of: np.ndarray) -> float:
    """Part of the places ``of`` at which the mask is true; NaN if there are none."""
    return float(mask[of].mean()) if of.any() else np.nan


def beyond(error: np.ndarray, where: np.ndarray) -> float:
    """95 % of the errors' magnitudes."""
    return float(np.quantile(np.abs(error[where]), 0.95)) if where.any() else np.nan


def score(scene: Scene, found: np.ndarray, sd: np.ndarray) -> dict[str, float]:
    """Say how good one movie's lines are; lengths in pixels, shares of 1."""
    truth = scene.truth[..., INNER]
    error, claimed_sd = found[..., INNER] - truth, sd[..., INNER]
    seen, clear = ~np.isnan(error), others(truth) > CLEAR
    floor = np.stack([bound(scene, w) for w in range(len(truth))])[..., INNER]
    hopped = np.abs(error) > HOP
    good = seen & clear & ~hopped
    steady = clear.all(axis=1) & (seen.sum(axis=1) >= FRAMES / 2) & ~hopped.any(axis=1)
    series = [error[w, seen[w, :, n], n] for w, n in np.argwhere(steady)]
    scatter, fixed = (np.array([one.std(ddof=1) for one in series]), np.array([one.mean() for one in series]))
    least = np.sqrt((floor**2).mean(axis=1))
    phase = np.sin(2 * np.pi * truth)
    return {
        "bias": float(error[good].mean()) if good.any() else np.nan,
        "locking": float(2 * (error * phase)[good].mean()) if good.any() else np.nan,
        "fixed": float(fixed.std()) if fixed.size else np.nan,
        "sd": float(np.median(scatter)) if scatter.size else np.nan,
        "bound": float(np.median(least[clear.all(axis=1)])),
        "ratio": float(np.median(scatter / least[steady])) if scatter.size else np.nan,
        "p95": beyond(error, good),
        "inside": share(np.abs(error) <= 1.96 * claimed_sd, good & ~np.isnan(claimed_sd)),
        "lost": share(~seen, clear),
        "hopped": share(hopped, seen),
        "near_p95": beyond(error, seen & ~clear),
        "near_lost": share(~seen, ~clear),
    }


def run(cell: Cell, folder: Path, n_seeds: int) -> str:
    """Score one cell's movies, write its CSV, whole, and give its name."""
    rows = []
    for seed, estimator in itertools.product(range(n_seeds), ESTIMATORS):
        if estimator == next(iter(ESTIMATORS)):
            scene = film(cell, seed)
        start = process_time()
        found = found_by(scene, estimator)
        rows.append({"seed": seed, "by": estimator, "seconds": process_time() - start, **score(scene, *found)})
    write(rows, folder / f"{cell.file}.csv")
    return cell.file


def write(rows: list[dict[str, object]], path: Path) -> None:
    """Write rows with a header, through a file beside it."""
    part = path.with_suffix(".part")
    with part.open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)
    part.replace(path)


def read(path: Path) -> dict[str, dict[str, np.ndarray]]:
    """Columns of a CSV by what found the lines."""
    rows = list(csv.DictReader(path.open()))
    return {
        by: {name: np.array([float(row[name]) for row in rows if row["by"] == by]) for name in rows[0] if name != "by"}
        for by in dict.fromkeys(row["by"] for row in rows)
    }


def mean_and_error(values: np.ndarray) -> list[str]:
    """Mean over the seeds that have a value, and its standard error; empty where there is none."""
    values = values[~np.isnan(values)]
    error = f"{values.std(ddof=1) / np.sqrt(values.size):.4f}" if values.size > 1 else ""
    return [f"{values.mean():.4f}", error] if values.size else ["", ""]


def line(of: dict[str, np.ndarray]) -> list[str]:
    """Figures of one line, in the order of ``HEAD``."""
    figures = [entry for key in (*LENGTHS, *SHARES) for entry in mean_and_error(of[key])]
    return [f"{np.mean(of['bound']):.4f}", *figures, f"{FRAMES / np.median(of['seconds']):.0f}"]


LENGTHS = ("sd", "ratio", "bias", "fixed", "locking", "p95", "near_p95")  # [pixels], but the ratio of SD and bound
SHARES = ("inside", "lost", "hopped", "near_lost")
HEAD = ["table", "movie", "by", "bound", *(f"{key}{end}" for key in (*LENGTHS, *SHARES) for end in ("", "_se"))]
HEAD += ["frames_per_second"]


def tables(folder: Path, *ends: str) -> None:
    """Print, as CSV, the cells of which there are files with all these ends."""
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(HEAD)
    there = [cell for cell in cells() if all((folder / f"{cell.file}{end}").is_file() for end in ends)]
    for cell, end in itertools.product(there, ends):
        for by, of in read(folder / f"{cell.file}{end}").items():
            table.writerow([cell.table, cell.name, by, *line(of)])


def main(folder: Path, n_seeds: int) -> None:
    """Run what is missing, then print the table."""
    folder.mkdir(parents=True, exist_ok=True)
    missing = [cell for cell in cells() if not (folder / f"{cell.file}.csv").is_file()]
    with ProcessPoolExecutor(2) as pool:
        for cell, _ in zip(
            missing, pool.map(run, missing, [folder] * len(missing), [n_seeds] * len(missing)), strict=True
        ):
            print(cell.file, file=sys.stderr)
    tables(folder, ".csv")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 50)
