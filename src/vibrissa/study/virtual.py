"""The virtual laboratory: a predicted motion, filmed; a simulated unit, recorded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.exact import cone_modes
from vibrissa.mechanics.profile import stationary_profile
from vibrissa.mechanics.superposition import Prediction, predict
from vibrissa.neural.virtual import simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.settings import Film, Study, UnitRecording
from vibrissa.texture.surface import random_grating
from vibrissa.video.camera import exposure_times
from vibrissa.video.rendering import render

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

_CHUNK = 250  # frames rendered at a time, so that memory does not grow with the movie
_FOLLICLE = 1.5e-3  # [m] of shaft seen below the skin: a blunt end there would bend the centreline of the base


def predicted_motion(study: Study) -> Prediction:
    """Prediction for the study's whisker, posture, texture and scan; the film needs them all."""
    if study.whisker is None or study.posture is None or study.texture is None or study.scan is None:
        raise ValueError("a prediction needs whisker, posture, texture and scan")
    grating = study.texture
    texture = random_grating(
        grating.length,
        rng=np.random.default_rng(grating.seed),
        reading=grating.reading,
        mean_period=grating.mean_period,
        depth=grating.depth,
    )
    return predict(study.whisker, study.posture, texture, study.scan)


@dataclass(frozen=True)
class Scene:
    """How the whisker lies in the image: turned so that its chord runs along the rows, the base on the left.

    Attributes
    ----------
    s : (N,) array
        Points of the shaft at most a pixel apart, from inside the follicle (above 1) to the physical tip.
    x, y : (N,) arrays
        Stationary profile in the image frame [m]; straight beyond the contact and inside the follicle.
    angle : (N,) array
        Angle θ to the substrate [rad].
    normal_x, normal_y : (N,) arrays
        The normal n = (−sin θ, cos θ) of the substrate's frame, in the image frame (y down).
    """

    s: Array
    x: Array
    y: Array
    angle: Array
    normal_x: Array
    normal_y: Array

    @property
    def skin(self) -> tuple[float, float]:
        """Where the shaft leaves the skin, s = 1 [m]."""
        base = int(np.argmin(np.abs(self.s - 1)))
        return float(self.x[base]), float(self.y[base])

    @property
    def tangent_x(self) -> Array:
        """The tangent t = (cos θ, sin θ), towards the base, in the image frame."""
        return -self.normal_y

    @property
    def tangent_y(self) -> Array:
        """Its other component."""
        return self.normal_x


def lay_out(prediction: Prediction, film: Film) -> Scene:
    """Place the stationary profile in the middle of the virtual camera's image."""
    whisker, posture, camera = prediction.whisker, prediction.posture, film.camera
    count = int(np.ceil((1 - whisker.tip) * whisker.length / camera.pixel_size)) + 1
    outside, step = np.linspace(1, whisker.tip, count, retstep=True)
    inside = np.arange(1 - step, 1 + _FOLLICLE / whisker.length, -step)[::-1]
    s = np.concatenate([inside, outside])
    profile = stationary_profile(posture, np.clip(s, posture.contact, 1))
    angle, straight = profile.angle.values, np.minimum(s - posture.contact, 0) + np.maximum(s - 1, 0)
    along = (profile.profile_x.values + straight * np.cos(angle)) * whisker.length
    up = (profile.profile_y.values + straight * np.sin(angle)) * whisker.length
    turn = np.pi - np.arctan2(float(profile.base_distance), float(profile.contact_distance))
    x, y = np.cos(turn) * along - np.sin(turn) * up, -np.sin(turn) * along - np.cos(turn) * up
    middle_x, middle_y = ((size - 1) / 2 * camera.pixel_size for size in (camera.width, camera.height))
    return Scene(
        s,
        x - (x.min() + x.max()) / 2 + middle_x,
        y - (y.min() + y.max()) / 2 + middle_y,
        angle,
        -np.sin(angle + turn),
        -np.cos(angle + turn),
    )


