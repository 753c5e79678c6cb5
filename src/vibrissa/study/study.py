"""Run a study: forward where it is virtual, backward on its movie, both held against each other."""

from __future__ import annotations

import json
import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import held, save
from vibrissa.mechanics.resonance import fit_modes
from vibrissa.neural.coupling import bin_means
from vibrissa.neural.response import spike_counts
from vibrissa.quantities import dataset
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.study.apparatus import apparatus, true_profile
from vibrissa.study.backward import Progress, analyse, counted, followed, still_of, track_file
from vibrissa.study.base_signals import BaseSignal, analyse_signal
from vibrissa.study.lines import base_lines, sweep_lines
from vibrissa.study.many import many_sweeps, posture_of
from vibrissa.study.outcome import Failures, attempting, not_analysed, not_fitted, noting
from vibrissa.study.populations import populations_of
from vibrissa.study.provenance import earlier_results, write_provenance
from vibrissa.study.report import write_report
from vibrissa.study.report_neurons import tables_of, unit_lines
from vibrissa.study.settings import Film, Study, UnitRecording
from vibrissa.study.surface import surface_lines, surface_results
from vibrissa.study.sweeps import read_series
from vibrissa.study.verdict import hold_against
from vibrissa.study.virtual import exposed_signals, film_motion, lay_out, predicted_motion, record_unit
from vibrissa.sweep.engine import Engine, single_threaded
from vibrissa.video.movie import read_blocks, write_movie
from vibrissa.video.tracking import Calibration, track

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.mechanics.motion import Motion
    from vibrissa.whisker import Whisker

Datasets = dict[str, "xr.Dataset"]

NODE_SPACING = 116e-6  # [m] the paper's median
_EVERY = 8  # nodes from one to the next whose truth is kept


