"""Whatever a dataset holds, drawn plainly: lines in time, shapes in their plane, maps, spikes, tables of units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from vibrissa.arrays import Array
from vibrissa.errors import TooFewError
from vibrissa.figures.canvas import add_caption, house_style, new_figure, spread
from vibrissa.figures.others.contents_panels import PAIRS, draw_panel
from vibrissa.neural.io.tables.selection import at_places, is_labelled
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PANELS = 5
_OFTEN = 0.8  # of the frames in which the whisker's most seen node is
_SHAPES = 12  # frames whose centrelines are drawn
_MANY, _SOME = 20_000, 5_000  # points of a series: of more than so many, the first so many are drawn
_CORNERS, _FIRST = 400, 120  # the same of gaps, which are drawn corner by corner
_ENDS = ("_low", "_high", "_sd", "_se")


def compute(data: xr.Dataset) -> xr.Dataset:
    """What is drawn of a dataset: its spikes, image, shapes or maps, else the first five of its longest variables.

    Parameters
    ----------
    data : Dataset
        Any.

    Returns
    -------
    Dataset
        The variables that are drawn. Attributes ``panels``, the variable of each panel, the first of a pair, and, where
        there is something to say, such as a verdict, ``caption``.

    Raises
    ------
    InputError
        If there is nothing to draw.
    """
    if {"unit_name", "p_value"} <= set(data.variables):  # perhaps with the spikes and the stimulus they are of
        data = data.drop_dims([dim for dim in data.dims if dim != "unit"])
    if "spike_time" in data:
        names = [name for name in ("spike_time", "spike_unit", "spike_trial", "unit_name") if name in data]
        placed = at_places(data) if is_labelled(data) else data
        return placed[names].assign_attrs(panels=["spike_time"])
    if "arc_length" in data and "y" in data:
        return _of_tracks(data)
    mapped = [str(name) for name, one in data.data_vars.items() if {"contact", "base_angle"} <= set(one.dims)]
    panels = [name for name in mapped if name != "cell_reason"] if "cell_reason" in data else _longest(data)
    drawn, stretch = _stretch(data[_with_ends(data, panels)])
    lines = [stretch, *(f"Verdict: {data.attrs['verdict']}." for _ in range("verdict" in data.attrs))]
    caption = " ".join(filter(None, lines))
    return drawn.assign_attrs(panels=panels[:_PANELS], **({"caption": caption} if caption else {}))


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
    panels = data.attrs["panels"]
    heights = [2.4 if name in (*dict(PAIRS), "grey", "spike_time") else 1.5 for name in panels]
    figure, axes = new_figure(6.4, 0.8 + sum(heights), len(panels), 1, height_ratios=heights)
    for axis, name in zip(np.ravel(axes), panels, strict=True):
        draw_panel(axis, data, name)
    return add_caption(figure, data) if "caption" in data.attrs else figure


def _longest(data: xr.Dataset) -> list[str]:
    """Variables of floats with the longest dimension; those with intervals first, shapes as pairs."""
    floats = [str(name) for name, one in data.data_vars.items() if one.dtype.kind in "fu" and one.ndim]
    own = [name for name in floats if not name.endswith(_ENDS) and name != "phase"]
    if not own:
        raise TooFewError("dataset", "must hold numbers along a dimension to be drawn", 0)
    longest = max((str(dim) for name in own for dim in data[name].dims), key=lambda dim: data.sizes[dim])
    some = [name for name in own if longest in data[name].dims and np.isfinite(data[name].values).any()]
    second = {y for x, y in PAIRS if x in some}
    return sorted((name for name in some if name not in second), key=lambda name: f"{name}_low" not in data)[:_PANELS]


def _with_ends(data: xr.Dataset, panels: list[str]) -> list[str]:
    """The variables, the second of each pair, the ends of their intervals and the names of units."""
    pairs = dict(PAIRS)
    also = [name for panel in panels for name in (pairs.get(panel, ""), f"{panel}_low", f"{panel}_high")]
    return [*panels, *(name for name in (*also, "unit_name") if name in data)]


def _stretch(data: xr.Dataset) -> tuple[xr.Dataset, str]:
    """The first part of what is too long to be seen, and the sentence that says so."""
    dim = max(data.sizes, key=lambda name: data.sizes[name])
    if dim not in data.coords or data[dim].dtype.kind != "f":
        return data, ""
    size = data.sizes[dim]
    walls = dim == "position" and bool((np.diff(data[dim].values) == 0).any())
    most, some = (_CORNERS, _FIRST) if walls else (_MANY, _SOME)
    if size <= most:
        return data, ""
    along: Array = data[dim].values
    unit = data[dim].attrs.get("units", "")
    return data.isel(
        {dim: slice(0, some)}
    ), f"The first {along[some] - along[0]:.3g} {unit} of {np.ptp(along):.4g} {unit}."


def _of_tracks(data: xr.Dataset) -> xr.Dataset:
    """Centrelines of some frames, and the motion of the node of each whisker that moves most of those often seen."""
    whole = data if "whisker" in data.dims else data.expand_dims("whisker")
    frames = spread(np.arange(whole.sizes["time"]), _SHAPES)
    across = max(("x", "y"), key=lambda name: float(np.nan_to_num(whole[name].std("time")).max()))
    moving = whole[across] - whole[across].mean("time")
    seen = np.isfinite(moving.values).sum(axis=1)
    often = seen >= _OFTEN * seen.max(axis=1, keepdims=True)
    node = np.where(often, np.nan_to_num(moving.std("time").values), -1.0).argmax(axis=1)
    most = np.stack([moving.values[w][:, k] for w, k in enumerate(node)])
    shapes = whole[["x", "y"]].isel(time=frames).rename(time="frame").drop_vars("frame")
    motion = dataset(lead=("whisker",), whisker=np.arange(len(node)), time=whole.time.values, tracked_motion=most)
    caption = (
        f"Centrelines of {len(frames)} frames, and of the nodes that are often seen that of each whisker that moves "
        "most, about its mean. A whisker has one colour in both panels."
    )
    return shapes.merge(motion, join="left", combine_attrs="drop_conflicts").assign_attrs(
        panels=["x", "tracked_motion"], caption=caption
    )
