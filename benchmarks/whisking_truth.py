"""Whisking movies whose whiskers are known: found, named and compared with the truth; WHISK [Clack2012] beside it.

.venv/bin/python benchmarks/whisking_truth.py FOLDER [--seeds 50] [--frames 300] [--kinds paw,pole] [--whisk WHISK]

Kinds of movies are in ``whisking_movies.py``: one row of four whiskers, a pad of twelve, both pads of a head that is
fixed or moves, a paw before the pad, a pole at which two whiskers bend, lit whiskers before a dark floor; 640 × 480
pixels, 500 frames a second. A seed draws whiskers, whisking, light, blur, noise and exposure. Scores are those of
``identity_scores.py``; lines must be found where they are as deep as a pixel's noise. FOLDER/<kind>.csv holds a row for
each seed and tracker; rows that are there are not made again, so a run that was stopped goes on. At the end the tables
are printed.

WHISK is a folder with WHISK's ``trace``, ``measure``, ``classify``, ``reclassify`` (PyPI: whisk-janelia 1.2.5),
``default.parameters``, and its filters, ``*.detectorbank``, as its first run writes them. Its ``trace`` loads FFmpeg 6,
which a wheel of PyAV 12 brings (LD_LIBRARY_PATH). It is given the number of whiskers of each pad, and both pads one by
one, each in its own half of the image.

What the movies lack of recorded ones: the head's flank, ears and limbs beyond an outline; hairs that whisk with the
skin; a pad whose skin slides as it whisks; whiskers out of focus; the border of the light, glare and dirt; compression.
"""

import argparse
import csv
import os
import sys
from pathlib import Path

import numpy as np
from identity_scores import BINS, LEASTS, score
from tracking_truth import write
from whiskers_apart import CLASSES, table_row
from whisking_movies import KINDS, scene_of
from whisking_trackers import Tracker, vibrissa_tracker, whisk_tracker

from vibrissa.video.camera.pad.filming import film
from vibrissa.video.camera.pad.truth import scene_truth

FIGURES = {
    "recall": 3,
    "astray": 3,
    "error": 3,
    "error_95": 3,
    "names": 1,
    "hairs": 1,
    "followed": 3,
    "worst": 3,
    "allowed": 3,
}
FIGURES |= {"switches": 1, "wrong": 1, "seconds": 1}
KEPT = {"followed": 3, "wrong": 1}


def mean(values: np.ndarray, digits: int = 4) -> str:
    """Mean over the seeds that have a value, ± its standard error."""
    values = values[~np.isnan(values)]
    if not values.size:
        return "–"
    if values.size == 1:
        return f"{values[0]:.{digits}f}"
    return f"{values.mean():.{digits}f} ± {values.std(ddof=1) / np.sqrt(values.size):.{digits}f}"


def missing(folder: Path, kind: str, seeds: int, trackers: dict[str, Tracker]) -> list[tuple[int, list[str]]]:
    """Seeds of a kind that lack a row, and the trackers that they lack."""
    done = {(int(row["seed"]), row["by"]) for row in stored(folder, kind)}
    wanted = [(seed, [by for by in trackers if (seed, by) not in done]) for seed in range(seeds)]
    return [one for one in wanted if one[1]]


def stored(folder: Path, kind: str) -> list[dict[str, str]]:
    """Rows that are there."""
    path = folder / f"{kind}.csv"
    return list(csv.DictReader(path.read_text().splitlines())) if path.is_file() else []


def run(folder: Path, kind: str, seed: int, frames: int, trackers: dict[str, Tracker]) -> None:
    """Film one scene, score it by each tracker, and store a row for each."""
    scene = scene_of(kind, seed)
    movie = np.concatenate(list(film(scene, frames)))
    truth = scene_truth(scene, frames, least_contrast=0.0).segments
    for by, tracker in trackers.items():
        before = os.times()
        found = tracker(movie, scene)
        row = {"seed": seed, "by": by, "frames": frames, "seconds": processor_time(before)}
        write([*stored(folder, kind), row | score(found, truth, scene.camera.noise)], folder / f"{kind}.csv")
        print(f"{kind}, seed {seed}, {by}", file=sys.stderr)


def processor_time(before: os.times_result) -> float:
    """Seconds of the processor since then, in other programs too."""
    now = os.times()
    return now.user + now.system + now.children_user + now.children_system - sum(before[:4])


def tables(folder: Path) -> None:
    """Print means over seeds ± their standard errors, and the calibration over all seeds."""
    print("| movie | by | seeds | " + " | ".join(FIGURES) + " |", (3 + len(FIGURES)) * "|---" + "|", sep="\n")
    rows = {kind: stored(folder, kind) for kind in KINDS}
    for kind, some in rows.items():
        for by in dict.fromkeys(row["by"] for row in some):
            of = [row for row in some if row["by"] == by]
            entries = [mean(np.array([float(row[name]) for row in of]), digits) for name, digits in FIGURES.items()]
            print("| " + " | ".join([kind, by, str(len(of)), *entries]) + " |")
    kept = {f"profile_{what}_{100 * least:.0f}": digits for least in LEASTS for what, digits in KEPT.items()}
    print("", "| movie | seeds | " + " | ".join(kept) + " |", (2 + len(kept)) * "|---" + "|", sep="\n")
    for kind, some in rows.items():
        of = [row for row in some if row["by"] == "vibrissa"]
        entries = [mean(np.array([float(row[name]) for row in of]), digits) for name, digits in kept.items()]
        print("| " + " | ".join([kind, str(len(of)), *entries]) + " |")
    head = "| movie | by | apart from | whiskers | followed | in 0.9 of their frames | wrong per 1,000 |"
    print("", head, 7 * "|---" + "|", sep="\n")
    for kind, some in rows.items():
        for by in dict.fromkeys(row["by"] for row in some):
            of = [row for row in some if row["by"] == by]
            for low in CLASSES:
                print("| " + " | ".join([kind, by, f"{low:g}", *table_row(of, low)]) + " |")
    print("", "| movie | by | called sure | is right | claims |", 5 * "|---" + "|", sep="\n")
    for kind, some in rows.items():
        for by in dict.fromkeys(row["by"] for row in some):
            for low in BINS:
                claims, sure, right = (
                    sum(float(row[f"{name}_{100 * low:.0f}"]) for row in some if row["by"] == by)
                    for name in ("claims", "sure", "right")
                )
                if claims:
                    print(f"| {kind} | {by} | {sure / claims:.3f} | {right / claims:.3f} | {claims:.0f} |")


def main() -> None:
    """Run what is missing, then print the tables."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("folder", type=Path)
    words.add_argument("--seeds", type=int, default=50)
    words.add_argument("--frames", type=int, default=300)
    words.add_argument("--kinds", default=",".join(KINDS))
    words.add_argument("--whisk", type=Path)
    asked = words.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    several = {"vibrissa": vibrissa_tracker(), "WHISK": whisk_tracker(asked.whisk)}
    trackers = {by: tracker for by, tracker in several.items() if tracker is not None}
    for kind in asked.kinds.split(","):
        for seed, lacking in missing(asked.folder, kind, asked.seeds, trackers):
            run(asked.folder, kind, seed, asked.frames, {by: trackers[by] for by in lacking})
    tables(asked.folder)


if __name__ == "__main__":
    main()
