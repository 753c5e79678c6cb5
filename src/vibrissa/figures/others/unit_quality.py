"""Quality of units: contamination over rate, signal to noise over violations, and stability; who is kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.figures.canvas import add_caption, bars, house_style, key_above, new_figure
from vibrissa.figures.colours import KINDS, MULTI, SINGLE

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"good": SINGLE, "mua": MULTI, "unlabelled": KINDS[0]}
OTHERS = "0.6"
PANELS = (
    ("unit_rate", "rate [Hz]", "contamination", "contamination"),
    ("unit_snr", "signal to noise", "refractory_violations", "refractory violations"),
    ("presence_ratio", "presence ratio", "rate_change", "change of rate"),
)


def compute(quality: xr.Dataset) -> xr.Dataset:
    """The units, with a caption.

    Parameters
    ----------
    quality : Dataset
        From :func:`vibrissa.neural.sorting.quality.unit_quality`.

    Returns
    -------
    Dataset
        The same, with the attribute ``caption``.
    """
    attrs, kept = quality.attrs, quality.kept.values.astype(bool)
    classes = quality.unit_class.values.astype(str)
    shares = [f"{kept[classes == one].sum()} of {(classes == one).sum()} {one}" for one in sorted(set(classes))]
    absent = int(np.isnan(quality.unit_snr.values).sum())
    beside = f"signal to noise, and share of intervals below the period; {absent} units without one are not drawn"
    if absent == classes.size:
        beside = "share of intervals below the period, beside the rate, as no unit has a signal to noise"
    period = f"{1e3 * attrs['refractory_period']:g} ms"
    caption = (
        f"Units, filled where kept: {', '.join(shares)}. A: share of foreign spikes, 95 % intervals (refractory "
        f"period {period}); dashed: the least rate. B: {beside}. C: share of the recording's bins in "
        f"which a unit fires, and change of its rate from start to end, over its mean. Observed for "
        f"{attrs['duration']:.4g} s."
    )
    return quality.assign_attrs(caption=caption)


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw the three panels.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(10.5, 4.0, 1, 3)
    for letter, axis, (x, x_label, y, y_label) in zip("ABC", axes[0], PANELS, strict=True):
        if np.isnan(data[x].values).all():
            x, x_label = PANELS[0][:2]
        _units(axis, data, x, y)
        axis.set(xlabel=x_label, ylabel=y_label)
        axis.set_title(f"{letter}  {y_label.capitalize()}")
    axes[0, 0].set(xscale="log", ylim=(-0.03, 1.03))
    axes[0, 0].axvline(data.attrs["rule_least_rate"], color="0.5", ls="--", lw=0.8)
    axes[0, 2].axhline(0, color="0.8", lw=0.8, zorder=0)
    axes[0, 2].set_xlim(-0.03, 1.03)
    key_above(axes[0, 0])
    return add_caption(figure, data)


def _units(axis: Axes, data: xr.Dataset, x: str, y: str) -> None:
    """Draw each class in its colour, filled where units are kept."""
    classes = data.unit_class.values.astype(str)
    for one in sorted(set(classes)):
        part = data.isel(unit=np.flatnonzero(classes == one))
        colour, kept = COLOURS.get(one, OTHERS), part.kept.values.astype(bool)
        if f"{y}_low" in data:
            ends = bars(part[y], part[f"{y}_low"], part[f"{y}_high"])
            axis.errorbar(part[x], part[y], yerr=ends, fmt="none", ecolor=colour, elinewidth=0.8, alpha=0.5)
        faces = np.where(kept, colour, "white")
        axis.scatter(part[x], part[y], c=faces.tolist(), edgecolors=colour, s=28, label=one, zorder=3)
