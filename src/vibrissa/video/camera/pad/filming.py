"""Movies of whisking scenes, block by block."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import erf

from vibrissa.arrays import Array
from vibrissa.video.camera.camera import Frames, counted, exposure_times
from vibrissa.video.camera.field import drift, empty_field
from vibrissa.video.camera.noise import gaussian_levels, noise_words
from vibrissa.video.camera.pad.bodies import Bodies, scene_bodies
from vibrissa.video.camera.pad.curves import Curves, scene_curves
from vibrissa.video.camera.pad.layout import draw_whiskers
from vibrissa.video.camera.pad.settings import WhiskingScene
from vibrissa.video.camera.rendering import read_out
from vibrissa.video.camera.scene import lit
from vibrissa.video.camera.scenery import Scenery
from vibrissa.video.camera.transmission import FWHM, Canvas

SUBFRAMES = 4  # instants of an exposure
FLOOR = 0.12  # light of the dark floor behind lit whiskers, over that of a lit body


def shaft_image(scene: WhiskingScene) -> tuple[Array, Array]:
    """How the shafts look across: share of the light on the centreline, and variance of the Gaussian.

    A dark band of width d, blurred by a Gaussian of standard deviation σ, takes the share erf(d/√8σ) on its middle and
    has the variance σ² + d²/12.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.

    Returns
    -------
    opacity : (W, N) array
        0 to 1.
    variance : (W, N) array
        [pixels²]
    """
    diameter = draw_whiskers(scene).diameter / scene.camera.pixel_size
    blur = scene.camera.blur / FWHM
    return scene.hair_opacity * erf(diameter / (np.sqrt(8) * blur)), blur**2 + diameter**2 / 12


def film(scene: WhiskingScene, n_frames: int, *, block: int = 50) -> Iterator[Frames]:
    """Film a whisking scene.

    Whiskers are averaged over the exposure; bodies and fur are drawn as they are in its middle. Noise is as in
    :func:`vibrissa.video.camera.rendering.render`.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.
    n_frames : int
        Number of frames.
    block : int
        Frames per block; the last may be shorter.

    Yields
    ------
    (block, height, width) array
        Eight-bit grey levels.

    Raises
    ------
    InputError
        If a number is not a whole one, at least 1.
    """
    camera, step = scene.camera, counted("block", block)
    time = exposure_times(camera, n_frames, SUBFRAMES)
    curves, middle = scene_curves(scene, time), scene_curves(scene, exposure_times(camera, n_frames))
    room, bodies, change = (
        _Room(scene),
        scene_bodies(scene),
        drift(scene.light, np.arange(n_frames) / camera.frame_rate),
    )
    levels = gaussian_levels() * np.float32(camera.noise)
    for start in range(0, n_frames, step):
        images = np.empty((min(step, n_frames - start), camera.height, camera.width), np.uint8)
        for index, image in enumerate(images, start):
            light = room.light(curves, middle, bodies, change[:, index], index)
            words = noise_words(scene.seed, index, image.size)
            read_out(light.ravel(), words, levels, camera.shot, camera.background, image.ravel())
        yield images


class _Room:
    """What does not change from frame to frame, and where the frames are drawn."""

    def __init__(self, scene: WhiskingScene) -> None:
        self.scene = scene
        self.opacity, self.variance = shaft_image(scene)
        self.field = empty_field(scene.camera, Scenery(light=scene.light))
        self.canvas = Canvas(scene.camera.height, scene.camera.width)
        self.glow, self.image = np.zeros_like(self.field), np.empty_like(self.field)

    def light(self, curves: Curves, middle: Curves, bodies: Bodies, change: Array, index: int) -> Array:
        """Grey levels of one frame before noise and rounding."""
        camera = self.scene.camera
        part = slice(index * SUBFRAMES, (index + 1) * SUBFRAMES)
        x, y = (np.ascontiguousarray(one[:, part] / camera.pixel_size) for one in (curves.x, curves.y))
        seen = self.canvas.transmitted(x, y, self.opacity, self.variance)
        poses = bodies.poses(middle.head, index, index / camera.frame_rate)
        shown = [bodies.shapes[name].seen(pose, seen.shape, camera.pixel_size) for name, pose in poses.items()]
        seen *= np.minimum.reduce(shown)
        if self.scene.polarity == "bright":
            seen = 1 - (1 - FLOOR) * seen
        lit(self.field, change, seen, 0.0, self.glow, self.image)
        return self.image
