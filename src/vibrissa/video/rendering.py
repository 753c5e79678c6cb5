"""Movies of whiskers whose true centrelines are known, as a virtual high-speed camera takes them.

The image of a whisker is its centreline spread by a Gaussian across the line: a pixel darkens with the distance from
its centre to the nearest point of the centreline, whatever the line's direction. Where whiskers cross, what they
transmit multiplies. Dark whiskers stand on a bright field; exposure, noise and the eight bits come after.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.video.camera import Camera, Frames, counted, digitise, exposure_times, illumination, render_background

__all__ = ["Camera", "expose", "exposure_times", "illumination", "render", "render_background"]

Array = NDArray[np.float64]
Function = TypeVar("Function", bound=Callable[..., Any])

FWHM = 2 * np.sqrt(2 * np.log(2))  # of a Gaussian, over its standard deviation
REACH = 5.0  # standard deviations; beyond, a line of full contrast darkens by less than 1e-3 grey levels


def expose(
    x: ArrayLike,
    y: ArrayLike,
    camera: Camera,
    *,
    subframes: int = 1,
    contrast: ArrayLike | None = None,
    diameter: ArrayLike | None = None,
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
    contrast : float, (N,) or (W, N) array, optional
        Darkening on the centreline [grey levels at ``camera.background``]; by default it falls evenly, from node to
        node, from ``camera.contrast[0]`` to ``camera.contrast[1]``.
    diameter : float, (N,) or (W, N) array, optional
        Diameter of the shaft [m]. It widens the line's image, variances added: blur²/8 ln 2 + diameter²/12, the second
        that of a uniformly dark band. By default the whisker is infinitely thin.

    Returns
    -------
    (T, height, width) array
        Grey levels.

    Raises
    ------
    InputError
        If shapes disagree, a position is not finite, or a contrast or a diameter is out of range.
    """
    scene = _Scene.of(x, y, camera, subframes, contrast, diameter)
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
    first_frame: int = 0,
    block: int = 256,
) -> Iterator[Frames]:
    """Movie of moving whiskers, block by block.

    The noise is Gaussian, drawn for each frame from a generator keyed by (seed, frame): equal seeds give equal bytes,
    whatever the size of the blocks, and a movie made in pieces is the movie made at once.

    Parameters
    ----------
    x, y, camera, subframes, contrast, diameter
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
    scene = _Scene.of(x, y, camera, subframes, contrast, diameter)
    start = counted("first_frame", first_frame, least=0)
    return _blocks(scene, counted("seed", seed, least=0), start, counted("block", block))


def _blocks(scene: _Scene, seed: int, first_frame: int, block: int) -> Iterator[Frames]:
    camera = scene.camera
    for start in range(0, scene.n_frames, block):
        count = min(block, scene.n_frames - start)
        images = np.empty((count, camera.height, camera.width), np.uint8)
        for index in range(count):
            noise = _noise(camera, seed, first_frame + start + index)
            images[index] = digitise(scene.frame(start + index) + noise)
        yield images


def _noise(camera: Camera, seed: int, frame: int) -> NDArray[np.float32]:
    """One frame of noise [grey levels], the same for the same seed and frame."""
    generator = np.random.Generator(np.random.Philox(key=np.array([seed, frame], np.uint64)))
    return generator.standard_normal((camera.height, camera.width), np.float32) * np.float32(camera.noise)


@dataclass(frozen=True)
class _Scene:
    """Checked curves [pixels] with, per node, the share of light taken and the variance across the line [pixels²]."""

    x: Array
    y: Array
    opacity: Array
    variance: Array
    camera: Camera
    subframes: int
    light: Array

    @classmethod
    def of(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        camera: Camera,
        subframes: int,
        contrast: ArrayLike | None,
        diameter: ArrayLike | None,
    ) -> _Scene:
        columns, rows = (np.ascontiguousarray(v, float) / camera.pixel_size for v in (x, y))
        _check_curves(columns, rows, counted("subframes", subframes))
        whiskers, _, nodes = columns.shape
        taper = np.linspace(*camera.contrast, nodes) if contrast is None else contrast
        grey = _per_node("contrast", taper, (whiskers, nodes), camera.background)
        shaft = _per_node("diameter", 0.0 if diameter is None else diameter, (whiskers, nodes), np.inf)
        variance = (camera.blur / FWHM) ** 2 + (shaft / camera.pixel_size) ** 2 / 12
        return cls(columns, rows, grey / camera.background, variance, camera, int(subframes), illumination(camera))

    @property
    def n_frames(self) -> int:
        return self.x.shape[1] // self.subframes

    def frame(self, index: int) -> Array:
        """Grey levels of one frame before noise and rounding."""
        instants = slice(index * self.subframes, (index + 1) * self.subframes)
        seen = np.zeros_like(self.light)
        _transmitted(self.x[:, instants], self.y[:, instants], self.opacity, self.variance, seen)
        return self.light * seen


def _check_curves(x: Array, y: Array, subframes: int) -> None:
    if x.ndim != 3 or x.shape != y.shape or x.shape[2] < 2:
        rule = "must both have the shape (whisker, instant, node), with 2 nodes or more"
        raise InputError("x and y", rule, f"{x.shape} and {y.shape}")
    if x.shape[1] % subframes or not x.shape[1]:
        raise InputError("x and y", f"must hold a multiple of {subframes} instants (subframes)", x.shape[1])
    for name, values in (("x", x), ("y", y)):
        if not np.isfinite(values).all():
            where = "whisker {}, instant {}, node {}".format(*np.argwhere(~np.isfinite(values))[0])
            raise InputError(name, "must be finite", f"none at {where}", "render the part of the shaft that is known")


def _per_node(name: str, values: ArrayLike, shape: tuple[int, int], most: float) -> Array:
    array = np.asarray(values, float)
    if array.ndim and array.shape not in (shape[1:], shape):
        raise InputError(name, f"must have the shape {shape[1:]} or {shape}", str(array.shape))
    if not np.all((array >= 0) & (array <= most) & np.isfinite(array)):
        rule = "must be finite, not negative" + (f", at most the background {most:g}" if most < np.inf else "")
        raise InputError(name, rule, f"{array.min():g}…{array.max():g}")
    return np.ascontiguousarray(np.broadcast_to(array, shape))


def _compiled(function: Function) -> Function:
    """Machine code on first use, kept on disk; the static type stays that of the function."""
    return cast(Function, njit(cache=True)(function))


@_compiled
def _transmitted(x: Array, y: Array, opacity: Array, variance: Array, seen: Array) -> None:
    """Add to ``seen`` (height, width) the share of the light that passes all whiskers, averaged over the instants."""
    whiskers, instants, _ = x.shape
    squared = np.full(seen.shape, np.inf)
    place = np.zeros(seen.shape)
    light = np.empty(seen.shape)
    for instant in range(instants):
        light[:] = 1.0
        for whisker in range(whiskers):
            reach = REACH * np.sqrt(variance[whisker].max())
            _nearest_point(x[whisker, instant], y[whisker, instant], reach, squared, place)
            _darken(squared, place, opacity[whisker], variance[whisker], light)
        seen += light / instants


@_compiled
def _nearest_point(x: Array, y: Array, reach: float, squared: Array, place: Array) -> None:
    """Squared distance [pixels²] from pixel centres to a polyline, and the node (with fraction) where it is."""
    height, width = squared.shape
    for k in range(x.size - 1):
        dx, dy = x[k + 1] - x[k], y[k + 1] - y[k]
        step = dx * dx + dy * dy
        top, bottom = max(0.0, min(y[k], y[k + 1]) - reach), min(height - 1.0, max(y[k], y[k + 1]) + reach)
        left, right = max(0.0, min(x[k], x[k + 1]) - reach), min(width - 1.0, max(x[k], x[k + 1]) + reach)
        for row in range(int(np.ceil(top)), int(np.floor(bottom)) + 1):
            for column in range(int(np.ceil(left)), int(np.floor(right)) + 1):
                along = ((column - x[k]) * dx + (row - y[k]) * dy) / step if step > 0 else 0.0
                u = min(1.0, max(0.0, along))
                distance = (column - x[k] - u * dx) ** 2 + (row - y[k] - u * dy) ** 2
                if distance < squared[row, column]:
                    squared[row, column] = distance
                    place[row, column] = k + u


@_compiled
def _darken(squared: Array, place: Array, opacity: Array, variance: Array, light: Array) -> None:
    """Light times what a whisker transmits, 1 − opacity·exp(−distance²/2·variance); forgets the distances."""
    last = opacity.size - 2
    for row in range(squared.shape[0]):
        for column in range(squared.shape[1]):
            if squared[row, column] < np.inf:
                k = min(int(place[row, column]), last)
                u = place[row, column] - k
                taken = opacity[k] * (1 - u) + opacity[k + 1] * u
                spread = variance[k] * (1 - u) + variance[k + 1] * u
                light[row, column] *= 1 - taken * np.exp(-squared[row, column] / (2 * spread))
                squared[row, column] = np.inf
