"""Profiles in plain tables: columns that name their unit, two bare columns, a NumPy array."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vibrissa.arrays import Array
from vibrissa.binary import COPIES, read_npy
from vibrissa.errors import FormatError, ShapeError
from vibrissa.limits import require_memory
from vibrissa.tables.reader import ANY, read_table
from vibrissa.tables.table import Table
from vibrissa.tables.text import as_number, first_line, header_names
from vibrissa.texture.measured import Measured

PROFILE = {"position": "m", "height": "m"}  # [m] where a header or an option says no other unit
OTHERS = {"diameter": "diameters along a whisker", "spike_time": "spikes", "time": "signals in time"}  # by a column


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
        Names the file and the line: a cell that is no number, a line of another length, columns missing or double; or
        the table is of something else, such as diameters.
    """
    first = first_line(path)
    _refuse_other(str(path), first)
    if Path(path).suffix == ".npy":
        position, height = _array(path).T
        return Measured(name=str(path), position=position, height=height, x_unit=None, z_unit=None)
    names = header_names(first)
    own = '"' not in first or all(re.sub(r"_[a-z]+$", "", name) in PROFILE for name in names)  # others quote theirs
    if own and any(name.lower().startswith(tuple(PROFILE)) for name in names):
        table = read_table(path, PROFILE, others=False)
        table.refuse_empty("must have points below its header")
        return _measured(table, zero=True)
    bare = [as_number(cell) for cell in re.split(r"[\s,;]+", first.strip())]
    if len(bare) != 2 or not np.isfinite(bare).all():
        return None
    return _measured(read_table(path, PROFILE, header=tuple(PROFILE), delimiter=ANY), zero=False)


def _refuse_other(path: str, header: str) -> None:
    """Refuse a table whose columns say that it holds no surface."""
    columns = [re.sub(r"_(m|mm|um|nm|s|ms)$", "", name.lower()) for name in header_names(header, "")]
    kind = next((OTHERS[name] for name in columns if name in OTHERS), None)
    if kind is not None and all(re.fullmatch("[a-z][a-z_]*", name) for name in columns):
        remedy = "a surface has columns position_mm,height_um, or position_mm,width_mm of its gaps"
        raise FormatError(path, "must be a surface", f"a table of {kind}", remedy)


def _array(path: str | Path) -> Array:
    table = read_npy(path)
    if table.ndim != 2 or table.shape[1] != 2 or table.dtype.kind not in "biuf":
        rule = "must hold two columns of numbers, position and height"
        raise ShapeError(str(path), rule, f"{table.dtype} of shape {table.shape}")
    require_memory(str(path), f"{table.shape[0]} points", 16 * COPIES * table.shape[0])
    return np.asarray(table, float)


def _measured(table: Table, *, zero: bool) -> Measured:
    """The profile of a table; the unit of a column without one is left to the option."""
    units = {kind: None if column == kind else unit for kind, (column, unit) in table.named.items()}
    return Measured(
        name=table.path,
        position=table.numbers("position", si=False),
        height=table.numbers("height", blanks=True, unknown=True, si=False),
        x_unit=units["position"],
        z_unit=units["height"],
        zero=zero,
    )
