"""One scan filmed again and again: the same texture, with what differs from run to run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.superposition import Prediction, predict
from vibrissa.quantities import dataset
from vibrissa.study.apparatus import true_profile
from vibrissa.study.virtual import Scene, film_motion, lay_out
from vibrissa.video.tracking import Calibration, track

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.settings import Film

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Jitter:
    """What differs from run to run; the noise of the pixels always does.

    The paper gives none of these. The defaults are those of its set-up as far as it tells: runs are aligned by a lamp
    seen in the movie, so to the nearest frame; the rest are guesses at a stepping motor and an anaesthetised animal,
    made once and not fitted to anything. What moves with heart and breath is not modelled.

    Of a ripple it is the travel that counts, r v / 2πf. In the built-in experiment, node at 15 mm, true motion, each
    alone: correlation of a run with the mean of five 0.997 from the start, 0.9995 from the ripple, 0.9996 from the
    contact (0.002 is 0.09 mm of H); but 0.95 from the same ripple at 2 Hz.

    Attributes
    ----------
    clock : float
        Start of the scan against the frames, evenly within ± this many frames.
    ripple : float
        Amplitude of the ripple of the scanning speed, over the speed, of a phase that differs from run to run.
    ripple_frequency : float
        Its frequency [Hz].
    contact : float
        Standard deviation of the contact's position ε; the base angle is kept, so that the pad moves towards the
        substrate or away from it.
    """

    clock: float = 0.5
    ripple: float = 0.01
    ripple_frequency: float = 20.0
    contact: float = 0.002

    def __post_init__(self) -> None:
        for name in ("clock", "ripple", "contact"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"Jitter.{name}", "must be finite and not negative", getattr(self, name))
        if not 0 < self.ripple_frequency < np.inf:
            raise InputError("Jitter.ripple_frequency", "must be positive and finite (Hz)", self.ripple_frequency)


def run_again(prediction: Prediction, jitter: Jitter, frame_rate: float, rng: np.random.Generator) -> Prediction:
    """Predict one more run.

    The edge x is met when the stage has travelled that far, v (t − t₀) + (r v / 2πf) sin(2πft + φ) = x. To first
    order in the ripple r that is a texture with its edges moved.

    Parameters
    ----------
    prediction : Prediction
        The scan without jitter.
    jitter : Jitter
        What differs.
    frame_rate : float
        Frames per second [Hz], the measure of ``jitter.clock``.
    rng : numpy.random.Generator
        Draws start, phase and contact.
    """
    speed, turn = prediction.scan.speed, 2 * np.pi * jitter.ripple_frequency
    start = rng.uniform(-1, 1) * jitter.clock / frame_rate
    phase = rng.uniform(0, 2 * np.pi)
    contact = prediction.posture.contact + jitter.contact * rng.standard_normal()

    def moved(edge: Array) -> Array:
        return edge + speed * start - jitter.ripple * speed / turn * np.sin(turn * edge / speed + phase)

    texture, posture = prediction.texture, replace(prediction.posture, contact=contact)
    first = moved(texture.position)
    warped = replace(texture, position=first, width=moved(texture.end) - first)
    return predict(prediction.whisker, posture, warped, prediction.scan, n_modes=len(prediction.kappa))


def film_repeats(
    prediction: Prediction,
    film: Film,
    *,
    rng: np.random.Generator,
    jitter: Jitter | None = None,
    n_runs: int = 5,
    n_repetitions: int = 20,
    distance: float = 15e-3,
) -> xr.Dataset:
    """Film and track the same scan again and again, and follow one node.

    Parameters
    ----------
    prediction : Prediction
        The scan without jitter.
    film : Film
        The movie of one run; its seed is drawn anew for each.
    rng : numpy.random.Generator
        Draws what differs.
    jitter : Jitter, optional
        How much; the defaults if not given.
    n_runs, n_repetitions : int
        Runs in one experiment, and experiments.
    distance : float
        Distance of the node from the skin along the shaft [m]; the nearest node is followed.

    Returns
    -------
    Dataset
        ``run_motion`` as tracked and ``run_motion_true`` (repetition, run, run_time): y of the node about its mean,
        down the image [m]. Attributes: the jitter, ``run_arc`` [m], ``speed`` [m/s].
    """
    jitter = jitter or Jitter()
    found, true = [], []
    for _ in range(n_runs * n_repetitions):
        again = run_again(prediction, jitter, film.camera.frame_rate, rng)
        scene = lay_out(again, film)  # the pad has moved
        tracked, arc = _tracked(again, replace(film, seed=int(rng.integers(2**31))), scene, distance)
        exact = true_profile(again, film, scene, np.array([arc])).y.values[:, 0]
        found.append(tracked - tracked.mean())
        true.append(exact - exact.mean())
    shape = n_repetitions, n_runs, film.n_frames
    attrs = {f"jitter_{name}": value for name, value in asdict(jitter).items()}
    return dataset(
        attrs | {"run_arc": arc, "speed": prediction.scan.speed, "frame_rate": film.camera.frame_rate},
        run_time=np.arange(film.n_frames) / film.camera.frame_rate,
        run_motion=np.reshape(found, shape),
        run_motion_true=np.reshape(true, shape),
    )


def _tracked(prediction: Prediction, film: Film, scene: Scene, distance: float) -> tuple[Array, float]:
    """Y of the node nearest to a distance from the skin, (T,), and its arc length [m]."""
    pixel, middle = film.camera.pixel_size, len(scene.s) // 3
    frames: Iterator[NDArray[np.uint8]] = film_motion(prediction, film, scene)
    profile = track(
        frames,
        seeds=[(scene.x[middle] / pixel, scene.y[middle] / pixel)],
        skin=[(scene.skin[0] / pixel, scene.skin[1] / pixel)],
        calibration=Calibration(frame_rate=film.camera.frame_rate, pixel_size=pixel),
    ).isel(whisker=0)
    node = int(np.abs(profile.arc_length.values - distance).argmin())
    return profile.y.values[:, node], float(profile.arc_length[node])
