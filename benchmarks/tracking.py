"""Tracking in memory: frames per second of the kernel on one core, against reading every pixel once.

.venv/bin/python benchmarks/tracking.py

2000 frames of 500 × 450 pixels: still noise (SD 3 grey levels) with lines of 1.77 px full width that vibrate.
Times are of the process (CPU), best of five. The first call compiles, into an empty cache; a new process then
loads what was compiled. Needs 500 MB.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vibrissa.video.follow.following import centrelines
from vibrissa.video.follow.search import Search
from vibrissa.video.kernel.estimator_table import ESTIMATORS

WIDTH, HEIGHT, FRAMES, BLOCK = 500, 450, 2000, 64
FIRST, LAST = 60, 460  # columns of the lines
SIGMA, NOISE = 0.75, 3.0
HEIGHTS = (200.0, 130.0, 290.0)  # rows of the lines at their base
STILLS = 20  # frames of different noise and place; the movie repeats them, too far apart to stay in a cache


def rows(height: float) -> NDArray[np.float64]:
    """Rows of a line (still, column) [px]: an arc, and a vibration that grows from the base."""
    u = np.clip((np.arange(WIDTH) - FIRST) / (LAST - FIRST), 0, 1)
    phase = 2 * np.pi * np.arange(STILLS)[:, None] / STILLS
    return height + 60 * u**2 + 15 * u + 0.3 * np.sin(phase) * np.sin(np.pi * 1.4 * u)


def movie() -> NDArray[np.uint8]:
    """Frames with all three lines; contrast 110 at the base to 40 at the tip."""
    rng, column = np.random.default_rng(0), np.arange(WIDTH)
    contrast = np.where((column >= FIRST) & (column <= LAST), 110 - 70 * (column - FIRST) / (LAST - FIRST), 0)
    stills = np.empty((STILLS, HEIGHT, WIDTH), np.uint8)
    for i in range(STILLS):
        image = 184 + NOISE * rng.standard_normal((HEIGHT, WIDTH))
        for height in HEIGHTS:
            off = np.arange(HEIGHT)[:, None] - rows(height)[i]
            image -= contrast * np.exp(-(off**2) / (2 * SIGMA**2))
        stills[i] = np.clip(np.rint(image), 0, 255)
    return np.tile(stills, (FRAMES // STILLS, 1, 1))


def best(call: Callable[[], object], repeats: int = 5) -> float:
    """Shortest CPU time of several runs, after one to warm up [s]."""
    call()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def follow(frames: NDArray[np.uint8], count: int, estimator: str) -> None:
    """Follow some whiskers through the movie, block by block."""
    seeds = [(250.0, float(rows(height)[0, 250])) for height in HEIGHTS[:count]]
    blocks = (frames[i : i + BLOCK] for i in range(0, len(frames), BLOCK))
    for lines in centrelines(blocks, seeds=seeds, search=Search(estimator=estimator)):
        if lines.reason.any():
            raise RuntimeError("a whisker was lost")


def first_call() -> float:
    """Seconds until a first short movie is tracked."""
    frames = movie()[:BLOCK]
    start = time.perf_counter()
    follow(frames, 1, "matched")
    return time.perf_counter() - start


def in_new_process(cache: str) -> float:
    """The same in a process of its own, compiled code kept in ``cache``."""
    done = subprocess.run(
        [sys.executable, __file__, "first"],
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout)


def main() -> None:
    frames = movie()
    bare = best(lambda: [frame.max() for frame in frames])
    print(f"{'bare read of every pixel':<40} | {FRAMES / bare:8.0f} frames/s | {bare / FRAMES * 1e6:6.1f} µs/frame")
    for estimator in ESTIMATORS:
        for count in (1, 3):
            taken, head = (
                best(lambda part=part, count=count, estimator=estimator: follow(part, count, estimator))
                for part in (frames, frames[:BLOCK])
            )
            kernel = (taken - head) / (FRAMES - BLOCK)
            case = f"{estimator}, whiskers: {count}"
            per = f"{1 / kernel:8.0f} frames/s | {kernel * 1e6:6.1f} µs/frame"
            start = f"and {1e3 * (head - BLOCK * kernel):.1f} ms to start at the seeds"
            print(f"{case:<40} | {per} | {kernel * FRAMES / bare:.2f} × the bare read | {start}", flush=True)
    with tempfile.TemporaryDirectory() as cache:
        print(f"{'first call, compiling':<40} | {in_new_process(cache):.1f} s")
        print(f"{'first call of a later process':<40} | {in_new_process(cache):.1f} s")


if __name__ == "__main__":
    if sys.argv[1:] == ["first"]:
        print(first_call())
    else:
        main()
