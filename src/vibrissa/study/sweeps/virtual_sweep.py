"""One virtual sweep: predicted, disturbed, filmed, tracked and analysed, in memory."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.inverse.stationary_posture import Line
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.quantities import dataset
from vibrissa.study.movie.apparatus import true_profile
from vibrissa.study.movie.virtual import NODE_SPACING, FilmLayout, film_motion, lay_out, track_film
from vibrissa.study.spec.laboratory import SWEEP, Laboratory
from vibrissa.study.spec.nuisance import Nuisance
from vibrissa.study.spec.settings import Film
from vibrissa.study.store.result_store import SweepRow
from vibrissa.study.sweeps.jitter import Jitter, run_again
from vibrissa.study.sweeps.laboratory import VirtualSweep, plan
from vibrissa.study.sweeps.nuisance import Disturbed, disturbed, slow_motion, travel, wandered
from vibrissa.study.sweeps.sweep_analysis import (
    SweepFacts,
    analyse_sweep,
    exposed_displacement,
    followed_throughout,
)
from vibrissa.study.sweeps.sweep_table import N_MODES
from vibrissa.study.sweeps.truth import TrueMotion, true_motion
from vibrissa.texture.surface import Gaps
from vibrissa.video.camera.scenery import Light

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.whisker import Whisker

_SEEN = 0.5  # of the frames in which a node that counts was seen
_EVERY = 4  # frames from one to the next that the shares of the modes are taken from
_MARGIN = 24  # pixels about a whisker whose film is cropped


class Filmed(NamedTuple):
    """A virtual sweep as filmed and tracked.

    Attributes
    ----------
    profile : Dataset
        Of the whisker.
    known : SweepFacts
        What the experimenter knows.
    motion : TrueMotion
        The motion over the surface that was filmed, with what stage and tip did.
    film, scene : Film, Scene
        The camera's, and how the whisker lies in the image.
    image : (height, width) array of uint8
        First frame.
    """

    profile: xr.Dataset
    known: SweepFacts
    motion: TrueMotion
    film: Film
    scene: FilmLayout
    image: NDArray[np.uint8]


def filmed_sweep(laboratory: Laboratory, sweep: VirtualSweep) -> Filmed:
    """Predict, disturb, film and track one planned sweep, in memory.

    Parameters
    ----------
    laboratory : Laboratory
        The virtual laboratory.
    sweep : VirtualSweep
        As planned.

    Returns
    -------
    Filmed
        Tracked.

    Raises
    ------
    InputError
        If the motion cannot be predicted, or the whisker is lost.
    ConvergenceError
        If the rod does not come to rest.
    """
    texture = laboratory.grating(sweep.key[3])
    rng = laboratory.rng(SWEEP, *sweep.key)
    met = _run(predict(sweep.whisker, sweep.posture, texture, sweep.scan), laboratory, rng)
    film = film_of(met, laboratory, rng)
    scene = lay_out(met, film)
    real = true_motion(met, laboratory.truth, film)
    span = film.n_frames / film.camera.frame_rate
    known = SweepFacts(
        whisker=_known(laboratory, sweep),
        scan_speed=sweep.scan.speed,
        base_height=sweep.base_height,
        texture=texture,
        substrate=_substrate(met, scene),
        friction=laboratory.friction,
        exposure=film.camera.exposure,
        instants=film.subframes,
    )
    profile, image = _tracked(disturbed(real, laboratory.nuisance, span, rng), film, scene)
    return Filmed(profile, known, real, film, scene, image)


def known_whisker(laboratory: Laboratory, number: int) -> Whisker:
    """Whisker of a planned sweep as the experimenter knows it: its geometry, with the nominal E and ρ.

    Parameters
    ----------
    laboratory : Laboratory
        The virtual laboratory.
    number : int
        Of the sweep, as planned.

    Returns
    -------
    Whisker
        Without what was drawn about it.
    """
    return _known(laboratory, plan(laboratory)[0][number])


def _known(laboratory: Laboratory, sweep: VirtualSweep) -> Whisker:
    return replace(sweep.whisker, youngs_modulus=laboratory.youngs_modulus, density=laboratory.density)


def virtual_sweep(laboratory: Laboratory, sweep: VirtualSweep) -> tuple[SweepRow, xr.Dataset]:
    """Film, track and analyse one planned sweep, and add the truth.

    Parameters
    ----------
    laboratory : Laboratory
        The virtual laboratory.
    sweep : VirtualSweep
        As planned.

    Returns
    -------
    row, series
        As ``analyse_sweep``, with the truth: ``contact_true``, ``mode_rms_true`` … and ``mode_displacement_true``
        (mode, time), of the motion over the surface, without hum, drift and friction noise;
        ``variance_explained_true`` of its profile at the nodes that were tracked, that is, without the tracker's noise.

    Raises
    ------
    InputError
        As :func:`filmed_sweep` and ``analyse_sweep``.
    """
    filmed = filmed_sweep(laboratory, sweep)
    known, motion = filmed.known, filmed.motion
    row, series = analyse_sweep(filmed.profile, known)
    true = exposed_displacement(motion, series.time.values, known.exposure, known.instants)
    labelled = dataset(mode=series.mode.values, time=series.time.values, mode_displacement_true=true)
    truth = _truth(motion, laboratory.grating(sweep.key[3]), true) | {"variance_explained_true": _shares(filmed)}
    return row | truth, series.merge(labelled, combine_attrs="override")


def _shares(filmed: Filmed) -> Array:
    """Shares of the variance that the modes would explain to a perfect tracker, ε known."""
    seen = np.isfinite(filmed.profile.x.values).mean(axis=0) >= _SEEN
    arc = filmed.profile.arc_length.values[seen]
    film = filmed.film  # one instant of the shutter's three, which take 3 % of mode 3, and few frames: they cost much
    camera = replace(film.camera, frame_rate=film.camera.frame_rate / _EVERY)
    some = replace(film, subframes=1, n_frames=film.n_frames // _EVERY, camera=camera)
    perfect = true_profile(filmed.motion.position, some, filmed.scene, arc)
    contact = filmed.motion.prediction.posture.contact
    found = decompose(perfect, filmed.known.whisker, contact, n_modes=N_MODES)
    return np.asarray(found.variance_explained.values)


def _run(prediction: Prediction, laboratory: Laboratory, rng: np.random.Generator) -> Prediction:
    """The single-contact prediction of this run, with what stage and tip do that the plan does not know."""
    nuisance = laboratory.nuisance
    real = prediction
    if nuisance.wander:
        span = prediction.end + nuisance.wander_time
        wander = slow_motion(nuisance.wander, nuisance.wander_time, 2 * span, rng)
        met = wandered(prediction.texture, prediction.scan.speed, wander)
        real = predict(prediction.whisker, prediction.posture, met, prediction.scan)
    if nuisance.clock or nuisance.ripple or nuisance.contact:
        real = run_again(real, _jitter(nuisance), laboratory.camera.frame_rate, rng)
    return real


def _jitter(nuisance: Nuisance) -> Jitter:
    names = ("clock", "ripple", "ripple_frequency", "contact")
    return Jitter(**{name: getattr(nuisance, name) for name in names})


def film_of(prediction: Prediction, laboratory: Laboratory, rng: np.random.Generator) -> Film:
    """The movie of one run: its seeds, and its field if it is cropped to the whisker.

    Parameters
    ----------
    prediction : Prediction
        The motion.
    laboratory : Laboratory
        The virtual laboratory.
    rng : Generator
        Source of randomness.

    Returns
    -------
    Film
        Of that run.
    """
    nuisance, pixels, light = laboratory.nuisance, int(rng.integers(2**31)), int(rng.integers(2**31))
    drift = Light(drift=nuisance.light_drift, drift_time=nuisance.drift_time, seed=light)
    film = Film(
        n_frames=laboratory.frames(prediction.scan.speed),
        subframes=laboratory.subframes,
        seed=pixels,
        camera=laboratory.camera,
        light=drift,
        fur=laboratory.fur,
        shadow=laboratory.shadow,
    )
    if not laboratory.crop:
        return film
    scene, pixel = lay_out(prediction, film), film.camera.pixel_size
    width, height = (int(np.ceil(np.ptp(values) / pixel)) + 2 * _MARGIN for values in (scene.x, scene.y))
    return replace(film, camera=replace(film.camera, width=width, height=height))


def _tracked(motion: Disturbed, film: Film, scene: FilmLayout) -> tuple[xr.Dataset, NDArray[np.uint8]]:
    """Profile of the filmed whisker, which must not be lost, and the first frame."""
    frames = film_motion(motion.motion.prediction, film, scene, motion.position)
    first = next(frames)
    profile = track_film(chain([first], frames), film, scene, NODE_SPACING).isel(whisker=0)
    followed_throughout(profile)
    return profile, first[0]


def _substrate(prediction: Prediction, scene: FilmLayout) -> Line:
    """Two points of the substrate's line in the image, which the camera sees edge on [m]."""
    distance, height = prediction.response.flat.base
    x, y = scene.place(np.array([-1.0, 0.0]) * distance, np.full(2, -height))
    return (float(x[0]), float(y[0])), (float(x[1]), float(y[1]))


def _truth(motion: TrueMotion, texture: Gaps, true: Array) -> SweepRow:
    real = motion.prediction
    whisker, posture = real.whisker, real.posture
    return {
        "contact_true": posture.contact,
        "base_angle_true": posture.base_angle,
        "friction_true": posture.friction,
        "youngs_modulus_true": whisker.youngs_modulus,
        "resonant_frequency_true": motion.resonances[:N_MODES],
        "damping_true": np.full(N_MODES, real.scan.damping),
        "mode_rms_true": true.std(axis=1),
        "phase_jitter": travel(texture, real.texture),
    }
