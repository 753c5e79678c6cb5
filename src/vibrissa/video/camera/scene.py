"""Checked whiskers before a camera, and the light that reaches its sensor in each frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, FormatError, RangeError, ShapeError
from vibrissa.loops import njit
from vibrissa.video.camera.camera import Camera, counted
from vibrissa.video.camera.field import drift, empty_field, led_glow, lit_share
from vibrissa.video.camera.scenery import Scenery
from vibrissa.video.camera.transmission import FWHM, Canvas


class RenderedScene:
    """Whiskers in front of the light: curves [pixels], their opacity and variance across, and what does not change.

    Parameters
    ----------
    x, y, camera, subframes, contrast, diameter, scenery, first_frame
        As in :func:`vibrissa.video.camera.rendering.expose`.

    Raises
    ------
    InputError
        If shapes disagree, a position is not finite, or a contrast or a diameter is out of range.
    """

    def __init__(
        self,
        x: ArrayLike,
        y: ArrayLike,
        camera: Camera,
        subframes: int,
        contrast: ArrayLike | None,
        diameter: ArrayLike | None,
        scenery: Scenery | None,
        first_frame: int,
    ) -> None:
        self.x, self.y = (np.ascontiguousarray(v, float) / camera.pixel_size for v in (x, y))
        self.camera, self.subframes = camera, counted("subframes", subframes)
        _check_curves(self.x, self.y, self.subframes)
        whiskers, _, nodes = self.x.shape
        taper = np.linspace(*camera.contrast, nodes) if contrast is None else contrast
        grey = _per_node("contrast", taper, (whiskers, nodes), camera.background)
        shaft = _per_node("diameter", 0.0 if diameter is None else diameter, (whiskers, nodes), np.inf)
        self.opacity = grey / camera.background
        self.variance = (camera.blur / FWHM) ** 2 + (shaft / camera.pixel_size) ** 2 / 12
        self.scenery, self.first_frame = scenery or Scenery(), counted("first_frame", first_frame, least=0)
        self.field, self.glow = empty_field(camera, self.scenery), led_glow(camera, self.scenery.led)
        time = (self.first_frame + np.arange(self.n_frames)) / camera.frame_rate
        self.change = drift(self.scenery.light, time)
        self.canvas = Canvas(camera.height, camera.width)

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return self.x.shape[1] // self.subframes

    def frame(self, index: int) -> Array:
        """Grey levels of one frame before noise and rounding.

        Parameters
        ----------
        index : int
            Its number among those of the scene, from 0.

        Returns
        -------
        (height, width) array
            Grey levels.
        """
        instants = slice(index * self.subframes, (index + 1) * self.subframes)
        seen = self.canvas.transmitted(self.x[:, instants], self.y[:, instants], self.opacity, self.variance)
        led = self.scenery.led
        share = 0.0 if led is None else lit_share(self.camera, led, self.first_frame + index)
        image = np.empty_like(seen)
        lit(self.field, self.change[:, index], seen, share, self.glow, image)
        return image


@njit(cache=True, nogil=True)
def lit(field: Array, change: Array, seen: Array, share: float, glow: Array, image: Array) -> None:
    """Steady light times its drift, 1 + g₀ + g₁X + g₂Y, times what the whiskers let pass; and the LED's light."""
    height, width = image.shape
    x, y = 2 / max(width - 1, 1), 2 / max(height - 1, 1)
    for row in range(height):
        level = 1 + change[0] + change[2] * (y * row - 1)
        for column in range(width):
            image[row, column] = field[row, column] * seen[row, column] * (level + change[1] * (x * column - 1))
        if share > 0:
            for column in range(width):
                image[row, column] += share * glow[row, column]


def _check_curves(x: Array, y: Array, subframes: int) -> None:
    if x.ndim != 3 or x.shape != y.shape or x.shape[2] < 2:
        rule = "must both have the shape (whisker, instant, node), with 2 nodes or more"
        raise ConflictError("x and y", rule, f"{x.shape} and {y.shape}")
    if x.shape[1] % subframes or not x.shape[1]:
        raise FormatError("x and y", f"must hold a multiple of {subframes} instants (subframes)", x.shape[1])
    for name, values in (("x", x), ("y", y)):
        if not np.isfinite(values).all():
            where = "whisker {}, instant {}, node {}".format(*np.argwhere(~np.isfinite(values))[0])
            raise RangeError(name, "must be finite", f"none at {where}", "render the part of the shaft that is known")


def _per_node(name: str, values: ArrayLike, shape: tuple[int, int], most: float) -> Array:
    array = np.asarray(values, float)
    if array.ndim and array.shape not in (shape[1:], (shape[0], 1), shape):
        raise ShapeError(name, f"must have the shape {shape[1:]}, {(shape[0], 1)} or {shape}", str(array.shape))
    if not np.all((array >= 0) & (array <= most) & np.isfinite(array)):
        rule = "must be finite, not negative" + (f", at most the background {most:g}" if most < np.inf else "")
        raise ConflictError(name, rule, f"{array.min():g}…{array.max():g}")
    return np.ascontiguousarray(np.broadcast_to(array, shape))
