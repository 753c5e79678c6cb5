"""Centrelines of all whiskers at any instants, bent at the pole where they touch it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Mask
from vibrissa.video.camera.pad.layout import Whiskers, draw_whiskers
from vibrissa.video.camera.pad.motion import HeadPath, head_path, whisker_angles
from vibrissa.video.camera.pad.settings import FilmedPole, WhiskingScene

UNROLL = 0.4  # share of the curvature in the image's plane lost per radian of protraction: the shaft rolls about itself
SLIPS = np.deg2rad(40.0)  # turn of the tip at which a whisker slips off the pole
_HALVINGS = 24  # of the tip's turn: to 40°/2²⁴


class Curves(NamedTuple):
    """Centrelines x, y (W, T, N) [m] in the image, base to tip; base angle (W, T) [rad]; contact (W, T); the head."""

    x: Array
    y: Array
    angle: Array
    touching: Mask
    head: HeadPath


def scene_curves(scene: WhiskingScene, time: Array) -> Curves:
    """Centrelines of a scene.

    Parameters
    ----------
    scene : WhiskingScene
        The scene.
    time : (T,) array
        Instants [s], ascending.

    Returns
    -------
    Curves
        At these instants; the angle is that from tailwards, protraction positive, of the shaft at its base.
    """
    whiskers, head = draw_whiskers(scene), head_path(scene, time)
    angle = whisker_angles(scene, whiskers, time)
    bend = whiskers.bend[:, None] * (1 - UNROLL * (angle - whiskers.rest[:, None]).clip(-1, 1))[..., None]
    course = angle[..., None] + bend
    x, y = _placed(whiskers, course, head)
    touching = np.zeros(angle.shape, bool)
    if scene.pole is not None:
        for who in scene.pole.touched_by:
            touching[who] = _touch(scene.pole, whiskers, who, course, head, x, y)
    return Curves(x, y, angle, touching, head)


def _placed(whiskers: Whiskers, course: Array, head: HeadPath) -> tuple[Array, Array]:
    """Points in the image of whiskers whose shaft has the direction ``course`` (W, T, N) from tailwards."""
    step = (whiskers.length / (course.shape[-1] - 1))[:, None, None]
    middle = (course[..., 1:] + course[..., :-1]) / 2
    forward = np.cumsum(-np.cos(middle) * step, axis=-1)
    sideward = np.cumsum(np.sin(middle) * step, axis=-1) * whiskers.side[:, None, None]
    forward, sideward = (np.concatenate([np.zeros_like(v[..., :1]), v], axis=-1) for v in (forward, sideward))
    forward, sideward = forward + whiskers.base[:, 0, None, None], sideward + whiskers.base[:, 1, None, None]
    cos, sin = np.cos(head.heading)[:, None], np.sin(head.heading)[:, None]
    x = head.nose[:, 0, None] + cos * forward - sin * sideward
    y = head.nose[:, 1, None] + sin * forward + cos * sideward
    return x, y


def _touch(pole: FilmedPole, whiskers: Whiskers, who: int, course: Array, head: HeadPath, x: Array, y: Array) -> Mask:
    """Bend one whisker where it would pass through the pole, in ``x`` and ``y``; say when it touches.

    The shaft turns back as a uniform cantilever does that is loaded where it meets the pole, 2σ − σ² of the turn there,
    as much as keeps the pole's border at its surface; the end beyond turns with it. Where the turn would be more than
    ``SLIPS`` it has slipped off, and is free.
    """
    one = Whiskers(*(values[who : who + 1] for values in whiskers))
    side = float(one.side[0])
    inside, at = _beyond(pole, x[who], y[who], side)
    hit = np.flatnonzero(inside)
    some = HeadPath(head.nose[hit], head.heading[hit])
    free, load = course[who, hit], at[hit]
    sigma = np.minimum(np.arange(course.shape[-1]) / np.maximum(load, 1)[:, None], 1.0)
    low, high = np.zeros(hit.size), np.full(hit.size, SLIPS)
    for _ in range(_HALVINGS):
        turn = (low + high) / 2
        px, py = _placed(one, (free - turn[:, None] * (2 * sigma - sigma**2))[None], some)
        still, _ = _beyond(pole, px[0], py[0], side)
        low, high = np.where(still, turn, low), np.where(still, high, turn)
    px, py = _placed(one, (free - high[:, None] * (2 * sigma - sigma**2))[None], some)
    held = high < SLIPS * (1 - 1e-3)
    x[who, hit[held]], y[who, hit[held]] = px[0][held], py[0][held]
    touching = np.zeros(x.shape[1], bool)
    touching[hit[held]] = True
    return touching


def _beyond(pole: FilmedPole, x: Array, y: Array, side: float) -> tuple[Mask, NDArray[np.intp]]:
    """Whether each shaft (T, N) has the pole's border or all of it on its rear side, and the node beside the pole."""
    dx, dy = pole.position[0] - x, pole.position[1] - y
    squared = dx**2 + dy**2
    at = squared.argmin(axis=1)
    instant = np.arange(len(x))
    tangent_x, tangent_y = np.gradient(x, axis=1)[instant, at], np.gradient(y, axis=1)[instant, at]
    length = np.hypot(tangent_x, tangent_y)
    off_x, off_y = dx[instant, at], dy[instant, at]
    # protraction turns the shaft of the right side against the sense from x to y, that of the left side with it
    ahead = -side * (tangent_x * off_y - tangent_y * off_x) / length
    past_tip = (at == x.shape[1] - 1) & (tangent_x * off_x + tangent_y * off_y > pole.radius * length)
    return (ahead < pole.radius) & ~past_tip & (at > x.shape[1] // 8), at
