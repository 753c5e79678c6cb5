"""Profiles from the files of profilometers and microscopes, read by SurfaceTopography."""

from __future__ import annotations

import math
import re
import warnings
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from vibrissa.arrays import Array, Mask
from vibrissa.binary import COPIES, refuse_bomb
from vibrissa.errors import FormatError, InputError, PackageError, ShapeError, TooFewError, UnknownError, install
from vibrissa.limits import require_memory
from vibrissa.tables.units import to_si, units_of
from vibrissa.texture.measured import SHORTEST_SCAN, TOO_SHORT, Measured

AXES = "xy"
_TEXTS = {"xyz", "asc"}  # formats of bare text, whose readers go through all of any file
_START, _PART = 1 << 18, 1 << 12  # bytes of a file that are looked at: of its start; of its middle, of its end
_NUMBER = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|nan", re.IGNORECASE)
_HIDES = "a row with another separator, or without a finite number, hides those above it: mend it"
_TWO_COLUMNS = "a text needs two columns, or a header such as position_mm,height_um"


def read_topography(path: str | Path, line: str | None = None) -> Measured:
    """Profile from an instrument's file.

    Parameters
    ----------
    path : path
        A file of any format that SurfaceTopography reads (al3d, datx, frt, gwy, hfm, opd, opdx, plu, sdf, sur, vk,
        x3p and some thirty more), with a profile or a map of heights.
    line : str, optional
        Which line of a map: ``"x:12"`` runs along x and is the one of number 12, counted from 0 along y; ``"y:12"``
        runs along y.

    Returns
    -------
    Measured
        In the unit of the file, NaN where nothing was measured; the origin is the file's first point.

    Raises
    ------
    InputError
        If SurfaceTopography is not installed or cannot read the file, a map is too small or lacks its line, or a
        profile is given one.
    """
    surface, notes = _opened(path)
    if surface.dim == 2:
        return _along(path, surface, line, notes)
    if line is not None:
        raise FormatError(str(path), "holds a single profile", f"line {line}", "leave `line` out")
    position, height = np.asarray(surface.positions(), float), _heights(surface)
    height[_invalid(path, height.size)] = np.nan
    return Measured(
        name=str(path), position=position, height=height, x_unit=surface.unit, z_unit=surface.unit, notes=notes
    )


