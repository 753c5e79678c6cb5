"""Profiles in plain tables: columns that name their unit, two bare columns, a NumPy array."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from reprlib import repr as short

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import as_number, csv_lines, text_lines
from vibrissa.texture.measured import Measured

Array = NDArray[np.float64]

KINDS = ("position", "height")
SAY_COLUMNS = "columns are position and height with their unit, such as position_mm,height_um"


def read_columns(path: str | Path) -> Measured | None:
    """Profile from a plain table, or None if the file is something else.

    Parameters
    ----------
    path : path
        ``.npy`` with an (N, 2) array; or UTF-8 text: below a header with ``position`` and ``height``, each ending in
        its unit (``_m``, ``_mm``, ``_um``, ``_nm``), comma-separated; or two bare columns. Blank lines and lines that
        start with ``#`` are left alone. An empty height, or ``nan``, was not measured.

    Returns
    -------
    Measured or None
        With the units of the header, else without. Zero is the zero of the file only below a header.

    Raises
    ------
    InputError
        Names the file and the line: a cell that is no number, a line of another length, columns missing or double.
    """
    if not Path(path).is_file():
        raise InputError(str(path), "must be an existing file")
    if Path(path).suffix == ".npy":
        return _bare(path, _array(path))
    first = first_line(path)
    if any(cell.strip().lower().startswith(KINDS) for cell in re.split("[,;\t]", first)):
        return _named(path)
    if len(_split(first)) == 2 and np.isfinite([as_number(cell) for cell in _split(first)]).all():
        return _bare(path, _two_columns(path))
    return None


def first_line(path: str | Path) -> str:
    """First line of the file that is neither blank nor a comment; nothing where that is no text."""
    try:
        with open(path, encoding="utf-8-sig", errors="replace") as file:
            opening = file.read(4096).splitlines()
    except OSError as error:
        raise InputError(str(path), f"could not be read ({error.strerror or error})") from error
    return next((line for line in opening if line.strip() and not line.lstrip().startswith("#")), "")


def _array(path: str | Path) -> Array:
    try:
        table = np.asarray(np.load(path, allow_pickle=False), float)
    except (ValueError, EOFError, OSError) as error:
        raise InputError(str(path), f"could not be read as an array ({error})") from error
    if table.ndim != 2 or table.shape[1] != 2:
        raise InputError(str(path), "must hold two columns, position and height", f"shape {table.shape}")
    return table


def _bare(path: str | Path, table: Array) -> Measured:
    return Measured(name=str(path), position=table[:, 0], height=table[:, 1], x_unit=None, z_unit=None)


def _split(line: str) -> list[str]:
    return re.split(r"[\s,;]+", line.strip())


def _two_columns(path: str | Path) -> Array:
    return np.array([_row(f"{path}, line {number}", KINDS, _split(line)) for number, line in text_lines(path)])


def _named(path: str | Path) -> Measured:
    """Columns by the names in the header, which end in their unit."""
    (number, header), *lines = csv_lines(path)
    refuse_separators(f"{path}, line {number}", header)
    if not lines:
        raise InputError(str(path), "must have points below its header", "none")
    kinds, _, units = zip(*(name.partition("_") for name in header), strict=True)
    if sorted(kinds) != sorted(KINDS):
        rule = "must name two columns, position and height, and no other"
        remedy = f"in small letters: {','.join(header).lower()}" if _in_capitals(kinds) else SAY_COLUMNS
        raise InputError(f"{path}, line {number}", rule, ",".join(header), remedy)
    table = np.array([_row(f"{path}, line {number}", kinds, cells) for number, cells in lines])
    x, z = kinds.index("position"), kinds.index("height")
    return Measured(
        name=str(path),
        position=table[:, x],
        height=table[:, z],
        x_unit=units[x] or None,
        z_unit=units[z] or None,
        zero=True,
    )


def _in_capitals(kinds: Sequence[str]) -> bool:
    return sorted(kind.lower() for kind in kinds) == sorted(KINDS)


def refuse_separators(here: str, header: Sequence[str]) -> None:
    """Refuse a header whose columns stand between semicolons or tabs."""
    if len(header) == 1 and re.search("[;\t]", header[0]):
        names = ",".join(re.split("[;\t]", header[0]))
        remedy = f"such as {short(names)}, with points, not commas, in the numbers"
        raise InputError(here, "must separate its columns by commas", short(header[0]), remedy)


def _row(here: str, kinds: Sequence[str], cells: list[str]) -> list[float]:
    if len(cells) != 2:
        raise InputError(here, "must have two numbers, position and height", f"{len(cells)} cells")
    return [_value(f"{here}, {kind}", kind, cell) for kind, cell in zip(kinds, cells, strict=True)]


def _value(here: str, kind: str, cell: str) -> float:
    value = as_number(cell)
    if kind == "height" and cell.lower() in ("", "nan"):
        return np.nan
    if not np.isfinite(value):
        raise InputError(here, "must be a finite number", short(cell))
    return value
