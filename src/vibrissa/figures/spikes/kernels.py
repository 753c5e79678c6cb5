"""Poisson model of one unit: what each whisker does to its rate, how late, and what its own spikes do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibrissa.figures.canvas import add_caption, bars, house_style, new_figure, say_absent, shown_in
from vibrissa.figures.colours import KINDS, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = KINDS[:4]  # of the whiskers whose kernels are drawn


def compute(data: xr.Dataset) -> xr.Dataset:
    """Choose the unit that is drawn, and the whiskers whose kernels are.

    Parameters
    ----------
    data : Dataset
        From :func:`vibrissa.neural.glm.poisson_model.whisker_kernels`: the first unit to which a whisker matters is
        drawn, or the first of all.

    Returns
    -------
    Dataset
        That unit; attributes ``drawn_whiskers``, places of the up to four whiskers of least p-value, and ``caption``.
    """
    some = np.flatnonzero(data.whisker_matters.values.any(axis=1))
    one = data.isel(unit=int(some[0]) if some.size else 0)
    p = one.whisker_p_value.values
    drawn = [int(k) for k in np.argsort(p, kind="stable")[: len(COLOURS)] if np.isfinite(p[k])]
    return one.assign_attrs(drawn_whiskers=drawn, caption=_caption(one))


def _caption(one: xr.Dataset) -> str:
    why = str(one.reason.values)
    reason = f" {why[0].upper()}{why[1:]}." if why else ""
    explained = ""
    if np.isfinite(float(one.deviance_explained)):
        explained = (
            f" The model takes away {100 * float(one.deviance_explained):.1f} % of the deviance of a steady rate in "
            f"trials not seen; penalty {float(one.penalty):g}."
        )
    return (
        f"Unit {one.unit_name.values}, {one.attrs['n_trials']} presentations; {int(one.whisker_matters.sum())} of "
        f"{one.sizes['whisker']} whiskers matter (p at most {one.attrs['level']:g}, adjusted over whiskers)."
        f"{explained} A: rise of the logarithm of the rate with a lasting envelope of each whisker; filled, those that "
        "matter. B: the same by latency, for each bin, of the whiskers of least p. C: factor on the rate after a spike "
        f"of the unit; 1, none. Bars and bands: 95 % intervals over trials.{reason}"
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw effects, kernels, and the unit's own past.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Three panels.
    """
    figure, axes = new_figure(10.5, 4.6, 1, 3, width_ratios=[1, 1.3, 1.1])
    axes[0, 0].set_title("A  Effect of each whisker")
    axes[0, 1].set_title("B  Kernels")
    axes[0, 2].set_title("C  Own past")
    if np.isfinite(data.whisker_effect.values).any():
        _draw_effects(axes[0, 0], data)
        _draw_kernels(axes[0, 1], data)
    else:
        for axis in axes[0, :2]:
            say_absent(axis, "no model: see the caption")
    _draw_past(axes[0, 2], data)
    return add_caption(figure, data)


def _draw_effects(axis: Axes, data: xr.Dataset) -> None:
    factor, unit = shown_in(str(data.attrs.get("stimulus_unit", "m")))
    place, matters = np.arange(data.sizes["whisker"]), data.whisker_matters.values.astype(bool)
    value, low, high = (data[f"whisker_effect{end}"].values / factor for end in ("", "_low", "_high"))
    axis.axvline(0, color=TRUTH, lw=0.8)
    for mask, face in ((matters, "0.2"), (~matters, "none")):
        ends = np.maximum(bars(value[mask], low[mask], high[mask]), 0)
        axis.errorbar(value[mask], place[mask], xerr=ends, fmt="o", ms=4, lw=0.9, color="0.2", mfc=face)
    axis.set_yticks(place, [str(name) for name in data.whisker.values], fontsize=7, parse_math=False)
    axis.set(ylim=(len(place) - 0.5, -0.5), xlabel=f"rise of ln(rate) [1/{unit}]")


def _draw_kernels(axis: Axes, data: xr.Dataset) -> None:
    factor, unit = shown_in(str(data.attrs.get("stimulus_unit", "m")))
    lag = 1e3 * data.kernel_lag
    axis.axhline(0, color=TRUTH, lw=0.8)
    for k, colour in zip(data.attrs["drawn_whiskers"], COLOURS, strict=False):
        one = data.isel(whisker=k)
        axis.fill_between(
            lag, one.whisker_kernel_low / factor, one.whisker_kernel_high / factor, color=colour, alpha=0.15, lw=0
        )
        axis.plot(lag, one.whisker_kernel / factor, color=colour, label=str(one.whisker.values))
    axis.set(xlabel="latency [ms]", ylabel=f"rise of ln(rate), for each bin [1/{unit}]")
    axis.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=len(COLOURS), fontsize=7, borderaxespad=0)


def _draw_past(axis: Axes, data: xr.Dataset) -> None:
    if not data.sizes["past_lag"] or not np.isfinite(data.past_kernel.values).any():
        say_absent(axis, "the unit's own past is not in the model")
        return
    lag = 1e3 * data.past_lag
    axis.axhline(1, color=TRUTH, lw=0.8)
    axis.fill_between(lag, data.past_kernel_low, data.past_kernel_high, color="0.2", alpha=0.2, lw=0)
    axis.plot(lag, data.past_kernel, color="0.2")
    top = 1.15 * max(1.0, float(np.nanmax(data.past_kernel.values)))
    axis.set(xlabel="time after a spike [ms]", ylabel="factor on the rate", ylim=(0, top))
