"""Files: results whole or not at all, equal bytes for equal results."""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.errors import ConflictError, FormatError, MachineError, MissingError

if TYPE_CHECKING:
    import xarray as xr

_PACKED = {"zlib": True, "complevel": 4, "shuffle": True}  # level 9 takes three times as long for 1 % less
_SCALE, _NO_VARIABLE = b"DIMENSION_SCALE", b"This is a netCDF dimension but not a netCDF variable"
_LARGE = 1 << 14  # bytes: of less, the index of the chunks costs what is won


def existing(path: str | Path) -> Path:
    """Give the path of a file that is there.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Path
        The same.

    Raises
    ------
    MissingError
        If no file is there.
    """
    if not Path(path).is_file():
        raise MissingError(str(path), "must be an existing file")
    return Path(path)


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Give a temporary name beside ``path``; rename it to ``path`` when all went well, else remove it.

    The temporary name keeps the suffix, by which writers choose their format.

    Parameters
    ----------
    path : path
        Name of the file; its folder exists.

    Returns
    -------
    iterator of Path
        One name, of a file that does not exist yet.

    Raises
    ------
    InputError
        If the folder does not exist; :class:`~vibrissa.errors.MachineError` if the disk is full.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise MissingError(str(path.parent), "must be an existing folder", remedy="make it, or choose another")
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    with _writing(path):
        try:
            yield temporary
            with open(temporary, "rb+") as written:
                os.fsync(written.fileno())  # else a power cut may leave the name without the content
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise MachineError(str(path), f"could not be written ({error.strerror or error})") from error


def save(data: xr.Dataset, path: str | Path) -> None:
    """Write a dataset as NetCDF (netCDF-4 through h5netcdf), whole or not at all.

    The file is built in memory first: the HDF5 library crashes where a disk fills up under it.

    Parameters
    ----------
    data : Dataset
        What is written.
    path : path
        Name of the file; one that is there is replaced.

    Raises
    ------
    InputError
        As :func:`written_whole`.
    """
    content = encoded(data)
    with written_whole(path) as temporary:
        temporary.write_bytes(content)


def encoded(data: xr.Dataset) -> bytes:
    """NetCDF of a dataset, equal bytes for equal datasets; large arrays of floats are compressed, without loss.

    It is built in another thread. A profiler, as the one in every worker of Dask, keeps what it sees in a thread
    alive for a moment; HDF5 then gives up the room of what it has deleted later, and lays the file out in another way.

    Parameters
    ----------
    data : Dataset
        What is encoded.

    Returns
    -------
    bytes
        Content of a NetCDF file.
    """
    plain = data.drop_encoding()  # of a file that it was read from
    large = {name: _PACKED for name, one in plain.variables.items() if one.dtype.kind == "f" and one.nbytes >= _LARGE}
    with ThreadPoolExecutor(1) as unseen:
        return bytes(unseen.submit(plain.to_netcdf, engine="h5netcdf", encoding=large).result())


def load(path: str | Path) -> xr.Dataset:
    """Read a dataset written by :func:`save` into memory.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Dataset
        All of the file.

    Raises
    ------
    InputError
        If the file is missing or is no NetCDF file.
    """
    import xarray as xr
    from xarray.backends import InMemoryDataStore

    path = existing(path)
    try:
        stored = _stored(path)
        if stored is None:
            return xr.load_dataset(path, engine="h5netcdf", decode_times=False)
        return xr.load_dataset(InMemoryDataStore(*stored), decode_times=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, KeyError) as error:
        raise FormatError(str(path), "must be a NetCDF file written by vibrissa", remedy=str(error)) from error


