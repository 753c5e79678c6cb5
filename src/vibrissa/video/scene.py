"""Checked whiskers before a camera, and the light that reaches its sensor in each frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrissa.errors import InputError
from vibrissa.video.camera import Camera, counted
from vibrissa.video.field import drift, empty_field, led_glow, lit_share
from vibrissa.video.scenery import Scenery
from vibrissa.video.transmission import FWHM, Canvas, compiled

__all__ = ["Scene"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """Checked curves [pixels]; the share of light they take and their variance across [pixels²]; the light."""

    x: Array
    y: Array
    opacity: Array
    variance: Array
    camera: Camera
    subframes: int
    scenery: Scenery
    first_frame: int
    field: Array
    glow: Array
    change: Array
    canvas: Canvas

    @classmethod
    def of(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        camera: Camera,
        subframes: int,
        contrast: ArrayLike | None,
        diameter: ArrayLike | None,
        scenery: Scenery | None,
        first_frame: int,
    ) -> Scene:
        """Check what :func:`vibrissa.video.rendering.expose` was given; draw what does not change."""
        columns, rows = (np.ascontiguousarray(v, float) / camera.pixel_size for v in (x, y))
        _check_curves(columns, rows, counted("subframes", subframes))
        whiskers, _, nodes = columns.shape
        taper = np.linspace(*camera.contrast, nodes) if contrast is None else contrast
        grey = _per_node("contrast", taper, (whiskers, nodes), camera.background)
        shaft = _per_node("diameter", 0.0 if diameter is None else diameter, (whiskers, nodes), np.inf)
        variance = (camera.blur / FWHM) ** 2 + (shaft / camera.pixel_size) ** 2 / 12
        scenery, start = scenery or Scenery(), counted("first_frame", first_frame, least=0)
        return cls(
            x=columns,
            y=rows,
            opacity=grey / camera.background,
            variance=variance,
            camera=camera,
            subframes=int(subframes),
            scenery=scenery,
            first_frame=start,
            field=empty_field(camera, scenery),
            glow=led_glow(camera, scenery.led),
            change=drift(scenery.light, (start + np.arange(columns.shape[1] // subframes)) / camera.frame_rate),
            canvas=Canvas(camera.height, camera.width),
        )

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return self.x.shape[1] // self.subframes

    def frame(self, index: int) -> Array:
        """Grey levels of one frame before noise and rounding."""
        instants = slice(index * self.subframes, (index + 1) * self.subframes)
        seen = self.canvas.transmitted(self.x[:, instants], self.y[:, instants], self.opacity, self.variance)
        led = self.scenery.led
        share = 0.0 if led is None else lit_share(self.camera, led, self.first_frame + index)
        image = np.empty_like(seen)
        _lit(self.field, self.change[:, index], seen, share, self.glow, image)
        return image


@compiled
def _lit(field: Array, change: Array, seen: Array, share: float, glow: Array, image: Array) -> None:
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
        raise InputError("x and y", rule, f"{x.shape} and {y.shape}")
    if x.shape[1] % subframes or not x.shape[1]:
        raise InputError("x and y", f"must hold a multiple of {subframes} instants (subframes)", x.shape[1])
    for name, values in (("x", x), ("y", y)):
        if not np.isfinite(values).all():
            where = "whisker {}, instant {}, node {}".format(*np.argwhere(~np.isfinite(values))[0])
            raise InputError(name, "must be finite", f"none at {where}", "render the part of the shaft that is known")


def _per_node(name: str, values: ArrayLike, shape: tuple[int, int], most: float) -> Array:
    array = np.asarray(values, float)
    if array.ndim and array.shape not in (shape[1:], (shape[0], 1), shape):
        raise InputError(name, f"must have the shape {shape[1:]}, {(shape[0], 1)} or {shape}", str(array.shape))
    if not np.all((array >= 0) & (array <= most) & np.isfinite(array)):
        rule = "must be finite, not negative" + (f", at most the background {most:g}" if most < np.inf else "")
        raise InputError(name, rule, f"{array.min():g}…{array.max():g}")
    return np.ascontiguousarray(np.broadcast_to(array, shape))
