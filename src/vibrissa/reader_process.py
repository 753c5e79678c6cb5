"""Readers in a separate process: damaged HDF5 and MATLAB files crash or hang the libraries that read them."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vibrissa.errors import FormatError

PATIENCE, PACE = 30.0, 1e6  # [s] and [bytes/s] granted to the library, which a damaged file may keep busy for ever
_HDF5 = b"\x89HDF\r\n\x1a\n"
DAMAGED = (OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError, MemoryError)


def tables_read_by(module: str, path: Path, rule: str) -> Mapping[str, np.ndarray]:
    """Tables of a file, read by a module that runs as a process with a limit of time.

    Parameters
    ----------
    module : str
        Its name; it ends in a call of :func:`write_tables`.
    path : path
        A file that exists.
    rule : str
        What the file must be, for the message.

    Returns
    -------
    mapping
        An array for each name that the module writes.

    Raises
    ------
    FormatError
        If the module refuses the file, crashes on it, or does not end in time.
    """
    limit = PATIENCE + path.stat().st_size / PACE
    try:
        reader = _process(module, path, limit)
    except subprocess.TimeoutExpired as error:
        raise FormatError(str(path), f"must be readable within {limit:.0f} s", remedy="the file is damaged") from error
    if reader.returncode:
        said = reader.stderr.decode(errors="replace").strip().splitlines()
        crashed = reader.returncode < 0 or not said  # by a signal
        raise FormatError(str(path), rule, remedy="the file is damaged: its reader crashed" if crashed else said[-1])
    return np.load(io.BytesIO(reader.stdout))


def refuse_endless(path: Path) -> None:
    """Refuse a damaged file of HDF5 on which the library would run for ever, or crash; any other file passes.

    Parameters
    ----------
    path : path
        A file that exists.

    Raises
    ------
    FormatError
        If a process that looks through it does not end in time, or is ended by a signal.
    """
    with open(path, "rb") as file:
        if file.read(len(_HDF5)) != _HDF5:
            return
    limit = PATIENCE + path.stat().st_size / PACE
    rule, damaged = "must be a whole file of HDF5", "the file is damaged: its reader {}"
    try:
        walker = _process("vibrissa.hdf5_walk", path, limit)
    except subprocess.TimeoutExpired as error:
        raise FormatError(str(path), rule, remedy=damaged.format(f"does not end within {limit:.0f} s")) from error
    if walker.returncode < 0:
        raise FormatError(str(path), rule, remedy=damaged.format("crashed"))


def _process(module: str, path: Path, limit: float) -> subprocess.CompletedProcess[bytes]:
    """Run a module on a file; -P keeps the folder of the data off the path on which modules are looked for."""
    return subprocess.run([sys.executable, "-P", "-m", module, str(path)], capture_output=True, timeout=limit)


def write_tables(tables_of: Callable[[Path], Mapping[str, Any]]) -> None:
    """Write the tables of the file that the command line names to standard output, or one line on the error.

    Parameters
    ----------
    tables_of : callable
        Reads the file; returns an array for each name.
    """
    try:
        np.savez(sys.stdout.buffer, **tables_of(Path(sys.argv[1])))
    except DAMAGED as damage:
        sys.exit(" ".join(str(damage).split()) or type(damage).__name__)
