"""Movies of whiskers whose true centrelines are known, as a virtual high-speed camera takes them.

The image of a whisker is its centreline spread by a Gaussian across the line: a pixel darkens with the distance from
its centre to the nearest point of the centreline, whatever the line's direction. Where whiskers cross, what they
transmit multiplies. Dark whiskers stand on a bright field; exposure, noise and the eight bits come after.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.quantities import require
from vibrissa.video.camera import WHITE, Camera, Frames, counted, exposure_times, illumination
from vibrissa.video.field import render_background
from vibrissa.video.noise import gaussian_levels, noise_words
from vibrissa.video.scene import Scene
from vibrissa.video.scenery import Scenery
from vibrissa.video.transmission import compiled

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Camera", "expose", "exposure_times", "illumination", "render", "render_background", "render_profile"]

Array = NDArray[np.float64]


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
        What stands in the field beside the whiskers; by default nothing, in even and steady light.
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
    scene = Scene.of(x, y, camera, subframes, contrast, diameter, scenery, first_frame)
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
    pixels or frames: see :mod:`vibrissa.video.noise`; ``camera.shot`` says how it grows with the light.

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
    scene = Scene.of(x, y, camera, subframes, contrast, diameter, scenery, first_frame)
    return _blocks(scene, counted("seed", seed, least=0), counted("block", block))


def render_profile(
    profile: xr.Dataset,
    camera: Camera,
    *,
    seed: int,
    subframes: int = 1,
    contrast: ArrayLike | None = None,
    diameter: ArrayLike | None = None,
    scenery: Scenery | None = None,
    block: int = 256,
) -> Iterator[Frames]:
    """Movie of a ``profile``: of tracked or predicted whiskers, filmed anew.

    Frame n is centred on the n-th 1/frame_rate after the profile's first instant. Between its instants nodes move
    straight on, and so they do for the half exposure before the first and after the last; sample a profile faster than
    the camera films it, for what happens within an exposure to be seen.

    Parameters
    ----------
    profile : Dataset
        ``x``, ``y`` (whisker, time, node) or (time, node) [m], in the frame ``image``, and ``time`` [s], of two
        instants or more.
    camera, seed, subframes, contrast, diameter, scenery, block
        As in :func:`render`.

    Returns
    -------
    iterator of (block, height, width) arrays
        Eight-bit grey levels.

    Raises
    ------
    InputError
        As :func:`render`, and if the profile is in another frame or its times do not rise; before the first block.
    """
    time, x, y = _filmed(profile)
    n_frames = int(np.floor((time[-1] - time[0]) * camera.frame_rate * (1 + 1e-9))) + 1
    instants = time[0] + exposure_times(camera, n_frames, subframes)
    return render(
        _at(instants, time, x),
        _at(instants, time, y),
        camera,
        seed=seed,
        subframes=subframes,
        contrast=contrast,
        diameter=diameter,
        scenery=scenery,
        block=block,
    )


def _filmed(profile: xr.Dataset) -> tuple[Array, Array, Array]:
    """Times (T,) and positions (W, T, N) of a profile that can be filmed."""
    require(profile, "x", "y")
    if profile.attrs.get("frame") != "image":
        raise InputError("profile", "must be in the frame 'image'", repr(profile.attrs.get("frame")))
    time = np.asarray(profile["time"], float)
    if time.size < 2 or not np.all(np.diff(time) > 0):
        raise InputError("profile.time", "must rise, over two instants or more")
    order = ("whisker", "time", "node") if "whisker" in profile.x.dims else ("time", "node")
    x, y = (np.atleast_3d(np.asarray(profile[name].transpose(*order), float).T).T for name in ("x", "y"))
    return time, x, y


def _at(instants: Array, time: Array, values: Array) -> Array:
    """Values (W, T, N) at other instants, on straight lines in time."""
    k = np.clip(np.searchsorted(time, instants, side="right") - 1, 0, time.size - 2)
    share = ((instants - time[k]) / (time[k + 1] - time[k]))[:, None]
    return (1 - share) * values[:, k] + share * values[:, k + 1]


def _blocks(scene: Scene, seed: int, block: int) -> Iterator[Frames]:
    camera, levels = scene.camera, gaussian_levels() * np.float32(scene.camera.noise)
    for start in range(0, scene.n_frames, block):
        count = min(block, scene.n_frames - start)
        images = np.empty((count, camera.height, camera.width), np.uint8)
        for index, image in enumerate(images, start):
            words = noise_words(seed, scene.first_frame + index, image.size)
            _read_out(scene.frame(index).ravel(), words, levels, camera.shot, camera.background, image.ravel())
        yield images


@compiled
def _read_out(
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
