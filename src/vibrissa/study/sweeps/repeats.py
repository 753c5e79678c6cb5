"""Sweeps of a virtual laboratory that are filmed again and again: how far a run repeats, as in Figure 3E."""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import spread
from vibrissa.figures.paper.parts.fig3_motion import most_alike, run_correlations
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.study.movie.apparatus import true_profile
from vibrissa.study.movie.virtual import FilmLayout, film_motion, lay_out, track_film
from vibrissa.study.spec.laboratory import REPEAT, Laboratory, Truth
from vibrissa.study.store.result_store import StoredWork, SweepRow, finished, made_of
from vibrissa.study.sweeps.jitter import Jitter, run_again
from vibrissa.study.sweeps.laboratory import VirtualSweep, plan
from vibrissa.study.sweeps.truth import TrueMotion, true_motion
from vibrissa.study.sweeps.virtual_sweep import film_of
from vibrissa.sweep.engine import Engine

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Film

FOLDER = "repeats"
RUNS = 5  # the paper's


def repeats_of(
    laboratory: Laboratory, sweeps: xr.Dataset, count: int, out: Path, engine: Engine | None, progress: Progress
) -> xr.Dataset | None:
    """Run some sweeps, spread over the table, five times each with the jitter of lamp, stage and animal.

    Parameters
    ----------
    laboratory : Laboratory
        Whose sweeps they are.
    sweeps : Dataset
        Its table; of the accepted ones.
    count : int
        How many are repeated.
    out : Path
        Folder of the results; each experiment is kept in its ``repeats``.
    engine, progress
        Who does the work; called with ("repeated runs", done, total).

    Returns
    -------
    Dataset or None
        ``run_motion`` and ``run_motion_true`` (repetition, run, run_time) [m], cut to the shortest, ``run_correlation``
        and ``run_correlation_others`` (repetition, run), of whole runs; texture, speed and node of the experiment whose
        runs are most alike; see :func:`vibrissa.study.sweeps.repeats.film_repeats`. None if no sweep was accepted.

    Raises
    ------
    InputError
        If a sweep cannot be run again.
    """
    able = np.flatnonzero(sweeps.accepted.values)
    if not len(able):
        return None
    planned = plan(laboratory)[0]
    jobs = [_job(laboratory, planned[i]) for i in spread(able, count).tolist()]
    made = finished(jobs, out / FOLDER, "repeated runs", engine, progress)
    found = [run_correlations(one.run_motion.values) for one in made]
    shown = made[most_alike(np.concatenate([with_mean for with_mean, _ in found]))]
    shortest = min((one.run_time.values for one in made), key=len)
    return dataset(
        {name: value for name, value in shown.attrs.items() if name.startswith(("jitter_", "run_"))},
        run_time=shortest,
        run_trough_start=shown.run_trough_start.values,
        run_trough_width=shown.run_trough_width.values,
        run_motion=np.concatenate([one.run_motion.values[..., : len(shortest)] for one in made]),
        run_motion_true=np.concatenate([one.run_motion_true.values[..., : len(shortest)] for one in made]),
        run_correlation=np.concatenate([with_mean for with_mean, _ in found]),
        run_correlation_others=np.concatenate([with_others for _, with_others in found]),
    )


def true_repeats(repeats: xr.Dataset) -> xr.Dataset:
    """The same runs as a perfect tracker would see them.

    Parameters
    ----------
    repeats : Dataset
        From :func:`repeats_of`.

    Returns
    -------
    Dataset
        ``run_correlation`` and ``run_correlation_others`` (repetition, run) of ``run_motion_true``.
    """
    with_mean, with_others = run_correlations(repeats.run_motion_true.values)
    return dataset(run_correlation=with_mean, run_correlation_others=with_others)


def _job(laboratory: Laboratory, sweep: VirtualSweep) -> StoredWork:
    of = made_of(repeats=asdict(laboratory) | {"runs": RUNS}, sweep=asdict(replace(sweep, number=0)))
    return StoredWork({}, partial(_repeated, laboratory, sweep), of)


def _repeated(laboratory: Laboratory, sweep: VirtualSweep) -> tuple[SweepRow, xr.Dataset]:
    rng = laboratory.rng(REPEAT, *sweep.key)
    prediction = predict(sweep.whisker, sweep.posture, laboratory.grating(sweep.key[3]), sweep.scan)
    film = film_of(prediction, laboratory, rng)
    return {}, film_repeats(prediction, film, truth=laboratory.truth, rng=rng, n_runs=RUNS, n_repetitions=1)


def film_repeats(
    prediction: Prediction,
    film: Film,
    *,
    rng: np.random.Generator,
    truth: Truth = "modes",
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
    truth : {"rod", "modes"}
        What the whisker does.
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
        down the image [m]; ``run_trough_start``, ``run_trough_width`` (run_trough), the texture. Attributes: the
        jitter, ``run_arc`` [m], ``run_speed`` [m/s].
    """
    jitter = jitter or Jitter()
    found, true = [], []
    for _ in range(n_runs * n_repetitions):
        again = run_again(prediction, jitter, film.camera.frame_rate, rng)
        scene = lay_out(again, film)  # the pad has moved
        motion = true_motion(again, truth, film)
        tracked, arc = _tracked(motion, replace(film, seed=int(rng.integers(2**31))), scene, distance)
        exact = true_profile(motion.position, film, scene, np.array([arc])).y.values[:, 0]
        found.append(tracked - tracked.mean())
        true.append(exact - exact.mean())
    shape = n_repetitions, n_runs, film.n_frames
    attrs = {f"jitter_{name}": value for name, value in asdict(jitter).items()}
    start, width, _ = prediction.gaps
    return dataset(
        attrs | {"run_arc": arc, "run_speed": prediction.scan.speed, "frame_rate": film.camera.frame_rate},
        run_trough_start=start,
        run_trough_width=width,
        run_time=np.arange(film.n_frames) / film.camera.frame_rate,
        run_motion=np.reshape(found, shape),
        run_motion_true=np.reshape(true, shape),
    )


def _tracked(motion: TrueMotion, film: Film, scene: FilmLayout, distance: float) -> tuple[Array, float]:
    """Y of the node nearest to a distance from the skin, (T,), and its arc length [m]."""
    profile = track_film(film_motion(motion.prediction, film, scene, motion.position), film, scene).isel(whisker=0)
    node = int(np.abs(profile.arc_length.values - distance).argmin())
    return profile.y.values[:, node], float(profile.arc_length[node])
