"""Traces in the HDF5 file of WhiskiWrap: a row and two lists of pixels for each segment."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from vibrissa.errors import InputError
from vibrissa.video.whisk_files import Segment, Values, existing, refuse_coordinates
from vibrissa.video.whisk_profile import Known

NOBODY = 0xFFFF  # −1 in the unsigned column
PATIENCE, PACE = 30.0, 1e6  # [s] and [bytes/s] granted to the HDF5 library, which a damaged list keeps busy for ever
DAMAGED = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, MemoryError)


def read_whiskiwrap(path: str | Path) -> tuple[list[Segment], dict[tuple[int, int], Known]]:
    """Segments of a WhiskiWrap HDF5 file, and what it knows of them by frame and number.

    The tables ``summary`` (``fid``, ``wid``, ``follicle_x``, ``follicle_y`` and, if measured, ``label``),
    ``pixels_x`` and ``pixels_y`` are read, by a process of their own with a limit of time, since damaged lists can
    neither be told nor read. WhiskiWrap writes label 0 for every segment until they are classified; where there is no
    label, nobody is known.

    Returns
    -------
    segments : list of Segment
        ``thick`` and ``score`` are NaN: WhiskiWrap does not keep them.
    known : dict
        Identity and follicle end [px].

    Raises
    ------
    InputError
        If the file is missing, no HDF5 file, without these tables, or they do not fit.
    """
    path = existing(path)
    limit = PATIENCE + path.stat().st_size / PACE
    try:
        reader = subprocess.run([sys.executable, "-m", __name__, str(path)], capture_output=True, timeout=limit)
    except subprocess.TimeoutExpired as error:
        raise InputError(str(path), f"must be readable within {limit:.0f} s", remedy="the file is damaged") from error
    if reader.returncode:
        line = (reader.stderr.decode(errors="replace").strip().splitlines() or ["the HDF5 library crashed"])[-1]
        raise InputError(str(path), "must be a WhiskiWrap HDF5 file with its pixels", remedy=line)
    tables = np.load(io.BytesIO(reader.stdout))
    columns = [np.split(tables[f"{axis}"], tables[f"{axis}_end"][:-1]) for axis in ("x", "y")]
    return _segments(path, tables["summary"], columns), _known(tables["summary"])


def _write_tables(path: Path, out: Any) -> None:
    """Write the tables of a file as arrays: the rows, and the pixels one after the other with the end of each list."""
    import h5py

    with h5py.File(path, "r") as file:
        if missing := [name for name in ("summary", "pixels_x", "pixels_y") if name not in file]:
            raise KeyError(f"has no table {', '.join(missing)}; write it with the pixels, not summary_only")
        tables: dict[str, Any] = {"summary": _rows(path, file["summary"])}
        for axis in ("x", "y"):
            lists = [np.atleast_1d(np.asarray(one, float)) for one in _rows(path, file[f"pixels_{axis}"])]
            tables[axis] = np.concatenate([*lists, np.zeros(0)])
            tables[f"{axis}_end"] = np.cumsum([one.size for one in lists])
    np.savez(out, **tables)


def _rows(path: Path, table: Any) -> np.ndarray:
    """All rows of a table, unless it counts more of them than the file has bytes: damaged counts take for ever."""
    if len(table.shape) != 1 or table.size > path.stat().st_size:
        raise ValueError(f"{table.name} has the shape {table.shape}, more than the file can hold")
    return table[:]


def _segments(path: str | Path, summary: np.ndarray, columns: list[list[Values]]) -> list[Segment]:
    needed = {"fid", "wid", "follicle_x", "follicle_y"}
    if missing := sorted(needed - set(summary.dtype.names or ())):
        raise InputError(f"{path}, summary", f"must have the columns {', '.join(missing)}")
    if {len(column) for column in columns} != {len(summary)}:
        counts = f"{len(summary)} rows, {' and '.join(str(len(column)) for column in columns)} lists"
        raise InputError(str(path), "must have pixels for each row of summary", counts)
    segments = []
    for i, (frame, wid) in enumerate(zip(summary["fid"].tolist(), summary["wid"].tolist(), strict=True)):
        x, y = (column[i] for column in columns)
        if x.size != y.size or not x.size:
            raise InputError(f"{path}, row {i}", "must have as many x as y", f"{x.size} and {y.size}")
        refuse_coordinates(f"{path}, row {i}", x, y)
        segments.append(Segment(frame, wid, x, y, np.full(x.size, np.nan), np.full(x.size, np.nan)))
    if len({(one.frame, one.wid) for one in segments}) < len(segments):
        raise InputError(str(path), "must hold each segment of a frame once", remedy="was a chunk written twice?")
    return segments


def _known(summary: np.ndarray) -> dict[tuple[int, int], Known]:
    labels = summary["label"].tolist() if "label" in (summary.dtype.names or ()) else [NOBODY] * len(summary)
    rows = zip(*(summary[name].tolist() for name in ("fid", "wid", "follicle_x", "follicle_y")), labels, strict=True)
    return {(frame, wid): Known(-1 if who == NOBODY else who, (x, y)) for frame, wid, x, y, who in rows}


if __name__ == "__main__":
    try:
        _write_tables(Path(sys.argv[1]), sys.stdout.buffer)
    except DAMAGED as damage:
        sys.exit(" ".join(str(damage).split()))
