"""Frames per second of the virtual camera, feature by feature, beside two limits.

.venv/bin/python benchmarks/rendering.py [FRAMES]

500 × 450 pixels, whiskers of some 400 columns, one core: processor time, best of seven. Prints "case | frames/s | ms
per frame"; the limits are to fill the same frames with a copied frame, and to draw the same noise with
standard_normal. The fixed parts are drawn anew for each movie, so a short movie shows it.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from time import process_time

import numpy as np

from vibrissa.video.camera.rendering import Camera, exposure_times, render
from vibrissa.video.camera.scenery import Fur, Led, Light, Scenery, Shadow

CAMERA = Camera(width=500, height=450)
DRIFT = Light(drift=0.01)
UNEVEN = Light(drift=0.01, vignette=0.2)
FUR = Fur(skin=4e-3, bulge=2e-3)
SHADOW = Shadow(substrate=(45e-3, 20e-3), facing=np.pi, depth=3e-3)
LED = Led(position=(44e-3, 4e-3), start=0.0)


def whiskers(count: int, frames: int, subframes: int) -> tuple[np.ndarray, np.ndarray]:
    """Whiskers that ring at 90 Hz and cross, (whisker, instant, node) [m]."""
    t = exposure_times(CAMERA, frames, subframes)[:, None]
    s = np.linspace(0, 1, 420)
    lines = [
        (40 + 400 * s + 0 * t, 150 + turn * s + 90 * s**2 + 2 * s * np.sin(2 * np.pi * 90 * t)) for turn in (0, 60, 120)
    ]
    columns, rows = (np.stack(values[:count]) for values in zip(*lines, strict=True))
    rows = rows + np.array([0, -20, -40])[:count, None, None]
    return columns * CAMERA.pixel_size, rows * CAMERA.pixel_size


def report(case: str, frames: int, run: Callable[[], object]) -> None:
    spent = []
    for _ in range(8):  # the first compiles
        start = process_time()
        run()
        spent.append(process_time() - start)
    best = min(spent[1:]) / frames
    print(f"{case} | {1 / best:.0f} | {1e3 * best:.2f}")


def film(
    case: str,
    frames: int,
    *,
    count: int = 1,
    subframes: int = 3,
    scenery: Scenery | None = None,
    camera: Camera = CAMERA,
) -> None:
    x, y = whiskers(count, frames, subframes)
    report(case, frames, lambda: drain(render(x, y, camera, seed=0, subframes=subframes, scenery=scenery)))


def drain(blocks: Iterator[object]) -> None:
    for _ in blocks:
        pass


def copied(frames: int) -> None:
    one = np.zeros((CAMERA.height, CAMERA.width), np.uint8)
    for start in range(0, frames, 256):
        block = np.empty((min(256, frames - start), *one.shape), np.uint8)
        block[:] = one


def drawn(frames: int) -> None:
    for frame in range(frames):
        generator = np.random.Generator(np.random.Philox(key=np.array([0, frame], np.uint64)))
        generator.standard_normal((CAMERA.height, CAMERA.width), np.float32)


def main(frames: int) -> None:
    film("one whisker, 1 instant", frames, subframes=1)
    film("one whisker, 3 instants", frames)
    film("one whisker, 3 instants, drifting light", frames, scenery=Scenery(light=DRIFT))
    film("… and vignette, fur, shadow", frames, scenery=Scenery(light=UNEVEN, fur=FUR, shadow=SHADOW))
    film("… and LED", frames, scenery=Scenery(light=UNEVEN, fur=FUR, shadow=SHADOW, led=LED))
    everything = Scenery(light=UNEVEN, fur=FUR, shadow=SHADOW, led=LED)
    film("… and three whiskers", frames, count=3, scenery=everything)
    film("… and 10 instants", frames, count=3, subframes=10, scenery=everything)
    film("one whisker, 3 instants, noise that grows with the light", frames, camera=replace(CAMERA, shot=0.95))
    report("limit: copy a frame", frames, lambda: copied(frames))
    report("limit: standard_normal alone", frames, lambda: drawn(frames))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
