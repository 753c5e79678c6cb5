"""Signals measured at the base of a whisker, a robot's or an isolated one: files → ``follicle``."""

from __future__ import annotations

from pathlib import Path
from reprlib import repr as short
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array, Integers, Mask
from vibrissa.binary import read_wav
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError, TooFewError, UnknownError
from vibrissa.mechanics.scan.follicle import base_moment
from vibrissa.quantities import dataset
from vibrissa.signals.even_times import misfit_of
from vibrissa.tables.reader import read_table
from vibrissa.tables.table import Table
from vibrissa.tables.units import channel_and_unit, in_si, to_si, units_of
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    import xarray as xr


Kind = Literal["moment", "curvature", "strain", "hall", "force"]

CALIBRATED: dict[Kind, str] = {
    "moment": "N m", "curvature": "1/m", "strain": "strain", "hall": "N m", "force": "N",
}  # fmt: skip
_STEEP = 3  # steps of the converter by which values still change just before they are clipped
_HELD = 3  # samples in a row that are no peak of a wave that is sampled finely, but its clipping
_STUCK, _STRETCHES = 8, 5  # times in a row that a value repeats, and how often that happens, if it is no chance
_ABRUPT = 0.3  # [of the usual step] by which a signal goes into such a stretch and leaves it, not as into a rest
_CHANGING = 0.25  # least share of samples that differ from the one before, in a record not slow nor mostly at rest


def read_base_signal(
    path: str | Path,
    *,
    kind: Kind,
    unit: str,
    calibration: float | None = None,
    sampling_rate: float | None = None,
    column: str | None = None,
    rest: tuple[float, float] | None = None,
    whisker: Whisker | None = None,
) -> xr.Dataset:
    """Read a signal measured at the base, in place of what the model says the follicle feels.

    Parameters
    ----------
    path : path
        ``.wav``; or a table of comma-separated values with a header: ``time`` (or ``time_ms``, ``time_us``), unless
        the sampling rate is given, and the signal.
    kind : {"moment", "curvature", "strain", "hall", "force"}
        What the sensor measures. ``strain``: of the surface at the base, ε = bC with the base radius b; it needs the
        whisker. ``hall``: a magnet on a compliant base, which the calibration turns into a moment. ``force``:
        across the shaft.
    unit : str
        Unit of the numbers in the file. One of the kind's own (``N m``, ``mN m``, ``uN m``, ``nN m``; ``1/m``,
        ``1/mm``; ``1``, ``mstrain``, ``ustrain``; ``N``, ``mN``, ``uN``) or that of the reading, such as ``V``, which
        needs a calibration. Of integers in a ``.wav``: ``full scale``, the lowest number being −1.
    calibration : float, optional
        N m (moment, hall), 1/m, strain or N per unit of the reading. Its sign sets the sign: positive is what bends
        the shaft away from the substrate.
    sampling_rate : float, optional
        [Hz], of a table without times.
    column : str, optional
        Column of the table, or channel of the ``.wav`` from 1, where there are several.
    rest : (start, stop), optional
        Times [s] in which nothing touches the whisker: their mean is zero. Without it the file's zero is kept.
    whisker : Whisker, optional
        Gives b and E, by which moment and curvature follow from each other: M = E (π/4) b⁴ C.

    Returns
    -------
    Dataset
        ``follicle``: ``base_moment`` [N m], ``base_curvature`` [1/m] or ``transverse_force`` [N] (time), as far as
        known; in the attributes kind, unit, calibration, zero, ``clipped``: samples at the ends of the range; of
        floats and tables, whose range is unknown, those that are three or more in a row the largest or smallest of all;
        and ``stuck``: samples that repeat the one before, eight or more in a row, where a signal that otherwise changes
        does so five times or more, and goes into and out of these stretches by a step.

    Raises
    ------
    InputError
        Names what is missing or impossible: a unit without calibration, a cell that is no number, samples lost.
    """
    if kind not in get_args(Kind):
        raise UnknownError("kind", f"must be one of {', '.join(get_args(Kind))}", repr(kind))
    scale = _scale(kind, unit, calibration)
    wave = Path(path).suffix.lower() == ".wav"
    if wave and sampling_rate is not None:
        raise ConflictError("sampling_rate", "must not be given: a .wav states its own", sampling_rate)
    time, raw, clipped = _wav(path, unit, column) if wave else _table(path, column, sampling_rate, unit)
    attrs = {"kind": kind, "unit": unit, "calibration": scale, "clipped": clipped, "zero": "of the file"}
    attrs["stuck"] = _stuck(raw, clipped > 0)
    if rest is not None:
        raw = raw - _at_rest(time, raw, rest)
        attrs["zero"] = f"mean of {rest[0]:g} to {rest[1]:g} s"
    return dataset(attrs, time=time, **_quantities(kind, scale * raw, whisker))


