"""The motion of one point of a whisker: from files, and joined to a loop."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from vibrissa.errors import InputError
from vibrissa.files import load
from vibrissa.quantities import require

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

LARGEST = 5e-3  # [m] of displacement 5 mm from the base; beyond it a unit is wrong
_NEAR = 1e-6  # [m] a node this close is at the distance
_APART = 2e-3  # [m] widest spacing of nodes between which the shaft is taken for straight
_MOST_SAMPLES = 2_000_000  # [1] of one whisker: 24 of them are 0.4 gigabytes
_UNEVEN = 0.01  # of a sampling interval
_COLUMNS = {"time": 1.0, "time_ms": 1e3, "displacement": 1.0, "displacement_mm": 1e3, "displacement_um": 1e6}


@dataclass(frozen=True, kw_only=True)
class Motion:
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
    """

    displacement: Array = field(repr=False)
    sampling_rate: float
    source: str = "motion"
    resonance: float = np.nan

    def __post_init__(self) -> None:
        if not (0 < self.sampling_rate < np.inf):
            raise InputError(f"{self.source}: sampling rate", "must be positive (Hz)", self.sampling_rate)
        if self.displacement.ndim != 1 or len(self.displacement) < 4:
            raise InputError(self.source, "must have at least 4 samples", self.displacement.shape)
        _refuse_values(self.source, self.displacement, self.sampling_rate)

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return (len(self.displacement) - 1) / self.sampling_rate


def _refuse_values(source: str, displacement: Array, sampling_rate: float) -> None:
    bad = np.flatnonzero(~np.isfinite(displacement))
    if len(bad):
        where = f"{len(bad)} not measured, the first at {bad[0] / sampling_rate:.6g} s"
        raise InputError(f"{source}: displacement", "must be finite", where, "cut the record to where it was measured")
    largest = float(np.abs(displacement).max())
    if largest > LARGEST:
        remedy = "is it in millimetres or micrometres? Name a CSV column displacement_mm or displacement_um"
        raise InputError(f"{source}: displacement", f"must be at most {LARGEST:g} m", f"{largest:.4g} m", remedy)


def read_motion(path: str | Path, *, distance: float = 5e-3, which: int = 0) -> Motion:
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

    Raises
    ------
    InputError
        Samples that are uneven or missing, a wrong unit, no node near the distance, an unknown ending.
    """
    if not 0 < distance < np.inf:
        raise InputError("distance", "must be positive (m)", distance)
    ending = Path(path).suffix.lower()
    if ending == ".csv":
        return _from_text(path)
    if ending != ".nc":
        raise InputError(str(path), "must end in .nc or .csv", repr(ending))
    return motion_at(load(path), distance, which=which, source=str(path))


def motion_at(data: xr.Dataset, distance: float, *, which: int = 0, source: str = "dataset") -> Motion:
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
    """
    if "whisker" in data.dims:
        if not 0 <= which < data.sizes["whisker"]:
            raise InputError(f"{source}: whisker", f"must be one of 0 to {data.sizes['whisker'] - 1}", which)
        data = data.isel(whisker=which)
    if "mode_displacement" in data and "arc_length" not in data:
        raise InputError(source, "must tell how a point moves", "modes alone", f"scan again with --node {distance:g}")
    require(data, "time", "arc_length", *(["displacement"] if "displacement" in data else ["x", "y"]))
    extra = set(data["displacement" if "displacement" in data else "x"].dims) - {"time", "node"}
    if extra:
        raise InputError(source, "must have dimensions time and node alone", f"{', '.join(map(str, extra))} as well")
    rate = even_rate(data["time"].to_numpy().astype(float), source)
    moved = data["displacement"].transpose("time", "node").to_numpy() if "displacement" in data else _normal(data)
    known = data["resonant_frequency"].to_numpy().ravel() if "resonant_frequency" in data else np.array([])
    first = float(known[0]) if known.size else np.nan
    motion = _between(moved.astype(float), data["arc_length"].to_numpy(), distance, source)
    return Motion(displacement=motion, sampling_rate=rate, source=source, resonance=first)


def even_rate(time: Array, source: str) -> float:
    """Sampling rate [Hz] of times [s] that must be even to a hundredth of an interval."""
    if len(time) < 4:
        raise InputError(f"{source}: time", "must have at least 4 samples", len(time))
    if not np.all(np.isfinite(time)):
        raise InputError(f"{source}: time", "must be finite", f"NaN at sample {np.argmin(np.isfinite(time))}")
    step = (time[-1] - time[0]) / (len(time) - 1)
    if not step > 0:
        raise InputError(f"{source}: time", "must ascend", f"{time[0]:.6g} s to {time[-1]:.6g} s")
    off = np.abs(time - time[0] - step * np.arange(len(time))) > _UNEVEN * step
    if off.any():
        where = f"sample {np.argmax(off)} at {time[np.argmax(off)]:.6g} s out of step"
        raise InputError(f"{source}: time", "must be even", where, "interpolate where frames were lost")
    return float(1 / step)


