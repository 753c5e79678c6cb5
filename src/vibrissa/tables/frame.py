"""Tables in memory: data frames of pandas, read as strictly as files, and made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from reprlib import repr as short
from typing import TYPE_CHECKING, Any

from vibrissa.errors import ConflictError, MissingError, ShapeError, nearest
from vibrissa.tables.table import Table
from vibrissa.tables.units import TEXT, unit_of

if TYPE_CHECKING:
    import pandas as pd
    from pandas import DataFrame as DataFrame

HERE = "DataFrame"
Spellings = Mapping[str, Sequence[str]]


def data_frame(columns: Mapping[str, Any]) -> DataFrame:
    """Data frame of columns.

    Parameters
    ----------
    columns : mapping of (R,) arrays or lists
        Cells by the name of their column, in this order.

    Returns
    -------
    DataFrame
        With a row for each.
    """
    import pandas as pd

    return pd.DataFrame(dict(columns))


def table_of_frame(
    frame: DataFrame, needed: Mapping[str, str], optional: Mapping[str, str], spellings: Spellings
) -> Table:
    """Table of the columns of a data frame that are asked for.

    Parameters
    ----------
    frame : DataFrame
        With named columns, or levels of its index.
    needed, optional : mapping of str
        SI unit of each quantity, as in :func:`vibrissa.tables.reader.read_table`.
    spellings : mapping of sequences of str
        Other names that a quantity may have where no column has its own, each with or without a unit.

    Returns
    -------
    Table
        Cells of these columns; missing values are empty cells.

    Raises
    ------
    InputError
        If a column is missing, or two may be meant, with the words that rename it.
    """
    import pandas as pd

    known = {**needed, **optional}
    if any(name and _fits([str(name)], *one, spellings) for name in frame.index.names for one in known.items()):
        frame = frame.reset_index()
    header = tuple(str(name) for name in frame.columns)
    named = {
        kind: found for kind, si in known.items() if (found := _column(header, kind, si, kind in needed, spellings))
    }
    cells = {name: _text(frame.iloc[:, header.index(name)], known[kind] == TEXT) for kind, (name, _) in named.items()}
    return Table(
        path=HERE,
        header=header,
        lines=range(len(frame)),
        named=named,
        cells=pd.DataFrame(cells, dtype=object),
        row_word="row",
    )


def _fits(header: Sequence[str], kind: str, si: str, spellings: Spellings) -> list[tuple[str, str]]:
    """Columns that may hold a quantity, each with its unit: its own name, then that with a unit, then another."""
    if own := [(name, si) for name in header if name == kind]:
        return own
    for words in ((kind,), spellings.get(kind, ())):
        found = [(name, unit) for name in header for word in words if (unit := unit_of(name, word, si)) is not None]
        if found:
            return found
    return []


def _column(header: Sequence[str], kind: str, si: str, needed: bool, spellings: Spellings) -> tuple[str, str] | None:
    found = _fits(header, kind, si, spellings)
    if len(found) > 1:
        names = ", ".join(name for name, _ in found)
        one = found[0][0]
        rename = "" if one == kind else f", or rename the one that is meant: {_renaming(one, kind)}"
        raise ConflictError(HERE, f"must have one column {kind}", names, f"drop the others{rename}")
    if found or not needed:
        return found[0] if found else None
    near = nearest(kind, header, cutoff=0.5)
    remedy = f"name it so: {_renaming(near[0] if near else 'NAME', kind)}"
    raise MissingError(HERE, f"must have a column {kind}", short(",".join(header)), remedy)


def _renaming(name: str, kind: str) -> str:
    return f"frame.rename(columns={{{name!r}: {kind!r}}})"


def _text(column: pd.Series, words: bool) -> list[str]:
    """Cells as text, from which numbers are read again to the last bit."""
    values = column.to_numpy().tolist()
    if any(isinstance(value, list | tuple) or hasattr(value, "shape") for value in values[:1]):
        remedy = f"frame.explode({column.name!r})"
        raise ShapeError(f"{HERE}, {column.name}", "must hold one value in each row", "an array", remedy)
    if words and column.dtype.kind == "f":  # whole numbers that pandas widened
        values = [int(value) if value == value and float(value).is_integer() else value for value in values]
    return ["" if gone else str(value) for gone, value in zip(column.isna(), values, strict=True)]
