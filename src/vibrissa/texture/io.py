"""Textures on disk: troughs as a table of comma-separated values, reliefs from tables and instruments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal, TypedDict, Unpack

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.errors import ConflictError, FormatError, InputError, RangeError, UnknownError
from vibrissa.tables.reader import read_table
from vibrissa.tables.text import first_line, header_names
from vibrissa.tables.units import unit_of
from vibrissa.tables.writer import write_table
from vibrissa.texture.measured import Measured
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import LONGEST, Gaps
from vibrissa.texture.table import read_columns
from vibrissa.texture.topography import read_topography

Level = Literal["line", "none"]


class Settled(TypedDict, total=False):
    """What a file may leave open; see :func:`read_height_profile`."""

    line: str | None
    part: tuple[float, float] | None
    x_unit: str | None
    z_unit: str | None
    fill: bool
    level: Level | None


LARGEST = {"position": LONGEST, "width": 0.05, "depth": 0.01}  # [m] beyond these a unit is wrong
NEEDED, OPTIONAL = {"position": "m", "width": "m"}, {"depth": "m"}
SAY_UNITS = "columns ending in _mm and _um take millimetres and micrometres, others metres"


def read_gaps(path: str | Path) -> Gaps:
    """Gaps from a CSV file; the header names the units.

    Parameters
    ----------
    path : path
        UTF-8 text, comma-separated, one line for each gap in order of arrival, below a header with the columns
        ``position`` (edge that meets the contact first), ``width`` and, if the depth is not 35 µm, ``depth`` (one
        value on all lines). They are in metres; ``position_mm``, ``width_um`` and the like in millimetres and
        micrometres. Blank lines and lines that start with ``#`` are left alone.

    Returns
    -------
    Gaps
        The gaps of the file.

    Raises
    ------
    InputError
        Names the file and, where there is one, the line: a missing, double or unknown column, a cell that is no
        number, gaps that are not wide, not ascending or not apart, lengths that cannot be in that unit.
    """
    if _has_column(path, "height"):
        remedy = "gaps have position, width, depth; a surface, position and height alone, goes into scan or run"
        raise FormatError(str(path), "must be a table of gaps", "one with a column of heights", remedy)
    table = read_table(path, NEEDED, OPTIONAL, others=False)
    table.refuse_empty("must have at least one gap below its header", "an empty texture")
    values = {kind: table.numbers(kind) for kind in LARGEST if kind in table}
    _refuse_gaps(f"{path}, line", table.lines, values)
    depth = {"depth": float(values["depth"][0])} if "depth" in values else {}
    return Gaps(position=values["position"], width=values["width"], **depth)


def write_gaps(texture: Gaps, path: str | Path) -> None:
    """Write a texture so that :func:`read_gaps` gives it back to the last bit; whole or not at all.

    Parameters
    ----------
    texture : Gaps
        The gaps; written in metres, with their depth on every line.
    path : path
        Name of the file; one that is there is replaced.

    Raises
    ------
    InputError
        If the texture is one that would not be read again (see :func:`read_gaps`) or the file cannot be written.
    """
    depth = np.full(texture.position.size, texture.depth)
    table = {"position": texture.position, "width": texture.width, "depth": depth}
    _refuse_gaps("gap", range(1, 1 + depth.size), table)
    write_table(path, table)


def holds_gaps(path: str | Path) -> bool:
    """Whether a file has the header of a table of gaps, to be read by :func:`read_gaps`.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    bool
        True where a column is a width.

    Raises
    ------
    InputError
        If there is no such file.
    """
    return _has_column(path, "width")


def _has_column(path: str | Path, kind: str) -> bool:
    return any(unit_of(name.lower(), kind, "m") for name in header_names(first_line(path)))


def read_texture(
    path: str | Path,
    *,
    flip: bool = False,
    tell: Callable[[str], None] = lambda note: None,
    **settled: Unpack[Settled],
) -> Gaps | HeightProfile:
    """Gaps of a table of gaps, or else heights along the scan.

    Parameters
    ----------
    path : path
        As :func:`read_gaps` or :func:`read_height_profile` takes it.
    flip : bool
        Scan in the other direction: what comes last in the file meets the contact first.
    tell, settled
        As :func:`read_height_profile` takes them; a table of gaps leaves nothing to be settled.

    Returns
    -------
    Gaps or HeightProfile
        The texture, in the order in which the contact meets it.

    Raises
    ------
    InputError
        As these two; and if something is settled that a table of gaps does not leave open.
    """
    if not holds_gaps(path):
        return read_height_profile(path, flip=flip, tell=tell, **settled)
    useless = [name for name, value in settled.items() if value]
    if useless:
        raise ConflictError(useless[0], f"must not be given: {path} is a table of gaps, which leaves nothing open")
    troughs = read_gaps(path)
    if not flip:
        return troughs
    back = troughs.position[0] + troughs.end[-1] - troughs.end  # the first gap stays where the file has it
    return Gaps(position=back[::-1], width=troughs.width[::-1], depth=troughs.depth)


def read_height_profile(
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
) -> HeightProfile:
    """Height profile from a table or from the file of a profilometer or microscope; nothing is guessed.

    What a file does not settle is refused, with the option that settles it; they act in the order units, part, flip,
    fill, level. The first point of the file meets the contact first. An instrument's zeros mean nothing: the profile
    then begins at position 0 and its mean height is 0, so that a posture is the one on the mean surface. Below a
    header ``position_mm,height_um`` the zeros are the file's own, as those of drawn surfaces and of written ones are
    meant, but for the height of a levelled profile and the place of one that is flipped or cut; if they may be those of
    an instrument, this is said.

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
        sample under the instrument, or of the sample itself; the file does not distinguish the two.
    flip : bool
        The last point of the file meets the contact first.
    tell : callable
        Takes one line of text for each thing that was decided or is worth knowing.

    Returns
    -------
    HeightProfile
        Positions and heights [m], ascending in the order in which the contact meets them.

    Raises
    ------
    InputError
        In one line: no topography, units missing or stated twice, a map without its line, unsorted positions, holes,
        tilt, shorter than 0.3 mm (too small for a whisker), lengths that cannot be in that unit.
    """
    if level not in (None, "line", "none"):
        raise UnknownError("level", "must be line or none", level)
    measured = read_columns(path)
    if measured is None:
        measured = read_topography(path, line)
    elif line is not None:
        raise FormatError(str(path), "holds a single profile", f"line {line}", "leave `line` out")
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
    own = "heights count from their mean, places from the point that meets the contact first"
    notes = final.own_zeros() if profile.zero else [own]
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
        level = abs(rise) <= 1e-9 * np.ptp(whole.height)  # the rest is the rounding of the line of least squares
        notes.append("no tilt to take away" if level else said)
    return [*notes, *final.sampling()]


def _relief(profile: Measured) -> HeightProfile:
    try:
        return HeightProfile(position=profile.position, height=profile.height)
    except InputError as error:
        raise error.renamed(f"{profile.name}: {error.quantity}") from error


def write_height_profile(relief: HeightProfile, path: str | Path) -> None:
    """Write a relief so that :func:`read_height_profile`, with level "none", gives it back to the last bit.

    Parameters
    ----------
    relief : HeightProfile
        The profile; written in metres.
    path : path
        Name of the file; one that is there is replaced.
    """
    write_table(path, {"position_m": relief.position, "height_m": relief.height})


def _refuse_gaps(place: str, numbers: Sequence[int], values: dict[str, Array]) -> None:
    """Refuse what no texture can be, at the first gap where it shows."""

    def refuse(wrong: Mask, kind: str, rule: str, remedy: str = "") -> None:
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            raise RangeError(f"{place} {numbers[first]}, {kind}", rule, f"{values[kind][first]:.6g} m", remedy)

    position, width = values["position"], values["width"]
    for kind, column in values.items():
        refuse(np.abs(column) > LARGEST[kind], kind, f"must be at most {LARGEST[kind]:g} m", SAY_UNITS)
        refuse((column <= 0) & (kind != "position"), kind, "must be positive")
    before = np.concatenate([[-np.inf], position[:-1]])
    refuse(position <= before, "position", "must be beyond that of the gap before it", "sort the gaps by position")
    before_end = np.concatenate([[-np.inf], (position + width)[:-1]])
    overlap = position - before_end <= 0
    refuse(overlap, "position", "must be beyond the end of the gap before it", "gaps may not overlap")
    if "depth" in values:
        refuse(values["depth"] != values["depth"][0], "depth", "must be the same on all lines")
