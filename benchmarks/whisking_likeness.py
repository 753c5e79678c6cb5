"""How like recorded movies the scenes of ``whisking_movies.py`` are: lines, their length, width and depth, the noise.

.venv/bin/python benchmarks/whisking_likeness.py MOVIE...

Lines are those that the finder finds in every thirtieth of 200 frames of a recorded movie, and of 60 frames of four
seeds of each kind of scene with dark whiskers. The noise is that of a pixel in the lower half of the image, from the
median difference of following frames; compression may leave none of it.
"""

import importlib
import sys
from pathlib import Path

import numpy as np
from whisking_movies import KINDS, scene_of
from whisking_trackers import FINDER, there

from vibrissa.video.camera.pad.filming import film
from vibrissa.video.io.movie import read_blocks

WATCHED, EVERY, SEEDS = 200, 30, 4


def about(name: str, frames: np.ndarray) -> str:
    """One line of the table."""
    pairs = frames[: 2 * (len(frames) // 2)].astype(float)
    noise = np.median(np.abs(pairs[1::2] - pairs[::2])[:, frames.shape[1] // 2 :]) / 0.6745 / np.sqrt(2)
    found = importlib.import_module(FINDER).find_segments(frames[::2])
    length = found.sizes["point"] / (len(frames) / 2)
    width, depth = (found[key].values for key in ("line_width", "line_contrast"))
    spread = [" to ".join(f"{one:.1f}" for one in np.nanquantile(v, [0.25, 0.75])) for v in (width, depth)]
    lines = found.sizes["segment"] / (len(frames) / 2)
    size = f"{frames.shape[2]} × {frames.shape[1]}"
    entries = [name, size, f"{lines:.0f}", f"{length:.0f}", *spread, f"{np.median(frames):.0f}", f"{noise:.1f}"]
    return "| " + " | ".join(entries) + " |"


def sampled(frames: np.ndarray) -> np.ndarray:
    """Pairs of following frames, from every thirtieth on."""
    return np.concatenate([frames[k : k + 2] for k in range(10, len(frames) - 1, EVERY)])


def main(movies: list[Path]) -> None:
    """Print the table."""
    if not there(FINDER):
        sys.exit(f"vibrissa has no {FINDER} here")
    print("| movie | size | lines | their length [px] | width, quartiles [px] | depth, quartiles | level | noise |")
    print(8 * "|---" + "|")
    for path in movies:
        print(about(path.stem, sampled(next(iter(read_blocks(path, WATCHED))))), flush=True)
    for kind in KINDS:
        if kind == "bright":
            continue
        frames = [sampled(next(iter(film(scene_of(kind, seed), 60, block=60)))) for seed in range(SEEDS)]
        print(about(kind, np.concatenate(frames)), flush=True)


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
