"""Movies of whiskers whose true centrelines are known, as a virtual high-speed camera takes them.

The image of a whisker is its centreline spread by a Gaussian across the line: a pixel darkens with the distance from
its centre to the nearest point of the centreline, whatever the line's direction. Where whiskers cross, what they
transmit multiplies. Whiskers are dark on a bright field; exposure, noise and the eight bits come after.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrissa.arrays import Array
from vibrissa.loops import njit
from vibrissa.video.camera.camera import WHITE, Camera, Frames, counted, exposure_times, illumination
from vibrissa.video.camera.field import render_background
from vibrissa.video.camera.noise import gaussian_levels, noise_words
from vibrissa.video.camera.scene import RenderedScene
from vibrissa.video.camera.scenery import Scenery

__all__ = ["Camera", "expose", "exposure_times", "illumination", "render", "render_background"]


def expose(
    x: ArrayLike,
    y: ArrayLike,
    camera: Camera,
    *,
    subframes: int = 1,
    contrast: ArrayLike | None = None,
    diameter: ArrayLike | None = None,
    scenery: Scenery | None = None,
    first_frame: int = 0,
) -> Array:
    """Grey levels that reach the sensor: motion blur included, without noise or rounding.

    Parameters
    ----------
    x, y : (W, T·subframes, N) arrays
        Centrelines [m] of W whiskers, N nodes from base to tip, at the instants of :func:`exposure_times`, in the frame
        ``image``: x along the columns, y down the rows, zero at the centre of the first pixel. Nodes are joined by
        straight segments: set them about one pixel apart. Parts outside the image are not seen.
    camera : Camera
        The camera.
    subframes : int
        Instants per frame; the images at these instants are averaged.
    contrast : float, (N,), (W, 1) or (W, N) array, optional
        Darkening on the centreline [grey levels at ``camera.background``]; by default it falls evenly, from node to
        node, from ``camera.contrast[0]`` to ``camera.contrast[1]``.
    diameter : float, (N,), (W, 1) or (W, N) array, optional
        Diameter of the shaft [m]. It widens the line's image, variances added: blur²/8 ln 2 + diameter²/12, the second
        that of a uniformly dark band. By default the whisker is infinitely thin.
    scenery : Scenery, optional
        What is in the field beside the whiskers; by default nothing, in even and steady light.
    first_frame : int
        Number of the first frame given, for the drift of the light and the LED.

    Returns
    -------
    (T, height, width) array
        Grey levels.

    Raises
    ------
    InputError
        If shapes disagree, a position is not finite, or a contrast or a diameter is out of range.
    """
    scene = RenderedScene(x, y, camera, subframes, contrast, diameter, scenery, first_frame)
    return np.stack([scene.frame(index) for index in range(scene.n_frames)])


def render(
    x: ArrayLike,
    y: ArrayLike,
    camera: Camera,
    *,
    seed: int,
    subframes: int = 1,
    contrast: ArrayLike | None = None,
    diameter: ArrayLike | None = None,
    scenery: Scenery | None = None,
    first_frame: int = 0,
    block: int = 256,
) -> Iterator[Frames]:
    """Movie of moving whiskers, block by block.

    The noise is Gaussian, drawn for each frame from a generator keyed by (seed, frame): equal seeds give equal bytes,
    whatever the size of the blocks, and a movie made in pieces is the movie made at once. It has no memory between
    pixels or frames: see :mod:`vibrissa.video.camera.noise`; ``camera.shot`` says how it grows with the light.

    Parameters
    ----------
    x, y, camera, subframes, contrast, diameter, scenery
        As in :func:`expose`.
    seed : int
        Seed of the noise, 0 to 2⁶⁴ − 1.
    first_frame : int
        Number of the first frame given, for a movie made in pieces.
    block : int
        Frames per block; the last may be shorter.

    Returns
    -------
    iterator of (block, height, width) arrays
        Eight-bit grey levels, rounded to the nearest and clipped to 0–255.

    Raises
    ------
    InputError
        As :func:`expose`, and for a seed, a first frame or a block out of range; before the first block.
    """
    scene = RenderedScene(x, y, camera, subframes, contrast, diameter, scenery, first_frame)
    return _blocks(scene, counted("seed", seed, least=0), counted("block", block))


def _blocks(scene: RenderedScene, seed: int, block: int) -> Iterator[Frames]:
    camera, levels = scene.camera, gaussian_levels() * np.float32(scene.camera.noise)
    for start in range(0, scene.n_frames, block):
        count = min(block, scene.n_frames - start)
        images = np.empty((count, camera.height, camera.width), np.uint8)
        for index, image in enumerate(images, start):
            words = noise_words(seed, scene.first_frame + index, image.size)
            read_out(scene.frame(index).ravel(), words, levels, camera.shot, camera.background, image.ravel())
        yield images


@njit(cache=True, nogil=True)
def read_out(
    light: Array,
    words: NDArray[np.uint64],
    levels: NDArray[np.float32],
    shot: float,
    background: float,
    image: NDArray[np.uint8],
) -> None:
    """Add the noise, its variance 1 − shot + shot·light/background of that of ``levels``; round and clip."""
    for pixel in range(image.size):
        noise = levels[(words[pixel >> 2] >> np.uint64(16 * (pixel & 3))) & np.uint64(0xFFFF)]
        spread = np.sqrt(1 - shot + shot * light[pixel] / background) if shot > 0 else 1.0
        image[pixel] = np.uint8(min(max(np.rint(light[pixel] + noise * spread), 0.0), WHITE))
