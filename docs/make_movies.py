"""The picture of docs/movies.md: one frame with everything the virtual camera knows, three whiskers found and tracked.

Run: python docs/make_movies.py [OUT]
"""

import sys

import numpy as np

from vibrissa.figures.others import preview
from vibrissa.video.camera.camera import Camera
from vibrissa.video.camera.rendering import render
from vibrissa.video.camera.scenery import Fur, Led, Light, Scenery, Shadow
from vibrissa.video.find.finding import find_seeds
from vibrissa.video.tracking import Calibration, track

CAMERA = Camera(width=500, height=450, shot=0.95)
PIXEL = CAMERA.pixel_size


def scene() -> np.ndarray:
    """One frame of three whiskers, (1, height, width)."""
    x = np.linspace(20, 440, 500)
    rows = np.array([80 + 0.42 * (x - 20), 210 - 0.15 * (x - 20) + 7e-4 * (x - 20) ** 2, 380 - 3e-4 * (x - 20) ** 2])
    scenery = Scenery(
        light=Light(vignette=0.2),
        fur=Fur(skin=40 * PIXEL, seed=1),
        shadow=Shadow(substrate=(430 * PIXEL, 225 * PIXEL), facing=np.pi - 0.1, depth=1e-3),
        led=Led(position=(480 * PIXEL, 30 * PIXEL), start=0.0, radius=6 * PIXEL),
    )
    curves = np.broadcast_to(x, rows.shape)[:, None] * PIXEL, rows[:, None] * PIXEL
    return next(iter(render(*curves, CAMERA, seed=1, scenery=scenery)))


def main(out: str) -> None:
    """Find, track and draw."""
    frames = scene()
    side, found = find_seeds(frames[0], region=(60, 0, 405, 449))
    calibration = Calibration(frame_rate=CAMERA.frame_rate, pixel_size=PIXEL)
    seeds = [one.seed for one in found]
    profile = track([frames], seeds=seeds, base=side, region=(60, 0, 405, 449), calibration=calibration)
    preview.draw(preview.compute([frames], profile)).savefig(out, dpi=150)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "docs/movies-preview.png")
