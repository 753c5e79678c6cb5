"""Datasets as what a file of Neurodata Without Borders holds: series on one clock, tables, intervals."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.arrays import Array
from vibrissa.neural.io.formats.nwb import pynwb_module
from vibrissa.neural.io.formats.nwb_writer import UNITS, described, measured

if TYPE_CHECKING:
    import xarray as xr

_SAME_TIME = 1e-9  # [s] below which archives take two times for one
_LARGE = 2**16  # bytes from which values are compressed, without loss


class Clock:
    """The clock of a session, on which recordings are laid whose own times are not known to it.

    Each starts after the one before, a whole number of seconds later than by its own clock; the first keeps its own
    time if that does not begin below 0.

    Parameters
    ----------
    pause : float
        Least time between two recordings [s].
    taken : float, optional
        Until when the clock is taken by what was recorded on it [s].
    """

    def __init__(self, pause: float, taken: float | None = None) -> None:
        self._pause, self._taken = pause, taken

    def lay(self, time: Array) -> Array:
        """Times on the session's clock of a recording that has these times (T,) on its own [s].

        Parameters
        ----------
        time : (T,) array
            On its own clock [s].

        Returns
        -------
        (T,) array
            On the session's clock [s].
        """
        earliest = 0.0 if self._taken is None else self._taken + self._pause
        stays = self._taken is None and time[0] >= 0
        laid = time if stays else time + ceil(earliest - time[0])
        self._taken = float(laid[-1])
        return np.asarray(laid, float)


def sampling(time: Array) -> dict[str, Any]:
    """Times of a series: start and rate where they are even to the nanosecond, else every one.

    Parameters
    ----------
    time : (T,) array
        [s].

    Returns
    -------
    dict
        ``rate`` and ``starting_time``, or ``timestamps``.
    """
    if time.size > 1 and time[-1] > time[0]:
        rate = (time.size - 1) / float(time[-1] - time[0])
        for one in (round(rate), round(rate, 3), round(rate, 6), rate):
            if one > 0 and np.abs(time[0] + np.arange(time.size) / one - time).max() < _SAME_TIME:
                return {"rate": float(one), "starting_time": float(time[0])}
    return {"timestamps": _compressed(time)}


def add_series(
    module: Any, data: xr.Dataset, time: Array, *, prefix: str = "", suffix: str = "", comments: str = ""
) -> None:
    """Add every variable of a dataset that goes by time as a series: time first, then what else it goes by.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb; becomes their home.
    data : Dataset
        Variables (…, time, …), units and long names in their attributes.
    time : (T,) array
        The same times on the session's clock [s].
    prefix, suffix : str
        Before and after the names.
    comments : str
        For all of them: of the frame of reference and the like.
    """
    pynwb = pynwb_module()
    when = sampling(time)
    for name, variable in data.data_vars.items():
        if "time" not in variable.dims:
            continue
        others = [dim for dim in variable.dims if dim != "time"]
        columns = f"; one column for each {' and '.join(map(str, others))}" if others else ""
        series = pynwb.TimeSeries(
            name=f"{prefix}{name}{suffix}",
            description=_sentence(variable) + columns,
            data=_compressed(variable.transpose("time", *others).values),
            unit=UNITS.get(unit := str(variable.attrs.get("units", "1")), unit),
            comments=f"{comments} NaN: not measured.".strip(),
            **when,
        )
        module.add(series)
        if "timestamps" in when:
            when = {"timestamps": series}  # written once, the others refer to it


def add_table(module: Any, name: str, text: str, data: xr.Dataset, dim: str) -> None:
    """Add the variables of a dataset that go by one dimension alone as a table; what nobody measured, no column.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb; takes what is added.
    name : str
        Of the table.
    text : str
        Its description.
    data : Dataset
        Variables of any dimensions.
    dim : str
        The dimension of its rows.
    """
    pynwb = pynwb_module()
    named = [str(one) for one in data.data_vars if data[one].dims == (dim,) and measured(data[one])]
    if not named or not data.sizes[dim]:
        return
    named = [*([dim] if dim in data.coords else []), *named]
    columns = [
        pynwb.core.VectorData(name=one, description=described(data[one]), data=plain(data[one].values)) for one in named
    ]
    module.add(pynwb.core.DynamicTable(name=name, description=text, columns=columns))


def add_row(module: Any, name: str, text: str, data: xr.Dataset) -> None:
    """Add the single values of a dataset as a table of one row.

    Parameters
    ----------
    module : ProcessingModule
        Of pynwb; takes what is added.
    name : str
        Of the table.
    text : str
        Its description.
    data : Dataset
        Of its variables those without dimensions.
    """
    single = data[[one for one in data.data_vars if not data[one].dims]]
    add_table(module, name, text, single.reset_coords(drop=True).expand_dims("row"), "row")


def add_intervals(file: Any, name: str, text: str, times: Sequence[Array], columns: xr.Dataset) -> None:
    """Add intervals of time on the session's clock [s], with what is known of each.

    Parameters
    ----------
    file : NWBFile
        Of pynwb.
    name, text : str
        Name and description.
    times : sequence of arrays
        Times of the samples of each, R of them: it reaches from the first to the last.
    columns : Dataset
        Variables of one dimension (R,), each a column.
    """
    pynwb = pynwb_module()
    table = pynwb.epoch.TimeIntervals(name=name, description=text)
    for one in columns.data_vars:
        table.add_column(name=str(one), description=described(columns[one]))
    values = {str(one): plain(columns[one].values) for one in columns.data_vars}
    for k, time in enumerate(times):
        row = {one: column[k] for one, column in values.items()}
        table.add_row(start_time=float(time[0]), stop_time=_last(time), **row)
    file.add_time_intervals(table)


def _last(time: Array) -> float:
    """Last time, or what a reader who adds up steps of the rate finds in its place, if that is later by a rounding."""
    when = sampling(time)
    return max(float(time[-1]), when["starting_time"] + (time.size - 1) / when["rate"] if "rate" in when else -np.inf)


def plain(values: NDArray[Any]) -> Any:
    """Values as the format takes them: words as a list.

    Parameters
    ----------
    values : array
        Numbers or words.

    Returns
    -------
    array or list of str
        Words as a list, numbers as they are.
    """
    return values.astype(str).tolist() if values.dtype.kind in "OUS" else values


def _sentence(variable: xr.DataArray) -> str:
    """Long name of a variable; what is adimensional says so."""
    text = str(variable.attrs.get("long_name", variable.name))
    return f"{text} (adimensional)" if variable.attrs.get("units", "1") == "1" else text


def _compressed(values: NDArray[Any]) -> Any:
    if values.nbytes < _LARGE:
        return values
    return pynwb_module().H5DataIO(np.ascontiguousarray(values), compression="gzip", shuffle=True)
