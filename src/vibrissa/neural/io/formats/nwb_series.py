"""Stimuli from files of Neurodata Without Borders: series in time, on the session's clock or as templates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError
from vibrissa.neural.io.formats.nwb import opened, pynwb_module
from vibrissa.neural.io.tables.stimuli import NAMES, labelled_stimulus
from vibrissa.neural.io.tables.stimulus_csv import LEVEL, in_stated_unit
from vibrissa.rounded_times import refuse_rounded
from vibrissa.tables.units import is_unit

SESSION = "session"  # value of the attribute `clock` of a stimulus that is on the session's clock
NAMES_SHOWN = 9


def read_nwb_stimulus(
    path: str | Path, *, channel: str | None = None, unit: str | None = None, envelope: bool = False
) -> xr.Dataset:
    """Stimulus from the series of an NWB file.

    Parameters
    ----------
    path : path
        The file.
    channel : str, optional
        A series by its name, anywhere in the file (``NAME:0`` for one column of several); or a whisker of a command
        that vibrissa exported. By default the one series among the file's stimuli and templates, with all its columns.
    unit : str, optional
        Unit of a series that states none that is known.
    envelope : bool
        Whether the series is an envelope already, as one in dB is.

    Returns
    -------
    Dataset
        See :func:`vibrissa.neural.io.tables.stimuli.labelled_stimulus`; with the dimension ``whisker`` where there are
        several columns. The attribute ``clock`` is ``session``, or ``presentation`` for a template.

    Raises
    ------
    InputError
        If pynwb is not installed; if there is no such series, or several may be meant; if its unit is not known.
    """
    with opened(path) as file:
        found = _series(file)
        name, column = _chosen(file, found, channel, str(path))
        series, clock = found[name]
        here = f"{path}, {name}"
        time, values = _times(series, here), _values(series, here)
        names = _columns(file, name, values.shape[1])
        stated, conversion = str(series.unit), float(series.conversion)
        offset = float(getattr(series, "offset", 0.0) or 0.0)
    values = conversion * values.T + offset
    if stated == "unknown" or not is_unit(stated):
        if unit is None:
            raise MissingError("signal_unit", f"must be given: {here} states no unit that is known", repr(stated))
        stated = unit
    elif unit is not None and unit != stated:
        raise ConflictError("signal_unit", f"must be left out: {here} states its own, {stated}", unit)
    values, si = in_stated_unit(values, stated)
    envelope = envelope or si == LEVEL or name == "stimulus_envelope"
    lead: dict[str, Any] = {"whisker": names}
    if column is not None or len(names) == 1:
        values, lead = values[column or 0], {}
    attrs = {"source": Path(path).name, "series": name, "clock": clock}
    return labelled_stimulus(time, values, si, envelope=envelope, lead=lead, attrs=attrs)


def _series(file: Any) -> dict[str, tuple[Any, str]]:
    """All series of numbers of a file by their names, each with its clock; stimuli before the rest."""
    places: list[tuple[Any, str]] = [(file.stimulus_template, "presentation"), (file.stimulus, SESSION)]
    places += [(file.acquisition, SESSION), *((one.data_interfaces, SESSION) for one in file.processing.values())]
    found: dict[str, tuple[Any, str]] = {}
    for place, clock in places:
        for one in _flat(place.values()):
            if np.asarray(one.data[:1]).dtype.kind in "fiu" and one.name not in found:
                found[one.name] = one, clock
    return found


def _flat(things: Any) -> list[Any]:
    """Series, and those in containers such as BehavioralTimeSeries, Position or CompassDirection."""
    kind = pynwb_module().TimeSeries
    inner = [[one] if isinstance(one, kind) else one.children for one in things]
    return [one for part in inner for one in part if isinstance(one, kind)]


def _chosen(file: Any, found: dict[str, tuple[Any, str]], channel: str | None, path: str) -> tuple[str, int | None]:
    """Name of the series that is meant, and its column if one is."""
    if not found:
        raise MissingError(path, "must hold a series in time", remedy="give the stimulus as a CSV with `stimulus`")
    there = f"it has {', '.join(list(found)[:NAMES_SHOWN])}" + (" …" if len(found) > NAMES_SHOWN else "")
    if channel is None:
        shown = [name for name in found if name in {**file.stimulus_template, **file.stimulus}]
        if len(shown) != 1:
            raise MissingError("whisker", f"must be given: which series of {path} was presented", None, there)
        return shown[0], None
    if channel in found:
        return channel, None
    name, _, place = channel.rpartition(":")
    if name in found and place.isdecimal() and int(place) < found[name][0].data.shape[-1]:
        return name, int(place)
    for name in found:
        if channel in (names := _columns(file, name, 0)):
            return name, names.index(channel)
    raise MissingError("whisker", f"must be a series of {path}", repr(channel), there)


def _columns(file: Any, name: str, count: int) -> list[str]:
    """Names of the columns of a series: of a command or a stimulus that vibrissa exported, its whiskers."""
    holders = [one for one in file.processing.values() if "whiskers" in one.data_interfaces]
    if holders and name in ("command", *NAMES):
        return [str(one) for one in holders[0]["whiskers"]["whisker"][:]]
    return [name] if count == 1 else [f"{name}:{k}" for k in range(count)]


def _values(series: Any, here: str) -> Array:
    """Samples, (T, C)."""
    values = np.asarray(series.data[:], float)
    if values.ndim not in (1, 2) or not values.size:
        raise FormatError(here, "must be a series of numbers, (T,) or (T, channels)", values.shape)
    return values.reshape(len(values), -1)


def _times(series: Any, here: str) -> Array:
    """Times of the samples [s]."""
    if series.rate is not None:
        if not series.rate > 0:
            raise FormatError(here, "must have a positive rate (Hz)", series.rate)
        return float(series.starting_time or 0.0) + np.arange(len(series.data)) / float(series.rate)
    if series.timestamps is None:
        raise FormatError(here, "must have a rate or timestamps")
    time = np.asarray(series.timestamps[:], float)
    refuse_rounded(time, f"{here}: time")
    later = (np.diff(time, prepend=-np.inf) > 0) & np.isfinite(time)
    if not later.all():
        k = int(np.argmin(later))
        remedy = "sort its samples, and leave out doubled ones and those without a time"
        raise RangeError(f"{here}: time", "must be finite and ascend", f"{time[k]:.6g} s at sample {k}", remedy)
    return time
