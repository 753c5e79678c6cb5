"""Textures on disk: troughs as a table of comma-separated values, reliefs from tables and instruments."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path
from reprlib import repr as short
from typing import Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.files import as_number, csv_lines, written_whole
from vibrissa.texture.measured import Measured
from vibrissa.texture.relief import Relief
from vibrissa.texture.surface import LONGEST, Array, Troughs
from vibrissa.texture.table import first_line, read_columns, refuse_separators
from vibrissa.texture.topography import read_topography

Level = Literal["line", "none"]


class Settled(TypedDict, total=False):
    """What a file may leave open; see :func:`read_relief`."""

    line: str | None
    part: tuple[float, float] | None
    x_unit: str | None
    z_unit: str | None
    fill: bool
    level: Level | None


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


def holds_troughs(path: str | Path) -> bool:
    """Whether a file has the header of a table of gaps, to be read by :func:`read_troughs`."""
    if not Path(path).is_file():
        raise InputError(str(path), "must be an existing file")
    return any(COLUMNS.get(cell.strip().lower()) == "width" for cell in re.split("[,;\t]", first_line(path)))


def read_texture(
    path: str | Path,
    *,
    flip: bool = False,
    tell: Callable[[str], None] = lambda note: None,
    **settled: Unpack[Settled],
) -> Troughs | Relief:
    """Gaps of a table of gaps, or else heights along the scan.

    Parameters
    ----------
    path : path
        As :func:`read_troughs` or :func:`read_relief` takes it.
    flip : bool
        Scan in the other direction: what comes last in the file meets the contact first.
    tell, settled
        As :func:`read_relief` takes them; a table of gaps leaves nothing to be settled.

    Raises
    ------
    InputError
        As these two; and if something is settled that a table of gaps does not leave open.
    """
    if not holds_troughs(path):
        return read_relief(path, flip=flip, tell=tell, **settled)
    useless = [name for name, value in settled.items() if value]
    if useless:
        option = f"--{useless[0].replace('_', '-')}"
        raise InputError(option, f"must not be given: {path} is a table of gaps, which leaves nothing open")
    troughs = read_troughs(path)
    return troughs.reversed(float(troughs.position[0] + troughs.end[-1])) if flip else troughs


def read_relief(
    path: str | Path,
    *,
    line: str | None = None,
    part: tuple[float, float] | None = None,
    x_unit: str | None = None,
    z_unit: str | None = None,
    fill: bool = False,
    level: Level | None = None,
    flip: bool = False,
    tell: Callable[[str], None] = lambda note: None,
) -> Relief:
    """Height profile from a table or from the file of a profilometer or microscope; nothing is guessed.

    What a file does not settle is refused, with the option that settles it; they act in the order units, part, flip,
    fill, level. The first point of the file meets the contact first. An instrument's zeros mean nothing: the profile
    then begins at position 0 and its mean height is 0, so that a posture is the one on the mean surface. Below a
    header ``position_mm,height_um`` the zeros are the file's own, but for the height of a levelled profile and the
    place of one that is flipped or cut.

    Parameters
    ----------
    path : path
        A table (see :func:`vibrissa.texture.table.read_columns`) or, with the extra ``surface``, an instrument's file
        (see :func:`vibrissa.texture.topography.read_topography`).
    line : str, optional
        The line of a map: ``"x:12"`` runs along x as number 12 along y, counted from 0; ``"y:12"`` along y.
    part : (2,) tuple of float, optional
        Keep the points from the first to the second distance from the file's first point [m].
    x_unit, z_unit : str, optional
        Units of positions and heights (m, mm, um, nm) where the file states none.
    fill : bool
        Straight lines across points that were not measured; unmeasured ends are left out.
    level : {"line", "none"}, optional
        Take the line of least squares away, or keep the profile as it is. By default a profile is refused whose line
        rises by more than its heights about it span: most of what the whisker would feel is then the tilt of the
        sample under the instrument, or of the sample itself, which the file cannot tell apart.
    flip : bool
        The last point of the file meets the contact first.
    tell : callable
        Takes one line of text for each thing that was decided or is worth knowing.

    Returns
    -------
    Relief
        Positions and heights [m], ascending in the order in which the contact meets them.

    Raises
    ------
    InputError
        In one line: no topography, units missing or stated twice, a map without its line, unsorted positions, holes,
        tilt, shorter than 0.3 mm (too small for a whisker), lengths that cannot be in that unit.
    """
    if level not in (None, "line", "none"):
        raise InputError("--level", "must be line or none", level)
    measured = read_columns(path)
    if measured is None:
        measured = read_topography(path, line)
    elif line is not None:
        raise InputError(str(path), "holds a single profile", f"--line {line}", "leave --line out")
    profile = measured.in_metres(x_unit, z_unit)
    profile = profile.part(*part) if part else profile
    profile.refuse_short()
    profile = profile.flipped() if flip else profile
    profile.refuse_order()
    profile.refuse_unmeasured()
    if not fill:
        profile.refuse_holes()
    whole = profile.filled()
    whole.refuse_short()
    if level is None:
        whole.refuse_tilt()
    final = whole.levelled() if level == "line" else whole
    for note in [*measured.notes, *_decisions(profile, whole, final)]:
        tell(note)
    return _relief(final.zeroed())


def _decisions(profile: Measured, whole: Measured, final: Measured) -> list[str]:
    """What was filled, left out, taken away and taken for granted, and how finely the profile is sampled."""
    notes = (
        [] if profile.zero else ["heights count from their mean, places from the point that meets the contact first"]
    )
    bridged = whole.height.size - np.count_nonzero(np.isfinite(profile.height))
    if bridged:
        wide = f"{profile.widest_hole() * 1e3:.3g} mm the widest hole"
        notes.append(f"{bridged} points without height bridged by straight lines, {wide}")
    if profile.height.size > whole.height.size:
        notes.append(f"{profile.height.size - whole.height.size} points without height at the ends left out")
    if final is not whole:
        slope = float(whole.line()[1])
        rise = slope * np.ptp(whole.position)
        said = f"a tilt of {slope * 1e3:.3g} mm per m taken away, {rise * 1e6:.3g} µm over the length"
        level = abs(rise) <= 1e-9 * np.ptp(whole.height)  # what is left is the rounding of the line of least squares
        notes.append("no tilt to take away" if level else said)
    return [*notes, *final.sampling()]


def _relief(profile: Measured) -> Relief:
    try:
        return Relief(position=profile.position, height=profile.height)
    except InputError as error:
        raise InputError(f"{profile.name}:", str(error)) from error


def write_relief(relief: Relief, path: str | Path) -> None:
    """Write a relief so that :func:`read_relief`, told to keep its level, gives it back to the last bit; whole or not.

    Parameters
    ----------
    relief : Relief
        The profile; written in metres.
    path : path
        Name of the file; one that is there is replaced.
    """
    rows = zip(relief.position.tolist(), relief.height.tolist(), strict=True)
    text = "\n".join(["position_m,height_m", *(",".join(map(repr, row)) for row in rows), ""])
    with written_whole(path) as temporary:
        temporary.write_bytes(text.encode())


def _names(path: str | Path, number: int, header: list[str]) -> list[str]:
    """Check the header: known columns, each once, position and width among them."""
    here = f"{path}, line {number}"
    refuse_separators(here, header)
    for name in header:
        if name not in COLUMNS:
            near = get_close_matches(name.lower(), COLUMNS, n=1, cutoff=0.75)
            remedy = f"did you mean {near[0]}?" if near else SAY_COLUMNS
            if any(known.startswith("height") for known in header):
                remedy = "gaps have position, width, depth; a surface, position and height alone, goes into scan or run"
            raise InputError(here, "has an unknown column", short(name), remedy)
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
