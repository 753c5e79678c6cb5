"""Lines of a fan of whiskers that swing about fixed bases, each drawn as a curve; and whose each line is."""

import numpy as np
import xarray as xr

from vibrissa.quantities import dataset

AMPLITUDE, PERIOD = 14.0, 30  # of the swing: degrees, and frames
NOISE = 0.2  # standard deviation of a point [px]


def swing(frames: int) -> np.ndarray:
    """Of the whole fan in each frame [°]."""
    return AMPLITUDE * np.sin(2 * np.pi * np.arange(frames) / PERIOD)


def curve(base: tuple[float, float], angle: float, length: int, bend: float = 0.0, *, kink: float = 0.0, at: int = 0):
    """Points (2, n), a pixel apart: curved by ``bend`` degrees a pixel, and turned by ``kink`` more from ``at`` on."""
    along = np.arange(length)
    way = np.deg2rad(angle + bend * along + kink * (along >= at) * np.clip((along - at) / 25, 0, 1))
    return np.stack([base[0] + np.cumsum(np.cos(way)), base[1] + np.cumsum(np.sin(way))])


def segments(frames: list[list[np.ndarray]], owners: list[list[int]], seed: int) -> tuple[xr.Dataset, np.ndarray]:
    """Segments of the curves of each frame, and the owner of each."""
    rng = np.random.default_rng(seed)
    lines = [one for some in frames for one in some]
    points = np.concatenate(lines, axis=1)
    points = points + rng.normal(0, NOISE, points.shape)
    size = np.array([one.shape[1] for one in lines])
    owner = np.concatenate([np.array(some) for some in owners])
    width = np.full(points.shape[1], 2.0)
    made = dataset(
        {"frames": len(frames), "width": 1200, "height": 900, "source": "fan"},
        segment_frame=np.repeat(np.arange(len(frames)), [len(some) for some in frames]),
        segment_start=np.cumsum([0, *size[:-1]]),
        column=points[0],
        row=points[1],
        line_width=width,
        line_contrast=np.repeat(20.0 + 5 * (owner % 7), size),
        position_sd=0.1 * width,
    )
    return made, owner
