"""Files of WHISK to the last byte: traced segments (``.whiskers``) and their measurements (``.measurements``)."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Integers
from vibrissa.errors import FormatError, MissingError, RangeError, TooFewError
from vibrissa.files import existing

Values = NDArray[np.float64]
Table = NDArray[np.void]

WHISKERS = b"bwhiskbin1\0\0"
OPENINGS = (WHISKERS[:10], b"whisker1", b"bwhiskpoly")  # of files of curves
MEASUREMENTS = b"measv3\0\0"
FURTHEST = 1e5  # coordinates beyond it are no pixels
CONVERT = "convert it with WHISK's whisker_convert to whiskbin1"
COLUMNS = ("length", "score", "angle", "curvature", "follicle_x", "follicle_y", "tip_x", "tip_y")
FOLLICLE = COLUMNS.index("follicle_x")


class Segment(NamedTuple):
    """One curve that WHISK traced in one frame.

    Attributes
    ----------
    frame : int
        Frame, from 0.
    wid : int
        Number of the segment in its frame; not who it is.
    x, y : (N,) arrays
        Column and row [px]; points about 1 px apart along the curve, from either end.
    thick : (N,) array
        Width of the line [px].
    score : (N,) array
        Response of WHISK's line detector, in its units.
    """

    frame: int
    wid: int
    x: Values
    y: Values
    thick: Values
    score: Values


def read_whiskers(path: str | Path) -> list[Segment]:
    """Segments of a ``.whiskers`` file (bwhiskbin1), in the order of the file.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    list of Segment
        All curves.

    Raises
    ------
    InputError
        If the file is missing, of another kind, cut off, longer than it says, empty, or holds a segment twice or values
        that cannot be pixels.
    """
    data = existing(path).read_bytes()
    if not data.startswith(WHISKERS):
        raise FormatError(str(path), "must be a .whiskers file of kind bwhiskbin1", repr(data[:12]), CONVERT)
    if len(data) < len(WHISKERS) + 4:
        raise FormatError(str(path), "must hold its count of segments", f"{len(data)} bytes", "the file is cut off")
    end = len(data) - 4
    count, at = int.from_bytes(data[end:], "little", signed=True), len(WHISKERS)
    segments: list[Segment] = []
    while at < end:
        segment, at = _segment(path, data, at, end, len(segments))
        segments.append(segment)
    if not segments:
        remedy = "nothing was traced, or the file is cut off"
        raise TooFewError(str(path), "must hold at least one segment", remedy=remedy)
    if count != len(segments):
        raise FormatError(str(path), f"must hold the {count} segments it counts", len(segments), "the file is damaged")
    if len({(one.frame, one.wid) for one in segments}) < count:
        raise FormatError(str(path), "must hold each segment of a frame once", remedy="the file is damaged")
    return segments


def _segment(path: str | Path, data: bytes, at: int, end: int, index: int) -> tuple[Segment, int]:
    """One segment, and where the next one starts."""
    thing, damaged = f"{path}, segment {index}", "the file is cut off or damaged"
    if end - at < 12:
        raise FormatError(thing, "must have a head of 12 bytes", f"{end - at} left", damaged)
    wid, frame, points = np.frombuffer(data, "<i4", 3, at).tolist()
    if wid < 0 or frame < 0 or points < 1:
        raise FormatError(thing, "must have id, frame and points", f"{wid}, {frame} and {points}", damaged)
    if 16 * points > end - at - 12:
        raise FormatError(thing, f"must hold its {points} points", f"{end - at - 12} bytes left", damaged)
    with np.errstate(invalid="ignore"):  # damaged bytes may be NaN of a kind that NumPy warns of
        x, y, thick, score = np.frombuffer(data, "<f4", 4 * points, at + 12).reshape(4, points).astype(float)
    refuse_coordinates(thing, x, y)
    return Segment(frame, wid, x, y, thick, score), at + 12 + 16 * points


def refuse_coordinates(thing: str, x: Values, y: Values) -> None:
    """Refuse points that cannot be pixels.

    Parameters
    ----------
    thing : str
        What has the points, for the error.
    x, y : (N,) arrays
        Coordinates [px].

    Raises
    ------
    InputError
        If one is not finite or too large.
    """
    if not (np.abs(x) < FURTHEST).all() or not (np.abs(y) < FURTHEST).all():
        raise FormatError(thing, f"must have finite coordinates below {FURTHEST:g} px", remedy="the file is damaged")


def packed_whiskers(segments: Sequence[Segment]) -> bytes:
    """Bytes of a ``.whiskers`` file (bwhiskbin1), which :func:`read_whiskers` gives back.

    Parameters
    ----------
    segments : sequence of Segment
        Their points are stored in single precision.

    Returns
    -------
    bytes
        Content of the file.
    """
    parts = [WHISKERS]
    for one in segments:
        parts.append(np.array([one.wid, one.frame, one.x.size], "<i4").tobytes())
        parts.append(np.array([one.x, one.y, one.thick, one.score], "<f4").tobytes())
    return b"".join([*parts, len(segments).to_bytes(4, "little")])


def _row(measures: int) -> np.dtype[np.void]:
    head = ("row", "frame", "wid", "identity", "face_x", "face_y", "follicle_x_column", "follicle_y_column")
    fields: list[Any] = [(name, "<i4") for name in (*head, "velocity_valid", "measures")]
    fields += [("face_axis", "S1"), ("data", "<f8", (measures,)), ("velocity", "<f8", (measures,))]
    return np.dtype(fields)


def measurements_beside(path: Path) -> Path | None:
    """Find the measurements that are read with a file of curves: those of the same name.

    Parameters
    ----------
    path : Path
        Any file.

    Returns
    -------
    Path or None
        ``.measurements``; None where there are none, or the file has no curves of WHISK.
    """
    beside = path.with_suffix(".measurements")
    if not (beside.is_file() and path.is_file()):
        return None
    with suppress(OSError), path.open("rb") as stream:  # a file that cannot be read is refused where it is needed
        return beside if stream.read(10).startswith(OPENINGS) else None
    return None


def read_measurements(path: str | Path) -> Table:
    """Rows of a ``.measurements`` file (measv3), in the order of WHISK's table.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    (R,) structured array
        ``frame``, ``wid``, ``identity`` (WHISK's state: −1 none, else the whisker from the first), ``face_x``,
        ``face_y``, ``face_axis`` and ``data``: length [px], score, angle [°], curvature [1/px], follicle and tip
        (x, y) [px]; and what else the file has.

    Raises
    ------
    InputError
        If the file is missing, of another kind, cut off, longer than it says or inconsistent.
    """
    data, damaged = existing(path).read_bytes(), "the file is cut off or damaged"
    if not data.startswith(MEASUREMENTS):
        remedy = "convert it with WHISK's measurements_convert to v3"
        raise FormatError(str(path), "must be a .measurements file of kind measv3", repr(data[:8]), remedy)
    if len(data) < 16:
        raise MissingError(str(path), "must state its numbers of rows and measures", f"{len(data)} bytes", damaged)
    rows, measures = np.frombuffer(data, "<i4", 2, 8).tolist()
    if rows < 0 or measures != len(COLUMNS):
        raise FormatError(str(path), f"must have rows of {len(COLUMNS)} measures", f"{rows} of {measures}", damaged)
    kind = _row(measures)
    if len(data) != 16 + rows * kind.itemsize:
        raise FormatError(str(path), f"must hold its {rows} rows", f"{len(data)} bytes", damaged)
    table = np.frombuffer(data, kind, rows, 16)[::-1].copy()
    _refuse_rows(path, table)
    return table


def _refuse_rows(path: str | Path, table: Table) -> None:
    if np.any(table["measures"] != len(COLUMNS)) or np.any(table["follicle_x_column"] != FOLLICLE):
        rule = "must have the measures of WHISK in their order"
        raise FormatError(str(path), rule, remedy="measure the traces again")
    if np.any(table["frame"] < 0) or np.any(table["wid"] < 0):
        raise RangeError(str(path), "must have frames and segments from 0", remedy="the file is damaged")
    if np.unique(table[["frame", "wid"]]).size < table.size:
        raise FormatError(str(path), "must measure each segment of a frame once", remedy="the file is damaged")


def packed_measurements(table: Table) -> bytes:
    """Bytes of a ``.measurements`` file (measv3), which :func:`read_measurements` gives back to the last bit.

    Parameters
    ----------
    table : structured array
        As of :func:`read_measurements`.

    Returns
    -------
    bytes
        Content of the file.
    """
    counts = np.array([table.size, len(COLUMNS)], "<i4").tobytes()
    return MEASUREMENTS + counts + table[::-1].tobytes()


def measured(keys: Integers, data: Values, face: tuple[int, int], axis: bytes) -> Table:
    """Table of segments by their ``keys`` frame, wid and identity (R, 3), with their measures ``data`` (R, 8).

    Parameters
    ----------
    keys : (R, 3) array
        Frame, wid and identity of each segment.
    data : (R, 8) array
        Measures, as in :func:`read_measurements`.
    face : (int, int)
        Column and row of the face [px].
    axis : bytes
        Side of the face, ``x`` or ``y``.

    Returns
    -------
    (R,) structured array
        As of :func:`read_measurements`.
    """
    table = np.zeros(len(data), _row(len(COLUMNS)))
    table["row"] = np.arange(len(data))
    table["frame"], table["wid"], table["identity"] = keys.T
    table["face_x"], table["face_y"] = face
    table["face_axis"], table["measures"], table["data"] = axis, len(COLUMNS), data
    table["follicle_x_column"], table["follicle_y_column"] = FOLLICLE, FOLLICLE + 1
    return table
