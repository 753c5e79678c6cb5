"""Damaged movies: what is found of bytes flipped in the coded frames, by codec.

    .venv/bin/python benchmarks/damage.py [--flips 40]

Each line of the table is one movie of a moving dark line with noise, damaged in so many ways: one byte, at a random
place of a random frame as it is coded, takes another value. ``found``: reading ends with a line that names the movie;
``harmless``: all frames are as without the damage; ``unseen``: frames differ, and nothing was said.
"""

from __future__ import annotations

import argparse
import csv
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import tifffile

from vibrissa.errors import InputError
from vibrissa.video.io import encoder
from vibrissa.video.io.movie import open_movie, read_blocks

SIZE = 120, 160
CONTAINERS: dict[str, tuple[str, str, dict[str, str], str]] = {
    "FFV1, MKV": (".mkv", "ffv1", {}, "gray"),
    "FFV1, AVI": (".avi", "ffv1", {}, "gray"),
    "FFV1 without checksums": (".mkv", "ffv1", {"level": "3", "slicecrc": "0"}, "gray"),
    "PNG, MOV": (".mov", "png", {}, "gray"),
    "H.264 lossless, MP4": (".mp4", "libx264", {"qp": "0"}, "gray"),
    "H.264 CRF 18, MP4": (".mp4", "libx264", {"crf": "18"}, "gray"),
    "MPEG-4, AVI": (".avi", "mpeg4", {"q:v": "2"}, "yuv420p"),
    "MJPEG, AVI": (".avi", "mjpeg", {"q:v": "2"}, "yuvj420p"),
    "FFVHUFF, AVI": (".avi", "ffvhuff", {}, "gray"),
    "uncompressed, AVI": (".avi", "rawvideo", {}, "gray"),
}
Span = tuple[int, int]


def scene(count: int = 24) -> np.ndarray:
    """A dark line that moves, with noise, (count, height, width) of uint8."""
    rng, (row, column) = np.random.default_rng(3), np.mgrid[: SIZE[0], : SIZE[1]]
    lines = [60 + 8 * np.sin(k / 3) + 0.2 * (column - 80) + 5 * (column / 80) ** 2 for k in range(count)]
    levels = [180 - 60 * np.exp(-(((row - line) / 1.2) ** 2)) + rng.normal(0, 2, SIZE) for line in lines]
    return np.clip(levels, 0, 255).astype(np.uint8)


def contained(folder: Path, name: str, frames: np.ndarray) -> tuple[Path, list[Span]]:
    """A movie in a container; place and size of each coded frame."""
    suffix, codec, options, stored = CONTAINERS[name]
    path = folder / f"movie{suffix}"
    encoder.encode(path, list(frames), codec, options, "gray", stored, 25.0)
    with av.open(str(path)) as file:
        return path, [(one.pos, one.size) for one in file.demux(file.streams.video[0]) if one.size]


def paged(compression: str | None) -> Callable[[Path, np.ndarray], tuple[Path, list[Span]]]:
    """Writer of a TIFF with a page for each frame."""

    def write(folder: Path, frames: np.ndarray) -> tuple[Path, list[Span]]:
        path = folder / "movie.tif"
        tifffile.imwrite(path, frames, compression=compression, photometric="minisblack", metadata=None)
        with tifffile.TiffFile(path) as file:
            pages = [(page.dataoffsets[0], page.databytecounts[0]) for page in file.pages]
        return path, pages if compression else [(pages[0][0], frames.nbytes)]

    return write


def bare(folder: Path, frames: np.ndarray) -> tuple[Path, list[Span]]:
    """A NumPy array on disk."""
    np.save(folder / "movie.npy", frames)
    start = (folder / "movie.npy").stat().st_size - frames.nbytes
    return folder / "movie.npy", [(start, frames.nbytes)]


def photron(folder: Path, frames: np.ndarray) -> tuple[Path, list[Span]]:
    """A header with bare frames, as Photron's cameras write them."""
    said = {"Total Frame": len(frames), "Image Width": SIZE[1], "Image Height": SIZE[0]}
    said |= {"Color Bit": 8, "EffectiveBit Depth": 8}
    (folder / "movie.cih").write_text("\n".join(f"{key} : {value}" for key, value in said.items()))
    (folder / "movie.mraw").write_bytes(frames.tobytes())
    return folder / "movie.mraw", [(0, frames.nbytes)]


OTHERS: dict[str, Callable[[Path, np.ndarray], tuple[Path, list[Span]]]] = {
    "TIFF, deflate": paged("zlib"),
    "TIFF, uncompressed": paged(None),
    "NumPy array": bare,
    "Photron MRAW": photron,
}


def tally(path: Path, coded: list[Span], flips: int, seed: int = 5) -> Counter[str]:
    """Outcomes of so many damages of a movie."""
    true, whole, places = read(path), path.read_bytes(), random.Random(seed)
    found: Counter[str] = Counter()
    for _ in range(flips):
        start, size = places.choice(coded)
        damaged = bytearray(whole)
        damaged[places.randrange(start, start + size)] ^= places.randrange(1, 256)
        path.write_bytes(damaged)
        try:
            found["harmless" if np.array_equal(read(path), true) else "unseen"] += 1
        except InputError:
            found["found"] += 1
    path.write_bytes(whole)
    return found


def read(path: Path) -> Any:
    """All frames."""
    return np.concatenate(list(read_blocks(path)))


def main() -> None:
    """Print the table as CSV."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flips", type=int, default=40, help="damages of each movie")
    flips, frames = parser.parse_args().flips, scene()
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["codec", "checksums", "found", "harmless", "unseen"])
    for name in (*CONTAINERS, *OTHERS):
        with tempfile.TemporaryDirectory() as folder:
            make = OTHERS.get(name)
            path, coded = make(Path(folder), frames) if make else contained(Path(folder), name, frames)
            said, found = open_movie(path).checksums, tally(path, coded, flips)
            counts = (found[kind] for kind in ("found", "harmless", "unseen"))
            table.writerow([name, "yes" if said else "no", *counts])


if __name__ == "__main__":
    main()
