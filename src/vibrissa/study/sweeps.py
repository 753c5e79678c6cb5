"""Many sweeps on all cores: each is a file, written whole; what is there already is not done again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.files import digest, load, save
from vibrissa.study.laboratory import Laboratory, VirtualSweep, plan
from vibrissa.study.recorded_sweeps import RecordedSweep, read_sweeps, recorded_sweep
from vibrissa.study.store import Job, Progress, finish, made_of, path_of
from vibrissa.study.sweep_table import sweep_table
from vibrissa.study.virtual_sweep import virtual_sweep
from vibrissa.sweep.engine import Engine

if TYPE_CHECKING:
    import xarray as xr

FOLDER = "sweeps"  # of the results' folder

_COUNTS = ("animals", "whiskers", "conditions", "textures", "runs")  # do not change the sweeps, only how many there are


def run_laboratory(
    laboratory: Laboratory, out: str | Path, *, engine: Engine | None = None, progress: Progress | None = None
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
        Called with ("sweeps", done, total).

    Returns
    -------
    Dataset
        ``sweeps``, see :func:`vibrissa.study.sweep_table.sweep_table`. Attributes: ``laboratory`` (JSON) and
        ``impossible_height``, ``impossible_contact``, ``impossible_fold``, conditions that were drawn anew.

    Raises
    ------
    InputError
        If the laboratory finds no posture, or the folder cannot be written.
    """
    jobs, impossible = laboratory_jobs(laboratory)
    counted = {f"impossible_{reason}": count for reason, count in impossible.items()}
    attrs = {"laboratory": json.dumps(asdict(laboratory), sort_keys=True), **counted}
    return run_jobs(jobs, Path(out), attrs, engine, progress)


def laboratory_jobs(laboratory: Laboratory) -> tuple[list[Job], dict[str, int]]:
    """Sweeps of a laboratory, and how many conditions were drawn anew, by reason."""
    planned, impossible = plan(laboratory)
    told = {name: value for name, value in asdict(laboratory).items() if name not in _COUNTS}
    return [_virtual_job(laboratory, sweep, told) for sweep in planned], impossible


def _virtual_job(laboratory: Laboratory, sweep: VirtualSweep, told: dict[str, Any]) -> Job:
    _, _, condition, texture, run = sweep.key
    nominal = sweep.whisker.length, sweep.whisker.cone_angle
    row = {
        "animal": sweep.animal,
        "whisker_name": sweep.whisker_name,
        "texture": texture,
        "condition": condition,
        "run": run,
        "scan_speed": sweep.scan.speed,
        "base_height": sweep.base_height,
        "length": nominal[0],
        "cone_angle": nominal[1],
        "timescale": 2 * nominal[0] / nominal[1] * float(np.sqrt(laboratory.density / laboratory.youngs_modulus)),
    }
    of = made_of(laboratory=told, sweep=asdict(replace(sweep, number=0)))
    return Job(row, partial(virtual_sweep, laboratory, sweep), of)


def run_recorded(
    table: str | Path, out: str | Path, *, engine: Engine | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Analyse a user's sweeps, listed in a table; a bad one is reported, and the others go on.

    Parameters
    ----------
    table : path
        See :func:`vibrissa.study.recorded_sweeps.read_sweeps`.
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


def recorded_jobs(table: str | Path) -> tuple[list[Job], list[str]]:
    """Sweeps of a user's table, and the files of their textures."""
    entries = read_sweeps(table)
    names = list(dict.fromkeys(entry.texture for entry in entries if entry.texture is not None))
    return [_recorded_job(entry, names) for entry in entries], names


def kept_sweeps(jobs: Sequence[Job], out: str | Path) -> int:
    """How many of them are in the folder of results already."""
    return sum(path_of(Path(out) / FOLDER, job.address).is_file() for job in jobs)


def _recorded_job(entry: RecordedSweep, names: list[str]) -> Job:
    row = {
        "animal": entry.animal,
        "whisker_name": entry.whisker_name,
        "texture": -1 if entry.texture is None else names.index(entry.texture),
        "condition": entry.condition,
        "run": entry.run,
        "scan_speed": entry.scan_speed,
        "base_height": entry.base_height,
        "length": entry.whisker.length,
        "cone_angle": entry.whisker.cone_angle,
        "timescale": entry.whisker.timescale,
    }
    names_of_files = [name for name in (entry.movie, entry.track, entry.texture) if name is not None]
    contents = {name: digest(entry.folder / name) for name in names_of_files}
    of = made_of(files=contents, entry={**asdict(entry), "folder": ""})
    return Job(row, partial(recorded_sweep, entry), of)


def run_jobs(
    jobs: Sequence[Job], out: Path, attrs: dict[str, Any], engine: Engine | None, progress: Progress | None
) -> xr.Dataset:
    """Do what is not there yet, then gather the table and save it."""
    table = sweep_table(finish(jobs, out / FOLDER, "sweeps", engine, progress), attrs)
    save(table, out / "sweeps.nc")
    return table


def read_series(out: str | Path, sweep: int) -> xr.Dataset:
    """Time series of one sweep, of the folder that holds ``sweeps.nc``.

    Returns
    -------
    Dataset
        ``mode_displacement`` and ``envelope``; ``mode_displacement_model`` and ``envelope_model`` where the texture
        is known, ``mode_displacement_true`` where the sweep is virtual (mode, time), over L. No variable if the sweep
        was rejected.
    """
    table = (Path(out) / "sweeps.nc").absolute()
    return load(
        path_of(Path(out) / FOLDER, _addresses(table, table.stat().st_mtime_ns if table.is_file() else 0)[sweep])
    )


@lru_cache(maxsize=4)
def _addresses(table: Path, _: int) -> list[str]:
    """Addresses of a table's sweeps, read once for each state of the file."""
    return [str(address) for address in load(table).address.values]
