"""The whiskers of the pads: where on the head each one is, its length, diameter, curvature and resting direction.

The frame ``head`` is fixed to the head: x forward, zero at the tip of the nose, y to the right side, [m].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.video.camera.pad.settings import SIDES, WhiskingScene
from vibrissa.whisker import atlas_curvature, atlas_whisker
from vibrissa.whisker.measured import atlas_entry

NODES = 96
_ELEVATION = np.deg2rad([45.0, 22.0, 0.0, -20.0, -40.0])  # of rows A to E out of the plane of the image
_FLAT = (0.4, 0.75, 1.0, 0.9, 0.6)  # share of the intrinsic curvature that lies in that plane, by row
_COLUMNS_APART, _LAST_COLUMN = 2.1e-3, 4e-3  # along the snout; behind the nose, of column 4 [m]
_BOW = 0.6e-3  # by which the columns of the outer rows lie farther forward [m]
_REST, _PER_COLUMN, _PER_ROW = (np.deg2rad(one) for one in (66.0, 14.0, -5.0))  # direction from tailwards
_SPREAD = np.deg2rad(3.0)  # of the individuals' directions


class Whiskers(NamedTuple):
    """Whiskers as the camera projects them, W of them.

    ``base`` (W, 2) [m] in the frame ``head``; ``side`` (W,) −1 left, 1 right; ``column`` (W,) on the pad; ``rest`` (W,)
    [rad] direction from tailwards, protraction positive; ``length`` (W,) [m]; ``diameter`` (W, N) [m]; ``bend`` (W, N)
    [rad] by which the free shaft has turned forward at each node, evenly spaced from base to tip; ``gain`` (W,).
    """

    base: Array
    side: Array
    column: Array
    rest: Array
    length: Array
    diameter: Array
    bend: Array
    gain: Array


def half_width(behind: Array) -> Array:
    """Half the width of the head seen from above.

    Parameters
    ----------
    behind : array
        Distance behind the tip of the nose [m].

    Returns
    -------
    array
        [m]; 0 before the nose.
    """
    behind = np.maximum(behind, 0.0)
    nose = 2.2e-3 * np.sqrt(np.minimum(behind / 1.2e-3, 1))
    return nose + 6.5e-3 * (1 - np.exp(-((behind / 6e-3) ** 1.5))) + 0.12 * behind


def draw_whiskers(scene: WhiskingScene) -> Whiskers:
    """Whiskers of a scene, whose individual differences follow from its seed.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.

    Returns
    -------
    Whiskers
        Side after side, in the order of ``scene.names``.
    """
    rng = np.random.default_rng([scene.seed, 1])
    each = [_one(name, side, scene, rng) for side in scene.sides for name in scene.names]
    return Whiskers(*(np.array(values) for values in zip(*each, strict=True)))


def _one(name: str, side: str, scene: WhiskingScene, rng: np.random.Generator) -> Whiskers:
    entry, whisker = atlas_entry(name), atlas_whisker(name)
    row = entry.row - 1 + (0.5 if entry.column == 0 else 0.0)  # the Greek arc lies between the rows
    elevation = float(np.interp(row, np.arange(5), _ELEVATION))
    jitter = rng.standard_normal(5)
    behind = _LAST_COLUMN + _COLUMNS_APART * (4 - entry.column) - _BOW * (row / 2 - 1) ** 2 + 2e-4 * jitter[0]
    away = half_width(np.array(behind)) * (0.7 + 0.27 * np.cos(elevation))
    rest = _REST + _PER_COLUMN * entry.column + _PER_ROW * (row - 2) + _SPREAD * jitter[1]
    scale = 1 + 0.08 * jitter[2]  # of the individual against the atlas
    shaft = whisker.length * (1 - whisker.tip)
    along = np.linspace(0, shaft, NODES)
    curvature = atlas_curvature(name, whisker).at(along) * np.interp(row, np.arange(5), _FLAT) * (1 + 0.15 * jitter[3])
    bend = np.concatenate([[0.0], np.cumsum((curvature[1:] + curvature[:-1]) / 2 * np.diff(along))])
    return Whiskers(
        base=np.array([-behind, SIDES[side] * away]),
        side=np.array(SIDES[side]),
        column=np.array(float(entry.column)),
        rest=np.array(rest),
        length=np.array(shaft * scale * np.cos(elevation)),
        diameter=2 * whisker.cone_angle * (whisker.length - along) * scale,
        bend=bend,
        gain=np.array(1 + scene.whisks.individual * jitter[4]),
    )