def _scale(kind: Kind, unit: str, calibration: float | None) -> float:
    """SI units of the quantity per number in the file."""
    own = [] if kind == "hall" else units_of(CALIBRATED[kind])
    if unit in own and calibration is not None:
        raise ConflictError("calibration", f"must not be given: {unit} is a unit of {kind} already", calibration)
    if unit in own:
        return to_si(1.0, unit)
    if calibration is None:
        known = f"; or give unit as {', '.join(own)}" if own else ""
        raise MissingError(
            "calibration", f"must be given for a reading in {unit!r}", None, f"{_per(kind, unit)}{known}"
        )
    if not np.isfinite(calibration) or calibration == 0:
        raise RangeError("calibration", "must be finite and not 0", calibration, _per(kind, unit))
    return calibration


def _per(kind: Kind, unit: str) -> str:
    return f"in {CALIBRATED[kind]} per {unit}"


def _quantities(kind: Kind, values: Array, whisker: Whisker | None) -> dict[str, Any]:
    if kind == "force":
        return {"transverse_force": values}
    if kind in ("moment", "hall"):
        stiffness = np.nan if whisker is None else float(base_moment(whisker, np.ones(1))[0])
        moment = {"base_moment": values}
        return moment if whisker is None else {**moment, "base_curvature": values / stiffness}
    if kind == "curvature" and whisker is None:
        return {"base_curvature": values}
    if whisker is None:
        raise MissingError("whisker", "must be given for a strain: its base radius turns it into curvature")
    curvature = values / whisker.base_radius if kind == "strain" else values
    return {"base_moment": base_moment(whisker, curvature), "base_curvature": curvature}


def _at_rest(time: Array, raw: Array, rest: tuple[float, float]) -> float:
    inside = (time >= rest[0]) & (time <= rest[1])
    if inside.sum() < 2:
        raise TooFewError("rest", f"must hold samples, of {time[0]:g} to {time[-1]:g} s", rest)
    step = time[1] - time[0]
    if rest[0] < time[0] - step or rest[1] > time[-1] + step:
        raise RangeError("rest", f"must lie in the record, {time[0]:g} to {time[-1]:g} s", rest)
    return float(raw[inside].mean())


def _wav(path: str | Path, unit: str, column: str | None) -> tuple[Array, Array, int]:
    rate, channels = read_wav(path)
    if len(channels) < 2:
        raise TooFewError(str(path), "must hold samples", len(channels))
    one = channels[:, _channel(path, column, channels.shape[1])]
    values, clipped = _full_scale(path, one, unit)
    return np.arange(len(one)) / rate, values, clipped


def _channel(path: str | Path, column: str | None, count: int) -> int:
    if column is None and count > 1:
        raise MissingError("column", f"must be given: {path} has {count} channels", None, f"1 to {count}")
    chosen = column or "1"
    if not (chosen.isdecimal() and 1 <= int(chosen) <= count):
        raise UnknownError("column", f"must be a channel of {path}, 1 to {count}", short(column))
    return int(chosen) - 1


def _full_scale(path: str | Path, samples: NDArray[Any], unit: str) -> tuple[Array, int]:
    """Samples as numbers, integers over their largest; and how many are at either end."""
    if samples.dtype.kind == "f":
        if not np.isfinite(samples).all():
            raise FormatError(str(path), "must hold finite samples")
        return samples.astype(float), _held(samples)
    if unit != "full scale":
        raise UnknownError("unit", f"must be 'full scale': {path} holds integers", repr(unit), "calibrate full scale")
    ends = np.iinfo(samples.dtype)
    middle = (float(ends.max) + float(ends.min) + 1) / 2  # 8 bits are stored without sign, about 128
    largest = ends.max & -256 if _is_24_bit(samples) else ends.max
    clipped = int(np.count_nonzero((samples == ends.min) | (samples == largest)))
    return (samples.astype(float) - middle) / (float(ends.max) - middle + 1), clipped


