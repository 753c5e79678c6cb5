"""Traces in the HDF5 file of WhiskiWrap: a row and two lists of pixels for each segment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.lib.recfunctions import rename_fields

from vibrissa.errors import FormatError, MissingError, ShapeError
from vibrissa.files import existing
from vibrissa.reader_process import tables_read_by
from vibrissa.video.foreign import whiskiwrap_tables
from vibrissa.video.foreign.whisk_files import Segment, Values, refuse_coordinates
from vibrissa.video.foreign.whisk_profile import KnownSegment

NOBODY = 0xFFFF  # −1 in the unsigned column
FORMER = {"time": "fid", "id": "wid", "fol_x": "follicle_x", "fol_y": "follicle_y"}  # names in its first versions


def read_whiskiwrap(path: str | Path) -> tuple[list[Segment], dict[tuple[int, int], KnownSegment]]:
    """Segments of a WhiskiWrap HDF5 file, and what it knows of them by frame and number.

    The tables ``summary`` (``fid``, ``wid``, ``follicle_x``, ``follicle_y``, in the first versions ``time``, ``id``,
    ``fol_x``, ``fol_y``; if measured, ``label``),
    ``pixels_x`` and ``pixels_y`` are read, by a separate process with a limit of time, since damaged lists can
    neither be recognised nor read. WhiskiWrap writes label 0 for every segment until they are classified; where
    there is no label, nobody is known.

    Parameters
    ----------
    path : path
        The file.

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
    rule = "must be a WhiskiWrap HDF5 file with its pixels"
    tables = tables_read_by(whiskiwrap_tables.__name__, existing(path), rule)
    columns = [np.split(tables[f"{axis}"], tables[f"{axis}_end"][:-1]) for axis in ("x", "y")]
    summary = tables["summary"]
    names = summary.dtype.names or ()
    former = {old: new for old, new in FORMER.items() if new not in names}
    summary = rename_fields(summary, former) if names else summary
    return _segments(path, summary, columns), _known(summary)


def _segments(path: str | Path, summary: np.ndarray, columns: list[list[Values]]) -> list[Segment]:
    needed = {"fid", "wid", "follicle_x", "follicle_y"}
    if missing := sorted(needed - set(summary.dtype.names or ())):
        raise MissingError(f"{path}, summary", f"must have the columns {', '.join(missing)}")
    if {len(column) for column in columns} != {len(summary)}:
        counts = f"{len(summary)} rows, {' and '.join(str(len(column)) for column in columns)} lists"
        raise ShapeError(str(path), "must have pixels for each row of summary", counts)
    segments = []
    for i, (frame, wid) in enumerate(zip(summary["fid"].tolist(), summary["wid"].tolist(), strict=True)):
        x, y = (column[i] for column in columns)
        if x.size != y.size or not x.size:
            raise ShapeError(f"{path}, row {i}", "must have as many x as y", f"{x.size} and {y.size}")
        refuse_coordinates(f"{path}, row {i}", x, y)
        segments.append(Segment(frame, wid, x, y, np.full(x.size, np.nan), np.full(x.size, np.nan)))
    if len({(one.frame, one.wid) for one in segments}) < len(segments):
        raise FormatError(str(path), "must hold each segment of a frame once", remedy="was a chunk written twice?")
    return segments


def _known(summary: np.ndarray) -> dict[tuple[int, int], KnownSegment]:
    labels = summary["label"].tolist() if "label" in (summary.dtype.names or ()) else [NOBODY] * len(summary)
    rows = zip(*(summary[name].tolist() for name in ("fid", "wid", "follicle_x", "follicle_y")), labels, strict=True)
    return {(frame, wid): KnownSegment(-1 if who == NOBODY else who, (x, y)) for frame, wid, x, y, who in rows}