def _between(moved: Array, arc: Array, distance: float, source: str) -> Array:
    """Motion at a distance, from the (T, N) motion of nodes."""
    near = int(np.argmin(np.abs(np.where(np.isfinite(arc), arc, np.inf) - distance)))
    if abs(arc[near] - distance) <= _NEAR:
        return moved[:, near]
    below, above = np.flatnonzero(arc < distance), np.flatnonzero(arc > distance)
    if not (len(below) and len(above)) or arc[above].min() - arc[below].max() > _APART:
        remedy = f"predict with --node {distance:g}, or choose --distance {arc[near]:g}"
        raise InputError(source, f"must have a node at {distance:g} m, or two about it", f"{arc[near]:g} m", remedy)
    low, high = below[np.argmax(arc[below])], above[np.argmin(arc[above])]
    share = (distance - arc[low]) / (arc[high] - arc[low])
    return (1 - share) * moved[:, low] + share * moved[:, high]


def _normal(data: xr.Dataset) -> Array:
    """(T, N) displacement along the normal of the mean profile, positive to its concave side [m]."""
    x, y = (data[name].transpose("time", "node").to_numpy().astype(float) for name in ("x", "y"))
    seen = np.isfinite(x).all(0) & np.isfinite(y).all(0)
    if seen.sum() < 3:
        raise InputError("profile", "must have 3 nodes seen in every frame", int(seen.sum()), "cut the record")
    dx, dy = x - x.mean(0), y - y.mean(0)
    arc = data["arc_length"].to_numpy()[seen]
    angle = np.full(len(seen), np.nan)
    angle[seen] = np.unwrap(np.arctan2(np.gradient(y.mean(0)[seen], arc), np.gradient(x.mean(0)[seen], arc)))
    turn = np.ptp(angle[seen]) and angle[seen][-1] - angle[seen][0]
    side = -1.0 if turn < 0 else 1.0
    return side * (np.cos(angle) * dy - np.sin(angle) * dx)


def _from_text(path: str | Path) -> Motion:
    """Motion from a CSV file."""
    if not Path(path).is_file():
        raise InputError(str(path), "must be an existing file")
    try:
        rows = [row for row in csv.reader(Path(path).read_text("utf-8-sig").splitlines()) if row and row[0][:1] != "#"]
    except (UnicodeDecodeError, OSError, csv.Error) as error:
        raise InputError(str(path), f"must be readable text ({error})") from error
    head = [name.strip() for name in rows[0]] if rows else []
    if [name.partition("_")[0] for name in head] != ["time", "displacement"] or not set(head) <= set(_COLUMNS):
        raise InputError(str(path), f"must have columns time,displacement (of {', '.join(_COLUMNS)})", ",".join(head))
    time, displacement = _numbers(path, rows[1:]).T / [[_COLUMNS[name]] for name in head]
    return Motion(displacement=displacement, sampling_rate=even_rate(time, str(path)), source=str(path))


def _numbers(path: str | Path, rows: Sequence[Sequence[str]]) -> Array:
    for number, row in enumerate(rows, 2):
        try:
            if len([float(cell) for cell in row]) != 2:
                raise ValueError
        except ValueError:
            raise InputError(f"{path}, row {number}", "must be two numbers", ",".join(row)[:40]) from None
    return np.array(rows, float).reshape(-1, 2)


