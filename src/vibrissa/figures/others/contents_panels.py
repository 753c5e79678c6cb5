"""Panels of what any dataset holds: spikes, an image, shapes in their plane, maps, tables, lines."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import bars, spread
from vibrissa.figures.colours import FOUND

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

PAIRS = (("profile_x", "profile_y"), ("fitted_x", "fitted_y"), ("x", "y"))
_PREFIXED = ("m", "s", "Hz", "N", "N m", "m/s", "Pa", "V")  # units that are written with µ, m, k on the ticks
_LINES = 6  # of one panel, each of its own colour
_TABLE = 60  # entries of a table, drawn as points, not lines
_WIDE = 100  # letters of a title
_BESIDE: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1, 0.5), "fontsize": "x-small"}


def draw_panel(axis: Axes, data: xr.Dataset, name: str) -> None:
    """Draw one variable, or a pair, as its dimensions ask.

    Parameters
    ----------
    axis : Axes
        Where.
    data : Dataset
        From :func:`vibrissa.figures.others.contents.compute`.
    name : str
        The variable; the first of a pair.
    """
    if name == "spike_time":
        _raster(axis, data)
    elif name == "grey":
        axis.imshow(data.grey, cmap="gray")
        axis.set(xlabel="column [pixels]", ylabel="row [pixels]")
    elif name in dict(PAIRS):
        _plane(axis, data, name, dict(PAIRS)[name])
    else:
        longest = str(max(data[name].dims, key=lambda dim: data[name].sizes[dim]))
        grid = [dim for dim in data[name].dims if data[name].sizes[dim] > 1 and data[dim].dtype.kind == "f"]
        if len(grid) > 1 and set(grid) & {"contact", "base_angle"}:
            _image(axis, data[name], str(grid[-2]), str(grid[-1]))
        elif data[name].ndim == 1 and data[longest].dtype.kind in "iU" and data.sizes[longest] <= _TABLE:
            _table(axis, data, name)
        else:
            _lines(axis, data[name], longest)


def _raster(axis: Axes, data: xr.Dataset) -> None:
    """Spikes of each unit; its trials, where there are some, one above the other."""
    rows, size = data.spike_unit.values.astype(float), 4.0
    if "spike_trial" in data:
        rows, size = rows - 0.4 + 0.8 * data.spike_trial.values / (data.spike_trial.values.max(initial=0) + 1), 1.5
    axis.plot(data.spike_time, rows, "|", color="k", ms=size, mew=0.5)
    if "unit_name" in data and data.sizes["unit"] <= _TABLE:
        axis.set_yticks(range(data.sizes["unit"]), [str(name) for name in data.unit_name.values])
    axis.set(xlabel="time [s]", ylabel="unit", title="spikes, trial by trial" if "spike_trial" in data else "spikes")


def _plane(axis: Axes, data: xr.Dataset, x: str, y: str) -> None:
    """Shapes at one scale along both axes; of an image, rows downwards."""
    along = [dim for dim in ("node", "s") if dim in data[x].dims]
    others = [dim for dim in data[x].dims if dim not in along]
    shapes = [data[name].transpose(*others, *along).values.reshape(-1, data.sizes[along[0]]) for name in (x, y)]
    each = len(shapes[0]) // data.sizes[others[0]] if others else 1  # shapes of one whisker
    for k, one in enumerate(zip(*shapes, strict=True)):
        axis.plot(*one, lw=0.8, color=_colour(k // each), label=f"{others[0]} {k}" if others else None)
    if others and others[0] != "whisker":
        axis.legend(**_BESIDE)
    axis.set_aspect("equal", adjustable="datalim")
    if x != "profile_x":
        axis.invert_yaxis()
    for side, name in ((axis.xaxis, x), (axis.yaxis, y)):
        _label(side, data[name], name[-1] + (", over L" if x == "profile_x" else ""))


def _image(axis: Axes, one: xr.DataArray, down: str, across: str) -> None:
    """A map over two of its dimensions, at the first value of the others."""
    rest: dict[str, Any] = {str(dim): 0 for dim in one.dims if dim not in (down, across)}
    several = [
        f"{dim} {float(one[dim][0]):.3g} {one[dim].attrs.get('units', '')}" for dim in rest if one.sizes[dim] > 1
    ]
    flat = one.isel(rest).transpose(down, across)
    mesh = axis.pcolormesh(one[across], one[down], flat, cmap="viridis", shading="nearest")
    axis.figure.colorbar(mesh, ax=axis)
    axis.set_title(_title(one, "".join(f", at {text}".rstrip() for text in several)))
    for side, dim in ((axis.xaxis, across), (axis.yaxis, down)):
        unit = one[dim].attrs.get("units", "1")
        side.set_label_text(dim.replace("_", " ") + ("" if unit == "1" else f" [{unit}]"))


def _table(axis: Axes, data: xr.Dataset, name: str) -> None:
    """A point for each entry, with its interval where there is one."""
    one = data[name]
    dim = str(one.dims[0])
    places = np.arange(one.size)
    ends = [data[f"{name}_{end}"].values for end in ("low", "high")] if f"{name}_low" in data else None
    error = None if ends is None else np.maximum(bars(one.values, *ends), 0)
    axis.errorbar(places, one.values, error, fmt="o", ms=4, color=FOUND, capsize=2)
    names = data["unit_name"] if dim == "unit" and "unit_name" in data else one[dim] if dim in one.coords else places
    crowded = one.size > 12
    axis.set_xticks(places, [str(text) for text in np.asarray(names)], rotation=90 if crowded else 0)
    axis.set(xlabel="" if crowded else dim, xlim=(-0.5, one.size - 0.5), title=_title(one))
    _ticks(axis.yaxis, one)


def _lines(axis: Axes, one: xr.DataArray, longest: str) -> None:
    rest = [dim for dim in one.dims if dim != longest]
    flat = one.transpose(longest, *rest).values.reshape(one.sizes[longest], -1)
    along = one[longest].values if longest in one.coords else np.arange(one.sizes[longest])
    chosen = spread(np.arange(flat.shape[1]), _LINES)
    lines = axis.plot(along, flat[:, chosen], lw=0.8)
    for line, k in zip(lines, chosen, strict=True):
        line.set_color(_colour(k) if rest == ["whisker"] else line.get_color())
    if len(rest) == 1 and len(chosen) > 1:
        names = one[rest[0]].values if rest[0] in one.coords else np.arange(flat.shape[1])
        axis.legend(lines, [f"{rest[0]} {names[k]}" for k in chosen], **_BESIDE)
    axis.set_title(_title(one))
    _ticks(axis.yaxis, one)
    axis.set_xlabel(longest)
    if longest in one.coords:
        _label(axis.xaxis, one[longest], longest)


def _colour(whisker: int) -> str:
    """Colour of a whisker, the same in each panel."""
    from matplotlib import rcParams

    cycle = rcParams["axes.prop_cycle"].by_key()["color"]
    return str(cycle[whisker % len(cycle)])


def _title(one: xr.DataArray, end: str = "") -> str:
    """What a variable means, with its unit where the ticks do not show it."""
    unit = one.attrs.get("units", "1")
    shown = "" if unit == "1" or unit in _PREFIXED else f" [{unit}]"
    return fill(f"{one.attrs.get('long_name') or one.name}{shown}{end}", _WIDE)


def _label(side: Axis, one: xr.DataArray, word: str) -> None:
    unit = one.attrs.get("units", "1")
    side.set_label_text(word.replace("_", " ") + ("" if unit == "1" or unit in _PREFIXED else f" [{unit}]"))
    _ticks(side, one)


def _ticks(side: Axis, one: xr.DataArray) -> None:
    """Numbers with the unit and its prefix, such as 50 µm; never with an offset."""
    from matplotlib.ticker import EngFormatter

    unit = one.attrs.get("units", "1")
    if unit in _PREFIXED:
        side.set_major_formatter(EngFormatter(unit=unit))