def film_motion(prediction: Prediction, film: Film, scene: Scene) -> Iterator[NDArray[np.uint8]]:
    """Frames of the predicted motion, rendered block by block.

    The shaft does not stretch: with a transverse displacement u it slips along itself by w, dw/ds = u dθ/ds, w = 0 at
    the base. Beyond the contact it goes on straight, along its slope there.

    Yields
    ------
    (T, height, width) array of uint8
        At most 250 frames.
    """
    shape, steady = _shape_matrix(prediction, scene.s)
    slip, steady_slip = _slip(shape, scene.angle), _slip(steady, scene.angle)
    times = exposure_times(film.camera, film.n_frames, film.subframes)
    for first in range(0, film.n_frames, _CHUNK):
        t = times[first * film.subframes : (first + _CHUNK) * film.subframes]
        d, q = prediction.amplitudes(t)
        u = (d[:, None] * steady + q.T @ shape) * prediction.whisker.length
        w = (d[:, None] * steady_slip + q.T @ slip) * prediction.whisker.length
        x = scene.x + u * scene.normal_x + w * scene.tangent_x
        y = scene.y + u * scene.normal_y + w * scene.tangent_y
        yield from render(
            x[None],
            y[None],
            film.camera,
            seed=film.seed,
            subframes=film.subframes,
            diameter=2 * prediction.whisker.base_radius * scene.s,
            first_frame=first,
        )


def _slip(u: Array, angle: Array) -> Array:
    """Slip −∫_s^1 u dθ along the tangent, for displacements u (..., N) on points from the base outwards."""
    steps = (u[..., 1:] + u[..., :-1]) / 2 * np.diff(angle)
    return np.concatenate([np.zeros((*u.shape[:-1], 1)), np.cumsum(steps, axis=-1)], axis=-1)


def _shape_matrix(prediction: Prediction, s: Array) -> tuple[Array, Array]:
    """Mode shapes (M, N) and Ū (N,), continued beyond the contact along their slope there."""
    contact = prediction.posture.contact
    inside = np.clip(s, contact, 1)
    beyond = np.minimum(s - contact, 0)
    slope = cone_modes(prediction.kappa, contact, np.array([contact]), derivative=1)
    shapes = cone_modes(prediction.kappa, contact, inside) + slope * beyond
    response = prediction.response.displacement(inside)
    return shapes, response + prediction.response.contact_angle * beyond


def exposed_signals(prediction: Prediction, film: Film, distance: float) -> xr.Dataset:
    """What a perfect tracker would find: every signal averaged over each exposure.

    Parameters
    ----------
    prediction : Prediction
        The motion.
    film : Film
        Its camera and number of frames.
    distance : float
        Distance from the base of the point whose displacement is wanted [m].

    Returns
    -------
    Dataset
        ``mode_displacement``, ``mode_amplitude`` (mode, time), ``excursion`` (time), over L;
        ``point_displacement`` (time) [m].
    """
    t = exposure_times(film.camera, film.n_frames, film.subframes)
    d, q = prediction.amplitudes(t)
    length = prediction.whisker.length
    point = np.array([1 - distance / length])
    shape, steady = _shape_matrix(prediction, point)

    def exposed(values: Array) -> Array:
        return values.reshape(*values.shape[:-1], film.n_frames, film.subframes).mean(axis=-1)

    return dataset(
        {"response": "linear", "jump": prediction.scan.jump, "distance": distance},
        time=np.arange(film.n_frames) / film.camera.frame_rate,
        mode=np.arange(1, len(q) + 1),
        excursion=exposed(d),
        mode_amplitude=exposed(q),
        mode_displacement=exposed(q + prediction.c[:, None] * d),
        point_displacement=exposed(length * (d * steady[0] + shape[:, 0] @ q)),
        kappa=prediction.kappa,
        resonant_frequency=prediction.omega / (2 * np.pi),
        coupling=prediction.c,
    )


def record_unit(recording: UnitRecording, time: Array, displacement: Array) -> xr.Dataset:
    """Spikes of the simulated unit, driven by the envelope of a displacement.

    Parameters
    ----------
    recording : UnitRecording
        The unit and the number of trials.
    time, displacement : (T,) arrays
        [s] and [m].

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.virtual.simulate_spikes`.
    """
    envelope, _ = analytic_envelope(displacement)
    rng = np.random.default_rng(recording.seed)
    return simulate_spikes(recording.unit, time, envelope, recording.n_trials, rng=rng)