def _held(values: NDArray[Any]) -> int:
    """How many samples are at an end of all values at which they stop short again and again, and are not at rest."""
    held, levels = 0, np.unique(values)
    quantum = np.diff(levels).min(initial=np.inf)  # of the converter
    for end in {levels[0], levels[-1]} - {0, np.median(values)}:
        starts, stops = _stretches(values == end)
        long = (stops - starts >= _HELD) & (starts > 0)
        steps = np.abs(values[starts[long] - 1] - end)
        if steps.size > 1 and np.median(steps) > _STEEP * quantum:
            held += int((stops - starts)[long].sum())
    return held


def _stuck(values: Array, clipped: bool) -> int:
    """How many samples repeat the one before since they were held or lost: see :func:`read_base_signal`.

    A slow signal in whole steps of a converter changes by one of them, and one that comes to rest decays before.
    """
    step, levels = np.abs(np.diff(values)), np.unique(values)
    moved = step[step > 0]
    if moved.size < _CHANGING * step.size:
        return 0
    abrupt = max(_ABRUPT * np.median(moved), _STEEP * np.diff(levels).min())
    starts, stops = _stretches(step == 0)
    long = (stops - starts >= _STUCK) & (starts > 0) & (stops < step.size)
    if clipped:
        long &= ~np.isin(values[starts], levels[[0, -1]])
    starts, stops = starts[long], stops[long]
    lost = (step[starts - 1] > abrupt) & (step[stops] > abrupt)
    return int((stops - starts)[lost].sum()) if np.count_nonzero(lost) >= _STRETCHES else 0


def _stretches(inside: Mask) -> tuple[Integers, Integers]:
    """Where stretches of True begin, and where they have ended."""
    starts, stops = np.flatnonzero(np.diff(inside, prepend=False, append=False)).reshape(-1, 2).T
    return starts, stops


def _is_24_bit(samples: NDArray[Any]) -> bool:
    """Whether integers of 32 bits hold samples of 24, which lie in the upper ones."""
    return samples.dtype.itemsize == 4 and not (samples & 255).any()


def _table(path: str | Path, column: str | None, sampling_rate: float | None, unit: str) -> tuple[Array, Array, int]:
    table = read_table(path, {}, {"time": "s"})
    if len(table) < 2:
        raise TooFewError(str(path), "must hold a header and samples", f"{len(table)} samples")
    column = _column(f"{path}, header", table.others, column)
    stated = channel_and_unit(column)[1]
    if stated is not None and in_si(1.0, stated) != in_si(1.0, unit):
        raise ConflictError("unit", f"must be {stated}, as {path} states for {column}", unit)
    values = table.numbers(column)
    if "time" in table and sampling_rate is not None:
        rule = "must have a column of time or a sampling rate, not both"
        raise MissingError(str(path), rule, short(",".join(table.header)), "leave `sampling_rate` out")
    if "time" not in table and sampling_rate is None:
        rule, remedy = (
            "must have one column of time, or a sampling rate given",
            "columns time, time_s, time_ms, time_us",
        )
        raise MissingError(str(path), rule, short(",".join(table.header)), remedy)
    if sampling_rate is None:
        return _even(table), values, _held(values)
    if not 0 < sampling_rate < np.inf:
        raise RangeError("sampling_rate", "must be positive (Hz)", sampling_rate)
    return np.arange(len(values)) / sampling_rate, values, _held(values)


def _column(here: str, signals: list[str], column: str | None) -> str:
    if column is not None and column not in signals:
        raise UnknownError("column", f"must be one of {', '.join(signals) or 'none'} ({here})", short(column))
    if column is None and len(signals) != 1:
        raise MissingError("column", f"must be given: {here} has {len(signals)} signals", short(", ".join(signals)))
    return column or signals[0]


def _even(table: Table) -> Array:
    """The even grid that the times keep to."""
    path, time = table.path, table.numbers("time")
    if not time[-1] > time[0]:
        raise RangeError(str(path), "must have times that ascend")
    if misfit := misfit_of(time):
        line = table.lines[misfit.sample]
        remedy = f"{misfit.remedy}, or leave the column of time out and give `sampling_rate`"
        raise FormatError(f"{path}, line {line}", "must be sampled evenly", misfit.found, remedy)
    return np.linspace(time[0], time[-1], len(time))
