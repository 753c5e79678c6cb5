"""Random still scenes of one to six whiskers before fur, crossings and uneven light included; their count is known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.video.camera.rendering import Camera, render

NODES = 240


class Scene(NamedTuple):
    image: np.ndarray
    lines: list[np.ndarray]  # (columns, rows) of each whisker [px]
    base: str


def scene(seed: int) -> Scene:
    """One scene: bases at least 14 px apart, directions and bends at random, so that whiskers may cross."""
    rng = np.random.default_rng(seed)
    width, height, count = 320, 240, int(rng.integers(1, 7))
    rows = 40 + 14 * np.arange(11)
    bases = np.sort(rng.choice(rows, count, replace=False)) + rng.uniform(-3, 3, count)
    columns, lines = rng.uniform(25, 40), []
    for base in bases:
        length, angle = rng.uniform(130, 260), rng.uniform(-25, 25)
        s = np.linspace(0, 1, NODES)
        direction = np.deg2rad(angle + rng.uniform(-25, 25) * s)
        step = length / (NODES - 1)
        lines.append(
            np.stack([columns + np.cumsum(step * np.cos(direction)), base + np.cumsum(step * np.sin(direction))])
        )
    hairs = [_hair(rng, columns) for _ in range(40)]
    camera = Camera(
        width=width,
        height=height,
        noise=rng.uniform(2, 5),
        background=170.0,
        gradient=(rng.uniform(-60, 60), rng.uniform(-60, 60)),
        blur=rng.uniform(1.5, 2.5),
    )
    strength = [np.linspace(rng.uniform(50, 110), rng.uniform(12, 30), NODES) for _ in lines]
    strength += [np.linspace(rng.uniform(30, 100), 10, NODES) for _ in hairs]
    x, y = np.stack([*lines, *hairs]).transpose(1, 0, 2)[:, :, None] * camera.pixel_size
    (image,) = next(render(x, y, camera, seed=seed, contrast=np.array(strength)))
    image = image.copy()
    image[:, : int(columns) - 4] = rng.integers(5, 15)
    if rng.random() < 0.5:
        return Scene(image[:, ::-1].copy(), [np.stack([width - 1 - c, r]) for c, r in lines], "right")
    return Scene(image, lines, "left")


def _hair(rng: np.random.Generator, column: float) -> np.ndarray:
    length, angle, row = rng.uniform(5, 25), np.deg2rad(rng.uniform(-60, 60)), rng.uniform(0, 240)
    s = np.linspace(0, length, NODES)
    return np.stack([column - 6 + s * np.cos(angle), row + s * np.sin(angle)])
