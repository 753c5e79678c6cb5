"""The panels of Figure 6A–B of the model, each on its axes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.colours import LAND, PREDICTED, ordered

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

NODE = 0.9  # s of the paper's Fig. 6A


def draw_node(axes: list[Axes], data: xr.Dataset, values: xr.DataArray, letter: str) -> None:
    """Displacement near the base: exact left, linear right; of A in units of L and in micrometres.

    Parameters
    ----------
    axes : list of Axes
        Two panels.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig6_model.compute`.
    values : DataArray
        By form and gap.
    letter : str
        A or B.
    """
    axes[1].sharey(axes[0])
    for axis, form in zip(axes, data.form.values, strict=True):
        for colour, gap in zip(ordered(data.sizes["gap"]), data.gap.values, strict=True):
            line = values.sel(form=form, gap=gap)
            axis.plot(1e3 * data.edge_time, line, color=colour, label=f"λ = {1e3 * gap:.1f} mm")
        axis.axhline(0, color="0.8", lw=0.6, zorder=0)
        axis.set(xlabel="time after t₁ [ms]", xlim=(-2, 45))
        axis.set_title(
            f"{letter}  {str(form).capitalize()} response" if axis is axes[0] else f"{str(form).capitalize()} response"
        )
    if letter == "B":
        axes[0].set_ylabel("displacement / λ")
        return
    axes[0].set_ylabel("displacement [10⁻³ L]")
    scale = 1e3 * data.attrs["whisker_length"]
    right = axes[1].secondary_yaxis("right", functions=(partial(np.multiply, scale), partial(np.multiply, 1 / scale)))
    right.set_ylabel("[µm]")


def draw_inset(axis: Axes, data: xr.Dataset) -> None:
    """Profile at t₁ above the substrate, with an arrow at the node.

    Parameters
    ----------
    axis : Axes
        That has the inset.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig6_model.compute`.
    """
    inset = axis.inset_axes((0.52, 0.5, 0.48, 0.5))
    x, y = 1e3 * data.shaft_x.values, 1e3 * data.shaft_y.values
    inset.axhspan(-3, 0, color=LAND, lw=0)
    inset.plot(x, y, "k", lw=1.2)
    node = 1e3 * data.attrs["node_x"], 1e3 * data.attrs["node_y"]
    inset.annotate(
        f"s = {NODE}", node, (-14, 8), textcoords="offset points", ha="right", arrowprops={"arrowstyle": "->"}
    )
    inset.set(aspect="equal", xticks=[], yticks=[], ylim=(-3, y.max() + 4))
    inset.axis("off")


def draw_pair(axes: Sequence[Axes], data: xr.Dataset, values: xr.DataArray, title: str, unit: str) -> None:
    """Exact on the left, linear on the right, on one scale.

    Parameters
    ----------
    axes : sequence of Axes
        Two panels.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig6_model.compute`.
    values : DataArray
        By form and gap.
    title, unit : str
        Of the panels.
    """
    axes[1].sharey(axes[0])
    for axis, form in zip(axes, data.form.values, strict=True):
        for colour, gap in zip(ordered(data.sizes["gap"]), data.gap.values, strict=True):
            axis.plot(1e3 * data.time, values.sel(form=form, gap=gap), color=colour)
        axis.set(
            xlabel="time after t₂ [ms]",
            title=f"{title}\n{str(form).capitalize()}" if axis is axes[0] else f"\n{str(form).capitalize()}",
            xlim=(-2, 30),
        )
    axes[0].set_ylabel(unit)


def draw_gain(axis: Axes, data: xr.Dataset, title: str) -> None:
    """Gain against speed: displacement and vibration, exact and linear.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        Of one reading of the gratings.
    title : str
        Of the panel.
    """
    looks = (("gain_displacement", "q₁ + Q₁", "o"), ("gain_vibration", "q₁", "s"))
    for name, label, marker in looks:
        for form, line in zip(data.form.values, ("-", "--"), strict=True):
            rms, error = 1e3 * data[name].sel(form=form), 1e3 * data[name + "_se"].sel(form=form)
            look: dict[str, Any] = {"color": PREDICTED, "ls": line, "label": f"{label}, {form}"}
            (points, *_) = axis.errorbar(1e3 * data.speed, rms, error, **look)
            points.set(marker=marker, markersize=3.5, markerfacecolor=PREDICTED if line == "-" else "white")
    axis.set(xlabel="scanning speed [mm/s]", ylim=(0, None), title=title)