def _stored(path: Path) -> tuple[dict[str, xr.Variable], dict[str, Any]] | None:
    """Variables and attributes, their conventions not decoded; None of a file that names dimensions in another way.

    h5netcdf looks for every dimension anew at each variable, which takes longer than all else.
    """
    import h5py
    import xarray as xr
    from h5netcdf.attrs import Attributes

    def attrs(of: h5py.HLObject) -> dict[str, Any]:
        return dict(Attributes(of.attrs, h5py.check_dtype, h5py))

    with h5py.File(path, "r") as file:
        scales = {one.attrs["_Netcdf4Dimid"]: name for name, one in file.items() if one.attrs.get("CLASS") == _SCALE}
        variables = {}
        for name, one in file.items():
            if one.attrs.get("NAME", b"").startswith(_NO_VARIABLE):
                continue
            if not isinstance(one, h5py.Dataset) or (one.ndim and "_Netcdf4Coordinates" not in one.attrs):
                return None
            dims = [scales[place] for place in one.attrs["_Netcdf4Coordinates"]] if one.ndim else []
            words = h5py.check_string_dtype(one.dtype) is not None
            values, encoding = (one.asstr()[()], {"dtype": str}) if words else (one[()], {})
            variables[name] = xr.Variable(dims, values, attrs(one), encoding)
        return variables, attrs(file)


def attributes(path: str | Path) -> dict[str, Any]:
    """Read the attributes alone of a dataset written by :func:`save`.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    dict
        Attributes by name.

    Raises
    ------
    InputError
        If the file is missing or is no NetCDF file.
    """
    import h5netcdf

    path = existing(path)
    try:
        with h5netcdf.File(path, "r") as file:
            return dict(file.attrs)
    except (OSError, ValueError, KeyError) as error:
        raise FormatError(str(path), "must be a NetCDF file written by vibrissa", remedy=str(error)) from error


@contextmanager
def held(folder: str | Path) -> Iterator[Path]:
    """Hold a folder of results, which need not exist yet, for this process alone; gives an empty folder beside it.

    The caller writes its results into the empty folder, and moves them when they are whole. That folder and a lock
    beside it are removed in the end; those that a killed process left are taken over.

    Parameters
    ----------
    folder : path
        Of the results.

    Returns
    -------
    iterator of Path
        The empty folder.

    Raises
    ------
    InputError
        If another process holds it, or its parent does not exist or cannot be written.
    """
    folder = Path(folder).absolute()
    if not folder.parent.is_dir():
        raise MissingError(str(folder.parent), "must be an existing folder", remedy="make it, or choose another `out`")
    if folder.exists() and not folder.is_dir():
        raise MissingError(str(folder), "must be a folder", remedy="choose another `out`")
    work = folder.with_name(f".{folder.name}.part")
    with _writing(folder), _locked(folder):
        try:
            shutil.rmtree(work, ignore_errors=True)
            work.mkdir()
            yield work
        finally:
            shutil.rmtree(work, ignore_errors=True)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock a file beside a folder; the system lets go of it when this process ends, whatever ends it."""
    from filelock import FileLock, Timeout

    lock, holder = (folder.with_name(f".{folder.name}.{part}") for part in ("lock", "holder"))
    taken = FileLock(lock, blocking=False)
    try:
        taken.acquire()
    except Timeout as error:
        who = "another run's"
        with suppress(OSError):
            who = holder.read_text(encoding="utf-8") or who
        raise ConflictError(str(folder), "must not be in use", who, "wait for it, or choose another `out`") from error
    try:
        holder.write_text(f"process {os.getpid()} on {platform.node()}", encoding="utf-8")
        yield
    finally:
        holder.unlink(missing_ok=True)
        with suppress(PermissionError):  # where an open file cannot be removed it stays, locked by no one
            lock.unlink(missing_ok=True)
        taken.release()


def digest(path: str | Path) -> str:
    """SHA-256 of a file, or of all files of a folder with their names; nothing where it cannot be read.

    Parameters
    ----------
    path : path
        A file or a folder.

    Returns
    -------
    str
        64 digits, or nothing.
    """
    path = Path(path)
    if path.is_dir():
        parts = [f"{part.name} {digest(part)}" for part in sorted(path.iterdir()) if part.is_file()]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""
