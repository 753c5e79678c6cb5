"""Whatever a dataset holds, drawn plainly: lines along its longest dimension, spikes as a raster, grids as images."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from vibrissa.errors import TooFewError
from vibrissa.figures.canvas import house_style, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PANELS = 5
_LINES = 8  # of one panel


def compute(data: xr.Dataset) -> xr.Dataset:
    """The variables that are drawn: of floats, with the longest dimension, the first five.

    Parameters
    ----------
    data : Dataset
        Any.

    Returns
    -------
    Dataset
        Of these.

    Raises
    ------
    InputError
        If there is none.
    """
    if "spike_time" in data:
        return data[["spike_time", "spike_unit"]]
    drawn = [str(name) for name, one in data.data_vars.items() if one.dtype.kind in "fu" and one.ndim]
    if not drawn:
        raise TooFewError("dataset", "must hold numbers along a dimension to be drawn", 0)
    longest = max((str(dim) for name in drawn for dim in data[name].dims), key=lambda dim: data.sizes[dim])
    some = [name for name in drawn if longest in data[name].dims and np.isfinite(data[name].values).any()]
    return data[some[:_PANELS]]


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw what :func:`compute` gives.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        A panel for each variable.
    """
    names = ["spike_time"] if "spike_time" in data else [str(name) for name in data.data_vars]
    figure, axes = new_figure(6.0, 1.0 + 1.4 * len(names), len(names), 1)
    for axis, name in zip(np.ravel(axes), names, strict=True):
        if name == "spike_time":
            axis.plot(data.spike_time, data.spike_unit, "|", color="k", ms=4)
            axis.set(xlabel="time [s]", ylabel="unit")
        elif name == "grey":
            axis.imshow(data.grey, cmap="gray")
        else:
            _lines(axis, data[name])
    return figure


def _lines(axis: object, one: xr.DataArray) -> None:
    longest = str(max(one.dims, key=lambda dim: one.sizes[dim]))
    rest = [dim for dim in one.dims if dim != longest]
    flat = one.transpose(longest, *rest).values.reshape(one.sizes[longest], -1)
    along = one[longest].values if longest in one.coords else np.arange(one.sizes[longest])
    axis.plot(along, flat[:, :_LINES], lw=0.8)  # type: ignore[attr-defined]
    axis.set_title(_label(one), loc="left", fontsize="small")  # type: ignore[attr-defined]
    axis.set_xlabel(_label(one[longest]) if longest in one.coords else longest)  # type: ignore[attr-defined]


def _label(one: xr.DataArray) -> str:
    unit = one.attrs.get("units", "1")
    return str(one.name) if unit == "1" else f"{one.name} [{unit}]"
