"""Results kept in files, each named by what it is made of: what is there already is not done again."""

from __future__ import annotations

import errno
import hashlib
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa import __version__
from vibrissa.errors import ConvergenceError, InputError, MachineError
from vibrissa.files import load, save
from vibrissa.quantities import dataset
from vibrissa.sweep.engine import Engine, each

if TYPE_CHECKING:
    import xarray as xr

Row = dict[str, Any]
Progress = Callable[[str, int, int], None]

_LETTERS = 24  # of an address: 96 bits
_PASSING = {errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE}  # errors that may pass by themselves


@dataclass(frozen=True)
class Job:
    """One piece of work whose result is a file.

    Attributes
    ----------
    row : dict
        What is known of it beforehand.
    work : callable
        A pure function: gives the rest of the row, and time series.
    made_of : str
        JSON of all that the result depends on, the version too; see :func:`made_of`.
    """

    row: Row
    work: Callable[[], tuple[Row, xr.Dataset]]
    made_of: str

    @cached_property
    def address(self) -> str:
        """Name of its file: the SHA-256 of ``made_of``."""
        return hashlib.sha256(self.made_of.encode()).hexdigest()[:_LETTERS]


def made_of(**what: Any) -> str:
    """Canonical JSON of what a result depends on, and of this version."""
    return json.dumps({"vibrissa_version": __version__, **what}, sort_keys=True)


def path_of(folder: Path, address: str) -> Path:
    """File of an address."""
    return folder / f"{address}.nc"


def finish(
    jobs: Sequence[Job], folder: Path, stage: str, engine: Engine | None = None, progress: Progress | None = None
) -> list[Row]:
    """Do the jobs whose file is not in the folder yet; each is written whole, by whoever does it.

    Parameters
    ----------
    jobs : sequence of Job
        What is wanted.
    folder : Path
        Made if absent; the workers of a cluster must see it under the same name.
    stage : str
        What the progress is told of.
    engine : Engine, optional
        Who does the work.
    progress : callable, optional
        Called with (stage, done, total).

    Returns
    -------
    list of dict
        Row of each job, with ``address``, ``accepted`` and ``rejected``.

    Raises
    ------
    MachineError
        If the folder cannot be written, the workers write somewhere else, or are lost.
    """
    folder = folder.absolute()
    new = [place for place in (folder, folder.parent) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.glob(".*.part*"):  # of a process that was killed
            left.unlink(missing_ok=True)
    except OSError as error:
        raise MachineError(str(folder), f"could not be written ({error.strerror or error})") from error
    rows = {job.address: kept_row(folder, job.address) for job in jobs}
    missing = list({job.address: job for job in jobs if rows[job.address] is None}.values())
    there = len(jobs) - len(missing)

    def tell(done: int, _: int) -> None:
        if progress is not None:
            progress(stage, there + done, len(jobs))

    try:
        each(partial(do, folder=folder), missing, engine or Engine(), tell)
    except InputError as error:  # what is wrong with a job stands in its row: this is none's
        with suppress(OSError):  # not empty
            for place in new:
                place.rmdir()
        raise MachineError(error.thing, error.said) from error
    for job in missing:
        rows[job.address] = kept_row(folder, job.address)
    return [_found(folder, job, rows[job.address]) for job in jobs]


def _found(folder: Path, job: Job, row: Row | None) -> Row:
    if row is None:
        remedy = "give --out on a file system that all see under the same name"
        raise MachineError(str(path_of(folder, job.address)), "must be seen by all workers", None, remedy)
    return row


def do(job: Job, folder: Path) -> None:
    """Do one job and write its file; one that cannot be done leaves the reason."""
    try:
        row, series = job.work()
        row = job.row | row | {"accepted": True, "rejected": ""}
    except (InputError, ConvergenceError, OSError, MemoryError) as error:
        _refuse_machine(error)
        row, series = job.row | {"accepted": False, "rejected": str(error)}, dataset()
    plain = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in row.items()}
    told = {"row": json.dumps(plain), "made_of": job.made_of, "address": job.address}
    save(series.assign_attrs(told), path_of(folder, job.address))


def _refuse_machine(error: Exception) -> None:
    """Raise what is no fault of the job, and may go well another time: it is not kept as its result."""
    if isinstance(error, MachineError):
        raise error
    if isinstance(error, MemoryError):
        raise MachineError("a worker", "has too little memory", None, "try fewer --workers") from error
    if isinstance(error, OSError) and error.errno in _PASSING:
        raise MachineError("a worker", "could not go on", error.strerror, "then give the same command again") from error


def kept_row(folder: Path, address: str) -> Row | None:
    """Row of a file that is there, whole and of this address; else nothing."""
    path = path_of(folder, address)
    if not path.is_file():
        return None
    try:
        attrs = load(path).attrs
    except InputError:  # cut off by a crash of the machine: it is done again
        return None
    if attrs.get("address") != address:
        return None
    row = json.loads(attrs["row"]) | {"address": address}
    return {name: np.array(value) if isinstance(value, list) else value for name, value in row.items()}
