"""Tables of DeepLabCut, text or HDF5: a row for every frame from 0 on, columns found by their names."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import FormatError, MissingError, ShapeError, TooFewError

if TYPE_CHECKING:
    import pandas as pd

LEVELS = ("scorer", "individuals", "bodyparts", "coords")  # rows of the header, by their first cells
COORDINATES = ("x", "y", "likelihood")


def read_deeplabcut(path: str | Path) -> pd.DataFrame:
    """Table of a DeepLabCut file whose rows are the frames from 0 on.

    Parameters
    ----------
    path : path
        Text (``.csv``) or HDF5 (``.h5``), which holds a pickled table.

    Returns
    -------
    DataFrame
        A row for every frame; columns by individual (where there are several), keypoint and coordinate: x, y,
        likelihood, whatever their order in the file.

    Raises
    ------
    InputError
        If rows are not the frames from 0 on, a column is missing, unknown or there twice, or a cell is no number.
    """
    import h5py
    import pandas as pd

    if h5py.is_hdf5(path):
        table = pd.DataFrame(pd.read_hdf(path, key="df_with_missing"))
        _refuse_frames(path, table.index)
    else:
        table = _of_text(path)
    return _ordered(path, table)


def _of_text(path: str | Path) -> pd.DataFrame:
    import pandas as pd

    lines = _lines(path)
    header = {line[0]: [cell.strip() for cell in line[1:]] for _, line in lines[: len(LEVELS)] if line[0] in LEVELS}
    rows = lines[len(header) :]
    _refuse_frames(path, [line[0] for _, line in rows])
    width = len(header["scorer"])
    for place, line in [*lines[: len(header)], *rows]:
        if len(line) != width + 1:
            rule, remedy = f"must have {width + 1} cells, as line 1", "the file is damaged"
            raise ShapeError(f"{path}, line {place}", rule, len(line), remedy)
    values = np.array([_numbers(f"{path}, line {place}", line[1:]) for place, line in rows])
    return pd.DataFrame(values, columns=pd.MultiIndex.from_arrays(list(header.values()), names=list(header)))


def _lines(path: str | Path) -> list[tuple[int, list[str]]]:
    """Cells of all lines that are not empty, with the number of the line in the file, from 1."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as text:
            reader = csv.reader(text)
            lines = [(reader.line_num, [line[0].strip(), *line[1:]]) for line in reader if "".join(line).strip()]
    except (UnicodeDecodeError, csv.Error) as error:
        raise FormatError(str(path), "must be text", remedy="the file is damaged") from error
    if lines[0][1][0] != "scorer":
        right = "save it with commas between cells and points in decimals"
        raise FormatError(str(path), "must have commas between its cells", repr(lines[0][1][0][:40]), right)
    return lines


def _numbers(place: str, cells: Sequence[str]) -> np.ndarray:
    """Numbers of a row; an empty cell was not measured."""
    values = np.full(len(cells), np.nan)
    for column, cell in enumerate(cells):
        try:
            values[column] = float(cell) if cell.strip() else np.nan
            good = not np.isinf(values[column])
        except ValueError:
            good = False
        if not good:
            raise FormatError(f"{place}, column {column + 2}", "must be a finite number, or empty", repr(cell[:40]))
    return values


def _refuse_frames(path: str | Path, frames: Iterable[object]) -> None:
    """Refuse a table whose rows are not the frames from 0 on: rows are counted."""
    numbers = [str(frame) for frame in frames]
    if not numbers:
        raise TooFewError(str(path), "must hold at least one frame")
    for row, number in enumerate(numbers):
        if number in (str(row), f"{row}.0"):
            continue
        remedy = "give predictions, a row for every frame"
        if number.removesuffix(".0").isdecimal():
            remedy = "give a row for every frame from 0 on, in order, with empty cells where nothing was tracked"
        if number == "1" and row == 0:
            remedy = "frames count from 0: subtract 1 from every number"
        raise FormatError(str(path), f"must have frame {row} in row {row}", repr(number[:40]), remedy)


def _ordered(path: str | Path, table: pd.DataFrame) -> pd.DataFrame:
    """The table with its columns by individual, keypoint and coordinate, as they are counted."""
    import pandas as pd

    levels = [name for name in LEVELS[1:] if name in table.columns.names]
    if levels[-2:] != ["bodyparts", "coords"]:
        raise MissingError(f"{path}, header", "must name bodyparts and coords", list(table.columns.names))
    found = pd.MultiIndex.from_arrays([table.columns.get_level_values(name) for name in levels], names=levels)
    wanted = pd.MultiIndex.from_product([*(found.unique(name) for name in levels[:-1]), COORDINATES], names=levels)
    for column in wanted.difference(found, sort=False):
        remedy = "give every individual the same keypoints" if len(levels) > 2 else ""
        raise MissingError(_named(path, column), "must be in the table of DeepLabCut", remedy=remedy)
    for column in found[found.duplicated()]:
        raise FormatError(_named(path, column), "must be there once", remedy="keep the columns of one scorer")
    for column in found.difference(wanted, sort=False):
        raise FormatError(_named(path, column), "must be x, y or likelihood of a keypoint in the plane")
    return table.set_axis(found, axis=1)[wanted].astype(float)


def _named(path: str | Path, column: Sequence[str]) -> str:
    *of, coordinate = column
    return f"{path}, column {coordinate!r} of {' of '.join(reversed(of))}"
