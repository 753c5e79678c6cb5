"""Surround map of one unit: weight of every whisker on the pad, its intervals, and what the delays determine."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.errors import UnknownError
from vibrissa.figures.canvas import add_caption, bars, house_style, key_above, new_figure
from vibrissa.figures.colours import KINDS, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"drives": KINDS[2], "suppresses": KINDS[0], "no": "0.35", "cannot tell": "0.7"}
STRADDLERS = {"alpha": (0.5, 0), "beta": (1.5, 0), "gamma": (2.5, 0), "delta": (3.5, 0)}
GREEK = dict(zip(STRADDLERS, "αβγδ", strict=True))
PER_UM = 1e-6  # 1/(s m) to AP/s/µm


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Choose the unit that is drawn and place its whiskers on the pad.

    Parameters
    ----------
    study : mapping
        ``surround``, of :func:`vibrissa.neural.glm.surround.surround_map`: the first unit that a whisker drives is
        drawn, or the first of all. Where ``true_weight`` (whisker) [1/(s m)] is in its attributes, it is drawn behind.

    Returns
    -------
    Dataset
        That unit; attributes ``caption`` and ``pad`` (whisker, 2): row A to E as 0 to 4 and arc from 0; NaN where a
        name has no such place.
    """
    data = study["surround"]
    driven = np.flatnonzero(data.strongest_whisker.values != "")
    one = data.isel(unit=int(driven[0]) if driven.size else 0)
    pad = np.array([place(str(name)) for name in one.whisker.values], float)
    return one.assign_attrs(pad=pad.ravel(), caption=_caption(one))


def place(name: str) -> tuple[float, float]:
    """Row (A to E as 0 to 4) and arc of a whisker by its name; NaN where the name is no whisker's.

    Parameters
    ----------
    name : str
        ``C2``, ``beta``.

    Returns
    -------
    row, arc : float
        NaN where the name is no whisker's.
    """
    if name in STRADDLERS:
        return STRADDLERS[name]
    found = re.fullmatch(r"([A-E])(\d)", name)
    return (float("ABCDE".index(found[1])), float(found[2])) if found else (np.nan, np.nan)


def _caption(one: xr.Dataset) -> str:
    verdict = one.surround_verdict.values
    named = {name: int(np.sum(verdict == name)) for name in COLOURS}
    hinge = f" Threshold {1e6 * one.threshold.item():.1f} µm, latency {1e3 * one.latency.item():.1f} ms for all."
    hinge = hinge if np.isfinite(one.threshold.item()) else ""
    reason = f" {one.reason.item()}." if one.reason.item() else ""
    trials, whiskers = one.attrs["n_trials"], one.sizes["whisker"]
    return (
        f"Unit {one.unit_name.item()}, {trials} presentations of one texture on {whiskers} whiskers with delays. "
        f"{named['drives']} drive it, {named['suppresses']} suppress it, {named['no']} do nothing that matters (less "
        f"than a fifth of the largest weight), {named['cannot tell']} cannot be determined.{hinge} Bars, 95 % "
        "intervals over presentations. C: largest correlation of a whisker's envelope with another's within 30 ms; "
        f"dashed, 0.9, above which they are not distinguished; condition number "
        f"{one.condition_number.item():.3g}.{reason}"
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """The pad, the weights, and how alike the copies are.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    figure, axes = new_figure(9.6, 4.4, 1, 3, width_ratios=[1, 1.5, 0.8])
    _draw_pad(axes[0, 0], data)
    _draw_weights(axes[0, 1], data)
    _draw_design(axes[0, 2], data)
    return add_caption(figure, data)


def _draw_pad(axis: Axes, data: xr.Dataset) -> None:
    pad = np.asarray(data.attrs["pad"], float).reshape(-1, 2)
    weight = PER_UM * data.surround_weight.values
    if np.isnan(pad).any():
        rule = "must be named as on the pad (A1 to E9, alpha to delta)"
        raise UnknownError("whiskers", rule, list(data.whisker.values))
    known = np.isfinite(weight)
    top = np.abs(weight[known]).max(initial=1e-12)
    look: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -top, "vmax": top, "ec": "0.5"}
    dots = axis.scatter(pad[known, 1], pad[known, 0], s=420, c=weight[known], **look)
    axis.scatter(pad[~known, 1], pad[~known, 0], s=420, fc="none", ec="0.7", ls="--")
    for (row, arc), name, value in zip(pad, data.whisker.values, weight, strict=True):
        label = GREEK.get(str(name), str(name))
        dark = np.isfinite(value) and abs(value) > 0.6 * top
        axis.text(arc, row, label, ha="center", va="center", fontsize=7, color="w" if dark else "k")
    axis.set(xlim=(-0.6, pad[:, 1].max() + 0.6), ylim=(4.7, -0.7), xlabel="arc", yticks=range(5), xticks=range(5))
    axis.set_yticklabels(list("ABCDE"))
    axis.set_title("A  Weight on the pad")
    axis.figure.colorbar(dots, ax=axis, label="AP/s/µm", orientation="horizontal", shrink=0.9, pad=0.02)


def _draw_weights(axis: Axes, data: xr.Dataset) -> None:
    place_of = np.arange(data.sizes["whisker"])
    value, low, high = (PER_UM * data[f"surround_weight{end}"].values for end in ("", "_low", "_high"))
    axis.axvline(0, color=TRUTH, lw=0.8)
    if "true_weight" in data.attrs:
        truth = PER_UM * np.asarray(data.attrs["true_weight"], float)
        axis.plot(truth, place_of, "|", color="k", ms=9, label="put in")
    for name, colour in COLOURS.items():
        own = (data.surround_verdict.values == name) & np.isfinite(value)
        if own.any():
            ends = bars(value[own], low[own], high[own])
            axis.errorbar(value[own], place_of[own], xerr=ends, fmt="o", ms=4, color=colour, label=name)
    blind = ~np.isfinite(value)
    axis.plot(np.zeros(blind.sum()), place_of[blind], "x", color=COLOURS["cannot tell"], ms=5)
    axis.set(yticks=place_of, ylim=(len(place_of) - 0.5, -0.5), xlabel="weight [AP/s/µm]")
    axis.set_yticklabels([str(name) for name in data.whisker.values], fontsize=7)
    axis.set_title("B  Weights and intervals")
    key_above(axis, columns=2)


def _draw_design(axis: Axes, data: xr.Dataset) -> None:
    place_of = np.arange(data.sizes["whisker"])
    axis.barh(place_of, data.copy_likeness.values, color=TRUTH)
    axis.axvline(0.9, color="0.2", ls="--")
    axis.set(xlim=(0, 1), ylim=(len(place_of) - 0.5, -0.5), xlabel="largest |r| with another", yticks=[])
    axis.set_title("C  How alike the copies are")
