"""The reader of tables of text, strict: a header that names known columns, then as many cells in each line."""

from __future__ import annotations

import csv
import re
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from io import StringIO
from pathlib import Path
from reprlib import repr as short
from typing import NoReturn

from vibrissa.errors import FormatError, MissingError, ShapeError, TooFewError, UnknownError, nearest
from vibrissa.tables.table import Table
from vibrissa.tables.text import each_line
from vibrissa.tables.units import PURE, TEXT, spellings, unit_of, units_of

SEPARATORS = "columns are separated by commas, decimals written with a point"
ANY = "any"  # in place of a delimiter: white space, commas and semicolons


def read_table(
    path: str | Path,
    needed: Mapping[str, str],
    optional: Mapping[str, str] | None = None,
    *,
    others: bool = True,
    header: Sequence[str] | None = None,
    delimiter: str = ",",
) -> Table:
    """Read a table whose header holds the columns that are needed.

    Parameters
    ----------
    path : path
        UTF-8 text; blank lines and lines that start with ``#`` are left alone.
    needed, optional : mapping of str
        SI unit of each quantity, ``vibrissa.tables.units.TEXT`` of words. A column is named as its quantity, or
        as it and a unit: ``width`` [m], ``width_um``.
    others : bool
        Whether the table may have further columns.
    header : sequence of str, optional
        Names of the columns of a table without a header.
    delimiter : str
        Between cells; ``ANY`` for white space, commas and semicolons.

    Returns
    -------
    Table
        All columns of the file.

    Raises
    ------
    InputError
        Names the file and the line: no file, no text, no header, a column missing, unknown or twice, a line with too
        few or too many cells.
    """
    import pandas as pd

    rows = each_line(path)
    known = {**needed, **(optional or {})}
    number, names = 1, tuple(header or ())
    if header is None:
        number, line = next(rows, (0, ""))
        if not number:
            raise TooFewError(str(path), "must hold a header and a line for each row", "an empty file")
        names = tuple(cell.strip() for cell in _cells(path, line, delimiter))
    named = _named(f"{path}, line {number}", names, needed, known, others)
    lines = array("q")
    text = StringIO("".join(_checked(path, rows, names, delimiter, lines)))
    how = {"sep": "," if delimiter == ANY else delimiter, "dtype": object, "na_filter": False, "low_memory": False}
    cells = pd.DataFrame({name: [] for name in names}, dtype=object)
    if lines:
        cells = pd.read_csv(text, header=None, names=list(names), skip_blank_lines=False, **how)
    return Table(path=str(path), header=names, lines=lines, named=named, cells=cells)


def _named(
    here: str, header: Sequence[str], needed: Mapping[str, str], known: Mapping[str, str], others: bool
) -> dict[str, tuple[str, str]]:
    """Column and unit of each quantity, of a header that is as it must be."""
    _refuse_separators(here, header)
    found: dict[str, tuple[str, str]] = {}
    for name in header:
        fits = [(kind, unit) for kind, si in known.items() if (unit := unit_of(name, kind, si)) is not None]
        if not fits and not others:
            _refuse_unknown(here, name, known)
        for kind, unit in fits[:1]:
            if kind in found:
                raise MissingError(here, f"must have one column {kind}", short(",".join(header)))
            found[kind] = name, unit
    for kind in needed:
        if kind not in found:
            remedy = _near(kind, known[kind], [name for name in header if name not in dict(found.values())])
            raise MissingError(here, f"must have a column {kind}", short(",".join(header)), remedy)
    for name, count in Counter(header).items():
        if count > 1:
            raise FormatError(here, "must name each column once", short(name))
    return found


def _refuse_separators(here: str, header: Sequence[str]) -> None:
    """Refuse a header whose columns are separated by semicolons or tabs."""
    if len(header) == 1 and re.search("[;\t]", header[0]):
        names = ",".join(re.split("[;\t]", header[0]))
        remedy = f"such as {short(names)}, with points, not commas, in the numbers"
        raise FormatError(here, "must separate its columns by commas", short(header[0]), remedy)


def _refuse_unknown(here: str, name: str, known: Mapping[str, str]) -> NoReturn:
    part_of = [kind for kind in known if name.lower() in kind.split("_")]
    stem = name.rpartition("_")[0].lower()
    if stem in known and name.lower() not in spellings(known.items()):
        names = spellings([(stem, known[stem])])
        unit = f", in {known[stem]}" * (known[stem] not in (TEXT, PURE))
        remedy = f"{stem} may be {', '.join(names)}" if len(names) > 1 else f"name it {stem}{unit}"
        raise UnknownError(here, "has an unknown column", short(name), remedy)
    near = part_of or nearest(name.lower(), spellings(known.items()), cutoff=0.75)
    remedy = f"did you mean {near[0]}?" if near else f"columns are {', '.join(known)}, in SI or ending in their unit"
    raise UnknownError(here, "has an unknown column", short(name), remedy)


def _near(wanted: str, si: str, header: Sequence[str]) -> str:
    """Say which column may have been meant, and how it is to be named."""
    for name in header:
        kind, _, end = name.rpartition("_")
        unit = f"_{end}" if kind and end in units_of(si) else ""
        plain = re.sub(r"[^a-z_]", "", name.removesuffix(unit).lower())
        words = [wanted, *wanted.split("_")]
        if plain and (nearest(plain, words, cutoff=0.6) or any(w.startswith(plain) for w in words)):
            return f"rename the column {short(name)} to {wanted}{unit}"
    return SEPARATORS


def _checked(
    path: str | Path, rows: Iterator[tuple[int, str]], header: Sequence[str], delimiter: str, lines: array[int]
) -> Iterator[str]:
    """Lines with as many cells as the header, and nothing in them that a parser would not see; numbers into lines."""
    limit = csv.field_size_limit()
    for number, line in rows:
        if delimiter != ANY and '"' not in line and len(line) <= limit:
            count, clean = line.count(delimiter) + 1, line
        else:
            cells = _cells(path, line, delimiter)
            count, clean = len(cells), line if delimiter != ANY else ",".join(cells) + "\n"
            if any("\n" in cell for cell in cells):
                raise FormatError(f"{path}, line {number}", "must close its quotes", short(line.rstrip()))
        if count != len(header):
            rule = f"must have {len(header)} cells, {','.join(header)}"
            raise ShapeError(f"{path}, line {number}", rule, count, SEPARATORS if delimiter == "," else "")
        if "\0" in line:
            name, cell = next(
                pair for pair in zip(header, _cells(path, line, delimiter), strict=True) if "\0" in pair[1]
            )
            raise FormatError(f"{path}, line {number}, {name}", "must be text in printable signs", short(cell))
        lines.append(number)
        yield clean


def _cells(path: str | Path, line: str, delimiter: str) -> list[str]:
    """Cells of one line."""
    if delimiter == ANY:
        return re.split(r"[\s,;]+", line.strip())
    try:
        return next(csv.reader([line.rstrip("\n") + "\n"], delimiter=delimiter))  # where quotes stay open it is seen
    except csv.Error as error:
        raise FormatError(str(path), f"must be text ({error})", remedy="save it as CSV, UTF-8") from error
