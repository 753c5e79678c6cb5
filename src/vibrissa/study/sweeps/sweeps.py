"""Many sweeps on all cores: each is a file, written whole; stored sweeps are reused."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.files import digest
from vibrissa.netcdf import load, save
from vibrissa.quantities.kinds import Progress
from vibrissa.study.spec.inputs import with_companions
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.spec.parts import every_by_modes
from vibrissa.study.spec.recorded_sweeps import RecordedSweep, read_sweeps
from vibrissa.study.store.result_store import StoredWork, finish, made_of, path_of
from vibrissa.study.sweeps.laboratory import VirtualSweep, plan
from vibrissa.study.sweeps.recorded_sweeps import recorded_sweep
from vibrissa.study.sweeps.sweep_table import COORDINATES, sweep_table
from vibrissa.study.sweeps.virtual_sweep import virtual_sweep
from vibrissa.sweep.engine import Engine

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.spec.settings import Study

FOLDER = "sweeps"  # of the results' folder

_COUNTS = ("animals", "whiskers", "conditions", "textures", "runs")  # do not change the sweeps, only how many there are


def run_laboratory(
    laboratory: Laboratory,
    out: str | Path,
    *,
    engine: Engine | None = None,
    progress: Progress | None = None,
    every: int = 1,
    name: str = "sweeps",
) -> xr.Dataset:
    """Make, film and analyse the sweeps of a virtual laboratory.

    Parameters
    ----------
    laboratory : Laboratory
        Equal ones give equal bytes.
    out : path
        Folder of ``sweeps.nc`` and of ``sweeps``, with a file for each; made if absent. Sweeps that are there already
        are kept.
    engine : Engine, optional
        Who does the work; a process per core by default.
    progress : callable, optional
        Called with (``name``, done, total).
    every : int
        Only every n-th of the planned sweeps.
    name : str
        Of the table's file.

    Returns
    -------
    Dataset
        ``sweeps``, see :func:`vibrissa.study.sweeps.sweep_table.sweep_table`. Attributes: ``laboratory`` (JSON) and
        ``impossible_height``, ``impossible_contact``, ``impossible_fold``, conditions that were drawn anew.

    Raises
    ------
    InputError
        If the laboratory finds no posture, or the folder cannot be written.
    """
    jobs, impossible = laboratory_jobs(laboratory)
    counted = {f"impossible_{reason}": count for reason, count in impossible.items()}
    attrs = {"laboratory": json.dumps(asdict(laboratory), sort_keys=True), **counted}
    return run_jobs(jobs[::every], Path(out), attrs, engine, progress, name)


def laboratory_jobs(laboratory: Laboratory) -> tuple[list[StoredWork], dict[str, int]]:
    """Sweeps of a laboratory, and how many conditions were drawn again, by reason.

    Parameters
    ----------
    laboratory : Laboratory
        The virtual laboratory.

    Returns
    -------
    jobs : list of StoredWork
    impossible : dict
        Numbers by reason.
    """
    planned, impossible = plan(laboratory)
    settings = {name: value for name, value in asdict(laboratory).items() if name not in _COUNTS}
    return [_virtual_job(laboratory, sweep, settings) for sweep in planned], impossible


def _virtual_job(laboratory: Laboratory, sweep: VirtualSweep, settings: dict[str, Any]) -> StoredWork:
    _, _, condition, texture, run = sweep.key
    length, cone_angle = sweep.whisker.length, sweep.whisker.cone_angle
    timescale = 2 * length / cone_angle * float(np.sqrt(laboratory.density / laboratory.youngs_modulus))
    identity = (sweep.animal, sweep.whisker_name, texture, condition, run)
    row = _row(*identity, sweep.scan.speed, sweep.base_height, length, cone_angle, timescale)
    of = made_of(laboratory=settings, sweep=asdict(replace(sweep, number=0)))
    return StoredWork(row, partial(virtual_sweep, laboratory, sweep), of)


def _row(*values: Any) -> dict[str, Any]:
    """What is known of a sweep beforehand: values of ``COORDINATES``, in their order."""
    return dict(zip(COORDINATES, values, strict=True))


def run_recorded(
    table: str | Path, out: str | Path, *, engine: Engine | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Analyse a user's sweeps, listed in a table; a bad one is reported, and the others continue.

    Parameters
    ----------
    table : path
        See :func:`vibrissa.study.spec.recorded_sweeps.read_sweeps`.
    out, engine, progress
        As in :func:`run_laboratory`.

    Returns
    -------
    Dataset
        ``sweeps``; ``rejected`` says why a sweep could not be analysed. ``texture`` numbers the files of textures in
        the order in which they are named first, −1: unknown; the attribute ``textures`` (JSON) names them.

    Raises
    ------
    InputError
        If the table is bad, or the folder cannot be written.
    """
    jobs, names = recorded_jobs(table)
    return run_jobs(jobs, Path(out), {"textures": json.dumps(names), "table": Path(table).name}, engine, progress)


