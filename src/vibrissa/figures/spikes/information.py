"""Information of each unit's spikes about the time in the stimulus."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.arrays import Mask
from vibrissa.figures.canvas import add_caption, bars, counted, house_style, new_figure, say_absent
from vibrissa.figures.colours import FOUND, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 60  # units whose names are written


def compute(data: xr.Dataset) -> xr.Dataset:
    """Sort the units by the information of a spike.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.neural.coding.information.unit_information`.

    Returns
    -------
    Dataset
        The units for which it is estimated, the largest first; attribute ``caption``.
    """
    bits = data.spike_information.values
    order = np.argsort(-np.nan_to_num(bits, nan=-np.inf), kind="stable")
    some = data.isel(unit=order[np.isfinite(bits[order])])
    left = data.sizes["unit"] - some.sizes["unit"]
    start, stop = data.attrs["window"]
    doubtful = [int((some[name].values != "").sum()) for name in ("spike_reason", "reason")]
    sure = [int(some[name].sum()) for name in ("informative", "count_informative")]
    notes = [
        f"; {left} cannot be estimated" if left else "",
        f"; hollow, {doubtful[0]} with too few spikes in A and B, {doubtful[1]} with too few spikes or trials in C "
        "(see reason)"
        if doubtful[1]
        else "",
    ]
    caption = (
        f"{counted(data.sizes['unit'], 'unit')}, {data.attrs['n_trials']} trials, {start:g} to {stop:g} s in bins of "
        f"{1e3 * data.attrs['bin_width']:g} ms; spikes of {sure[0]} and counts of {sure[1]} inform on the stimulus "
        f"beyond their error{''.join(notes)}. A: bits of one spike, corrected for the number of trials, with 95 % "
        "intervals; grey, as counted, which is too large. B: bits for each second if spikes are independent, against "
        "the mean rate; grey lines, 0.5, 1 and 2 bits for each spike. C: bits of the count in a bin."
    )
    return some.assign_attrs(caption=caption)


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw the three measures.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Three panels.
    """
    count = data.sizes["unit"]
    figure, axes = new_figure(9.6, min(9.0, 3.6 + 0.16 * count), 1, 3)
    titles = ("A  Of a spike", "B  Of a second", "C  Of the count in a bin")
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title)
        if not count:
            say_absent(axis, "no unit has enough spikes and trials; see reason")
    if count:
        _draw_sorted(axes[0, 0], data, "spike_information", names=True)
        _draw_rates(axes[0, 1], data)
        _draw_sorted(axes[0, 2], data, "count_information", names=False)
    return add_caption(figure, data)


def _draw_sorted(axis: Axes, data: xr.Dataset, name: str, *, names: bool) -> None:
    place = np.arange(data.sizes["unit"])
    value, low, high = (data[f"{name}{end}"].values for end in ("", "_low", "_high"))
    axis.axvline(0, color=TRUTH, lw=0.8)
    axis.plot(data[f"{name}_plain"], place, "|", color="0.5", ms=7)
    for mask, face in _faces(data, "reason" if name == "count_information" else "spike_reason"):
        reach = np.maximum(bars(value[mask], low[mask], high[mask]), 0)
        axis.errorbar(value[mask], place[mask], xerr=reach, fmt="o", ms=4, lw=0.9, color=FOUND, mfc=face)
    written = [str(one) for one in data.unit_name.values] if names and len(place) <= MOST else []
    axis.set_yticks(place[: len(written)], written, fontsize=7, parse_math=False)
    axis.set(ylim=(len(place) - 0.5, -0.5), xlabel="bits")


def _faces(data: xr.Dataset, reason: str) -> list[tuple[Mask, str]]:
    """Units without and with a reason against them, and what fills their points."""
    sure = data[reason].values == ""
    return [(sure, FOUND), (~sure, "none")]


def _draw_rates(axis: Axes, data: xr.Dataset) -> None:
    rate = data.unit_rate.values
    value, low, high = (data[f"information_rate{end}"].values for end in ("", "_low", "_high"))
    for bits in (0.5, 1, 2):
        axis.axline((0, 0), slope=bits, color=TRUTH, lw=0.8)
    for mask, face in _faces(data, "spike_reason"):
        reach = np.maximum(bars(value[mask], low[mask], high[mask]), 0)
        axis.errorbar(rate[mask], value[mask], reach, fmt="o", ms=4, lw=0.9, color=FOUND, mfc=face)
    axis.set(xlabel="mean rate [Hz]", ylabel="bits/s", xlim=(0, 1.1 * rate.max()))
    axis.set_ylim(min(0.0, float(np.nanmin(low, initial=0))), 1.1 * float(np.nanmax(high, initial=1e-3)))
