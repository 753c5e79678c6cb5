"""Gaussian noise of a sensor, counted and not remembered: any frame's noise follows from its seed and number alone."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

LEVELS = 2**16


@cache
def gaussian_levels() -> NDArray[np.float32]:
    """Sixteen-bit standard Gaussian: the means of the distribution's 65,536 equally likely slices, over their SD.

    Mean 0 and variance 1 as a Gaussian's; it ends at ±4.39, so that its kurtosis is 2.9998 instead of 3.

    Returns
    -------
    (65536,) array
        Rising; read-only.
    """
    edges = ndtri(np.arange(LEVELS + 1) / LEVELS)
    density = np.exp(-(edges**2) / 2) / np.sqrt(2 * np.pi)
    means = LEVELS * (density[:-1] - density[1:])
    means = (means - means[::-1]) / 2  # odd to the last bit
    levels = (means / means.std()).astype(np.float32)
    levels.flags.writeable = False
    return levels


def noise_words(seed: int, frame: int, size: int) -> NDArray[np.uint64]:
    """Random bits of one frame: Philox from zero, its key (seed, frame); four pixels share a word, the lowest first.

    Parameters
    ----------
    seed, frame : int
        From 0 to 2⁶⁴ − 1.
    size : int
        Number of pixels.

    Returns
    -------
    (⌈size/4⌉,) array
        Words of 64 bits.
    """
    generator = np.random.Philox(key=np.array([seed, frame], np.uint64))
    return generator.random_raw(-(-size // 4))


def sensor_noise(seed: int, frame: int, size: int) -> NDArray[np.float32]:
    """Noise of one frame, of variance 1, pixel after pixel: what :func:`vibrissa.video.camera.rendering.render` adds.

    Parameters
    ----------
    seed, frame, size : int
        As in :func:`noise_words`.

    Returns
    -------
    (size,) array
        In standard deviations.
    """
    words = noise_words(seed, frame, size)[:, None] >> np.arange(0, 64, 16, dtype=np.uint64)
    return gaussian_levels()[(words & np.uint64(LEVELS - 1)).ravel()[:size]]
