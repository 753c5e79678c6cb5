"""The virtual laboratory: a predicted motion, filmed; a simulated unit, recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Frames
from vibrissa.mechanics.scan.free_end import free_end_facts
from vibrissa.neural.simulated.virtual import simulate_spikes
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.spec.settings import Film, Study, UnitRecording
from vibrissa.study.spec.textures import predict_surface
from vibrissa.video.camera.camera import exposure_times
from vibrissa.video.camera.rendering import render
from vibrissa.video.camera.scenery import Fur, Scenery, Shadow
from vibrissa.video.tracking import Calibration, track

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.scan.motion import PredictedMotion

Position = Callable[[Array, Array], tuple[Array, Array]]

_CHUNK = 250  # frames rendered at a time, so that memory does not grow with the movie
NODE_SPACING = 116e-6  # [m] the paper's median
_FOLLICLE = 1.5e-3  # [m] of shaft seen below the skin: a blunt end there would bend the centreline of the base


def predicted_motion(study: Study) -> PredictedMotion:
    """Prediction for the study's whisker, posture, texture and scan; the film needs them all.

    Parameters
    ----------
    study : Study
        With whisker, posture, texture and scan.

    Returns
    -------
    PredictedMotion
        At any time.

    Raises
    ------
    ValueError
        If one of them is absent.
    """
    if study.whisker is None or study.posture is None or study.texture is None or study.scan is None:
        raise ValueError("a prediction needs whisker, posture, texture and scan")
    return predict_surface(study.whisker, study.posture, study.texture.made(study.folder), study.scan)


@dataclass(frozen=True)
class FilmLayout:
    """How the whisker lies in the image: turned so that its chord runs along the rows, the base on the left.

    Attributes
    ----------
    s : (N,) array
        Points of the shaft at most a pixel apart, from inside the follicle (above 1) to the physical tip.
    length : float
        L [m].
    turn : float
        Angle by which the substrate's frame is turned [rad].
    skin : (float, float)
        Where the shaft leaves the skin, s = 1, in the image frame (y down) [m].
    x, y : (N,) arrays
        Stationary profile in the image frame [m]; straight beyond the contact and inside the follicle.
    """

    s: Array
    length: float
    turn: float
    skin: tuple[float, float]
    x: Array
    y: Array

    def place(self, along: Array, up: Array) -> tuple[Array, Array]:
        """Positions from the base in the substrate's frame, over L, in the image frame [m].

        Parameters
        ----------
        along : array
            Along the substrate.
        up : array
            Above it.

        Returns
        -------
        x, y : arrays
            [m].
        """
        x, y = _turned(self.length * along, self.length * up, self.turn)
        return x + self.skin[0], y + self.skin[1]

    def unplace(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Undo ``place``, but in metres: from the image frame to the substrate's, from the base [m].

        Parameters
        ----------
        x : array
            To the right [m].
        y : array
            Down [m].

        Returns
        -------
        along, up : arrays
            [m].
        """
        return _turned(x - self.skin[0], y - self.skin[1], self.turn)  # turned and mirrored: its own inverse


def _turned(along: Array, up: Array, turn: float) -> tuple[Array, Array]:
    return np.cos(turn) * along - np.sin(turn) * up, -np.sin(turn) * along - np.cos(turn) * up


def lay_out(prediction: PredictedMotion, film: Film) -> FilmLayout:
    """Place the stationary profile in the middle of the virtual camera's image.

    Parameters
    ----------
    prediction : PredictedMotion
        The predicted motion.
    film : Film
        The virtual movie.

    Returns
    -------
    FilmLayout
        Points, turn and skin.
    """
    whisker, camera, flat = prediction.whisker, film.camera, prediction.response.flat
    count = int(np.ceil((1 - whisker.tip) * whisker.length / camera.pixel_size)) + 1
    outside, step = np.linspace(1, whisker.tip, count, retstep=True)
    inside = np.arange(1 - step, 1 + _FOLLICLE / whisker.length, -step)[::-1]
    s = np.concatenate([inside, outside])
    along, up = (whisker.length * values for values in flat.position(s))
    turn = float(np.pi - np.arctan2(flat.base[1], flat.base[0]))
    x, y = _turned(along, up, turn)
    sides = ((camera.width, x), (camera.height, y))
    middles = ((size - 1) / 2 * camera.pixel_size - (values.min() + values.max()) / 2 for size, values in sides)
    skin_x, skin_y = map(float, middles)
    return FilmLayout(s, whisker.length, turn, (skin_x, skin_y), x + skin_x, y + skin_y)


