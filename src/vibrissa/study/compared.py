"""Prediction against measurement over all sweeps of a study: on all cores, resumed where it stopped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import ConvergenceError, InputError
from vibrissa.files import load
from vibrissa.mechanics.comparison import compare_sweeps, found_scan
from vibrissa.mechanics.superposition import Prediction, predict
from vibrissa.study.gratings import Textures
from vibrissa.study.phase_jitter import jittered
from vibrissa.study.store import Job, Progress, Row, finish, made_of, path_of
from vibrissa.study.sweeps import FOLDER, read_series
from vibrissa.sweep.engine import Engine
from vibrissa.texture.io import read_troughs
from vibrissa.texture.surface import Troughs

if TYPE_CHECKING:
    import xarray as xr

_TOLD = ("largest_lag", "pseudo_textures", "vibrissa_version")


def textures_of(table: str | Path, sweeps: xr.Dataset) -> Textures:
    """Give the textures that a user's table names, by their numbers in the table of sweeps."""
    folder, names = Path(table).parent, json.loads(sweeps.attrs["textures"])
    return lambda number: read_troughs(folder / names[number])


def compare_all(
    sweeps: xr.Dataset, out: Path, gratings: Sequence[Troughs], *, engine: Engine | None, progress: Progress
) -> xr.Dataset | None:
    """Hold the prediction of every accepted sweep against its measurement.

    Parameters
    ----------
    sweeps : Dataset
        The table of sweeps.
    out : Path
        Its folder; each sweep's result is kept in a file of ``comparison``.
    gratings : sequence of Troughs
        From :func:`new_gratings`.
    engine, progress
        Who does the work; called with ("comparing", done, total).

    Returns
    -------
    Dataset or None
        See :func:`vibrissa.mechanics.comparison.compare_sweeps`; None if no sweep has a prediction.
    """
    import xarray as xr

    if not np.isfinite(sweeps.mode_rms_model.values).any():
        return None
    numbers = sweeps.sweep.values.tolist()
    jobs = [_job(sweeps.isel(sweep=[i]), out, list(gratings)) for i in range(len(numbers))]
    found = finish(jobs, out / "comparison", "comparing", engine, progress)
    for row in found:
        if not row["accepted"]:
            raise InputError("comparison", "could not be made", row["rejected"])
    rows = [load(path_of(out / "comparison", row["address"])) for row in found]
    rows = [row.assign_coords(sweep=[number]) for row, number in zip(rows, numbers, strict=True)]
    whole = xr.concat(rows, "sweep", combine_attrs="drop")
    addresses = xr.Variable("sweep", [row["address"] for row in found], dict(sweeps.address.attrs))
    return whole.assign(address=addresses).assign_attrs({name: rows[0].attrs[name] for name in _TOLD})


def _job(row: xr.Dataset, out: Path, gratings: list[Troughs]) -> Job:
    series = path_of(out.absolute() / FOLDER, str(row.address.values[0]))
    drawn = [hashlib.sha256(np.concatenate([one.position, one.width]).tobytes()).hexdigest() for one in gratings]
    of = made_of(comparison_of=str(row.address.values[0]), gratings=drawn)
    return Job({}, partial(_compared, row.assign_coords(sweep=[0]), series, gratings), of)


def _compared(row: xr.Dataset, series: Path, gratings: list[Troughs]) -> tuple[Row, xr.Dataset]:
    return {}, compare_sweeps(row, lambda _: load(series), gratings)


def jitter_of(sweeps: xr.Dataset, out: Path, textures: Textures, count: int) -> xr.Dataset | None:
    """What jitter of the tip does to the correlation, in some sweeps spread over the table.

    Returns
    -------
    Dataset or None
        See :func:`vibrissa.study.phase_jitter.jittered`; None if no sweep has a texture that its posture can cross.
    """
    able = np.flatnonzero(sweeps.accepted.values.astype(bool) & (sweeps.texture.values >= 0))
    chosen = able[np.unique(np.linspace(0, len(able) - 1, count).round().astype(int))] if len(able) else able
    predictions: list[Prediction] = []
    for i in chosen.tolist():
        one = sweeps.isel(sweep=i)
        whisker, posture, scan = found_scan(one)
        try:
            predictions.append(predict(whisker, posture, textures(int(one.texture)), scan, n_modes=1))
        except (InputError, ConvergenceError):
            continue
    if not predictions:
        return None
    time = read_series(out, int(sweeps.sweep[chosen[0]])).time.values
    return jittered(predictions, time, rng=np.random.default_rng(0))
