"""Tables of comma-separated values, read strictly: a header, then one line for each row."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from reprlib import repr as short

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import as_number, csv_lines

Array = NDArray[np.float64]

LONGEST = 1e7  # [s] beyond these 115 days a time is no time
SEPARATORS = "columns are separated by commas, decimals written with a point"


@dataclass(frozen=True, kw_only=True)
class Table:
    """Cells of a table as text.

    Attributes
    ----------
    path : str
        The file.
    lines : tuple of int
        Number of each row's line in the file.
    columns : dict
        Cells of each column by its name, without spaces around them.
    """

    path: str
    lines: tuple[int, ...]
    columns: dict[str, list[str]]

    def place(self, row: int, name: str) -> str:
        """Where a cell stands, for messages."""
        return f"{self.path}, line {self.lines[row]}, {name}"

    def refuse_first(self, wrong: NDArray[np.bool_], name: str, rule: str, remedy: str = "") -> None:
        """Refuse the first row in which something is wrong, by its line and cell."""
        if wrong.any():
            row = int(np.flatnonzero(wrong)[0])
            raise InputError(self.place(row, name), rule, short(self.columns[name][row]), remedy)

    def numbers(self, name: str, *, blanks: bool = False) -> Array:
        """Numbers of a column.

        Parameters
        ----------
        name : str
            The column.
        blanks : bool
            Whether empty cells are read as NaN.

        Returns
        -------
        (R,) array
            One finite number for each row.

        Raises
        ------
        InputError
            At the first cell that is not a finite number.
        """
        cells = self.columns[name]
        values = np.array([as_number(cell) for cell in cells], float)
        blank = np.array([blanks and not cell for cell in cells], bool)
        self.refuse_first(~np.isfinite(values) & ~blank, name, "must be a finite number")
        return values

    def column(self, name: str) -> str:
        """Name of a column of times as it stands in the file: in seconds, or ending in _ms."""
        return name if name in self.columns else f"{name}_ms"

    def seconds(self, name: str, *, blanks: bool = False) -> Array:
        """Times [s] of a column in seconds or, where its name ends in _ms, in milliseconds; as :meth:`numbers`."""
        column = self.column(name)
        time = self.numbers(column, blanks=blanks) / (1e3 if column != name else 1.0)
        self.refuse_first(np.abs(time) > LONGEST, column, f"must be at most {LONGEST:g} s", "give times in seconds")
        return time


def read_table(path: str | Path, required: Collection[str], optional: Collection[str] = ()) -> Table:
    """Read a table whose header holds the required columns.

    Parameters
    ----------
    path : path
        UTF-8 text; blank lines and lines that start with ``#`` are left alone.
    required : collection of str
        Columns that must be there; ``"time|time_ms"`` asks for exactly one of the two.
    optional : collection of str
        Further columns that are known; used to name what may have been meant.

    Returns
    -------
    Table
        All columns of the file.

    Raises
    ------
    InputError
        Names the file and the line: no file, no text, no header, a column missing or twice, a line too short.
    """
    lines = csv_lines(path)
    if not lines:
        raise InputError(str(path), "must hold a header and a line for each row", "an empty file")
    (number, header), rows = lines[0], lines[1:]
    _refuse_header(f"{path}, line {number}", header, required, optional)
    for line, cells in rows:
        if len(cells) != len(header):
            raise InputError(
                f"{path}, line {line}", f"must have {len(header)} cells, as the header", len(cells), SEPARATORS
            )
    columns = {name: [cells[k] for _, cells in rows] for k, name in enumerate(header)}
    return Table(path=str(path), lines=tuple(line for line, _ in rows), columns=columns)


def _refuse_header(here: str, header: list[str], required: Collection[str], optional: Collection[str]) -> None:
    for name in header:
        if header.count(name) > 1:
            raise InputError(here, "must name each column once", short(name))
    for names in required:
        either = names.split("|")
        found = [name for name in either if name in header]
        if len(found) > 1:
            raise InputError(here, f"must have only one of {' and '.join(either)}", "both")
        if not found:
            raise InputError(
                here,
                f"must have a column {' or '.join(either)}",
                short(",".join(header)),
                SEPARATORS + _near(either, header, {*optional, *"|".join(required).split("|")}),
            )


def _near(wanted: Collection[str], header: list[str], known: Collection[str]) -> str:
    """Say which column may have been meant."""
    for name in header:
        if name not in known and get_close_matches(re.sub(r"[^a-z_]", "", name.lower()), wanted, n=1, cutoff=0.6):
            return f"; is it {short(name)}?"
    return ""
