"""The truth of a whisking scene: where every whisker is in every frame, and which part of it can be seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.quantities import dataset
from vibrissa.video.camera.camera import exposure_times
from vibrissa.video.camera.field import empty_field
from vibrissa.video.camera.pad.bodies import Bodies, scene_bodies
from vibrissa.video.camera.pad.curves import Curves, scene_curves
from vibrissa.video.camera.pad.filming import FLOOR, shaft_image
from vibrissa.video.camera.pad.layout import NODES, draw_whiskers
from vibrissa.video.camera.pad.settings import WhiskingScene
from vibrissa.video.camera.scenery import Scenery
from vibrissa.video.camera.transmission import FWHM

if TYPE_CHECKING:
    import xarray as xr

LEAST = 3  # points of a visible run below which it is left out


class SceneTruth(NamedTuple):
    """``segments``: visible lines with the number of their whisker; ``profile``: all whiskers, hidden parts too."""

    segments: xr.Dataset
    profile: xr.Dataset


def scene_truth(scene: WhiskingScene, n_frames: int, *, least_contrast: float | None = None) -> SceneTruth:
    """Truth of a scene, in the middle of each exposure.

    A point is visible inside the image, where no body hides more than half of it, and where the line's depth is at
    least ``least_contrast``: a shaft ends in a tip that no camera shows. The depth is that of a whisker at rest; motion
    makes it less. Fur does not hide.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.
    n_frames : int
        Number of frames.
    least_contrast : float, optional
        [grey levels]; by default the standard deviation of a pixel's noise.

    Returns
    -------
    SceneTruth
        Segments, a whisker has several in a frame where something hides its middle; and the profile: ``x``, ``y``,
        ``node_visible`` (whisker, time, node), ``arc_length`` (whisker, node), ``whisker_angle`` and ``touching``
        (whisker, time). The attribute ``whiskers`` names them.
    """
    least = scene.camera.noise if least_contrast is None else least_contrast
    time = exposure_times(scene.camera, n_frames)
    curves, bodies = scene_curves(scene, time), scene_bodies(scene)
    opacity, variance = shaft_image(scene)
    depth = _depth(scene, curves, opacity)
    visible = _visible(scene, curves, bodies, time) & (depth >= least)
    names = ", ".join(f"{side} {name}" for side in scene.sides for name in scene.names)
    attrs: dict[str, Any] = {"frames": n_frames, "width": scene.camera.width, "height": scene.camera.height}
    attrs |= {"source": f"whisking scene of seed {scene.seed}", "whiskers": names}
    profile = dataset(
        attrs | {"pixel_size": scene.camera.pixel_size},
        lead=("whisker",),
        time=time,
        whisker=np.arange(scene.n_whiskers),
        x=curves.x,
        y=curves.y,
        arc_length=np.linspace(0, 1, NODES) * draw_whiskers(scene).length[:, None],
        whisker_angle=curves.angle,
        touching=curves.touching,
        node_visible=visible,
    )
    return SceneTruth(_segments(scene, curves, visible, depth, variance, attrs), profile)


def _depth(scene: WhiskingScene, curves: Curves, opacity: Array) -> Array:
    """Depth of the lines (W, T, N) [grey levels], by the steady light where they are."""
    camera = scene.camera
    light = empty_field(camera, Scenery(light=scene.light))
    column, row = (
        np.rint(v / camera.pixel_size).astype(int).clip(0, size - 1)
        for v, size in ((curves.x, camera.width), (curves.y, camera.height))
    )
    return np.asarray(light[row, column] * opacity[:, None] * (1 - FLOOR if scene.polarity == "bright" else 1.0))


def _visible(scene: WhiskingScene, curves: Curves, bodies: Bodies, time: Array) -> Mask:
    """Nodes (W, T, N) inside the image that no body hides."""
    camera = scene.camera
    right, bottom = (camera.width - 0.5) * camera.pixel_size, (camera.height - 0.5) * camera.pixel_size
    edge = -0.5 * camera.pixel_size
    visible = (curves.x > edge) & (curves.x < right) & (curves.y > edge) & (curves.y < bottom)
    for index, instant in enumerate(time):
        x, y = curves.x[:, index], curves.y[:, index]
        for name, pose in bodies.poses(curves.head, index, float(instant)).items():
            covered = bodies.shapes[name].covered(pose, x.ravel(), y.ravel())
            visible[:, index] &= (covered <= 0.5).reshape(x.shape)
    return visible


def _segments(
    scene: WhiskingScene, curves: Curves, visible: Mask, depth: Array, variance: Array, attrs: dict[str, Any]
) -> xr.Dataset:
    """Visible runs of the whiskers, about a pixel from point to point."""
    size, frame, who, parts = [], [], [], []
    pixels = draw_whiskers(scene).length / scene.camera.pixel_size
    for index in range(curves.x.shape[1]):
        for whisker in range(curves.x.shape[0]):
            at = np.linspace(0, NODES - 1, int(np.ceil(pixels[whisker])) + 1)
            for run in _runs(visible[whisker, index][np.rint(at).astype(int)]):
                shown = at[run]
                values = [curves.x[whisker, index] / scene.camera.pixel_size, depth[whisker, index]]
                values += [curves.y[whisker, index] / scene.camera.pixel_size, FWHM * np.sqrt(variance[whisker])]
                parts.append(np.array([np.interp(shown, np.arange(NODES), one) for one in values]))
                size.append(shown.size)
                frame.append(index)
                who.append(whisker)
    column, contrast, row, width = np.concatenate(parts, axis=1) if parts else np.empty((4, 0))
    return dataset(
        attrs,
        segment_frame=np.array(frame, int),
        segment_start=np.concatenate([[0], np.cumsum(size, dtype=int)[:-1]]) if size else np.empty(0, int),
        segment_whisker=np.array(who, int),
        column=column,
        row=row,
        line_width=width,
        line_contrast=contrast,
        position_sd=np.zeros(column.size),
    )


def _runs(shown: Mask) -> list[slice]:
    """Runs of points that are seen, long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], shown.astype(int), [0]])))
    return [slice(a, b) for a, b in edges.reshape(-1, 2) if b - a >= LEAST]
