"""Tables for a reader: no wider than the terminal, or than 80 columns where there is none."""

from __future__ import annotations

import re
import shutil
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vibrissa.cli.shared.display.shown_units import Shown, shown_units

if TYPE_CHECKING:
    import xarray as xr

Lines = list[str]

_GAP = 2  # spaces between columns
_NARROWEST = 24  # a column of words is wrapped to no less


def table_lines(data: xr.Dataset, names: Sequence[str]) -> Lines:
    """Give the named variables as text: scalars one by one, then one table for each dimension; in mm, µm, ms, degrees.

    A table that is too wide continues below, with its first column repeated; words are wrapped and no digit is lost.

    Parameters
    ----------
    data : Dataset
        Of the variables.
    names : sequence of str
        Variables of one dimension at most.

    Returns
    -------
    list of str
        No wider than the terminal.
    """
    width = shutil.get_terminal_size().columns
    lines: Lines = []
    units = shown_units(data, [name for name in names if data[name].dtype.kind == "f"])
    columns: dict[str, Lines] = {}
    for name in names:
        dims = data[name].dims
        if not dims:
            label = data[name].attrs.get("long_name", name)
            lines += wrapped(f"{label}: {_cells(data, name, units)[0]} {_bracket(units, name)}".rstrip(), width)
        elif len(dims) == 1:
            columns.setdefault(str(dims[0]), []).append(name)
    for dim, group in columns.items():
        first = [*map(_cell, data[dim].values if dim in data.coords else range(data.sizes[dim]))]
        rest_of = (name for name in group if name != dim)
        named = [(dim, "", first), *((name, _head(data, units, name), _cells(data, name, units)) for name in rest_of)]
        key, *rest = ([f"{name} {unit}".strip(), *cells] for name, unit, cells in named)
        if any(unit for _, unit, _ in named) and _total([key, *rest]) > width:  # units get a line of their own
            key, *rest = ([name, unit, *cells] for name, unit, cells in named)
        lines += folded(key, rest, width)
    return lines


def wrapped(line: str, width: int, indent: int = 2) -> Lines:
    """Break a line between words; what continues is indented.

    Parameters
    ----------
    line : str
        The line.
    width, indent : int
        Columns.

    Returns
    -------
    list of str
        Its parts.
    """
    return textwrap.wrap(line, width, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)


def hanging(lines: Sequence[str]) -> Lines:
    """Break lines that are too wide; each continues under the text behind its first word.

    Parameters
    ----------
    lines : sequence of str
        The lines.

    Returns
    -------
    list of str
        Their parts.
    """
    width = shutil.get_terminal_size().columns
    starts = [re.match(r" *\S+(?: \S+)* {2,}", line) for line in lines]
    return [
        part
        for line, start in zip(lines, starts, strict=True)
        for part in (wrapped(line, width, start.end() if start else 2) if len(line) > width else [line])
    ]


def folded(key: Lines, columns: Sequence[Lines], width: int) -> Lines:
    """Lay columns of text side by side, the key before each part that fits into the width.

    Parameters
    ----------
    key : list of str
        First column.
    columns : sequence of list of str
        The others, as long.
    width : int
        Columns of the terminal.

    Returns
    -------
    list of str
        Lines of all parts.
    """
    parts: list[list[Lines]] = [[]]
    left = width - _wide(key)
    for column in columns:
        if parts[-1] and _wide(column) + _GAP > left and _least(column) + _GAP > left:
            parts.append([])
            left = width - _wide(key)
        parts[-1].append(column)
        left -= min(_wide(column), max(left - _GAP, _least(column))) + _GAP
    return [line for part in parts for line in _drawn([key, *part], width)]


def _drawn(columns: Sequence[Lines], width: int) -> Lines:
    """Draw one part, to the right; words of the widest column are wrapped, to the left, where the line is too long."""
    widths = [_wide(column) for column in columns]
    wordy = widths.index(max(widths)) if _total(columns) > width else None
    if wordy is not None:
        others = _total(columns) - widths[wordy]
        widths[wordy] = min(widths[wordy], max(width - others, _least(columns[wordy])))
    lines: Lines = []
    for row in filter(any, zip(*columns, strict=True)):  # no line of units where there are none
        cells = [[cell.rjust(size)] for cell, size in zip(row, widths, strict=True)]
        if wordy is not None:
            cells[wordy] = [part.ljust(widths[wordy]) for part in wrapped(row[wordy], widths[wordy], 0)]
        blank = [" " * size for size in widths]
        lines += [(" " * _GAP).join(parts).rstrip() for parts in _beside(cells, blank)]
    return lines


def _beside(cells: Sequence[Lines], blank: Sequence[str]) -> Iterator[list[str]]:
    """Lines of cells of one row, filled up with blanks."""
    for k in range(max(map(len, cells))):
        yield [cell[k] if k < len(cell) else empty for cell, empty in zip(cells, blank, strict=True)]


def _wide(column: Lines) -> int:
    return max(map(len, column))


def _total(columns: Sequence[Lines]) -> int:
    return sum(map(_wide, columns)) + _GAP * (len(columns) - 1)


def _least(column: Lines) -> int:
    """Width below which a column is not wrapped: numbers keep theirs."""
    word = max(len(word) for cell in column for word in cell.split() or [""])
    return min(_wide(column), max(word, _NARROWEST))


def _head(data: xr.Dataset, units: Mapping[str, Shown], name: str) -> str:
    """Unit of a column; a share of the whisker's length says so, which a line of words does by itself."""
    over = re.search(r"\bover (L[²³]?)$", data[name].attrs.get("long_name", ""))
    return _bracket(units, name) or (f"[{over[1]}]" if over else "")


def _bracket(units: Mapping[str, Shown], name: str) -> str:
    return f"[{units[name].name}]" if name in units and units[name].name else ""


def _cells(data: xr.Dataset, name: str, units: Mapping[str, Shown]) -> Lines:
    values = data[name].values.ravel()
    return [_cell(value) for value in (values / units[name].size if name in units else values)]


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "–" if value != value else f"{value:.6g}"
    return str(value.item() if hasattr(value, "item") else value) if not isinstance(value, str) else value
