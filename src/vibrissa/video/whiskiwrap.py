"""Traces in the HDF5 file of WhiskiWrap: a row and two lists of pixels for each segment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vibrissa.errors import InputError
from vibrissa.video.whisk_files import Segment, Values, existing, refuse_coordinates
from vibrissa.video.whisk_profile import Known

NOBODY = 0xFFFF  # −1 in the unsigned column


def read_whiskiwrap(path: str | Path) -> tuple[list[Segment], dict[tuple[int, int], Known]]:
    """Segments of a WhiskiWrap HDF5 file, and what it knows of them by frame and number.

    The tables ``summary`` (``fid``, ``wid``, ``follicle_x``, ``follicle_y`` and, if measured, ``label``),
    ``pixels_x`` and ``pixels_y`` are read. WhiskiWrap writes label 0 for every segment until they are classified;
    where there is no label, nobody is known. A list whose length is damaged may keep the HDF5 library busy for long:
    the format has no checksum that would tell.

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
    import h5py

    with existing(path).open("rb") as stream:
        try:
            with h5py.File(stream, "r") as file:
                if "summary" not in file or "pixels_x" not in file or "pixels_y" not in file:
                    remedy = "write it with the pixels, not summary_only"
                    raise InputError(str(path), "must have the tables summary, pixels_x, pixels_y", list(file), remedy)
                summary, *columns = (_rows(path, file[name]) for name in ("summary", "pixels_x", "pixels_y"))
        except (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, MemoryError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(str(path), "must be a WhiskiWrap HDF5 file", remedy=str(error)) from error
    return _segments(path, summary, columns), _known(summary)


def _rows(path: str | Path, table: Any) -> np.ndarray:
    """All rows of a table, unless it counts more of them than the file has bytes: damaged counts take forever."""
    if len(table.shape) != 1 or table.size > Path(path).stat().st_size:
        rule = "must be a list of rows that the file can hold"
        raise InputError(f"{path}, {table.name}", rule, f"shape {table.shape}", "the file is damaged")
    return table[:]


def _segments(path: str | Path, summary: np.ndarray, columns: list[np.ndarray]) -> list[Segment]:
    needed = {"fid", "wid", "follicle_x", "follicle_y"}
    if missing := sorted(needed - set(summary.dtype.names or ())):
        raise InputError(f"{path}, summary", f"must have the columns {', '.join(missing)}")
    if {len(column) for column in columns} != {len(summary)}:
        counts = f"{len(summary)} rows, {' and '.join(str(len(column)) for column in columns)} lists"
        raise InputError(str(path), "must have pixels for each row of summary", counts)
    segments = []
    for i, (frame, wid) in enumerate(zip(summary["fid"].tolist(), summary["wid"].tolist(), strict=True)):
        x, y = (_numbers(f"{path}, row {i}", column[i]) for column in columns)
        if x.size != y.size or not x.size:
            raise InputError(f"{path}, row {i}", "must have as many x as y", f"{x.size} and {y.size}")
        refuse_coordinates(f"{path}, row {i}", x, y)
        segments.append(Segment(frame, wid, x, y, np.full(x.size, np.nan), np.full(x.size, np.nan)))
    if len({(one.frame, one.wid) for one in segments}) < len(segments):
        raise InputError(str(path), "must hold each segment of a frame once", remedy="was a chunk written twice?")
    return segments


def _numbers(thing: str, values: object) -> Values:
    try:
        return np.atleast_1d(np.asarray(values, float))
    except (TypeError, ValueError) as error:
        raise InputError(thing, "must hold numbers") from error


def _known(summary: np.ndarray) -> dict[tuple[int, int], Known]:
    labels = summary["label"].tolist() if "label" in (summary.dtype.names or ()) else [NOBODY] * len(summary)
    rows = zip(*(summary[name].tolist() for name in ("fid", "wid", "follicle_x", "follicle_y")), labels, strict=True)
    return {(frame, wid): Known(-1 if who == NOBODY else who, (x, y)) for frame, wid, x, y, who in rows}
