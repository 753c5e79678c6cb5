"""Results kept in files, each named by what it is made of, so that stored results are reused."""

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
from vibrissa.netcdf import attributes, load, save
from vibrissa.quantities import dataset
from vibrissa.quantities.kinds import Progress
from vibrissa.sweep.engine import Engine, each

if TYPE_CHECKING:
    import xarray as xr

SweepRow = dict[str, Any]

_LETTERS = 24  # of an address: 96 bits
_PASSING = {  # errors that may pass by themselves, the last three of them of a network disk
    errno.ENOSPC, errno.EDQUOT, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EIO, errno.ESTALE, errno.ETIMEDOUT,
}  # fmt: skip


@dataclass(frozen=True)
class StoredWork:
    """One piece of work whose result is a file.

    Attributes
    ----------
    row : dict
        What is known of it beforehand, whatever a stored file says: it need not be in ``made_of``.
    work : callable
        A pure function: gives the rest of the row, and time series.
    made_of : str
        JSON of all that the result depends on, the version too; see :func:`made_of`.
    """

    row: SweepRow
    work: Callable[[], tuple[SweepRow, xr.Dataset]]
    made_of: str

    @cached_property
    def address(self) -> str:
        """Name of its file: the SHA-256 of ``made_of``."""
        return hashlib.sha256(self.made_of.encode()).hexdigest()[:_LETTERS]


def made_of(**what: Any) -> str:
    """Canonical JSON of what a result depends on, and of this version.

    Parameters
    ----------
    **what : dict
        Names → values that JSON has.

    Returns
    -------
    str
        JSON, keys sorted.
    """
    return json.dumps({"vibrissa_version": __version__, **what}, sort_keys=True)


def path_of(folder: Path, address: str) -> Path:
    """File of an address.

    Parameters
    ----------
    folder : Path
        Of the results.
    address : str
        Of one result.

    Returns
    -------
    Path
        Of NetCDF.
    """
    return folder / f"{address}.nc"


def finish(
    jobs: Sequence[StoredWork], folder: Path, stage: str, engine: Engine | None = None, progress: Progress | None = None
) -> list[SweepRow]:
    """Do the jobs whose file is not in the folder yet; each is written whole, by whoever does it.

    Parameters
    ----------
    jobs : sequence of StoredWork
        What is wanted.
    folder : Path
        Made if absent; the workers of a cluster must see it under the same name.
    stage : str
        Name under which the progress is reported.
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
        _remove_unfinished(folder)
    except OSError as error:
        raise MachineError(str(folder), f"could not be written ({error.strerror or error})") from error
    rows = {job.address: kept_row(folder, job.address) for job in jobs}
    missing = list({job.address: job for job in jobs if rows[job.address] is None}.values())
    there = len(jobs) - len(missing)

    def report(done: int, _: int) -> None:
        if progress is not None:
            progress(stage, there + done, len(jobs))

    report(0, 0)
    try:
        each(partial(do, folder=folder), missing, engine or Engine(), report)
    except InputError as error:  # an error of a job is kept in its row; this is one of the machine
        with suppress(OSError):  # not empty
            for place in new:
                place.rmdir()
        raise MachineError(error.quantity, error.rule, error.value, error.remedy) from error
    except KeyboardInterrupt:
        _remove_unfinished(folder)
        raise
    for job in missing:
        rows[job.address] = kept_row(folder, job.address)
    return [_found(folder, job, rows[job.address]) for job in jobs]


def finished(
    jobs: Sequence[StoredWork], folder: Path, stage: str, engine: Engine | None, progress: Progress | None
) -> list[xr.Dataset]:
    """Do the jobs as :func:`finish` does, and read what they made; all must succeed.

    Parameters
    ----------
    jobs, folder, stage, engine, progress
        As :func:`finish` takes them.

    Returns
    -------
    list of Datasets
        One for each job.

    Raises
    ------
    InputError
        If a job could not be done; and as :func:`finish`.
    """
    rows = finish(jobs, folder, stage, engine, progress)
    if wrong := [row["rejected"] for row in rows if not row["accepted"]]:
        raise InputError(stage, f"could not be made ({wrong[0]})")
    return [load(path_of(folder, row["address"])) for row in rows]


def _remove_unfinished(folder: Path) -> None:
    """Remove files that a process was writing when it was killed."""
    for left in folder.glob(".*.part*"):
        left.unlink(missing_ok=True)


def _found(folder: Path, job: StoredWork, row: SweepRow | None) -> SweepRow:
    if row is None:
        remedy = "give an `out` on a file system that all see under the same name"
        raise MachineError(str(path_of(folder, job.address)), "must be seen by all workers", None, remedy)
    return row | job.row


def do(job: StoredWork, folder: Path) -> None:
    """Do one job and write its file; one that cannot be done leaves the reason.

    Parameters
    ----------
    job : StoredWork
        What is done.
    folder : Path
        Where its file is written.

    Raises
    ------
    MachineError
        What the machine refuses.
    """
    try:
        row, series = job.work()
        row = job.row | row | {"accepted": True, "rejected": ""}
    except (InputError, ConvergenceError, OSError, MemoryError) as error:
        _refuse_machine(error)
        row, series = job.row | {"accepted": False, "rejected": str(error)}, dataset()
    plain = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in row.items()}
    attrs = {"row": json.dumps(plain), "made_of": job.made_of, "address": job.address}
    save(series.assign_attrs(attrs), path_of(folder, job.address))


def _refuse_machine(error: Exception) -> None:
    """Raise what is no fault of the job, and may go well another time: it is not kept as its result."""
    if isinstance(error, MachineError):
        raise error
    if isinstance(error, MemoryError):
        raise MachineError("a worker", "has too little memory", None, "try fewer `workers`") from error
    if isinstance(error, OSError) and error.errno in _PASSING:
        raise MachineError(
            "a worker", "could not continue", error.strerror, "then give the same command again"
        ) from error


def kept_row(folder: Path, address: str) -> SweepRow | None:
    """Row of a file that is there, whole and of this address; else nothing.

    Parameters
    ----------
    folder : Path
        Of the results.
    address : str
        Of one result.

    Returns
    -------
    dict or None
        The row, with ``address``.
    """
    path = path_of(folder, address)
    if not path.is_file():
        return None
    try:
        attrs = attributes(path)
    except InputError:  # cut off by a crash of the machine: it is done again
        return None
    if attrs.get("address") != address:
        return None
    row = json.loads(attrs["row"]) | {"address": address}
    return {name: np.array(value) if isinstance(value, list) else value for name, value in row.items()}
