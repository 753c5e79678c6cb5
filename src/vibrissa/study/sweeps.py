"""Many sweeps on all cores: each is a file, written whole; what is there already is not done again."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa import __version__
from vibrissa.errors import ConvergenceError, InputError
from vibrissa.files import load, save
from vibrissa.quantities import dataset
from vibrissa.study.laboratory import Laboratory, VirtualSweep, plan
from vibrissa.study.recorded_sweeps import RecordedSweep, read_sweeps, recorded_sweep
from vibrissa.study.sweep_analysis import Row
from vibrissa.study.sweep_table import sweep_table
from vibrissa.study.virtual_sweep import virtual_sweep

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[str, int, int], None]

_COUNTS = ("animals", "conditions", "textures", "runs")  # do not change the sweeps, only how many there are
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Job:
    """One sweep to be done.

    Attributes
    ----------
    number : int
        In the table.
    row : dict
        What is known of it beforehand: the table's coordinates.
    work : callable
        Gives the rest of the row and the time series.
    mark : str
        What made it; a file of the same mark is the sweep's.
    """

    number: int
    row: Row
    work: Callable[[], tuple[Row, xr.Dataset]]
    mark: str


def run_laboratory(
    laboratory: Laboratory, out: str | Path, *, workers: int | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Make, film and analyse the sweeps of a virtual laboratory.

    Parameters
    ----------
    laboratory : Laboratory
        Equal ones give equal bytes.
    out : path
        Folder of ``sweeps.nc`` and ``sweeps/NNNN.nc``; made if absent. Sweeps of the same laboratory that are there
        already are kept.
    workers : int, optional
        Processes; one per core by default. With 1 everything is done in this one.
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
    planned, impossible = plan(laboratory)
    told = {name: value for name, value in asdict(laboratory).items() if name not in _COUNTS}
    jobs = [_virtual_job(laboratory, sweep, told) for sweep in planned]
    counted = {f"impossible_{reason}": count for reason, count in impossible.items()}
    attrs = {"laboratory": json.dumps(asdict(laboratory), sort_keys=True), **counted}
    return run_jobs(jobs, Path(out), attrs, workers, progress)


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
    return Job(sweep.number, row, partial(virtual_sweep, laboratory, sweep), mark_of(told, repr(sweep)))


def run_recorded(
    table: str | Path, out: str | Path, *, workers: int | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Analyse a user's sweeps, listed in a table; a bad one is reported, and the others go on.

    Parameters
    ----------
    table : path
        See :func:`vibrissa.study.recorded_sweeps.read_sweeps`.
    out, workers, progress
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
    entries = read_sweeps(table)
    names = list(dict.fromkeys(entry.texture for entry in entries if entry.texture is not None))
    jobs = [_recorded_job(number, entry, names) for number, entry in enumerate(entries)]
    return run_jobs(jobs, Path(out), {"textures": json.dumps(names), "table": Path(table).name}, workers, progress)


def _recorded_job(number: int, entry: RecordedSweep, names: list[str]) -> Job:
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
    files = [entry.folder / name for name in (entry.movie, entry.track, entry.texture) if name is not None]
    stamps = [file.stat().st_mtime_ns if file.is_file() else 0 for file in files]
    return Job(number, row, partial(recorded_sweep, entry), mark_of(stamps, repr(entry)))


def mark_of(*what: Any) -> str:
    """Mark of what is made of these (JSON), by this version."""
    return hashlib.sha256(json.dumps([__version__, *what], sort_keys=True).encode()).hexdigest()


def run_jobs(
    jobs: Sequence[Job],
    out: Path,
    attrs: dict[str, Any],
    workers: int | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Do what is not there yet, then gather the table and save it."""
    folder = out / "sweeps"
    finish(jobs, folder, "sweeps", workers, progress)
    rows = [_kept(job, folder) for job in jobs]
    table = sweep_table([row for row in rows if row is not None], attrs)
    save(table, out / "sweeps.nc")
    return table


def finish(
    jobs: Sequence[Job], folder: Path, stage: str, workers: int | None = None, progress: Progress | None = None
) -> None:
    """Do the jobs whose file is not in the folder yet, on all cores; each writes its own, whole.

    Parameters
    ----------
    jobs : sequence of Job
        What is wanted.
    folder : Path
        Made if absent.
    stage : str
        What the progress is told of.
    workers, progress
        As in :func:`run_laboratory`.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(folder), f"could not be written ({error.strerror or error})") from error
    missing = [job for job in jobs if _kept(job, folder) is None]
    tell = progress or (lambda *_: None)
    _compute(missing, folder, workers or os.cpu_count() or 1, partial(tell, stage), len(jobs))


def _compute(jobs: list[Job], folder: Path, workers: int, progress: Callable[[int, int], None], total: int) -> None:
    from dask.base import compute
    from dask.callbacks import Callback
    from dask.delayed import delayed

    done = total - len(jobs)

    def count(*_: object) -> None:
        nonlocal done
        done += 1
        progress(done, total)

    scheduler = "synchronous" if workers == 1 or len(jobs) < 2 else "processes"
    tasks = [delayed(do)(job, folder) for job in jobs]
    with Callback(posttask=count), _one_thread():  # type: ignore[no-untyped-call]
        compute(*tasks, scheduler=scheduler, num_workers=workers, chunksize=1)  # type: ignore[no-untyped-call]


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let processes that start now use one thread each: there are as many as cores."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def do(job: Job, folder: Path) -> None:
    """Do one sweep and write its file; one that cannot be analysed leaves the reason."""
    try:
        row, series = job.work()
        row = job.row | row | {"accepted": True, "rejected": ""}
    except (InputError, ConvergenceError, OSError) as error:
        row, series = job.row | {"accepted": False, "rejected": str(error)}, dataset()
    plain = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in row.items()}
    save(series.assign_attrs(row=json.dumps(plain), mark=job.mark), series_path(folder, job.number))


def series_path(folder: Path, number: int) -> Path:
    """File of one sweep's time series."""
    return folder / f"{number:04d}.nc"


def read_series(out: str | Path, sweep: int) -> xr.Dataset:
    """Time series of one sweep, of the folder that holds ``sweeps.nc``.

    Returns
    -------
    Dataset
        ``mode_displacement`` and ``envelope``; ``mode_displacement_model`` and ``envelope_model`` where the texture
        is known, ``mode_displacement_true`` where the sweep is virtual (mode, time), over L. No variable if the sweep
        was rejected.
    """
    return load(series_path(Path(out) / "sweeps", sweep))


def _kept(job: Job, folder: Path) -> Row | None:
    """Row of a sweep that was done before, if it was made by the same."""
    path = series_path(folder, job.number)
    if not path.is_file():
        return None
    attrs = load(path).attrs
    if attrs.get("mark") != job.mark:
        return None
    return {
        name: np.array(value) if isinstance(value, list) else value for name, value in json.loads(attrs["row"]).items()
    }
