"""Signals from any object that holds them: stimuli, displacements, envelopes in time."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import (
    ConflictError,
    FormatError,
    MissingError,
    RangeError,
    ShapeError,
    UnknownError,
    did_you_mean,
    require_positive,
)
from vibrissa.netcdf import load
from vibrissa.neural.io.tables.stimulus_csv import LARGEST_SD, read_stimulus_csv
from vibrissa.quantities import QUANTITIES
from vibrissa.rounded_times import refuse_rounded
from vibrissa.signals.even_times import UNEVEN, even_rate, misfit_of
from vibrissa.stimulus.export import read_command
from vibrissa.tables.kinds import described, is_a, is_quantity
from vibrissa.tables.stated import bare, refuse_masked
from vibrissa.tables.units import in_si

RIGHT = (
    "give an xarray DataArray with a coordinate time [s] and the attribute units, a pynapple Tsd, a neo AnalogSignal, "
    "or the name of a file"
)
TIMED = "xr.DataArray(values, {'time': np.arange(len(values)) / rate}, ['time'], attrs={'units': 'm'})"
EVEN = "array.assign_coords(time=np.arange(array.sizes['time']) / rate)"
HOLE = "give one presentation, cut from its onset to its end"
INTERPOLATE = "interpolate it onto even times first: np.interp(np.arange(t[0], t[-1], step), t, values)"
CUT = "cut the record to where it was measured, or interpolate over it: np.interp(t, t[seen], values[seen])"
NEO = ("AnalogSignal", "IrregularlySampledSignal")
TIMES_APART = (  # classes whose times an array of their values would lose
    ("pandas", "Series", "DataFrame"),
    ("pynapple", "Ts", "TsGroup", "TsdTensor"),
    ("neo", "SpikeTrain", "IrregularlySampledSignal"),
)
LONG = 0.1  # [s] of a hole: another presentation begins after it


class Signal(NamedTuple):
    """What an object says of its signal.

    Attributes
    ----------
    values : (T,) or (C, T) array
        In the unit.
    time : (T,) array
        [s].
    unit : str or None
        As the object has it; None where it says nothing.
    channels : (C,) array or None
        Names of the channels.
    name : str
        Of the signal.
    lead : str or None
        Dimension of the channels, where the object names it.
    """

    values: Array
    time: Array
    unit: str | None
    channels: Any
    name: str
    lead: str | None = None


def as_signal(
    thing: Any,
    *,
    sampling_rate: float | None = None,
    unit: str | None = None,
    quantity: str | None = "point_displacement",
) -> xr.DataArray:
    """Signal of any object, on even times, in SI units.

    Parameters
    ----------
    thing : object
        An xarray ``DataArray`` with a dimension ``time`` [s] and the attribute ``units``, or a ``Dataset`` that has one
        of the quantity. A NumPy array (T,), with its sampling rate. A pynapple ``Tsd`` or ``TsdFrame``. A neo
        ``AnalogSignal``, in whatever unit. The name of a file: a stimulus (``.csv``, ``.nc``), or a command with its
        sidecar (``.wav``, ``.npy``, ``.csv``).
    sampling_rate : float, optional
        Of an array [Hz]; other objects have their times.
    unit : str, optional
        Unit of numbers whose object has none: ``m``, ``um``, ``mV``; default: the SI unit of the quantity.
    quantity : str or None
        What it is, by its name in ``vibrissa.quantities.QUANTITIES``, which says in which unit it must be: by
        default the displacement of one point [m]. None: any signal, in its own unit.

    Returns
    -------
    DataArray
        ``time`` [s], or channels and time, where there are several; named as the quantity, with the attributes
        ``units``, ``long_name``, ``sampling_rate`` [Hz] and ``source``.

    Raises
    ------
    InputError
        If the object is of no such kind, its unit is another one, its times are uneven or have holes, or samples are
        not finite; says what to do.

    Examples
    --------
    >>> import numpy as np
    >>> signal = as_signal(np.sin(np.arange(100)), sampling_rate=2000.0, unit="um")
    >>> signal.name, signal.attrs["units"], float(signal.max().round(9)), float(signal.time[1])
    ('point_displacement', 'm', 1e-06, 0.0005)
    """
    if quantity is not None and quantity not in QUANTITIES:
        remedy = did_you_mean(quantity, QUANTITIES, "quantity=None for one that is not")
        raise UnknownError("quantity", "must be in vibrissa.quantities.QUANTITIES", repr(quantity), remedy)
    known = _known(thing, sampling_rate, quantity)
    source = Path(thing).name if isinstance(thing, str | PathLike) else described(thing)
    rate = _even(known, source)
    wanted = None if quantity is None else QUANTITIES[quantity].unit
    values, found = _in_unit(known, unit, wanted, source)
    name, text = quantity or known.name, QUANTITIES[quantity].long_name if quantity else known.name
    attrs = {"units": found, "long_name": text, "sampling_rate": rate, "source": source}
    time = xr.Variable("time", known.time, {"units": "s", "long_name": QUANTITIES["time"].long_name})
    if values.ndim == 1:
        return xr.DataArray(values, {"time": time}, ("time",), name, attrs)
    core = QUANTITIES[quantity].dims if quantity else ()
    lead = known.lead or next((dim for dim in core if dim != "time"), "channel")
    return xr.DataArray(values, {lead: np.asarray(known.channels), "time": time}, (lead, "time"), name, attrs)


def changed_signal(signal: Any, change: Callable[[Array], Array], name: str) -> Any:
    """A signal with other values, as an object of the same class, over the same times.

    Parameters
    ----------
    signal : DataArray, pynapple Tsd or TsdFrame, neo AnalogSignal, or (..., T) array, also of quantities
        On even times, where it has times.
    change : callable
        Takes the values (..., T) in the signal's own unit, and gives as many.
    name : str
        Of what it gives: of the new DataArray.

    Returns
    -------
    object
        Of the same class, with the unit, the columns and the time support of the signal.

    Raises
    ------
    InputError
        If the times are uneven or have holes, samples are not finite or masked, or it is of another kind.
    """
    if isinstance(signal, xr.DataArray):
        return _changed_array(signal, change, name)
    if is_a(signal, "pynapple", "Tsd", "TsdFrame") or is_a(signal, "neo", "AnalogSignal"):
        known = _known(signal, None, None)
        _even(known, described(signal))
        values = change(known.values).T
        if is_a(signal, "neo", "AnalogSignal"):
            return signal.duplicate_with_new_data(values.reshape(signal.shape), units=signal.units)
        columns = {} if known.channels is None else {"columns": signal.columns}
        return type(signal)(t=signal.t, d=values, time_support=signal.time_support, **columns)
    if isinstance(signal, xr.Dataset) or any(is_a(signal, *one) for one in TIMES_APART):
        raise FormatError("signal", "must be an array, a DataArray, a Tsd or an AnalogSignal", described(signal), TIMED)
    if is_quantity(signal):
        astropy = is_a(signal, "astropy", "Quantity")
        values, unit = (signal.value, signal.unit) if astropy else (signal.magnitude, signal.units)
        return type(signal)(change(_plain(values)), unit)
    return change(_plain(signal))


def _changed_array(signal: xr.DataArray, change: Callable[[Array], Array], name: str) -> xr.DataArray:
    if "time" not in signal.dims:
        raise MissingError("signal", "must have a dimension time", ", ".join(map(str, signal.dims)))
    last = signal.transpose(..., "time")
    if "time" in signal.coords:
        time = signal.time.drop_attrs() if signal.time.dtype.kind in "fiu" else signal.time  # even in any unit
        time = time - time[0] if time.dtype.kind == "M" else time
        _even(Signal(_plain(getattr(last.data, "magnitude", last.data)), seconds_of(time), None, None, name), "signal")
    found = last.copy(data=changed_signal(last.data, change, name)).transpose(*signal.dims).rename(name)
    about = signal.attrs.get("long_name")
    return found.assign_attrs(long_name=f"{name} of {about}") if about else found


def _plain(signal: Any) -> Array:
    """Numbers of an array whose unit is known."""
    refuse_masked(signal, "signal", CUT)
    try:
        return np.asarray(signal, float)
    except (TypeError, ValueError) as error:
        raise FormatError("signal", "must be an array of numbers", described(signal), RIGHT) from error


def _known(thing: Any, rate: float | None, quantity: str | None) -> Signal:
    """Values, times and unit of an object."""
    if is_quantity(thing) and not is_a(thing, "neo", *NEO):
        unit = QUANTITIES[quantity].unit if quantity else _unit_of(thing)
        refuse_masked(getattr(thing, "magnitude", thing), "signal", CUT)
        return _of_array(bare(thing, unit), rate)._replace(unit=unit)
    if isinstance(thing, np.ndarray | list | tuple) and not is_a(thing, "neo", *NEO):
        return _of_array(thing, rate)
    if rate is not None:
        raise ConflictError(
            "sampling_rate", "must go with an array", described(thing), "leave it out: it has its times"
        )
    if isinstance(thing, str | PathLike):
        thing = _of_path(Path(thing))
    if isinstance(thing, xr.Dataset):
        thing = _variable(thing, quantity)
    if isinstance(thing, xr.DataArray):
        return _of_data_array(thing)
    if is_a(thing, "pynapple", "Tsd", "TsdFrame"):
        columns = np.asarray(thing.columns) if is_a(thing, "pynapple", "TsdFrame") else None
        return Signal(np.asarray(thing.values, float).T, np.asarray(thing.t, float), None, columns, "signal")
    if is_a(thing, "neo", *NEO):
        return _of_neo(thing)
    raise UnknownError("signal", "must be an object that holds values in time", described(thing), RIGHT)


def _unit_of(thing: Any) -> str:
    """Name of the unit of an array that has one."""
    if is_a(thing, "quantities", "Quantity"):
        return str(thing.dimensionality.string)
    return str(thing.units if is_a(thing, "pint", "Quantity") else thing.unit)


def _of_array(thing: Any, rate: float | None) -> Signal:
    values = _plain(thing)
    if values.ndim != 1:
        remedy = "several: xr.DataArray(values, dims=('channel', 'time'), coords={'time': t})"
        raise ShapeError("signal", "must be an array (T,)", values.shape, remedy)
    if rate is None:
        raise MissingError("signal", "must have times", f"an array of {values.size} numbers", TIMED)
    require_positive("sampling_rate", rate, "Hz")
    return Signal(values, np.arange(values.size) / rate, None, None, "signal")


def _of_path(path: Path) -> xr.Dataset:
    kind, is_command = path.suffix.lower(), Path(f"{path}.json").is_file()  # with its sidecar
    plain = load if kind == ".nc" else read_stimulus_csv if kind == ".csv" and not is_command else None
    return plain(path) if plain else read_command(path)


def _variable(data: xr.Dataset, quantity: str | None) -> xr.DataArray:
    """The one variable of a dataset that is meant."""
    timed = [str(name) for name, one in data.data_vars.items() if "time" in one.dims]
    if quantity in timed:
        return data[quantity]
    if len(timed) != 1:
        remedy = f"take one: data[{timed[0]!r}]" if timed else "it has no variable along time"
        raise MissingError("signal", f"must be one variable of the dataset, {quantity}", ", ".join(timed), remedy)
    return data[timed[0]]


def _of_data_array(array: xr.DataArray) -> Signal:
    name = str(array.name or "signal")
    if "time" not in array.dims or "time" not in array.coords:
        raise MissingError(name, "must have a dimension time with its coordinate [s]", array.dims, EVEN)
    if array.ndim > 2:
        raise ShapeError(name, "must have the dimension time and one other at most", array.dims, "array.isel(…)")
    if is_quantity(array.data):
        array = array.copy(data=array.data.magnitude).assign_attrs(units=_unit_of(array.data))
    lead = [str(dim) for dim in array.dims if dim != "time"]
    values = array.transpose(*lead, "time").values
    channels = None if not lead else array[lead[0]].values
    return Signal(values.astype(float), seconds_of(array.time), array.attrs.get("units"), channels, name, *lead)


def seconds_of(time: xr.DataArray) -> Array:
    """Times of a signal in seconds, whatever unit they state.

    Parameters
    ----------
    time : (T,) DataArray
        Numbers in the unit of the attribute ``units``, seconds by default, or durations.

    Returns
    -------
    (T,) array
        [s].

    Raises
    ------
    InputError
        If they are dates or no numbers, or their unit is not one of time.
    """
    if time.dtype.kind == "m":
        return np.asarray(time.values / np.timedelta64(1, "ns"), float) * 1e-9
    if time.dtype.kind not in "fiu":
        remedy = "(array.time - array.time[0]) / np.timedelta64(1, 's')" if time.dtype.kind == "M" else EVEN
        raise FormatError("time", "must count in seconds from some zero", time.dtype, remedy)
    values, unit = in_si(time.values.astype(float), str(time.attrs.get("units", "s")))
    if unit != "s":
        raise FormatError("time", "must be in s, ms or us", unit, "array.time.attrs['units'] = 's'")
    return values


def _of_neo(signal: Any) -> Signal:
    """Channels of a neo signal, in the unit that it states."""
    values = np.asarray(signal.magnitude, float).T
    unit = str(signal.units.dimensionality.string)
    time = np.asarray(signal.times.rescale("s").magnitude, float)
    names = signal.array_annotations.get("channel_names", np.arange(len(values)))
    name = str(signal.name or "signal")
    return Signal(values[0], time, unit, None, name) if len(values) == 1 else Signal(values, time, unit, names, name)


def _even(known: Signal, source: str) -> float:
    """Sampling rate [Hz] of times that must be even and without holes, of samples that must be finite."""
    time = known.time
    lost = ~np.isfinite(known.values.reshape(-1, time.size)).all(0) if known.values.size else np.zeros(0, bool)
    if lost.any():
        where = f"{int(lost.sum())} samples that are not, the first at {time[np.argmax(lost)]:.6g} s"
        raise RangeError(source, "must have finite samples", where, CUT)
    refuse_rounded(time, f"{source}: time")
    step = np.diff(time)
    usual = float(np.median(step)) if step.size else 0.0
    wrong = np.abs(step - usual) > 2 * UNEVEN * abs(usual)  # both ends may be off
    if usual > 0 and wrong.any() and time[-1] > time[0] and misfit_of(time):
        what = "a hole" if step[k := int(np.argmax(wrong))] > 1.5 * usual else "a step"
        where = f"{what} of {step[k]:.6g} s after {time[k]:.6g} s, steps of {usual:.6g} s elsewhere"
        raise RangeError(f"{source}: time", "must be even", where, HOLE if step[k] > LONG else INTERPOLATE)
    try:
        return even_rate(time, source)
    except RangeError as error:
        raise RangeError(error.quantity, error.rule, error.value, INTERPOLATE) from error


def _in_unit(known: Signal, unit: str | None, wanted: str | None, source: str) -> tuple[Array, str]:
    """Values in SI, and their unit, which must be the one wanted."""
    if unit is not None and known.unit is not None and in_si(1.0, unit) != in_si(1.0, known.unit):
        raise ConflictError("unit", f"must be left out: {source} states its own, {known.unit}", unit)
    stated = unit or known.unit
    values, found = in_si(known.values, stated or wanted or "1")
    if wanted is not None and found != wanted:
        remedy = f"multiply it by {wanted} per {found} and state its unit, {wanted}"
        raise UnknownError(source, f"must be in {wanted}", stated, remedy)
    if stated is None and wanted == "m" and float(np.std(values)) > LARGEST_SD:
        size = f"standard deviation {np.std(values):.3g}"
        raise RangeError(source, "must move by less than 1 cm", size, "numbers are metres; say otherwise: unit='um'")
    return values, found
