"""Signal to noise of sorted units in the tables that lie beside them: those of phy, and of SpikeInterface's export."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vibrissa.errors import FormatError
from vibrissa.tables.reader import read_table
from vibrissa.tables.text import each_line
from vibrissa.tables.units import PURE, TEXT

FIRST = "cluster_info.tsv"  # what phy itself saved comes before the tables of others
TABLES = ("cluster_*.tsv", "cluster_*.csv", "metrics.csv")
KEYS = ("cluster_id", "id", "unit_id")
SNR = "snr"


def stated_snr(folder: Path, units: Sequence[str]) -> tuple[dict[str, Any], str]:
    """Signal to noise of units, from the first table in a folder that has a column ``snr``.

    Parameters
    ----------
    folder : Path
        Folder of sorted units.
    units : sequence of str
        Names of the units.

    Returns
    -------
    dict, str
        ``unit_snr`` (unit), NaN for units that the table leaves open, or nothing; and the name of the table.

    Raises
    ------
    InputError
        Names the table and the line: no column names the units, or a cell is no number.
    """
    found = {path.name: path for pattern in TABLES for path in sorted(folder.glob(pattern))}
    for name in sorted(found, key=lambda one: one != FIRST):
        values = _column(found[name])
        if values is not None:
            return {"unit_snr": np.array([values.get(unit, np.nan) for unit in units])}, name
    return {}, ""


def _column(path: Path) -> dict[str, float] | None:
    """Signal to noise by the name of the unit; None where the table has no such column."""
    delimiter = "\t" if path.suffix == ".tsv" else ","
    header = [cell.strip() for cell in next(each_line(path), (0, ""))[1].split(delimiter)]
    column = next((cell for cell in header if cell.lower() == SNR), None)
    if column is None:
        return None
    key = next((cell for cell in KEYS if cell in header), None)
    if key is None:
        raise FormatError(f"{path}, line 1", f"must name a column {KEYS[0]} beside {column}", ", ".join(header))
    table = read_table(path, {key: TEXT, column: PURE}, delimiter=delimiter)
    values = table.numbers(column, blanks=True, unknown=True)
    return dict(zip(table.text(key), values.tolist(), strict=True))