def _opened(path: str | Path) -> tuple[Any, tuple[str, ...]]:
    """Topography in the file, and what the file says of its channels and its stylus."""
    size = Path(path).stat().st_size
    if size == 0:
        raise TooFewError(str(path), "must hold a surface", "an empty file")
    require_memory(str(path), f"{size / 1e9:.3g} GB", size)
    refuse_bomb(path)
    library = _instrument_readers(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of readers that try a file which is not theirs
            reader = library.open_topography(str(path), format=_format(path, library))
            points = [math.prod(channel.nb_grid_pts) for channel in reader.channels]
            require_memory(str(path), f"{max(points)} points", 8 * COPIES * max(points))
            surface = reader.topography()
    except InputError:
        raise
    except Exception as error:  # forty readers, each with its own ways to fail
        cause = str(error).splitlines()
        about = f": {cause[0][:120]}" if cause and not cause[0].startswith("tried ") else ""
        rule = f"is no topography that can be read ({type(error).__name__}{about})"
        raise FormatError(str(path), rule, remedy=_TWO_COLUMNS) from error
    if reader.format() in _TEXTS:
        _refuse_lost_rows(path, max(points) if reader.format() == "xyz" else None)
    names = [channel.name for channel in reader.channels]
    channels = (f"its channel {reader.default_channel.name} is read, of {', '.join(names)}",) if names[1:] else ()
    return surface, channels + _stylus(surface)


def _format(path: str | Path, library: Any) -> str | None:
    """Name of the first format whose reader takes a file that holds no columns of numbers; None where it does.

    The readers of text, which go through the whole file before they refuse it, are then left out: of newlines alone
    the time that one of them takes grows as the square of their number.
    """
    if _has_numbers(path):
        return None
    with open(path, "rb") as file:
        start = file.read(library.MAGIC_BUFFER_SIZE)
    for reader in library.readers:
        name = reader.format()
        if name in _TEXTS or reader.can_read(start) == library.MagicMatch.NO:
            continue
        with suppress(Exception):  # of a reader that tries a file which is not its own
            library.open_topography(str(path), format=name).close()
            return str(name)
    raise FormatError(str(path), "is no topography that can be read (of no known format)", remedy=_TWO_COLUMNS)


def _has_numbers(path: str | Path) -> bool:
    """Whether a file may be a text of numbers: a line of them in its start, digits in its middle and at its end."""
    size = Path(path).stat().st_size
    with open(path, "rb") as file:
        *lines, last = file.read(_START).splitlines() or [b""]
        places = size // 2, max(size - _PART, 0)
        parts = [file.read(_PART) for place in places if file.seek(place) == place]
    lines += [last] if size < _START else []  # else it may be cut
    rows = (re.sub(b"[,;]", b" ", line).split() for line in lines)
    return any(row and all(map(_NUMBER.fullmatch, row)) for row in rows) and all(
        re.search(rb"\d", one) for one in parts
    )


def _refuse_lost_rows(path: str | Path, points: int | None) -> None:
    """Refuse a text with a row of anything but numbers: its reader silently leaves out that row, or all above it."""
    columns = rows = 0
    with open(path, encoding="latin-1") as file:  # any bytes, and the ends of lines of any system
        for number, line in enumerate(file, 1):
            cells = re.sub("[,;]", " ", line).encode("latin-1").split()
            if len(cells) > 1 and all(map(_NUMBER.fullmatch, cells)) and len(cells) == (columns or len(cells)):
                columns, rows = len(cells), rows + 1
            elif rows and cells:
                rule = f"must be {columns} numbers, as the rows above it"
                raise FormatError(f"{path}, line {number}", rule, line.strip()[:40] or None, "remove or mend it")
    if points is not None and rows != points:
        raise FormatError(str(path), f"has {rows} rows of numbers, of which only {points} can be read", None, _HIDES)


def _instrument_readers(path: str | Path) -> ModuleType:
    """Give the module of SurfaceTopography that opens a file by its content."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ImportWarning)  # that there is no MPI
            import SurfaceTopography.IO
    except ImportError as error:
        remedy = f"{install('surface')}, or give a table with a header such as position_mm,height_um"
        raise PackageError(str(path), "needs SurfaceTopography", remedy=remedy) from error
    return SurfaceTopography.IO


def _stylus(surface: Any) -> tuple[str, ...]:
    """What the radius of the instrument's stylus means, where the file knows it."""
    radius = surface.info.get("instrument", {}).get("parameters", {}).get("tip_radius", {})
    if "value" not in radius:
        return ()
    said = f"{radius['value']:g} {radius.get('unit', '')}".strip()
    return (f"measured with a stylus of radius {said}: grooves that it cannot enter are not in the file",)


def _heights(surface: Any) -> Array:
    """Heights in the unit of the file, NaN where nothing was measured."""
    return np.ma.filled(np.ma.asarray(surface.heights(), float), np.nan)


def _invalid(path: str | Path, size: int) -> Mask:
    """Points that an .hfm file marks as invalid, a mark that its reader leaves alone."""
    with open(path, "rb") as file:
        marked = file.readline().strip() == b"X;Y;valid"
    if not marked:
        return np.zeros(size, bool)
    try:
        marks = np.loadtxt(path, delimiter=";", skiprows=2, usecols=2, ndmin=1)
    except ValueError as error:
        rule = f"must mark each point as valid or not ({str(error)[:80]})"
        raise FormatError(str(path), rule, remedy="mend that row, or remove it") from error
    if marks.size != size:
        raise ShapeError(str(path), f"must mark each of its {size} points as valid or not", f"{marks.size} marks")
    return np.asarray(marks == 0)


def _along(path: str | Path, surface: Any, line: str | None, notes: tuple[str, ...]) -> Measured:
    """Profile along one line of a map, whose points have equal distances."""
    if surface.unit in units_of("m") and to_si(max(surface.physical_sizes), surface.unit) < SHORTEST_SCAN:
        raise TooFewError(str(path), TOO_SHORT, _extent(surface))
    heights = _heights(surface)
    axis, number = _chosen(path, surface, heights, line)
    height = np.take(heights, number, axis=1 - axis)
    step = float(surface.physical_sizes[axis]) / height.size
    return Measured(
        name=f"{path}, line {line}",
        position=step * np.arange(height.size),
        height=height,
        x_unit=surface.unit,
        z_unit=surface.unit,
        notes=notes,
    )


def _extent(surface: Any) -> str:
    """Lengths along x and y, in words."""
    known = surface.unit in units_of("m")
    lengths = [f"{1e3 * to_si(float(one), surface.unit) if known else one:.4g}" for one in surface.physical_sizes]
    return " × ".join(lengths) + (" mm" if known else " without unit")


def _chosen(path: str | Path, surface: Any, heights: Array, line: str | None) -> tuple[int, int]:
    """Axis along which the line runs, and its number on the other one."""
    nx, ny = heights.shape
    wanted = f"x:0 to x:{ny - 1} along x or y:0 to y:{nx - 1} along y"
    if line is None:
        holes = [np.isnan(heights).sum(axis) for axis in range(2)]
        axis = int(np.argmin([holes[0].min() / nx, holes[1].min() / ny]))
        best = int(np.argmin(holes[axis]))
        remedy = f"give `line`, {wanted}; {AXES[axis]}:{best} has the fewest holes, {holes[axis][best]}"
        found = f"{nx} × {ny} points, {_extent(surface)}"
        raise FormatError(str(path), "is a map, which the whisker crosses along one line", found, remedy)
    match = re.fullmatch(r"([xy]):(\d{1,9})", line)
    if match is None or int(match[2]) >= (ny, nx)[AXES.index(match[1])]:
        raise UnknownError("line", f"must be {wanted}", line)
    return AXES.index(match[1]), int(match[2])