def recorded_jobs(table: str | Path) -> tuple[list[StoredWork], list[str]]:
    """Sweeps of a user's table, and the files of their textures.

    Parameters
    ----------
    table : path
        See :func:`vibrissa.study.spec.recorded_sweeps.read_sweeps`.

    Returns
    -------
    jobs : list of StoredWork
    names : list of str
        Files of textures.
    """
    entries = read_sweeps(table)
    names = list(dict.fromkeys(entry.texture for entry in entries if entry.texture is not None))
    return [_recorded_job(entry, names) for entry in entries], names


def study_jobs(study: Study) -> list[StoredWork]:
    """All sweeps of a study: of a laboratory, also those of the paper's model; of a table.

    Parameters
    ----------
    study : Study
        With ``laboratory`` or ``sweeps``; else none.

    Returns
    -------
    list of StoredWork
        One for each.
    """
    if study.sweeps is not None:
        return recorded_jobs(study.folder / study.sweeps)[0]
    if study.laboratory is None:
        return []
    jobs, every = laboratory_jobs(study.laboratory)[0], every_by_modes(study)
    return jobs + (laboratory_jobs(replace(study.laboratory, truth="modes"))[0][::every] if every else [])


def kept_sweeps(jobs: Sequence[StoredWork], out: str | Path) -> int:
    """How many of them are in the folder of results already.

    Parameters
    ----------
    jobs : sequence of StoredWork
        One for each sweep.
    out : path
        Folder of the results.

    Returns
    -------
    int
        0 without a folder.
    """
    return sum(path_of(Path(out) / FOLDER, job.address).is_file() for job in jobs)


def _recorded_job(entry: RecordedSweep, names: list[str]) -> StoredWork:
    texture, whisker = -1 if entry.texture is None else names.index(entry.texture), entry.whisker
    identity = (entry.animal, entry.whisker_name, texture, entry.condition, entry.run)
    geometry = (whisker.length, whisker.cone_angle, whisker.timescale)
    row = _row(*identity, entry.scan_speed, entry.base_height, *geometry)
    named = with_companions(entry.folder, filter(None, (entry.movie, entry.track, entry.texture)))
    contents = {name: digest(path) for name, path in named.items()}
    of = made_of(files=contents, entry={**asdict(entry), "folder": ""})
    return StoredWork(row, partial(recorded_sweep, entry), of)


def run_jobs(
    jobs: Sequence[StoredWork],
    out: Path,
    attrs: dict[str, Any],
    engine: Engine | None,
    progress: Progress | None,
    name: str = "sweeps",
) -> xr.Dataset:
    """Do what is not there yet, then gather the table and save it.

    Parameters
    ----------
    jobs : sequence of StoredWork
        One for each sweep.
    out : path
        Folder of the results.
    attrs : dict
        Attributes of the table.
    engine : Engine, optional
        Who does the work.
    progress : callable
        Called with (``name``, done, total).
    name : str
        Of the table's file.

    Returns
    -------
    Dataset
        ``sweeps``.
    """
    table = sweep_table(
        finish(jobs, out / FOLDER, name.replace("_modes", ", the paper's model"), engine, progress), attrs
    )
    save(table, out / f"{name}.nc")
    return table


def read_series(out: str | Path, sweep: int) -> xr.Dataset:
    """Time series of one sweep, of the folder that holds ``sweeps.nc``.

    Parameters
    ----------
    out : path
        Folder of the results.
    sweep : int
        Its number.

    Returns
    -------
    Dataset
        ``mode_displacement`` and ``envelope``; ``mode_displacement_model`` and ``envelope_model`` where the texture
        is known, ``mode_displacement_true`` where the sweep is virtual (mode, time), over L. No variable if the sweep
        was rejected.
    """
    table = (Path(out) / "sweeps.nc").absolute()
    state = table.stat().st_mtime_ns if table.is_file() else 0
    return load(path_of(Path(out) / FOLDER, _addresses(table, state)[sweep]))


@lru_cache(maxsize=4)
def _addresses(table: Path, _: int) -> list[str]:
    """Addresses of a table's sweeps, read once for each state of the file."""
    return [str(address) for address in load(table).address.values]
