"""Tables of a WhiskiWrap file, read in a separate process; its imports are few, so that it starts at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrissa.reader_process import write_tables


def _tables(path: Path) -> dict[str, Any]:
    """Give the rows, and the pixels one after the other with the end of each list."""
    with h5py.File(path, "r") as file:
        if missing := [name for name in ("summary", "pixels_x", "pixels_y") if name not in file]:
            raise KeyError(f"has no table {', '.join(missing)}; write it with the pixels, not summary_only")
        tables: dict[str, Any] = {"summary": _rows(path, file["summary"])}
        for axis in ("x", "y"):
            lists = [np.atleast_1d(np.asarray(one, float)) for one in _rows(path, file[f"pixels_{axis}"])]
            tables[axis] = np.concatenate([*lists, np.zeros(0)])
            tables[f"{axis}_end"] = np.cumsum([one.size for one in lists])
    return tables


def _rows(path: Path, table: Any) -> np.ndarray:
    """All rows of a table, unless it counts more of them than the file has bytes: damaged counts would take hours."""
    if len(table.shape) != 1 or table.size > path.stat().st_size:
        raise ValueError(f"{table.name} has the shape {table.shape}, more than the file can hold")
    return table[:]


if __name__ == "__main__":
    write_tables(_tables)
