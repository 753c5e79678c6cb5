"""Numeric arrays of a file of MATLAB of any version, read in a process: damaged ones crash the libraries."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrissa.binary import COPIES
from vibrissa.limits import require_memory
from vibrissa.reader_process import write_tables


def _tables(path: Path) -> dict[str, Any]:
    """Arrays of numbers by name, their dimensions as MATLAB shows them."""
    if h5py.is_hdf5(path):
        with h5py.File(path) as file:
            arrays = {name: one for name, one in file.items() if isinstance(one, h5py.Dataset)}
            _fit(path, {name: one.shape for name, one in arrays.items()})
            return {name: np.asarray(one[...]).T for name, one in arrays.items() if one.dtype.kind in "fiu"}
    from scipy.io import loadmat, whosmat

    _fit(path, {name: shape for name, shape, _ in whosmat(path)})
    content = loadmat(path)
    return {name: one for name, one in content.items() if isinstance(one, np.ndarray) and one.dtype.kind in "fiub"}


def _fit(path: Path, shapes: dict[str, tuple[int, ...]]) -> None:
    found = ", ".join(f"{name} {'x'.join(map(str, shape))}" for name, shape in shapes.items())
    require_memory(str(path), found, 8 * COPIES * sum(map(math.prod, shapes.values())))


if __name__ == "__main__":
    write_tables(_tables)
