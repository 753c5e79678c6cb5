"""Textures on disk: troughs as a table of comma-separated values."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from reprlib import repr as short

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import as_number, csv_lines, written_whole
from vibrissa.texture.surface import LONGEST, Array, Troughs

UNITS = {"": 1.0, "_mm": 1e3, "_um": 1e6}  # per metre, by the end of a column's name
LARGEST = {"position": LONGEST, "width": 0.05, "depth": 0.01}  # [m] beyond these a unit is wrong
COLUMNS = {kind + unit: kind for kind in LARGEST for unit in UNITS}
SAY_UNITS = "columns ending in _mm and _um take millimetres and micrometres, others metres"
SAY_COLUMNS = f"columns are {', '.join(LARGEST)}, in metres or ending in _mm or _um, and separated by commas"


def read_troughs(path: str | Path) -> Troughs:
    """Troughs from a CSV file; the header names the units.

    Parameters
    ----------
    path : path
        UTF-8 text, comma-separated, one line for each gap in order of arrival, below a header with the columns
        ``position`` (edge that meets the contact first), ``width`` and, if the depth is not 35 µm, ``depth`` (one
        value on all lines). They are in metres; ``position_mm``, ``width_um`` and the like in millimetres and
        micrometres. Blank lines and lines that start with ``#`` are left alone.

    Returns
    -------
    Troughs
        The gaps of the file.

    Raises
    ------
    InputError
        Names the file and, where there is one, the line: a missing, double or unknown column, a cell that is no
        number, gaps that are not wide, not ascending or not apart, lengths that cannot be in that unit.
    """
    lines = csv_lines(path)
    if not lines:
        raise InputError(str(path), "must hold a header and a line for each gap", "an empty file", SAY_COLUMNS)
    names, numbers = _names(path, *lines[0]), [number for number, _ in lines[1:]]
    if not numbers:
        raise InputError(str(path), "must have at least one gap below its header", "an empty texture")
    table = np.array([_values(path, number, cells, names) for number, cells in lines[1:]]).T
    values = {COLUMNS[name]: column for name, column in zip(names, table, strict=True)}
    _refuse_gaps(f"{path}, line", numbers, values)
    depth = {"depth": float(values["depth"][0])} if "depth" in values else {}
    return Troughs(position=values["position"], width=values["width"], **depth)


def write_troughs(texture: Troughs, path: str | Path) -> None:
    """Write a texture so that :func:`read_troughs` gives it back to the last bit; whole or not at all.

    Parameters
    ----------
    texture : Troughs
        The gaps; written in metres, with their depth on every line.
    path : path
        Name of the file; one that is there is replaced.

    Raises
    ------
    InputError
        If the texture is one that would not be read again (see :func:`read_troughs`) or the file cannot be written.
    """
    depth = np.full(texture.position.size, texture.depth)
    table = {"position": texture.position, "width": texture.width, "depth": depth}
    _refuse_gaps("gap", range(1, 1 + depth.size), table)
    rows = zip(*(column.tolist() for column in table.values()), strict=True)
    text = "\n".join([",".join(table), *(",".join(map(repr, row)) for row in rows), ""])
    with written_whole(path) as temporary:
        temporary.write_bytes(text.encode())


def _names(path: str | Path, number: int, header: list[str]) -> list[str]:
    """Check the header: known columns, each once, position and width among them."""
    here = f"{path}, line {number}"
    for name in header:
        if name not in COLUMNS:
            near = get_close_matches(name.lower(), COLUMNS, n=1, cutoff=0.75)
            raise InputError(
                here, "has an unknown column", short(name), f"did you mean {near[0]}?" if near else SAY_COLUMNS
            )
    kinds = [COLUMNS[name] for name in header]
    for kind in LARGEST:
        if kinds.count(kind) > 1 or (kind != "depth" and kind not in kinds):
            raise InputError(here, f"must have one column {kind}", short(",".join(header)), SAY_COLUMNS)
    return header


def _values(path: str | Path, number: int, cells: list[str], names: list[str]) -> list[float]:
    """Numbers of one line [m]."""
    if len(cells) != len(names):
        raise InputError(f"{path}, line {number}", f"must have {len(names)} cells, as the header", len(cells))
    return [_metres(f"{path}, line {number}, {name}", name, cell) for name, cell in zip(names, cells, strict=True)]


def _metres(here: str, name: str, cell: str) -> float:
    value = as_number(cell)
    if not np.isfinite(value):
        raise InputError(here, "must be a finite number", short(cell))
    return value / UNITS[name.removeprefix(COLUMNS[name])]  # divided, not multiplied: nearest to the decimal written


def _refuse_gaps(place: str, numbers: Sequence[int], values: dict[str, Array]) -> None:
    """Refuse what no texture can be, at the first gap where it shows."""

    def refuse(wrong: NDArray[np.bool_], kind: str, rule: str, remedy: str = "") -> None:
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            raise InputError(f"{place} {numbers[first]}, {kind}", rule, f"{values[kind][first]:.6g} m", remedy)

    position, width = values["position"], values["width"]
    for kind, column in values.items():
        refuse(np.abs(column) > LARGEST[kind], kind, f"must be at most {LARGEST[kind]:g} m", SAY_UNITS)
        refuse((column <= 0) & (kind != "position"), kind, "must be positive")
    before = np.concatenate([[-np.inf], position[:-1]])
    refuse(position <= before, "position", "must be beyond that of the gap before it", "sort the gaps by position")
    before_end = np.concatenate([[-np.inf], (position + width)[:-1]])
    refuse(
        position - before_end <= 0, "position", "must be beyond the end of the gap before it", "gaps may not overlap"
    )
    if "depth" in values:
        refuse(values["depth"] != values["depth"][0], "depth", "must be the same on all lines")
