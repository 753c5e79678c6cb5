"""The cells of a table as text, and their numbers; a fault is named by file, line, column and value."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from reprlib import repr as short
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.errors import FormatError, TooFewError
from vibrissa.tables.text import as_number
from vibrissa.tables.units import to_si

if TYPE_CHECKING:
    import pandas as pd


LONGEST = 1e7  # [s] beyond these 115 days a time is no time


@dataclass(frozen=True, kw_only=True)
class Table:
    """Cells of a table as text.

    Attributes
    ----------
    path : str
        The file.
    header : tuple of str
        Names of all columns, as they are in the file.
    lines : (R,) sequence of int
        Number of each row's line in the file.
    named : dict
        Column and unit of each quantity that was asked for and is there.
    cells : DataFrame
        Text of the cells, by the names of the header.
    row_word : str
        What messages call a row.
    """

    path: str
    header: tuple[str, ...]
    lines: Sequence[int]
    named: dict[str, tuple[str, str]]
    cells: pd.DataFrame
    row_word: str = "line"

    def __contains__(self, quantity: str) -> bool:
        return quantity in self.named

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def others(self) -> list[str]:
        """Names of the columns that were not asked for."""
        known = {column for column, _ in self.named.values()}
        return [name for name in self.header if name not in known]

    def column(self, quantity: str) -> str:
        """Give the name, as it is in the file, of the column of a quantity.

        Parameters
        ----------
        quantity : str
            The quantity, or any column by its name.

        Returns
        -------
        str
            Such as ``width_um``.
        """
        return self.named[quantity][0] if quantity in self.named else quantity

    def text(self, quantity: str) -> list[str]:
        """Give the cells of a quantity, or of any column by its name, without spaces around them.

        Parameters
        ----------
        quantity : str
            The quantity, or any column by its name.

        Returns
        -------
        list of str
            One for each row.
        """
        return [cell.strip() for cell in self.cells[self.column(quantity)]]

    def rows(self) -> Iterator[tuple[str, dict[str, str]]]:
        """Give file and line of each row, for messages, and its cells by the names of their columns."""
        columns = [self.text(name) for name in self.header]
        for line, *cells in zip(self.lines, *columns, strict=True):
            yield f"{self.path}, {self.row_word} {line}", dict(zip(self.header, cells, strict=True))

    def place(self, row: int, quantity: str) -> str:
        """Name a cell in messages.

        Parameters
        ----------
        row : int
            From 0.
        quantity : str
            The quantity, or any column by its name.

        Returns
        -------
        str
            File, line and column.
        """
        return f"{self.path}, {self.row_word} {self.lines[row]}, {self.column(quantity)}"

    def refuse_first(self, wrong: Mask, quantity: str, rule: str, remedy: str = "") -> None:
        """Refuse the first row in which something is wrong, by its line and cell.

        Parameters
        ----------
        wrong : (R,) array of bool
            Rows that break the rule.
        quantity : str
            Whose cell breaks it.
        rule, remedy : str
            As in :class:`~vibrissa.errors.InputError`.

        Raises
        ------
        InputError
            If any row is wrong.
        """
        if np.any(wrong):
            row = int(np.flatnonzero(wrong)[0])
            cell = self.cells[self.column(quantity)].iloc[row].strip()
            raise FormatError(self.place(row, quantity), rule, short(cell), remedy)

    def refuse_empty(self, rule: str, found: str = "none") -> None:
        """Refuse a table that has a header alone.

        Parameters
        ----------
        rule, found : str
            As in :class:`~vibrissa.errors.InputError`.

        Raises
        ------
        InputError
            If there is no row.
        """
        if not self.lines:
            raise TooFewError(self.path, rule, found)

    def numbers(self, quantity: str, *, blanks: bool = False, unknown: bool = False, si: bool = True) -> Array:
        """Numbers of a column.

        Parameters
        ----------
        quantity : str
            The quantity, or any column by its name.
        blanks, unknown : bool
            Whether empty cells, and the word ``nan``, are read as NaN.
        si : bool
            In the SI unit of the quantity, or else in that of the column.

        Returns
        -------
        (R,) array
            One finite number for each row.

        Raises
        ------
        InputError
            At the first cell that is not a finite number.
        """
        cells = self.text(quantity)
        values = np.fromiter(map(as_number, cells), float, len(cells))
        missing = {*([""] if blanks else []), *(["nan"] if unknown else [])}
        open_cells = np.fromiter((cell.lower() in missing for cell in cells), bool, len(cells))
        self.refuse_first(~np.isfinite(values) & ~open_cells, quantity, "must be a finite number")
        return to_si(values, self.named[quantity][1]) if si and quantity in self.named else values

    def seconds(self, quantity: str, *, blanks: bool = False) -> Array:
        """Times of a column [s], none above 1e7; as :meth:`numbers`.

        Parameters
        ----------
        quantity : str
            The quantity.
        blanks : bool
            Whether empty cells are read as NaN.

        Returns
        -------
        (R,) array
            Times [s].

        Raises
        ------
        InputError
            At the first cell that is not a finite number, or is too large.
        """
        time = self.numbers(quantity, blanks=blanks)
        self.refuse_first(np.abs(time) > LONGEST, quantity, f"must be at most {LONGEST:g} s", "give times in seconds")
        return time

    def whole_numbers(self, quantity: str, rule: str, low: float = 0, high: float = np.inf) -> Integers:
        """Whole numbers of a column, from ``low`` up to and including ``high``; another breaks the rule.

        Parameters
        ----------
        quantity : str
            The quantity.
        rule : str
            What its cells must be.
        low, high : float
            Least and largest number.

        Returns
        -------
        (R,) array of int
            One for each row.

        Raises
        ------
        InputError
            At the first cell that breaks the rule.
        """
        values = self.numbers(quantity)
        self.refuse_first((values != np.floor(values)) | (values < low) | (values > high), quantity, rule)
        return values.astype(int)

    def names(self, quantity: str, rule: str = "must name a unit in printable signs") -> list[str]:
        """Words of a column, none of them empty or with signs that cannot be printed.

        Parameters
        ----------
        quantity : str
            The quantity.
        rule : str
            What its cells must be.

        Returns
        -------
        list of str
            One for each row.

        Raises
        ------
        InputError
            At the first cell that breaks the rule.
        """
        cells = self.text(quantity)
        self.refuse_first(np.array([not (cell and cell.isprintable()) for cell in cells], bool), quantity, rule)
        return cells