def joined(
    motions: Sequence[Motion], duration: float, sampling_rate: float, *, fade: float = 0.05
) -> tuple[Array, Array]:
    """Motions joined to one loop, without a seam at the joints or from the end to the start.

    Each motion gives the same time if it can, cut from its middle and freed from its mean. Neighbours overlap by
    ``fade`` with weights cos(π/2 σ) and sin(π/2 σ), σ = sin²(πu/2), u from 0 to 1: they and their slopes are
    continuous, and their squares sum to 1, so the power of independent motions does not dip. The loop is made at the
    highest sampling rate of the motions (or a multiple of the one asked for) by cubic splines and its Fourier series
    then cut to the one asked for, so nothing folds back into the band.

    Parameters
    ----------
    motions : sequence of Motion
        One for each texture, in order.
    duration : float
        Of the loop [s]; a whole number of samples.
    sampling_rate : float
        Of the loop [Hz].
    fade : float
        Overlap of neighbours [s].

    Returns
    -------
    loop : (T,) array
        One period [m], its mean 0.
    seams : (K,) array
        Where each overlap begins [s]; the last motion goes over into the first from 0 on.

    Raises
    ------
    InputError
        If the motions are too short for the loop, or a parameter is not positive.
    """
    count = samples(duration, sampling_rate)
    if not 0 < fade < duration / (2 * len(motions)):
        raise InputError("fade", f"must be positive and below {duration / (2 * len(motions)):.3g} s", fade)
    finer = int(np.ceil(max(motion.sampling_rate for motion in motions) / sampling_rate - 1e-9))
    work = sampling_rate * max(finer, 1)
    overlap = max(round(fade * work), 2)
    shares = _shares([motion.duration for motion in motions], duration, overlap / work)
    ends = np.round(np.cumsum([0, *shares]) * work).astype(int)
    loop = np.zeros(count * max(finer, 1))
    for motion, start, end in zip(motions, ends[:-1], ends[1:], strict=True):
        loop[np.arange(start, end + overlap) % len(loop)] += _piece(motion, end + overlap - start, overlap, work)
    series = np.fft.rfft(loop)[: count // 2 + 1] * (count / len(loop))
    series[0] = 0
    return np.fft.irfft(series, count), ends[:-1] / work


def samples(duration: float, sampling_rate: float) -> int:
    """Samples in a record; an InputError unless both are positive and the number is whole."""
    for name, value in (("duration", duration), ("sampling_rate", sampling_rate)):
        if not 0 < value < np.inf:
            raise InputError(name, "must be positive", value)
    count = round(duration * sampling_rate)
    if count > _MOST_SAMPLES:
        raise InputError(
            "command", f"must have at most {_MOST_SAMPLES} samples", f"{count:.3g}", "lower --sampling-rate"
        )
    if abs(count - duration * sampling_rate) > 1e-6 or count < 8:
        raise InputError("duration", "must be a whole number of at least 8 samples", f"{duration * sampling_rate:.9g}")
    return count


def _shares(durations: Sequence[float], duration: float, overlap: float) -> Array:
    """Time that each motion fills, without the overlap after it: equal, unless some are shorter."""
    spare = np.array(durations) - overlap
    if spare.min() <= overlap or spare.sum() < duration:
        have, need = f"{spare.clip(0).sum():.4g} s", f"{duration:g} s and {overlap:g} s of overlap each"
        raise InputError("inputs", f"must fill {need}", have, "scan a longer texture, add one, or shorten --duration")
    shares = np.zeros(len(spare))
    left = duration
    for rank, index in enumerate(np.argsort(spare)):
        shares[index] = min(spare[index], left / (len(spare) - rank))
        left -= shares[index]
    return shares


def _piece(motion: Motion, count: int, overlap: int, rate: float) -> Array:
    """``count`` samples from the middle of a motion, faded in and out [m]."""
    middle = (motion.duration - (count - 1) / rate) / 2
    start = np.floor(middle * motion.sampling_rate) / motion.sampling_rate  # on a sample: nothing to interpolate
    t = np.clip(start + np.arange(count) / rate, 0, motion.duration)
    grid = np.arange(len(motion.displacement)) / motion.sampling_rate
    cut = CubicSpline(grid, motion.displacement)(t)
    rise = np.pi / 2 * np.sin(np.pi / 2 * np.arange(overlap) / overlap) ** 2
    weight = np.ones(count)
    weight[:overlap], weight[count - overlap :] = np.sin(rise), np.cos(rise)
    return weight * (cut - cut.mean())


def seam_steps(loop: Array, seams: Array, fade: float, sampling_rate: float) -> tuple[Array, Array]:
    """Largest steps in value and in slope at the seams, over the largest elsewhere.

    At most about 1 where the seam does nothing that the motion does not do by itself.

    Parameters
    ----------
    loop : (T,) array
        One period.
    seams : (K,) array
        Where each overlap begins [s].
    fade, sampling_rate : float
        Length of the overlap [s]; [Hz].

    Returns
    -------
    step, bend : (K,) arrays
        |x(n+1) − x(n)| and |x(n+1) − 2x(n) + x(n−1)|: the largest of each overlap over the largest outside them.
    """
    step = np.abs(np.roll(loop, -1) - loop)
    bend = np.abs(np.roll(loop, -1) - 2 * loop + np.roll(loop, 1))
    about = np.arange(-1, round(fade * sampling_rate) + 2)
    spans = (np.round(seams * sampling_rate).astype(int)[:, None] + about) % len(loop)
    elsewhere = np.delete(np.arange(len(loop)), np.unique(spans))
    return step[spans].max(1) / step[elsewhere].max(), bend[spans].max(1) / bend[elsewhere].max()