def film_motion(
    prediction: PredictedMotion, film: Film, scene: FilmLayout, position: Position | None = None
) -> Iterator[NDArray[np.uint8]]:
    """Frames of the predicted motion, or of one that disturbs it, rendered block by block.

    The shaft does not stretch; beyond the contact it goes on straight, along its slope there.

    Parameters
    ----------
    prediction, film, scene
        Whisker and surface, camera, and how the whisker lies in the image.
    position : callable, optional
        Times (T,) [s] and points s (S,) → positions from the base along the substrate and up, over L, (T, S) each;
        those of the prediction by default.

    Yields
    ------
    (T, height, width) array of uint8
        At most 250 frames.
    """
    position = position or prediction.position
    times = exposure_times(film.camera, film.n_frames, film.subframes)
    how: dict[str, Any] = {"seed": film.seed, "subframes": film.subframes, "scenery": stage(prediction, film, scene)}
    how["diameter"] = 2 * prediction.whisker.base_radius * scene.s
    for first in range(0, film.n_frames, _CHUNK):
        t = times[first * film.subframes : (first + _CHUNK) * film.subframes]
        x, y = scene.place(*position(t, scene.s))
        yield from render(x[None], y[None], film.camera, first_frame=first, **how)


def stage(prediction: PredictedMotion, film: Film, scene: FilmLayout) -> Scenery:
    """What the film shows beside the whisker: the head up to the skin, the substrate under the contact.

    Parameters
    ----------
    prediction : PredictedMotion
        The predicted motion.
    film : Film
        The virtual movie.
    scene : FilmLayout
        How the whisker lies in the image.

    Returns
    -------
    Scenery
        Light, fur and shadow.
    """
    fur = Fur(skin=scene.skin[0], seed=film.seed) if film.fur else None
    shadow = _shadow(prediction, film.shadow, scene) if film.shadow else None
    return Scenery(light=film.light, fur=fur, shadow=shadow)


def _shadow(prediction: PredictedMotion, hidden: float, scene: FilmLayout) -> Shadow:
    """Shadow that hides this length of shaft [m] before the contact: low, as the whisker grazes the substrate."""
    s = prediction.posture.contact + np.array([0, hidden / scene.length])
    along, up = prediction.response.flat.position(s)
    x, y = scene.place(along, up)
    facing = float(np.arctan2(-np.cos(scene.turn), -np.sin(scene.turn)))  # the substrate's "up"
    return Shadow(substrate=(float(x[0]), float(y[0])), facing=facing, depth=float(up[1] - up[0]) * scene.length)


def exposed_signals(prediction: PredictedMotion, film: Film, distance: float) -> xr.Dataset:
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
        ``point_displacement`` (time) [m]; ``free_end_length``, ``jump_count``, ``jumps_allowed`` and its share.
    """
    t = exposure_times(film.camera, film.n_frames, film.subframes)
    q, point = prediction.amplitudes(t), np.array([1 - distance / prediction.whisker.length])
    displacement = prediction.displacement(t, point)[:, 0] * prediction.whisker.length

    def exposed(values: Array) -> Array:
        return values.reshape(*values.shape[:-1], film.n_frames, film.subframes).mean(axis=-1)

    return dataset(
        {"response": prediction.scan.response, "jump": prediction.scan.jump, "distance": distance},
        time=np.arange(film.n_frames) / film.camera.frame_rate,
        mode=np.arange(1, len(q) + 1),
        excursion=exposed(prediction.excursion(t)),
        mode_amplitude=exposed(q),
        mode_displacement=exposed(prediction.mode_displacement(t)),
        point_displacement=exposed(displacement),
        kappa=prediction.kappa,
        resonant_frequency=prediction.omega / (2 * np.pi),
        coupling=prediction.c,
        **free_end_facts(prediction.free_end_length, prediction.allowed_jumps),
    )


def record_unit(recording: UnitRecording, time: Array, displacement: Array) -> xr.Dataset:
    """Spikes of the simulated unit, driven by the envelope or the phase of a displacement.

    Parameters
    ----------
    recording : UnitRecording
        The unit and the number of trials.
    time, displacement : (T,) arrays
        [s] and [m].

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.simulated.virtual.simulate_spikes`.
    """
    envelope, phase = analytic_envelope(displacement)
    drive = envelope if recording.unit.drive == "envelope" else phase
    rng = np.random.default_rng(recording.seed)
    return simulate_spikes(recording.unit, time, drive, recording.n_trials, rng=rng)


def track_film(
    frames: Iterable[Frames], film: Film, scene: FilmLayout, node_spacing: float | None = None
) -> xr.Dataset:
    """Track the whisker of a virtual movie, whose seed and skin point are known.

    Parameters
    ----------
    frames : iterable of (T, height, width) arrays
        Of the movie, in order.
    film, scene
        Its camera, and how the whisker lies in the image.
    node_spacing : float, optional
        Arc length between nodes [m]; 5 pixels by default.

    Returns
    -------
    Dataset
        ``profile``, as :func:`vibrissa.video.tracking.track` gives it.
    """
    pixel, middle = film.camera.pixel_size, len(scene.s) // 3
    return track(
        frames,
        seeds=[(scene.x[middle] / pixel, scene.y[middle] / pixel)],
        skin=[(scene.skin[0] / pixel, scene.skin[1] / pixel)],
        calibration=Calibration(frame_rate=film.camera.frame_rate, pixel_size=pixel),
        node_spacing=node_spacing,
    )