def run_study(
    study: Study, out: str | Path, *, engine: Engine | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Run a study and write its datasets (NetCDF), its movie if virtual, its verdict, its report and its provenance.

    Parameters
    ----------
    study : Study
        From :func:`vibrissa.study.settings.read_study`.
    out : path
        Folder of the results; made if absent. What an earlier run made there is replaced, only once all went well. Many
        sweeps are kept one by one, in ``sweeps`` and ``comparison``: a run that was stopped goes on where it was.
    engine : Engine, optional
        Who does the work that comes by the many; a process per core by default.
    progress : callable, optional
        Called with (stage, done, total); total 0 where it is not known.

    Returns
    -------
    Dataset
        The verdict, truth against found; of many sweeps, a line for each; for a recorded movie, how far each whisker
        was followed; of units, how many are driven; of a surface alone, its modes and how far the model's assumptions
        hold; of base signals alone, their resonances. The attribute ``not_analysed`` (JSON) holds a line for each part,
        and each reason for which sweeps, could not be analysed, while the rest went on.

    Raises
    ------
    InputError
        If an input is bad, the folder cannot be written, another run is at work in it, or it holds another study's
        results.
    """
    out = Path(out).absolute()
    with held(out) as work, single_threaded():
        failed: Failures = {}
        earlier = earlier_results(study, out)
        results = _results(study, work, out, engine, progress or (lambda *_: None), failed)
        lines = not_analysed(results, failed)
        write_report(study, results, work / "report.html", partial(read_series, out), lines)
        for name, data in results.items():
            save(data, work / f"{name}.nc")
        write_provenance(study, results, work, out)
        out.mkdir(exist_ok=True)
        for name in earlier - {made.name for made in work.iterdir()}:
            (out / name).unlink(missing_ok=True)  # before the study was changed: figures must not mix the two
        for made in sorted(work.iterdir()):
            os.replace(made, out / made.name)
    told = {"not_analysed": lines, "not_fitted": not_fitted(results)}
    return _told(results).assign_attrs({name: json.dumps(one, ensure_ascii=False) for name, one in told.items()})


def _told(results: Datasets) -> xr.Dataset:
    """What a run tells in the end: the first of these that there is."""
    if "verdict" in results:
        return results["verdict"]
    if "sweeps" in results:
        return sweep_lines(results["sweeps"], results.get("comparison"))
    if "profile" in results:
        return followed(results["profile"])
    if tables_of(results):
        return unit_lines(results)
    if "scan" in results:
        return surface_lines(results["scan"])
    return base_lines(results)


def _results(
    study: Study, work: Path, out: Path, engine: Engine | None, progress: Progress, failed: Failures
) -> Datasets:
    """Every dataset the study's parts allow, in the order of the work."""
    results: Datasets = {}
    attempt = attempting(study, failed)
    for number, signal in enumerate(study.base_signal, 1):
        progress("base signals", number, len(study.base_signal))
        name = f"base_signal_{number}"
        results |= attempt(f"base signal {signal.label}", partial(_one_signal, name, signal, study.folder))
    if study.only_surface:
        progress("scan of the surface", 0, 0)
        results |= attempt("texture", partial(surface_results, study))
    if study.laboratory is not None or study.sweeps is not None:
        results |= attempt("sweeps", partial(many_sweeps, study, out, engine, progress, noting(failed)))
    if study.film is not None or study.movie is not None:
        results |= attempt("movie", partial(_one_movie, study, work, progress))
    return results | populations_of(study, out, engine, progress, attempt)


def _one_signal(name: str, signal: BaseSignal, folder: Path) -> Datasets:
    return {name: analyse_signal(signal, folder)}


def _one_movie(study: Study, work: Path, progress: Progress) -> Datasets:
    """What one movie gives, virtual or recorded: it is then the one that the figures show."""
    results: Datasets = {}
    prediction = None
    if study.film is not None:
        progress("predicting", 0, 0)
        prediction = predicted_motion(study)
        distance = (study.recording or UnitRecording()).distance
        results["prediction"] = exposed_signals(prediction, study.film, distance)
        profile, still = _filmed(prediction, study.film, work / "movie.mkv", progress)
        results |= _set_up(prediction, study.film, profile)
    elif study.movie is not None:
        profile = track_file(study.movie, study.folder, progress)
        still = still_of(study.folder / study.movie.path)
    results |= {"profile": profile, "still": still}
    if study.whisker is not None:
        true = study.posture.contact if study.film is not None and study.posture is not None else np.nan
        results |= posture_of(profile.isel(whisker=0), study.whisker, true)
    if study.whisker is not None and study.posture is not None:
        progress("decomposing and fitting", 0, 0)
        results |= _modal(study, profile.isel(whisker=0), study.whisker, study.posture.contact, prediction)
    if study.recording is not None and "modal" in results:
        progress("recording one unit", 0, 0)
        results |= _recorded(study.recording, results)
    if prediction is not None and "resonance" in results:
        results["verdict"] = hold_against(study, prediction, results)
    return results


def _filmed(prediction: Motion, film: Film, path: Path, progress: Progress) -> tuple[xr.Dataset, xr.Dataset]:
    """Film the motion to a lossless movie, then track that file."""
    scene = lay_out(prediction, film)
    frames = counted(film_motion(prediction, film, scene), "filming", film.n_frames, progress)
    write_movie(path, frames, playback_rate=25)
    pixel = film.camera.pixel_size
    middle = len(scene.s) // 3
    profile = track(
        counted(read_blocks(path), "tracking", film.n_frames, progress),
        seeds=[(scene.x[middle] / pixel, scene.y[middle] / pixel)],
        skin=[(scene.skin[0] / pixel, scene.skin[1] / pixel)],
        calibration=Calibration(frame_rate=film.camera.frame_rate, pixel_size=pixel),
        node_spacing=NODE_SPACING,
    )
    return profile, still_of(path)


def _set_up(prediction: Motion, film: Film, profile: xr.Dataset) -> Datasets:
    """What was filmed, to be drawn, and where some of the nodes truly were."""
    scene = lay_out(prediction, film)
    arc = profile.arc_length.values[0]
    true = true_profile(prediction, film, scene, arc[np.isfinite(arc)][::_EVERY])
    return {"apparatus": apparatus(prediction, film, scene), "true_profile": true}


def _modal(study: Study, profile: xr.Dataset, whisker: Whisker, contact: float, prediction: Motion | None) -> Datasets:
    """Decomposition and resonances; where the texture is known, also by its forcing and on the true signal."""
    modes = "straight" if study.scan is None else study.scan.modes
    results = analyse(profile, whisker, contact, n_modes=study.n_modes, modes=modes, posture=study.posture)
    if prediction is None or study.film is None or "resonance_white" not in results:
        return results
    expected = results["modal"].kappa.values / (2 * np.pi * whisker.timescale)
    true = exposed_signals(prediction, study.film, 0.0).isel(mode=slice(study.n_modes))
    for name, signal in (("", results["modal"]), ("_true", true)):
        shutter: dict[str, Any] = {"exposure": study.film.camera.exposure, "instants": study.film.subframes}
        fit, spectra = fit_modes(signal, expected, prediction=prediction, **shutter)
        results |= {f"resonance{name}": fit, f"spectra{name}": spectra}
    return results


def _recorded(recording: UnitRecording, results: Datasets) -> Datasets:
    """Spikes of a unit driven by the true motion where it is known, else by the tracked one."""
    modal = results["modal"]
    time = modal.time.values
    found = _displacement_at(modal, recording.distance)
    drive = results["prediction"].point_displacement.values if "prediction" in results else found
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


def _displacement_at(modal: xr.Dataset, distance: float) -> NDArray[np.float64]:
    """Tracked displacement at a distance from the skin [m], between the two nodes about it."""
    seen = modal.dropna("node", subset=["displacement"])
    arc = seen.arc_length.values
    if not arc.min() <= distance <= arc.max():
        raise InputError(
            "recording.distance", f"must lie on the tracked shaft, {arc.min():.4g}–{arc.max():.4g} m", distance
        )
    right = int(np.searchsorted(arc, distance).clip(1, len(arc) - 1))
    share = (distance - arc[right - 1]) / (arc[right] - arc[right - 1])
    values = seen.displacement.values
    return (1 - share) * values[:, right - 1] + share * values[:, right]
