"""Large maps as Zarr, in chunks that are read alone: a folder, whole or not at all."""

from __future__ import annotations

import os
import shutil
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.errors import ConflictError, MachineError, MissingError, PackageError, install

if TYPE_CHECKING:
    import xarray as xr


def refuse_zarr(path: Path) -> None:
    """Refuse, before any work, what cannot become a folder of Zarr.

    Parameters
    ----------
    path : Path
        Folder to be written.

    Raises
    ------
    InputError
        If zarr is not installed, the name is taken by something else, or its folder cannot be written.
    """
    if find_spec("zarr") is None or int(version("zarr").partition(".")[0]) < 3:  # xarray no longer writes with zarr 2
        raise PackageError("out", "needs zarr 3", str(path), f"{install('cluster')}, or a name in .nc")
    parent = path.absolute().parent
    if not (parent.is_dir() and os.access(parent, os.W_OK)):
        raise MissingError("out", "must lie in an existing folder that can be written", str(path), "choose another")
    if path.exists() and not (path / ".zgroup").is_file():
        raise ConflictError("out", "must be free, or a Zarr folder, which is replaced", str(path), "choose another")


def save_zarr(data: xr.Dataset, path: Path) -> None:
    """Write a dataset as Zarr of format 2, whole or not at all; one that is there is replaced.

    Parameters
    ----------
    data : Dataset
        What is written.
    path : Path
        Folder.

    Raises
    ------
    InputError
        See :func:`refuse_zarr`; or if the disk is full.
    """
    refuse_zarr(path)
    new, old = (path.absolute().with_name(f".{path.stem}.{os.getpid()}.{part}.zarr") for part in ("part", "old"))
    try:
        data.to_zarr(new, mode="w", zarr_format=2, consolidated=True, encoding=_checked(data))
        if path.exists():
            os.replace(path, old)
        os.replace(new, path)
    except OSError as error:
        raise MachineError(str(path), f"could not be written ({error.strerror or error})") from error
    finally:
        shutil.rmtree(new, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _checked(data: xr.Dataset) -> dict[str, dict[str, list[Any]]]:
    """A checksum for each chunk of numbers, which readers of Zarr verify."""
    from numcodecs import CRC32

    return {str(name): {"filters": [CRC32()]} for name, one in data.variables.items() if one.dtype.kind in "biuf"}
