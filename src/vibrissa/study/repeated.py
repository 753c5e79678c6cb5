"""Some sweeps of a virtual laboratory run five times each: how far a run repeats, as in Figure 3E."""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import InputError
from vibrissa.figures.fig3_motion import run_correlations
from vibrissa.files import load
from vibrissa.mechanics.superposition import predict
from vibrissa.quantities import dataset
from vibrissa.study.laboratory import REPEAT, Laboratory, VirtualSweep, plan
from vibrissa.study.repeats import film_repeats
from vibrissa.study.store import Job, Progress, Row, finish, made_of, path_of
from vibrissa.study.virtual_sweep import film_of
from vibrissa.sweep.engine import Engine

if TYPE_CHECKING:
    import xarray as xr

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
        ``run_motion`` (repetition, run, run_time) [m], cut to the shortest, ``run_correlation`` and
        ``run_correlation_others`` (repetition, run), of whole runs; see :func:`vibrissa.study.repeats.film_repeats`.
        None if no sweep was accepted.

    Raises
    ------
    InputError
        If a sweep cannot be run again.
    """
    able = np.flatnonzero(sweeps.accepted.values)
    chosen = able[np.unique(np.linspace(0, len(able) - 1, count).round().astype(int))] if len(able) else able
    planned = plan(laboratory)[0]
    rows = finish(
        [_job(laboratory, planned[i]) for i in chosen.tolist()], out / FOLDER, "repeated runs", engine, progress
    )
    if wrong := [row["rejected"] for row in rows if not row["accepted"]]:
        raise InputError("repeated runs", f"could not be made ({wrong[0]})")
    made = [load(path_of(out / FOLDER, row["address"])) for row in rows]
    if not made:
        return None
    found = [run_correlations(one.run_motion.values) for one in made]
    shortest = min((one.run_time.values for one in made), key=len)
    told = {name: value for name, value in made[0].attrs.items() if name.startswith("jitter_")}
    return dataset(
        told,
        run_time=shortest,
        run_motion=np.concatenate([one.run_motion.values[..., : len(shortest)] for one in made]),
        run_correlation=np.concatenate([with_mean for with_mean, _ in found]),
        run_correlation_others=np.concatenate([with_others for _, with_others in found]),
    )


def _job(laboratory: Laboratory, sweep: VirtualSweep) -> Job:
    told = asdict(laboratory) | {"runs": RUNS}
    return Job({}, partial(_repeated, laboratory, sweep), made_of(repeats=told, sweep=asdict(replace(sweep, number=0))))


def _repeated(laboratory: Laboratory, sweep: VirtualSweep) -> tuple[Row, xr.Dataset]:
    rng = laboratory.rng(REPEAT, *sweep.key)
    prediction = predict(sweep.whisker, sweep.posture, laboratory.grating(sweep.key[3]), sweep.scan)
    film = film_of(prediction, laboratory, rng)
    return {}, film_repeats(prediction, film, rng=rng, n_runs=RUNS, n_repetitions=1)
