"""Files: results whole or not at all, equal bytes for equal results; the lines and numbers of a table."""

from __future__ import annotations

import csv
import fcntl
import hashlib
import os
import platform
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.errors import InputError, MachineError

if TYPE_CHECKING:
    import xarray as xr


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Give a temporary name beside ``path``; rename it to ``path`` when all went well, else remove it.

    The temporary name keeps the suffix, by which writers choose their format.

    Raises
    ------
    InputError
        If the folder does not exist; :class:`~vibrissa.errors.MachineError` if the disk is full.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise InputError(str(path.parent), "must be an existing folder", remedy="make it, or choose another")
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())  # else a power cut may leave the name without the content
        os.replace(temporary, path)
    except OSError as error:
        raise MachineError(str(path), f"could not be written ({error.strerror or error})") from error
    finally:
        temporary.unlink(missing_ok=True)


def save(data: xr.Dataset, path: str | Path) -> None:
    """Write a dataset as NetCDF (netCDF-4 through h5netcdf), whole or not at all.

    The file is built in memory first: the HDF5 library crashes where a disk fills up under it.
    """
    content = encoded(data)
    with written_whole(path) as temporary:
        temporary.write_bytes(content)


def encoded(data: xr.Dataset) -> bytes:
    """NetCDF of a dataset, equal bytes for equal datasets.

    It is built in a thread of its own. A profiler, as the one in every worker of Dask, keeps what it sees in a thread
    alive for a moment; HDF5 then gives up the room of what it has deleted later, and lays the file out in another way.
    """
    with ThreadPoolExecutor(1) as unseen:
        return bytes(unseen.submit(data.to_netcdf, engine="h5netcdf").result())


def load(path: str | Path) -> xr.Dataset:
    """Read a dataset written by :func:`save` into memory.

    Raises
    ------
    InputError
        If the file is missing or is no NetCDF file.
    """
    import xarray as xr

    if not Path(path).is_file():
        raise InputError(str(path), "must be an existing file")
    try:
        return xr.load_dataset(path, engine="h5netcdf", decode_times=False)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(str(path), "must be a NetCDF file written by vibrissa", remedy=str(error)) from error


@contextmanager
def held(folder: str | Path) -> Iterator[Path]:
    """Hold a folder of results, which need not exist yet, for this process alone; gives an empty folder beside it.

    What makes the results writes into the folder that is given, and moves what is whole. It is removed in the end, and
    a lock beside it; those that a killed process left are taken over.

    Raises
    ------
    InputError
        If another process holds it, or its parent does not exist or cannot be written.
    """
    folder = Path(folder).absolute()
    if not folder.parent.is_dir():
        raise InputError(str(folder.parent), "must be an existing folder", remedy="make it, or choose another --out")
    if folder.exists() and not folder.is_dir():
        raise InputError(str(folder), "must be a folder", remedy="choose another --out")
    lock, work = folder.with_name(f".{folder.name}.lock"), folder.with_name(f".{folder.name}.part")
    with _locked(lock, folder):
        try:
            shutil.rmtree(work, ignore_errors=True)
            work.mkdir()
            yield work
        except OSError as error:
            raise MachineError(str(folder), f"could not be written ({error.strerror or error})") from error
        finally:
            shutil.rmtree(work, ignore_errors=True)


@contextmanager
def _locked(lock: Path, folder: Path) -> Iterator[None]:
    """The system lets go of the lock when this process ends, whatever ends it."""
    try:
        file = open(lock, "a+", encoding="utf-8")  # noqa: SIM115 (closed below; here its own error is told)
    except OSError as error:
        raise InputError(str(folder), f"could not be written ({error.strerror or error})") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            file.seek(0)
            remedy = "wait for it, or choose another --out"
            raise InputError(str(folder), "must not be in use", file.read() or "another run's", remedy) from error
        if not lock.exists() or not os.path.samestat(os.fstat(file.fileno()), lock.stat()):
            raise InputError(str(folder), "must not be in use", "a run that just ended", "try again")
        file.truncate(0)
        file.write(f"process {os.getpid()} on {platform.node()}")
        file.flush()
        try:
            yield
        finally:
            lock.unlink(missing_ok=True)


def digest(path: str | Path) -> str:
    """SHA-256 of a file, or of all files of a folder with their names; nothing where it cannot be read."""
    path = Path(path)
    if path.is_dir():
        parts = [f"{part.name} {digest(part)}" for part in sorted(path.iterdir()) if part.is_file()]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def text_lines(path: str | Path) -> list[tuple[int, str]]:
    """Lines of a UTF-8 text that are neither blank nor a comment (``#``), each with its number in the file.

    Raises
    ------
    InputError
        If there is no such file, or it cannot be read, or is no text.
    """
    if not Path(path).is_file():
        raise InputError(str(path), "must be an existing file")
    try:
        with open(path, encoding="utf-8-sig") as file:
            return [
                (number, line)
                for number, line in enumerate(file, 1)
                if line.strip() and not line.lstrip().startswith("#")
            ]
    except OSError as error:
        raise InputError(str(path), f"could not be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise InputError(str(path), f"must be text ({error})", remedy="save it as CSV, UTF-8") from error


def csv_lines(path: str | Path) -> list[tuple[int, list[str]]]:
    """Cells of every line of :func:`text_lines`, separated by commas, without spaces around them."""
    lines = text_lines(path)
    try:
        return [(number, [cell.strip() for cell in next(csv.reader([line]))]) for number, line in lines]
    except csv.Error as error:
        raise InputError(str(path), f"must be text ({error})", remedy="save it as CSV, UTF-8") from error


def as_number(cell: str) -> float:
    """Value of a cell; NaN where it is no number (nor ``1_0``, which Python would read as ten)."""
    try:
        return float("nan" if "_" in cell else cell)
    except ValueError:
        return float("nan")
