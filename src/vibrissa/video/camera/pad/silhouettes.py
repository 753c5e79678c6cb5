"""Opaque bodies before the camera, drawn once and moved rigidly: the head with its fur, a paw, a pole."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import affine_transform, gaussian_filter, map_coordinates

from vibrissa.arrays import Array, Mask
from vibrissa.video.camera.pad.layout import half_width
from vibrissa.video.camera.pad.settings import WhiskingScene
from vibrissa.video.camera.transmission import FWHM, Canvas

FINER = 2  # points of a silhouette per pixel, so that moving it blurs it by little
_HAIR_NODES = 10
_FUR_LENGTH, _FUR_ANGLE, _FUR_SPREAD = 0.9e-3, np.deg2rad(50.0), 0.35  # mean [m]; from tailwards, and its SD [rad]
_LIP, _LIP_LENGTH, _LIP_ANGLE, _LIP_SPREAD = 14, 2.5e-3, np.deg2rad(125.0), 0.3  # small vibrissae of each side
_HAIR_OPACITY, _HAIR_CURVATURE = 0.35, 120.0  # at the root, on the centreline; SD [1/m]


class Pose(NamedTuple):
    """Where the zero of a body lies in the image, (2,) [m], and the direction of its x axis [rad]."""

    place: Array
    turn: float


class Silhouette(NamedTuple):
    """A body in its own frame: ``cover`` and ``passed`` (rows, columns), share hidden and share of light that passes.

    ``first`` (2,) [m] is the place (x, y) of its first point, ``step`` [m] the distance of its points.
    """

    cover: Array
    passed: Array
    first: Array
    step: float

    def seen(self, pose: Pose, shape: tuple[int, int], pixel_size: float) -> Array:
        """Share of the light that passes, in an image.

        Parameters
        ----------
        pose : Pose
            Where the body is.
        shape : (int, int)
            Height and width of the image [pixels].
        pixel_size : float
            Side of a pixel [m].

        Returns
        -------
        (height, width) array
            0 to 1.
        """
        cos, sin = np.cos(pose.turn), np.sin(pose.turn)
        scale = pixel_size / self.step
        matrix = scale * np.array([[cos, -sin], [sin, cos]])  # of (row, column)
        offset = self._index(-pose.place[0], -pose.place[1], cos, sin)
        return np.asarray(affine_transform(self.passed, matrix, offset, shape, order=1, mode="constant", cval=1.0))

    def covered(self, pose: Pose, x: Array, y: Array) -> Array:
        """Share of each place that the body hides.

        Parameters
        ----------
        pose : Pose
            Where the body is.
        x, y : (P,) arrays
            Places in the image [m].

        Returns
        -------
        (P,) array
            0 to 1.
        """
        at = self._index(x - pose.place[0], y - pose.place[1], np.cos(pose.turn), np.sin(pose.turn))
        return np.asarray(map_coordinates(self.cover, at, order=1, mode="constant", cval=0.0))

    def _index(self, x: Array, y: Array, cos: float, sin: float) -> Array:
        column = (cos * x + sin * y - self.first[0]) / self.step
        row = (cos * y - sin * x - self.first[1]) / self.step
        return np.stack([row, column])


def _silhouette(scene: WhiskingScene, inside: Mask, first: tuple[float, float], hairs: Array | float) -> Silhouette:
    """Body whose border the optics blur, and what passes between the hairs around it."""
    spread = FINER * scene.camera.blur / FWHM
    cover = gaussian_filter(inside.astype(np.float32), spread, mode="nearest")
    passed = ((1 - scene.head.opacity * cover) * hairs).astype(np.float32)
    return Silhouette(cover, passed, np.array(first), scene.camera.pixel_size / FINER)


def _grid(first: tuple[float, float], last: tuple[float, float], step: float) -> tuple[Array, Array]:
    """Return x (1, columns) and y (rows, 1) [m]."""
    x, y = (np.arange(low, high + step, step) for low, high in zip(first, last, strict=True))
    return x[None], y[:, None]


def head_silhouette(scene: WhiskingScene) -> Silhouette:
    """The head and its fur, in the frame ``head``.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.

    Returns
    -------
    Silhouette
        As long as the image's diagonal, so that it reaches its border.
    """
    camera, step = scene.camera, scene.camera.pixel_size / FINER
    long = float(np.hypot(camera.width, camera.height)) * camera.pixel_size
    wide = float(half_width(np.array(long))) + 6 * _FUR_LENGTH
    first = (-long, -wide)
    x, y = _grid(first, (5e-3, wide), step)
    inside = (np.abs(y) < half_width(-x)) & (x < 0)
    columns, rows, opacity = _hairs(scene, long)
    columns, rows = (columns - first[0]) / step, (rows - first[1]) / step
    spread = np.full(opacity.shape, (FINER * camera.blur / FWHM) ** 2)
    hairs = Canvas(*inside.shape).transmitted(columns[:, None], rows[:, None], opacity, spread)
    return _silhouette(scene, inside, first, hairs)


def _hairs(scene: WhiskingScene, long: float) -> tuple[Array, Array, Array]:
    """Return x, y [m] and opacity (hair, node) of fur and of small vibrissae beside the mouth, which do not whisk."""
    rng = np.random.default_rng([scene.seed, 5])
    fur, lip = rng.poisson(2 * scene.head.fur * long), 2 * _LIP if scene.head.fur else 0
    count = fur + lip
    kind = np.arange(count) >= fur
    behind = np.where(kind, rng.uniform(0.5e-3, 4e-3, count), rng.uniform(1e-3, long, count))
    length = rng.exponential(np.where(kind, _LIP_LENGTH, _FUR_LENGTH))
    angle = np.where(kind, _LIP_ANGLE, _FUR_ANGLE) + rng.standard_normal(count) * np.where(
        kind, _LIP_SPREAD, _FUR_SPREAD
    )
    side = rng.choice([-1.0, 1.0], count)
    along = length[:, None] * (np.arange(_HAIR_NODES - 1) + 0.5) / (_HAIR_NODES - 1)
    course = angle[:, None] + rng.normal(0, _HAIR_CURVATURE, (count, 1)) * along
    step = length[:, None] / (_HAIR_NODES - 1)
    x, y = (np.pad(np.cumsum(step * v, axis=1), ((0, 0), (1, 0))) for v in (-np.cos(course), np.sin(course)))
    opacity = np.broadcast_to(np.linspace(_HAIR_OPACITY, 0, _HAIR_NODES), x.shape)
    return x - behind[:, None], side[:, None] * (y + half_width(behind)[:, None]), np.ascontiguousarray(opacity)


def paw_silhouette(scene: WhiskingScene) -> Silhouette:
    """A forepaw: arm, palm and four digits that point along x.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.

    Returns
    -------
    Silhouette
        Zero in the middle of the palm.
    """
    first, last = (-22e-3, -8e-3), (10e-3, 8e-3)
    x, y = _grid(first, last, scene.camera.pixel_size / FINER)
    inside = _near_line(x, y, (-18e-3, 0.0), (0.0, 0.0), 2.6e-3)
    for angle in np.deg2rad([-42.0, -14.0, 14.0, 42.0]):
        tip = (6.5e-3 * np.cos(angle), 6.5e-3 * np.sin(angle))
        inside = inside | _near_line(x, y, (0.0, 0.0), tip, 0.7e-3)
    return _silhouette(scene, inside, first, 1.0)


def pole_silhouette(scene: WhiskingScene, radius: float) -> Silhouette:
    """A pole seen along its axis.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.
    radius : float
        Its radius [m].

    Returns
    -------
    Silhouette
        Zero in its middle.
    """
    edge = radius + 4 * scene.camera.blur * scene.camera.pixel_size
    x, y = _grid((-edge, -edge), (edge, edge), scene.camera.pixel_size / FINER)
    return _silhouette(scene, np.hypot(x, y) < radius, (-edge, -edge), 1.0)


def _near_line(x: Array, y: Array, start: tuple[float, float], end: tuple[float, float], radius: float) -> Mask:
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = np.clip(((x - start[0]) * dx + (y - start[1]) * dy) / (dx**2 + dy**2), 0, 1)
    return np.asarray(np.hypot(x - start[0] - along * dx, y - start[1] - along * dy) < radius)
