"""Tables as files of comma-separated values."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vibrissa.files import written_whole


def write_table(path: str | Path, columns: Mapping[str, Any], *, digits: int | None = None) -> None:
    """Write a table of comma-separated values, UTF-8, whole or not at all.

    Parameters
    ----------
    path : path
        Name of the file; one that is there is replaced.
    columns, digits
        As in :func:`table_text`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    text = table_text(columns, digits=digits)
    with written_whole(path) as temporary:
        temporary.write_bytes(text.encode())


def table_text(columns: Mapping[str, Any], *, digits: int | None = None) -> str:
    """Text of a table of comma-separated values, a header and a line for each row.

    Parameters
    ----------
    columns : mapping of (R,) arrays or lists
        Cells by the name of their column, in this order.
    digits : int, optional
        Significant digits of numbers; by default as many as give them back to the last bit.

    Returns
    -------
    str
        Lines, each with its end.
    """
    import pandas as pd

    form = None if digits is None else f"%.{digits}g"
    return pd.DataFrame(dict(columns)).to_csv(index=False, lineterminator="\n", float_format=form, na_rep="nan")
