"""Names in one recorded movie as it is, mirrored, turned, at another size, and in parts: how far chance decides.

    vibrissa run examples/mouse-field.toml --out mouse
    .venv/bin/python benchmarks/marked_variants.py mouse/profile.nc test_video2.mp4

Whiskers are the same whichever way the movie is turned, so a tracker that is certain of its names gives the same ones.
Each variant is tracked without marks, its lines are brought back to the movie as it was recorded and held against
whiskers that were followed from marks, as in ``marked_names.py``; contradictions are not judged, so a few of them are
the study's errors. Parts are held against the name that most lines have in that part. Each pair of shares is of all
lines with a name, and of those whose name is at least 0.7 sure.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from marked_names import Named, Study, at_whisker, contradictions, read_study
from scipy.ndimage import gaussian_filter, zoom

from vibrissa.video.io.movie import read_blocks
from vibrissa.video.linked.linked_tracking import track_linked
from vibrissa.video.tracking import Calibration

Points = tuple[np.ndarray, np.ndarray]
Variant = tuple[np.ndarray, Callable[[np.ndarray, np.ndarray], Points]]  # frames, and where their points were recorded
CALIBRATION = Calibration(frame_rate=200.0, pixel_size=1e-4)
PART = 450  # frames
COLUMNS = "variant", "frames", "names", "named lines in a frame"
ROW, LEVELS = ("under its name", "contradicted"), (0.0, 0.7)  # all lines, and those at least so sure


def resized(movie: np.ndarray, factor: float) -> Variant:
    """The movie at another size."""
    blur = 0.4 / factor if factor < 1 else 0.0
    frames = np.stack([zoom(gaussian_filter(one.astype(float), blur), factor, order=3) for one in movie])
    (h, w), (height, width) = movie.shape[1:], frames.shape[1:]
    back = (w - 1) / (width - 1), (h - 1) / (height - 1)
    return frames.clip(0, 255).round().astype(np.uint8), lambda c, r: (c * back[0], r * back[1])


def variants(movie: np.ndarray) -> dict[str, Callable[[], Variant]]:
    """The whole movie in other forms."""
    h, w = movie.shape[1] - 1, movie.shape[2] - 1
    return {
        "as recorded": lambda: (movie, lambda c, r: (c, r)),
        "left for right": lambda: (movie[:, :, ::-1].copy(), lambda c, r: (w - c, r)),
        "upside down": lambda: (movie[:, ::-1].copy(), lambda c, r: (c, h - r)),
        "turned by 90°": lambda: (np.rot90(movie, 1, (1, 2)).copy(), lambda c, r: (w - r, c)),
        "0.7 times the size": lambda: resized(movie, 0.7),
        "1.6 times the size": lambda: resized(movie, 1.6),
        "half the contrast": lambda: ((movie * 0.5).round().astype(np.uint8), lambda c, r: (c, r)),
    }


def row(name: str, variant: Variant, study: Study, first: int = 0) -> str:
    """One line of the table."""
    frames, recorded = variant
    lines = track_linked(frames, calibration=CALIBRATION).segments
    points = np.stack(recorded(lines["column"].values.astype(float), lines["row"].values.astype(float)))
    ends = np.append(lines["segment_start"].values, points.shape[1])
    named = Named(*(lines[f"segment_{one}"].values for one in ("frame", "whisker", "probability")), points, ends)
    part, seen = slice(first, first + len(frames)), named.name >= 0
    entries = [name, str(len(frames)), str(named.name.max() + 1), f"{seen.sum() / len(frames):.2f}"]
    for column, across in zip(study.column[:, part], study.row[:, part], strict=True):
        at, followed = at_whisker(named, column, across), np.isfinite(across).any(axis=1)
        each = [scores(named, at, followed, least) for least in LEVELS]
        entries += [", ".join(both) for both in zip(*each, strict=True)]
    return "| " + " | ".join(entries) + " |"


def scores(named: Named, at: np.ndarray, followed: np.ndarray, least: float) -> tuple[str, str]:
    """Share of frames under the whisker's name, and of frames with the name that contradict the study."""
    if not (at & (named.name >= 0) & (named.sure >= least)).any():
        return "0.0", "–"
    right, every, against = contradictions(named, at, followed, least)
    return f"{100 * right.size / followed.sum():.1f}", f"{100 * against.size / max(every, 1):.1f}"


def main() -> None:
    """Print the table."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("study", type=Path)
    words.add_argument("movie", type=Path)
    asked = words.parse_args()
    study, movie = read_study(asked.study), np.concatenate(list(read_blocks(asked.movie)))
    heads = [*COLUMNS, *(f"{name} {what} [%]" for name in study.names for what in ROW)]
    print("| " + " | ".join(heads) + " |", len(heads) * "|---" + "|", sep="\n")
    for name, variant in variants(movie).items():
        print(row(name, variant(), study), flush=True)
    for first in range(0, len(movie), PART):
        part = movie[first : first + PART], lambda c, r: (c, r)
        print(row(f"frames {first} to {first + len(part[0]) - 1}", part, study, first), flush=True)


if __name__ == "__main__":
    main()
