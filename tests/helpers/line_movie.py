"""A movie of known truth, drawn independently of the package: a Gaussian line on a tilted background."""

from __future__ import annotations

import numpy as np

WIDTH, HEIGHT = 500, 450
FIRST, LAST = 60, 460  # columns of the line, base on the left
SIGMA = 0.75  # of the line's cross-section [px]: 1.77 px at half maximum, as measured on real stills


def truth(frames: int, amplitude: float = 0.3) -> np.ndarray:
    """Rows of the centreline (frames, WIDTH) [px]: an arc, and a vibration growing from the base."""
    column = np.arange(WIDTH)
    u = np.clip((column - FIRST) / (LAST - FIRST), 0, 1)
    rest = 200.37 + 60 * u**2 + 15 * u
    t = np.arange(frames)[:, None]
    return rest + amplitude * np.sin(2 * np.pi * t / 17.3) * np.sin(np.pi * 1.4 * u)


def movie(row: np.ndarray, rng: np.random.Generator, noise: float = 3.0) -> np.ndarray:
    """Frames (frames, HEIGHT, WIDTH) of uint8: contrast 110 at the base to 40 at the tip, noise SD 3."""
    column, height = np.arange(WIDTH), np.arange(HEIGHT)[:, None]
    contrast = np.where((column >= FIRST) & (column <= LAST), contrast_of(column), 0)
    background = 184 + 0.03 * (height - 225) + 0.02 * (column - 250)
    out, line = np.empty((len(row), HEIGHT, WIDTH), np.uint8), np.zeros((HEIGHT, WIDTH))
    for i, centre in enumerate(row):
        line[:] = 0  # 9 px away it is below the rounding of the background
        near = slice(max(int(centre.min()) - 9, 0), max(int(centre.max()) + 10, 0))
        # integrated over the pixel, so that the truth holds at any phase of the pixel grid
        off = height[near] - centre
        line[near] = sum(np.exp(-((off + d) ** 2) / (2 * SIGMA**2)) for d in (-0.4, -0.2, 0, 0.2, 0.4)) / 5
        image = background - contrast * line + noise * rng.standard_normal((HEIGHT, WIDTH))
        out[i] = np.clip(np.rint(image), 0, 255)
    return out


def contrast_of(column: np.ndarray) -> np.ndarray:
    """Peak of the line's contrast [grey levels]."""
    return 110 - 70 * np.clip((column - FIRST) / (LAST - FIRST), 0, 1)


def bound_of(contrast: float, noise: float = 3.0) -> float:
    """Cramér–Rao bound of the row of a line of known width: σ/(A √Σ g'²), with Σ g'² = √π/(2 SIGMA) [px]."""
    return noise / contrast * np.sqrt(2 * SIGMA / np.sqrt(np.pi))


def bound(row: np.ndarray) -> np.ndarray:
    """The bound in every frame and column, (frames, WIDTH)."""
    return np.broadcast_to([bound_of(contrast) for contrast in contrast_of(np.arange(WIDTH))], row.shape)
