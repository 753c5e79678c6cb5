"""The stages of one movie, virtual or recorded: from the prediction to the verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError
from vibrissa.mechanics.inverse.resonance import fit_modes
from vibrissa.neural.coupling.envelope_coupling import bin_means
from vibrissa.neural.coupling.response import spike_counts
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Datasets
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.movie.apparatus import apparatus, true_profile
from vibrissa.study.movie.backward import analyse, still_of
from vibrissa.study.movie.resting import shown_posture
from vibrissa.study.movie.track_file import counted, track_file
from vibrissa.study.movie.verdict import hold_against
from vibrissa.study.movie.virtual import (
    NODE_SPACING,
    exposed_signals,
    film_motion,
    lay_out,
    predicted_motion,
    record_unit,
    track_film,
)
from vibrissa.study.spec.settings import Film, UnitRecording
from vibrissa.video.io.movie import read_blocks, write_movie
from vibrissa.video.io.prefetch import prefetched

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.scan.motion import PredictedMotion
    from vibrissa.study.store.run_state import Run

MOVIE = "movie.mkv"  # the virtual movie, in the folder of the results
_EVERY = 8  # nodes from one to the next whose truth is kept


def predict_film(run: Run) -> Datasets:
    """Predict the motion that the virtual camera films: ``prediction``.

    Parameters
    ----------
    run : Run
        Its study has a film.

    Returns
    -------
    dict of Datasets
        The results named above.
    """
    run.progress("predicting", 0, 0)
    film, motion = _filmed(run, predicted_motion(run.study))
    run.motion = motion
    distance = (run.study.recording or UnitRecording()).distance
    return {"prediction": exposed_signals(motion, film, distance)}


def film_file(run: Run) -> Datasets:
    """Film the predicted motion to a lossless movie in the folder of results; no dataset.

    Parameters
    ----------
    run : Run
        Its motion is predicted.

    Returns
    -------
    dict of Datasets
        Empty.
    """
    film, motion = _filmed(run, run.motion)
    frames = prefetched(film_motion(motion, film, lay_out(motion, film)))  # rendered while those before are written
    write_movie(run.work / MOVIE, counted(frames, "filming", film.n_frames, run.progress), playback_rate=25)
    return {}


def _filmed(run: Run, motion: PredictedMotion | None) -> tuple[Film, PredictedMotion]:
    if run.study.film is None or motion is None:
        raise ValueError("a virtual movie needs a film and a predicted motion")
    return run.study.film, motion


def track_movie(run: Run) -> Datasets:
    """Track the movie of a study: ``profile``, ``still``; of a virtual one also ``apparatus`` and ``true_profile``.

    Parameters
    ----------
    run : Run
        Its study has a movie or a film, whose motion is then filmed.

    Returns
    -------
    dict of Datasets
        The results named above.

    Raises
    ------
    InputError
        If the movie is missing or bad, or a whisker is not found in it.
    """
    movie, folder = run.study.movie, run.study.folder
    if movie is not None:
        return {"profile": track_file(movie, folder, run.progress), "still": still_of(folder / movie.path)}
    film, motion = _filmed(run, run.motion)
    scene, path = lay_out(motion, film), run.work / MOVIE
    frames = counted(read_blocks(path), "tracking", film.n_frames, run.progress)
    profile = track_film(frames, film, scene, NODE_SPACING)
    arc = profile.arc_length.values[0]
    true = true_profile(motion.position, film, scene, arc[np.isfinite(arc)][::_EVERY])
    set_up = {"apparatus": apparatus(motion, film, scene), "true_profile": true}
    return {"profile": profile, "still": still_of(path), **set_up}


def fit_posture(run: Run) -> Datasets:
    """Fit the posture at rest: ``posture``. Only of a film is it known when the texture meets the contact.

    Parameters
    ----------
    run : Run
        Its study has a whisker, and the movie is tracked.

    Returns
    -------
    dict of Datasets
        The results named above.
    """
    run.progress("posture", 0, 0)
    study, profile = run.study, run.results["profile"].isel(whisker=0)
    if study.whisker is None:
        return {}
    if study.film is None or study.posture is None or study.texture is None:
        return shown_posture(profile, study.whisker)
    how: dict[str, Any] = {"friction": study.posture.friction, "texture": study.texture.made(study.folder)}
    return shown_posture(profile, study.whisker, **how, scan=study.scan, true=study.posture.contact)


def fit_movie(run: Run) -> Datasets:
    """Decompose the profile and fit resonances; where the texture is known, also by its forcing and on the true signal.

    Parameters
    ----------
    run : Run
        Its study has a whisker and a posture, and the movie is tracked.

    Returns
    -------
    dict of Datasets
        As :func:`vibrissa.study.movie.backward.analyse` gives them; of a film also ``resonance``, ``spectra``,
        ``resonance_true``, ``spectra_true``.
    """
    run.progress("decomposing and fitting", 0, 0)
    study, film, motion = run.study, run.study.film, run.motion
    if study.whisker is None or study.posture is None:
        return {}
    modes = "straight" if study.scan is None else study.scan.modes
    how: dict[str, Any] = {"n_modes": study.n_modes, "modes": modes, "posture": study.posture}
    results = analyse(run.results["profile"].isel(whisker=0), study.whisker, study.posture.contact, **how)
    if motion is None or film is None or "resonance_white" not in results:
        return results
    expected = results["modal"].kappa.values / (2 * np.pi * study.whisker.timescale)
    true = exposed_signals(motion, film, 0.0).isel(mode=slice(study.n_modes))
    for name, signal in (("", results["modal"]), ("_true", true)):
        shutter: dict[str, Any] = {"exposure": film.camera.exposure, "instants": film.subframes}
        fit, spectra = fit_modes(signal, expected, prediction=motion, **shutter)
        results |= {f"resonance{name}": fit, f"spectra{name}": spectra}
    return results


def record_neuron(run: Run) -> Datasets:
    """Simulate a unit driven by the true motion where it is known, else by the tracked one: ``spikes``, ``response``.

    Parameters
    ----------
    run : Run
        Its study has a recording, and the movie is decomposed.

    Returns
    -------
    dict of Datasets
        The results named above.

    Raises
    ------
    InputError
        If the point whose motion drives the unit is not on the tracked shaft.
    """
    run.progress("recording one unit", 0, 0)
    recording, modal = run.study.recording or UnitRecording(), run.results["modal"]
    time = modal.time.values
    found = _displacement_at(modal, recording.distance)
    drive = run.results["prediction"].point_displacement.values if run.motion is not None else found
    spikes = record_unit(recording, time, drive)
    width = recording.bin_width
    n_bins = int(np.floor((time[-1] - time[0]) / width + 1e-9))
    bins: dict[str, Any] = {"start": float(time[0]), "n_bins": n_bins, "bin_width": width}
    counts = spike_counts(spikes, n_trials=recording.n_trials, **bins)
    response = dataset(
        {"bin_width": width, "n_trials": recording.n_trials},
        bin=time[0] + width * np.arange(n_bins),
        firing_rate=counts.mean(axis=0) / width,
        bin_envelope=bin_means(time, analytic_envelope(found)[0], **bins),
        bin_envelope_true=bin_means(time, analytic_envelope(drive)[0], **bins),
    )
    return {"spikes": spikes, "response": response}


def _displacement_at(modal: xr.Dataset, distance: float) -> Array:
    """Tracked displacement at a distance from the skin [m], between the two nodes about it."""
    seen = modal.dropna("node", subset=["displacement"])
    arc = seen.arc_length.values
    if not arc.min() <= distance <= arc.max():
        rule = f"must lie on the tracked shaft, {arc.min():.4g}–{arc.max():.4g} m"
        raise RangeError("recording.distance", rule, distance)
    right = int(np.searchsorted(arc, distance).clip(1, len(arc) - 1))
    share = (distance - arc[right - 1]) / (arc[right] - arc[right - 1])
    values = seen.displacement.values
    return (1 - share) * values[:, right - 1] + share * values[:, right]


def judge(run: Run) -> Datasets:
    """Hold what was found in a virtual movie against its truth: ``verdict``.

    Parameters
    ----------
    run : Run
        Its film is fitted.

    Returns
    -------
    dict of Datasets
        The results named above.
    """
    _, motion = _filmed(run, run.motion)
    return {"verdict": hold_against(run.study, motion, run.results)}
