"""Which bodies are in a scene, and where each of them is at each instant."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.video.camera.pad.motion import HeadPath
from vibrissa.video.camera.pad.settings import SIDES, Paw, WhiskingScene
from vibrissa.video.camera.pad.silhouettes import Pose, Silhouette, head_silhouette, paw_silhouette, pole_silhouette

_PAW_FROM, _PAW_TO = np.array([-26e-3, 1e-3]), np.array([-5e-3, 19e-3])  # in the frame ``head``, of the right side [m]


class Bodies(NamedTuple):
    """Silhouettes of a scene by name."""

    scene: WhiskingScene
    shapes: dict[str, Silhouette]

    def poses(self, head: HeadPath, index: int, time: float) -> dict[str, Pose]:
        """Where each body is that may be seen.

        Parameters
        ----------
        head : HeadPath
            The head's path.
        index : int
            Its instant.
        time : float
            That instant [s].

        Returns
        -------
        dict of Pose
            By the name of the body.
        """
        nose, heading = head.nose[index], float(head.heading[index])
        found = {"head": Pose(nose, heading)}
        paw, pole = self.scene.paw, self.scene.pole
        if paw is not None and paw.start < time < paw.stop:
            found["paw"] = _paw_pose(paw, nose, heading, time)
        if pole is not None:
            found["pole"] = Pose(np.array(pole.position), 0.0)
        return found


def scene_bodies(scene: WhiskingScene) -> Bodies:
    """Draw the bodies of a scene.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.

    Returns
    -------
    Bodies
        Head, and paw and pole if there are any.
    """
    shapes = {"head": head_silhouette(scene)}
    if scene.paw is not None:
        shapes["paw"] = paw_silhouette(scene)
    if scene.pole is not None:
        shapes["pole"] = pole_silhouette(scene, scene.pole.radius)
    return Bodies(scene, shapes)


def _paw_pose(paw: Paw, nose: Array, heading: float, time: float) -> Pose:
    """From below the head over the whiskers and back, as the square of a sine."""
    out = np.sin(np.pi * (time - paw.start) / (paw.stop - paw.start)) ** 2
    mirror = np.array([1.0, SIDES[paw.side]])
    way, place = (_PAW_TO - _PAW_FROM) * mirror, (_PAW_FROM + out * (_PAW_TO - _PAW_FROM)) * mirror
    cos, sin = np.cos(heading), np.sin(heading)
    at = nose + np.array([cos * place[0] - sin * place[1], sin * place[0] + cos * place[1]])
    return Pose(at, heading + float(np.arctan2(way[1], way[0])))
