"""All lines in every frame: time of a frame on one core, against WHISK [Clack2012].

.venv/bin/python benchmarks/segments.py [MOVIE [TRACE]]
.venv/bin/python benchmarks/segments.py whisk MOVIE WHISKERS

The first searches 30 frames, by default of 640 × 480 pixels with six rendered whiskers. TRACE is WHISK's program
``trace`` (PyPI: whisk-janelia 1.2.5), beside which ``default.parameters`` must stand. Times are of the processor; the
movie is decoded beforehand. The second compares the lines of every twentieth frame of a movie with those that WHISK
traced there (its .whiskers file): the share of WHISK's longer ones that are found, and the scatter of the points about
a smooth curve over the standard deviation that is given with them.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
import tifffile

from vibrissa.video.camera.rendering import Camera, render
from vibrissa.video.find.movie_segments import LineSearch, find_segments
from vibrissa.video.foreign.whisk_files import read_whiskers
from vibrissa.video.io.movie import read_blocks

FRAMES, WIDTH, HEIGHT, WHISKERS = 30, 640, 480, 6
EVERY, LONG, NEAR, REACH = 20, 80, 2.0, 10


def rendered() -> np.ndarray:
    """Whiskers that sweep before an even background."""
    camera = Camera(width=WIDTH, height=HEIGHT, noise=3.0, background=184.0)
    s = np.linspace(0, 1, 400)[:, None]
    swing = np.deg2rad(15) * np.sin(2 * np.pi * np.arange(FRAMES) / FRAMES)
    x, y = [], []
    for k in range(WHISKERS):
        angle = np.deg2rad(-50 + 20 * k) + swing + 0.4 * s
        x.append(30 + 400 / len(s) * np.cumsum(np.cos(angle), axis=0))
        y.append(160 + 30 * k + 400 / len(s) * np.cumsum(np.sin(angle), axis=0))
    contrast = np.repeat(np.linspace(90, 20, len(s))[None], WHISKERS, axis=0)
    places = (np.stack(one).swapaxes(1, 2) * camera.pixel_size for one in (x, y))
    return next(render(*places, camera, seed=1, contrast=contrast))


def seconds(call: Callable[[], object], repeats: int = 3) -> float:
    """Shortest processor time of several runs, after one to warm up."""
    call()
    times = []
    for _ in range(repeats):
        start = process_time()
        call()
        times.append(process_time() - start)
    return min(times)


def traced(frames: np.ndarray, trace: Path) -> float:
    """Seconds of processor time that WHISK takes."""
    with tempfile.TemporaryDirectory() as folder:
        for path in (*trace.parent.glob("default.parameters"), *trace.parent.glob("*.detectorbank")):
            (Path(folder) / path.name).symlink_to(path)
        tifffile.imwrite(Path(folder) / "movie.tif", frames, photometric="minisblack")
        before = os.times()
        subprocess.run([trace, "movie.tif", "movie.whiskers"], cwd=folder, check=True, capture_output=True)
        return os.times().children_user - before.children_user


def speed(movie: Path | None, trace: Path | None) -> None:
    """Print frames per second, and ratios."""
    frames = rendered() if movie is None else next(read_blocks(movie, FRAMES))
    search = LineSearch(line_width=float(find_segments(frames[:1]).attrs["typical_width"]))
    new = seconds(lambda: find_segments(frames, search)) / len(frames)
    count = find_segments(frames, search).sizes["segment"] / len(frames)
    print(f"{frames.shape[2]} × {frames.shape[1]} pixels, {count:.1f} lines in a frame")
    print(f"all lines: {1 / new:.0f} frames/s, {frames[0].size / new / 1e6:.1f} Mpx/s")
    if trace is not None:
        theirs = traced(frames, trace) / len(frames)
        print(f"WHISK: {1 / theirs:.1f} frames/s; ratio {theirs / new:.1f}")


def roughness(points: np.ndarray) -> np.ndarray:
    """Distance of points to a quadratic through their neighbours, without each itself, over the SD of both."""
    out = []
    for k in range(REACH, len(points) - REACH):
        part = np.delete(points[k - REACH : k + REACH + 1], REACH, axis=0)
        way = part[-1, :2] - part[0, :2]
        way /= np.hypot(*way)
        along, off = (part[:, :2] - points[k, :2]) @ way, (part[:, :2] - points[k, :2]) @ np.array([-way[1], way[0]])
        if np.isnan(points[k, 2]) or np.isnan(part[:, 2]).any():
            continue
        basis = np.stack([np.ones_like(along), along, along**2], axis=1)
        row = np.linalg.pinv(basis)[0]
        out.append(row @ off / np.hypot(points[k, 2], np.sqrt(np.sum((row * part[:, 2]) ** 2))))
    return np.array(out)


def against_whisk(movie: Path, whiskers: Path) -> None:
    """Print which of WHISK's lines are found, and whether the scatter is as large as it is said to be."""
    frames = np.stack([frame for block in read_blocks(movie) for frame in block])[::EVERY]
    found = find_segments(frames)
    points = np.stack([found.column, found.row, found.position_sd], axis=1).astype(float)
    lines = np.split(points, found.segment_start.values[1:])
    here = [
        np.concatenate(
            [line for line, k in zip(lines, found.segment_frame.values, strict=True) if k == frame]
            or [np.full((1, 3), np.inf)]
        )
        for frame in range(len(frames))
    ]
    shares, off = [], []
    for one in read_whiskers(whiskers):
        if one.frame % EVERY == 0 and one.frame // EVERY < len(frames) and one.x.size > LONG:
            near = here[one.frame // EVERY]
            distance = np.hypot(one.x[:, None] - near[:, 0], one.y[:, None] - near[:, 1]).min(axis=1)
            shares.append(np.mean(distance < NEAR))
            off.append(distance[distance < NEAR])
    rough = np.concatenate([roughness(line) for line in lines])
    print(f"{len(frames)} frames, {len(lines)} lines of {found.attrs['typical_width']:.2f} px")
    half = np.mean(np.array(shares) > 0.5)
    print(f"WHISK's lines longer than {LONG} px: {len(shares)}; found over more than half of them: {half:.3f}")
    print(f"share of their length: {np.mean(shares):.3f}; median distance {np.median(np.concatenate(off)):.2f} px")
    typical = np.median(np.abs(rough)) / 0.6745
    print(f"scatter over SD: {rough.std():.2f}, from the median magnitude {typical:.2f}")
    print(f"median SD: {np.nanmedian(points[:, 2]):.3f} px")


if __name__ == "__main__":
    if sys.argv[1:2] == ["whisk"]:
        against_whisk(Path(sys.argv[2]), Path(sys.argv[3]))
    else:
        speed(*(Path(sys.argv[k]) if len(sys.argv) > k else None for k in (1, 2)))
