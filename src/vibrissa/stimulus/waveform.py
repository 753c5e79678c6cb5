"""The motion of one point of a whisker, from files."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import (
    FormatError,
    MissingError,
    RangeError,
    ShapeError,
    TooFewError,
    UnknownError,
    require_positive,
)
from vibrissa.netcdf import load
from vibrissa.quantities import require
from vibrissa.signals.even_times import even_rate
from vibrissa.tables.reader import read_table

LARGEST = 5e-3  # [m] of displacement 5 mm from the base; beyond it a unit is wrong
_NEAR = 1e-6  # [m] a node this close is at the distance
_APART = 2e-3  # [m] widest spacing of nodes between which the shaft is taken for straight


@dataclass(frozen=True, kw_only=True)
class PointMotion:
    """Displacement of one point on an even grid.

    Attributes
    ----------
    displacement : (T,) array
        Transverse displacement [m], any zero.
    sampling_rate : float
        [Hz].
    source : str
        Where it comes from.
    resonance : float
        First resonance of the whisker it comes from [Hz], NaN if not known.
    start : float
        Time of its first sample [s], on the clock of its table; 0 of others.
    """

    displacement: Array = field(repr=False)
    sampling_rate: float
    source: str = "motion"
    resonance: float = np.nan
    start: float = 0.0

    def __post_init__(self) -> None:
        require_positive(f"{self.source}: sampling rate", self.sampling_rate, "Hz")
        if self.displacement.ndim != 1 or len(self.displacement) < 4:
            raise TooFewError(self.source, "must have at least 4 samples", self.displacement.shape)
        _refuse_values(self.source, self.displacement, self.sampling_rate)

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return (len(self.displacement) - 1) / self.sampling_rate


def _refuse_values(source: str, displacement: Array, sampling_rate: float) -> None:
    bad = np.flatnonzero(~np.isfinite(displacement))
    if len(bad):
        where = f"{len(bad)} not measured, the first at {bad[0] / sampling_rate:.6g} s"
        raise RangeError(f"{source}: displacement", "must be finite", where, "cut the record to where it was measured")
    largest = float(np.abs(displacement).max())
    if largest > LARGEST:
        remedy = "is it in millimetres or micrometres? Name a CSV column displacement_mm or displacement_um"
        raise RangeError(f"{source}: displacement", f"must be at most {LARGEST:g} m", f"{largest:.4g} m", remedy)


def read_motion(path: str | Path, *, distance: float = 5e-3, which: int = 0) -> PointMotion:
    """Motion of a point of the shaft from a file.

    Parameters
    ----------
    path : path
        Dataset (``.nc``) with ``displacement`` at nodes, as a prediction or a decomposition has, or with tracked
        centrelines ``x``, ``y``; or text (``.csv``) with the columns ``time`` [s] (or ``time_ms``) and
        ``displacement`` [m] (or ``displacement_mm``, ``displacement_um``).
    distance : float
        Of the point from the base along the shaft [m]; a CSV file is taken to be of that point.
    which : int
        Which of the tracked whiskers.

    Returns
    -------
    PointMotion
        The motion on an even grid.

    Raises
    ------
    InputError
        Samples that are uneven or missing, a wrong unit, no node near the distance, an unknown ending.
    """
    require_positive("distance", distance, "m")
    ending = Path(path).suffix.lower()
    if ending == ".csv":
        table = read_table(path, {"time": "s", "displacement": "m"}, others=False)
        time, moved = table.numbers("time"), table.numbers("displacement")
        rate = even_rate(time, str(path))
        return PointMotion(displacement=moved, sampling_rate=rate, source=str(path), start=float(time[0]))
    if ending != ".nc":
        raise FormatError(str(path), "must end in .nc or .csv", repr(ending))
    return motion_at(load(path), distance, which=which, source=str(path))


def motion_at(data: xr.Dataset, distance: float, *, which: int = 0, source: str = "dataset") -> PointMotion:
    """Motion of a point of the shaft from a dataset.

    Parameters
    ----------
    data : Dataset
        ``time``, ``arc_length`` and either ``displacement`` or tracked ``x``, ``y``.
    distance : float
        Of the point from the base [m]. Between nodes at most 2 mm apart it is interpolated linearly.
    which : int
        Which of the whiskers, where there is a dimension ``whisker``.
    source : str
        What to call it in messages.

    Returns
    -------
    PointMotion
        The motion on an even grid.

    Raises
    ------
    InputError
        If a variable is missing, no node is near, or times are uneven.
    """
    if "whisker" in data.dims:
        if not 0 <= which < data.sizes["whisker"]:
            raise UnknownError(f"{source}: whisker", f"must be one of 0 to {data.sizes['whisker'] - 1}", which)
        data = data.isel(whisker=which)
    if "mode_displacement" in data and "arc_length" not in data:
        remedy = f"scan again with `nodes=[{distance:g}]`"
        raise MissingError(source, "must hold the motion of a point", "modes alone", remedy)
    names = ["displacement"] if "displacement" in data else ["x", "y"]
    require(data, "time", "arc_length", *names)
    extra = set(data[names[0]].dims) - {"time", "node"}
    if extra:
        raise ShapeError(source, "must have dimensions time and node alone", f"{', '.join(map(str, extra))} as well")
    rate = even_rate(data["time"].to_numpy().astype(float), source)
    moved = data["displacement"].transpose("time", "node").to_numpy() if "displacement" in data else _normal(data)
    known = data["resonant_frequency"].to_numpy().ravel() if "resonant_frequency" in data else np.array([])
    first = float(known[0]) if known.size else np.nan
    motion = _between(moved.astype(float), data["arc_length"].to_numpy(), distance, source)
    return PointMotion(displacement=motion, sampling_rate=rate, source=source, resonance=first)


def _between(moved: Array, arc: Array, distance: float, source: str) -> Array:
    """Motion at a distance, from the (T, N) motion of nodes."""
    near = int(np.argmin(np.abs(np.where(np.isfinite(arc), arc, np.inf) - distance)))
    if abs(arc[near] - distance) <= _NEAR:
        return moved[:, near]
    below, above = np.flatnonzero(arc < distance), np.flatnonzero(arc > distance)
    if not (len(below) and len(above)) or arc[above].min() - arc[below].max() > _APART:
        remedy = f"predict with `nodes=[{distance:g}]`, or choose `distance={arc[near]:g}`"
        raise MissingError(source, f"must have a node at {distance:g} m, or two about it", f"{arc[near]:g} m", remedy)
    low, high = below[np.argmax(arc[below])], above[np.argmin(arc[above])]
    share = (distance - arc[low]) / (arc[high] - arc[low])
    return (1 - share) * moved[:, low] + share * moved[:, high]


def _normal(data: xr.Dataset) -> Array:
    """(T, N) displacement along the normal of the mean profile, positive to its concave side [m]."""
    x, y = (data[name].transpose("time", "node").to_numpy().astype(float) for name in ("x", "y"))
    seen = np.isfinite(x).all(0) & np.isfinite(y).all(0)
    if seen.sum() < 3:
        raise TooFewError("profile", "must have 3 nodes seen in every frame", int(seen.sum()), "cut the record")
    dx, dy = x - x.mean(0), y - y.mean(0)
    arc = data["arc_length"].to_numpy()[seen]
    angle = np.full(len(seen), np.nan)
    angle[seen] = np.unwrap(np.arctan2(np.gradient(y.mean(0)[seen], arc), np.gradient(x.mean(0)[seen], arc)))
    turn = angle[seen][np.argmax(arc)] - angle[seen][np.argmin(arc)]
    side = -1.0 if turn < 0 else 1.0
    return side * (np.cos(angle) * dy - np.sin(angle) * dx)
