"""How much of the bare decoding rate is left when blocks are made of it, and when a whisker is tracked beside it.

A movie of 500 × 450 pixels, one line with noise of 3 grey levels; frames per second of wall time, best of several runs
taken in turn. "Bare" is the file's own decoder and nothing else: PyAV's frames thrown away, TIFF and MRAW read from the
file (12 bits unpacked). Run: python benchmarks/decoding.py [FRAMES]
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import av
import numpy as np
import tifffile

from vibrissa.video.io import photron
from vibrissa.video.io.movie import read_blocks, write_movie
from vibrissa.video.tracking import Calibration, track

HEIGHT, WIDTH, BLOCK = 450, 500, 64
CALIBRATION = Calibration(frame_rate=5000, pixel_size=20e-6)


def film(frames: int) -> np.ndarray:
    """A dark line across the image that vibrates by half a pixel, before a bright field."""
    rng, row = np.random.default_rng(0), np.arange(HEIGHT, dtype=np.float32)[:, None]
    arc = 200 + 40 * np.linspace(0, 1, WIDTH) ** 2
    noise = rng.normal(0, 3, (8, HEIGHT, WIDTH)).astype(np.float32)
    images = np.empty((frames, HEIGHT, WIDTH), np.uint8)
    for t, image in enumerate(images):
        line = 90 * np.exp(-((row - arc - 0.5 * np.sin(t / 3)) ** 2) / 1.1)
        image[:] = np.rint(180 - line + np.roll(noise[t % 8], t, axis=1))
    return images


def raw_avi(path: Path, images: np.ndarray) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("rawvideo", rate=25)
        stream.height, stream.width, stream.pix_fmt = HEIGHT, WIDTH, "gray"
        for image in images:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))


def mraw(path: Path, images: np.ndarray, bits: int) -> None:
    said = {"Total Frame": len(images), "Image Width": WIDTH, "Image Height": HEIGHT}
    said |= {"Color Bit": bits, "EffectiveBit Depth": bits, "Record Rate(fps)": 5000}
    path.with_suffix(".cih").write_text("\n".join(f"{key} : {value}" for key, value in said.items()))
    if bits == 12:
        first, last = (images.reshape(-1, 2).astype(np.uint16) << 4).T
        images = np.stack([first >> 4, ((first & 15) << 4) | (last >> 8), last & 255], axis=1).astype(np.uint8)
    path.with_suffix(".mraw").write_bytes(images.tobytes())


def bare_container(path: Path) -> None:
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        for _ in container.decode(stream):
            pass


def bare_tiff(path: Path) -> None:
    with tifffile.TiffFile(path) as file:
        file.asarray(series=0)


def bare_mraw(path: Path) -> None:
    with path.open("rb") as file:
        while file.read(BLOCK * HEIGHT * WIDTH):
            pass


def bare_packed(path: Path) -> None:
    levels = np.empty(BLOCK * HEIGHT * WIDTH, np.uint16)
    with path.open("rb") as file:
        while packed := file.read(levels.size * 3 // 2):
            photron._unpack(np.frombuffer(packed, np.uint8), levels[: len(packed) * 2 // 3])


def files(folder: Path, images: np.ndarray) -> Iterator[tuple[str, Path, Callable[[Path], None]]]:
    for name, path, codec in (
        ("FFV1", "ffv1.mkv", "ffv1"),
        ("FFVHUFF", "ffvhuff.avi", "ffvhuff"),
        ("H.264, CRF 18", "h264.mp4", "h264"),
        ("TIFF", "pages.tif", "ffv1"),
    ):
        write_movie(folder / path, [images], codec)
        yield name, folder / path, bare_tiff if path.endswith("tif") else bare_container
    raw_avi(folder / "raw.avi", images)
    yield "raw AVI", folder / "raw.avi", bare_container
    for bits, bare in ((8, bare_mraw), (12, bare_packed)):
        mraw(folder / f"mraw{bits}.mraw", images, bits)
        yield f"MRAW, {bits} bits", folder / f"mraw{bits}.mraw", bare


def fastest(calls: list[Callable[[], object]], repeats: int = 5) -> list[float]:
    """Shortest time of each call [s], all taken in turn, so that a busy machine slows them alike."""
    times = np.empty((repeats + 1, len(calls)))
    for run in times:
        for i, call in enumerate(calls):
            start = time.perf_counter()
            call()
            run[i] = time.perf_counter() - start
    return list(times[1:].min(axis=0))


def exhaust(path: Path) -> None:
    for _ in read_blocks(path, BLOCK):
        pass


def follow(blocks: Iterator[np.ndarray]) -> object:
    return track(blocks, seeds=[(250, 210)], calibration=CALIBRATION)


def main(frames: int) -> None:
    images = film(frames)
    (alone,) = fastest([lambda: follow(iter(np.split(images, range(BLOCK, frames, BLOCK))))])
    print(f"tracking from memory: {frames / alone:.0f} frames/s")
    print("file           |   bare | blocks | ratio | tracked | ratio | of the slower of decoding and tracking")
    with tempfile.TemporaryDirectory() as folder:
        for name, path, bare in files(Path(folder), images):
            seconds = fastest(
                [
                    lambda path=path, bare=bare: bare(path),
                    lambda path=path: exhaust(path),
                    lambda path=path: follow(read_blocks(path, BLOCK)),
                ]
            )
            rate = [frames / one for one in seconds]
            limit = min(rate[0], frames / alone)
            print(
                f"{name:<14} | {rate[0]:6.0f} | {rate[1]:6.0f} | {rate[1] / rate[0]:5.2f} | "
                f"{rate[2]:7.0f} | {rate[2] / rate[0]:5.2f} | {rate[2] / limit:.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 384)
