"""Results on disk: whole or not at all, equal bytes for equal results."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Give a temporary name beside ``path``; rename it to ``path`` when all went well, else remove it.

    The temporary name keeps the suffix, by which writers choose their format.

    Raises
    ------
    InputError
        If the folder does not exist, or the disk is full.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise InputError(str(path.parent), "must be an existing folder", remedy="make it, or choose another --out")
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(str(path), f"could not be written ({error.strerror or error})") from error
    finally:
        temporary.unlink(missing_ok=True)


def save(data: xr.Dataset, path: str | Path) -> None:
    """Write a dataset as NetCDF (netCDF-4 through h5netcdf), whole or not at all.

    The file is built in memory first: the HDF5 library crashes where a disk fills up under it.
    """
    content = data.to_netcdf(engine="h5netcdf")
    with written_whole(path) as temporary:
        temporary.write_bytes(content)


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
