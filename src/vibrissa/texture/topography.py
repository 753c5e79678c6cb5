"""Profiles from the files of profilometers and microscopes, read by SurfaceTopography."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError, install
from vibrissa.texture.measured import PER_METRE, SHORTEST_SCAN, TOO_SHORT, Measured

Array = NDArray[np.float64]

AXES = "xy"


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
        return _along(_Map.of(str(path), surface), line, notes)
    if line is not None:
        raise InputError(str(path), "holds a single profile", f"--line {line}", "leave --line out")
    position, height = np.asarray(surface.positions(), float), _heights(surface)
    height[_invalid(path, height.size)] = np.nan
    return Measured(
        name=str(path), position=position, height=height, x_unit=surface.unit, z_unit=surface.unit, notes=notes
    )


def _opened(path: str | Path) -> tuple[Any, tuple[str, ...]]:
    """Topography in the file, and what the file says of its channels and its stylus."""
    if Path(path).stat().st_size == 0:
        raise InputError(str(path), "must hold a surface", "an empty file")
    open_topography = _instrument_readers(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of readers that try a file which is not theirs
            reader = open_topography(str(path))
            surface = reader.topography()
    except Exception as error:  # forty readers, each with its own ways to fail
        cause = str(error).splitlines()
        about = f": {cause[0][:120]}" if cause and not cause[0].startswith("tried ") else ""
        rule = f"is no topography that can be read ({type(error).__name__}{about})"
        remedy = "a text needs two columns, or a header such as position_mm,height_um"
        raise InputError(str(path), rule, remedy=remedy) from error
    names = [channel.name for channel in reader.channels]
    channels = (f"its channel {reader.default_channel.name} is read, of {', '.join(names)}",) if names[1:] else ()
    return surface, channels + _stylus(surface)


def _instrument_readers(path: str | Path) -> Callable[[str], Any]:
    """Give the function of SurfaceTopography that opens a file by its content."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ImportWarning)  # that there is no MPI
            from SurfaceTopography.IO import open_topography
    except ImportError as error:
        remedy = f"{install('surface')}, or give a table with a header such as position_mm,height_um"
        raise InputError(str(path), "needs SurfaceTopography", remedy=remedy) from error
    return open_topography


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


def _invalid(path: str | Path, size: int) -> NDArray[np.bool_]:
    """Points that an .hfm file marks as invalid, a mark that its reader leaves alone."""
    with open(path, "rb") as file:
        marked = file.readline().strip() == b"X;Y;valid"
    if not marked:
        return np.zeros(size, bool)
    return np.loadtxt(path, delimiter=";", skiprows=2, usecols=2, ndmin=1) == 0


@dataclass(frozen=True, kw_only=True)
class _Map:
    """Heights on a grid, (x, y), its lengths and the distances of its points in one unit."""

    name: str
    height: Array
    size: tuple[float, float]
    unit: str | None

    @classmethod
    def of(cls, name: str, surface: Any) -> _Map:
        size = tuple(float(one) for one in surface.physical_sizes)
        return cls(name=name, height=_heights(surface), size=(size[0], size[1]), unit=surface.unit)

    def refuse_small(self) -> None:
        """Refuse a map too small in both directions."""
        if max(self.size) / PER_METRE.get(self.unit or "", np.nan) < SHORTEST_SCAN:
            raise InputError(self.name, TOO_SHORT, self.extent())

    def extent(self) -> str:
        """Lengths along x and y, in words."""
        per_metre = PER_METRE.get(self.unit or "")
        lengths = [f"{one / per_metre * 1e3 if per_metre else one:.4g}" for one in self.size]
        return " × ".join(lengths) + (" mm" if per_metre else " without unit")

    def clearest(self) -> str:
        """Line with the fewest unmeasured points, in words."""
        holes = [np.isnan(self.height).sum(axis) for axis in range(2)]
        axis = int(np.argmin([holes[k].min() / self.height.shape[k] for k in range(2)]))
        best = int(np.argmin(holes[axis]))
        return f"{AXES[axis]}:{best} has the fewest holes, {holes[axis][best]}"


def _along(surface: _Map, line: str | None, notes: tuple[str, ...]) -> Measured:
    surface.refuse_small()
    axis, number = _chosen(surface, line)
    height = surface.height[:, number] if axis == 0 else surface.height[number]
    step = surface.size[axis] / height.size
    return Measured(
        name=f"{surface.name}, line {line}",
        position=step * np.arange(height.size),
        height=height,
        x_unit=surface.unit,
        z_unit=surface.unit,
        notes=notes,
    )


def _chosen(surface: _Map, line: str | None) -> tuple[int, int]:
    """Axis along which the line runs, and its number on the other one."""
    nx, ny = surface.height.shape
    wanted = f"x:0 to x:{ny - 1} along x or y:0 to y:{nx - 1} along y"
    if line is None:
        found = f"{nx} × {ny} points, {surface.extent()}"
        remedy = f"--line {wanted}; {surface.clearest()}"
        raise InputError(surface.name, "is a map, which the whisker crosses along one line", found, remedy)
    match = re.fullmatch(r"([xy]):(\d{1,9})", line)
    if match is None or int(match[2]) >= (ny, nx)[AXES.index(match[1])]:
        raise InputError("--line", f"must be {wanted}", line)
    return AXES.index(match[1]), int(match[2])
