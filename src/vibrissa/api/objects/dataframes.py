"""Results as data frames of pandas: flat tables, with units in the names of their columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from vibrissa.errors import ShapeError, TooFewError
from vibrissa.neural.io.tables.selection import at_places
from vibrissa.neural.io.tables.spike_csv import flat_columns
from vibrissa.tables.frame import data_frame

if TYPE_CHECKING:
    from vibrissa.tables.frame import DataFrame

PLAIN = str.maketrans({" ": "_", "/": "_", "²": "2", "³": "3", "(": None, ")": None})


def to_dataframe(data: xr.Dataset | xr.DataArray) -> DataFrame:
    """Flat table of a dataset: a row for each spike, or for each value of its dimensions.

    Parameters
    ----------
    data : Dataset or DataArray
        Spikes; or variables whose dimensions lie within those of the one that has most of them.

    Returns
    -------
    DataFrame
        Columns end in their SI unit: ``spike_time_s``, ``x_m``, ``firing_rate_Hz``. Of spikes ``spike_time_s``,
        ``trial``, ``unit``, maybe ``whisker`` and ``quality``; a row without a time (NaN) names each unit, and the last
        trial where it is silent, so that :func:`vibrissa.api.objects.spikes.as_spikes` gives the same spikes back,
        also after the rows were sorted with their index, with units in the order of their names; what else is known of
        units or trials is a table of its own: ``to_dataframe(spikes[["trial_start", "trial_stop"]])``.
        Of ``envelope_coupling`` a row for each unit. Of others the dimensions come first, and what has fewer of them is
        repeated.

    Raises
    ------
    InputError
        If there is no variable, or none has the dimensions of all the others: says which fit together.

    Examples
    --------
    >>> from vibrissa.quantities import dataset
    >>> table = to_dataframe(dataset(time=[0.0, 0.5], point_displacement=[0.0, 1e-6]))
    >>> list(table.columns), table.point_displacement_m.tolist()
    (['time_s', 'point_displacement_m'], [0.0, 1e-06])
    """
    whole = data.to_dataset(name=data.name or "value") if isinstance(data, xr.DataArray) else data
    if {"spike_time", "significant"} <= set(whole.data_vars):  # what was found of units, with their spikes beside it
        whole = whole[[name for name, one in whole.data_vars.items() if one.dims == ("unit",)]]
    if "spike_time" in whole:
        cells = flat_columns(at_places(whole))
        time = [np.nan if cell == "" else cell for cell in cells.pop("spike_time")]
        return data_frame({"spike_time_s": time, **cells})
    dims = _dims(whole)
    shape = [whole.sizes[dim] for dim in dims]
    columns: dict[str, Any] = {}
    for name, one in [(dim, whole[dim]) for dim in dims] + [(n, v) for n, v in _others(whole, dims)]:
        values = one.transpose(*(dim for dim in dims if dim in one.dims)).values
        place = tuple(slice(None) if dim in one.dims else None for dim in dims)
        columns[f"{name}{_end(one)}"] = np.broadcast_to(values[place], shape).ravel()
    return data_frame(columns)


def _dims(data: xr.Dataset) -> list[str]:
    """Dimensions of the variable that has most of them, which must be those of all."""
    if not data.variables:
        raise TooFewError("data", "must hold at least one variable", 0)
    most = max(data.variables.values(), key=lambda one: one.ndim).dims
    alien = [str(name) for name, one in data.variables.items() if not set(one.dims) <= set(most)]
    if alien:
        along = {str(dim) for name in alien for dim in data[name].dims} - set(most)
        rule = f"must have variables along {', '.join(map(str, most))} alone"
        raise ShapeError("data", rule, ", ".join(alien), f"leave them out: data.drop_dims({sorted(along)!r})")
    return [str(dim) for dim in most]


def _others(data: xr.Dataset, dims: list[str]) -> list[tuple[str, Any]]:
    return [(str(name), one) for name, one in data.variables.items() if name not in dims]


def _end(one: Any) -> str:
    """End of a column's name: ``_m``, ``_per_m``, ``_m_s2``, or nothing where it is a pure number."""
    unit = str(one.attrs.get("units", "1"))
    return "" if unit == "1" else "_" + unit.replace("1/", "per ").translate(PLAIN)
