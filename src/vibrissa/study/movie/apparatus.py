"""The set-up of a virtual experiment, to be drawn, and what a perfect tracker would find in its movie."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.mechanics.scan.free_end import free_end_facts
from vibrissa.quantities import dataset
from vibrissa.study.movie.virtual import FilmLayout, Position
from vibrissa.video.camera.camera import exposure_times

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.scan.motion import PredictedMotion
    from vibrissa.study.spec.settings import Film

_BLOCK = 250  # frames reckoned at a time


def apparatus(prediction: PredictedMotion, film: Film, scene: FilmLayout) -> xr.Dataset:
    """Whisker, substrate and camera of a virtual experiment, seen along the edges of the grating.

    Parameters
    ----------
    prediction, film, scene
        The experiment, and how the whisker lies in the image.

    Returns
    -------
    Dataset
        ``shaft_x`` along the substrate from the contact towards the base and ``shaft_y`` above it (shaft), at rest,
        from the physical tip to the skin; ``field_x``, ``field_y`` (corner), the field of view; ``trough_start``,
        ``trough_width`` (trough): x_j, λ_j of the texture [m], or stretches of any surface below the middle of its
        heights; ``free_end_length``, ``jump_count``, ``jumps_allowed`` and its share, of the motion. Attributes:
        ``base_height`` H, ``base_distance`` D
        [m], ``base_angle`` [rad], ``speed`` [m/s], ``frame_rate`` [Hz], ``pixel_size``, ``depth`` [m].
    """
    start, width, depth = prediction.gaps
    flat, length, camera = prediction.response.flat, prediction.whisker.length, film.camera
    base_distance, base_height = (length * value for value in flat.base)
    along, up = flat.position(scene.s[scene.s <= 1])
    column, row = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])
    field_x, field_y = scene.unplace(
        (column * camera.width - 0.5) * camera.pixel_size, (row * camera.height - 0.5) * camera.pixel_size
    )
    return dataset(
        {
            "base_height": base_height,
            "base_distance": base_distance,
            "base_angle": prediction.posture.base_angle,
            "speed": prediction.scan.speed,
            "depth": depth,
            "frame_rate": camera.frame_rate,
            "pixel_size": camera.pixel_size,
        },
        shaft_x=length * along + base_distance,
        shaft_y=length * up + base_height,
        field_x=field_x + base_distance,
        field_y=field_y + base_height,
        trough_start=start,
        trough_width=width,
        **free_end_facts(prediction.free_end_length, prediction.allowed_jumps),
    )


def true_profile(position: Position, film: Film, scene: FilmLayout, arc_length: Array) -> xr.Dataset:
    """Where points of the shaft are in the image, averaged over each exposure.

    The shaft of the film does not stretch: exactly under the ``exact`` response, to first order in the motion under
    the ``linear`` one and in the vibration.

    Parameters
    ----------
    position : callable
        Times (T,) [s] and points s (S,) → positions from the base along the substrate and up, over L, (T, S) each.
    film, scene
        The camera, and how the whisker lies in the image.
    arc_length : (N,) array
        Distance of the points from the skin along the shaft [m], in ascending order.

    Returns
    -------
    Dataset
        ``x``, ``y`` (time, node) [m] in the image frame, ``arc_length`` (node).
    """
    times = exposure_times(film.camera, film.n_frames, film.subframes)
    points = np.concatenate([[1.0], 1 - arc_length / scene.length])  # what slips is reckoned from the base
    blocks = []
    for first in range(0, len(times), _BLOCK * film.subframes):
        t = times[first : first + _BLOCK * film.subframes]
        placed = np.stack(scene.place(*position(t, points)))[..., 1:]
        blocks.append(placed.reshape(2, -1, film.subframes, len(arc_length)).mean(axis=2))
    x, y = np.concatenate(blocks, axis=1)
    time = np.arange(film.n_frames) / film.camera.frame_rate
    return dataset({"frame": "image"}, time=time, x=x, y=y, arc_length=arc_length)
