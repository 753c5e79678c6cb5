"""The panels of Figure 9, each on its axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import bars, key_above, say_absent
from vibrissa.figures.colours import FITTED, OF_QUALITY, PAPER, TRUTH

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

QUALITIES = ("SU", "MU")
SOURCES = ("paper, N of Results", "paper, N of Methods", "here")
COLOURS = OF_QUALITY


def _of(data: xr.Dataset, quality: str, *, mask: str = "unit_fitted") -> xr.Dataset:
    return data.isel(unit=np.flatnonzero((data.unit_quality == quality) & data[mask]))


def one_unit(axis: Axes, data: xr.Dataset) -> None:
    """Rate of one unit in classes of the envelope, its two segments and its spontaneous rate.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    axis.set_title("A  One unit")
    if "class_rate" not in data:
        say_absent(axis, "the table of units has no classes of the envelope")
        return
    attrs = data.attrs
    look: dict[str, Any] = {"fmt": "o", "ms": 3.5, "color": COLOURS[attrs["shown_quality"]], "capsize": 2}
    axis.errorbar(1e6 * data.class_envelope, data.class_rate, data.class_rate_se, **look)
    corner, slope, baseline = (attrs[f"shown_{name}"] for name in ("threshold", "slope", "baseline"))
    last = float(data.class_envelope.max())
    curve = [baseline, baseline, baseline + slope * max(last - corner, 0)]
    axis.plot([0, 1e6 * corner, 1e6 * max(last, corner)], curve, color=FITTED)
    if np.isfinite(attrs["shown_spontaneous_rate"]):
        axis.axhline(attrs["shown_spontaneous_rate"], color="0.3", ls=":")
    axis.set(xlabel="envelope [µm]", ylabel="firing rate [Hz]", xlim=(0, None), ylim=(0, None))


def at_rest(axis: Axes, data: xr.Dataset) -> None:
    """Rate below the threshold against the spontaneous rate.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    axis.set_title("D  Below threshold")
    if not np.isfinite(data.rest_rate).any():
        say_absent(axis, "no window without stimulus in this study")
        return
    for quality, mark in zip(QUALITIES, "os", strict=True):
        some = _of(data, quality)
        axis.plot(some.rest_rate, some.below_rate, mark, color=COLOURS[quality], ms=3, label=quality)
    most = float(np.nanmax([data.rest_rate.max(), data.below_rate.max()]))
    axis.plot([0, most], [0, most], color="0.7", lw=0.8, zorder=0)
    axis.set(xlabel="spontaneous rate [Hz]", ylabel="below threshold [Hz]", xlim=(0, None), ylim=(0, None))
    key_above(axis)


def spread(axis: Axes, data: xr.Dataset, name: str, scale: float, edges: Array) -> None:
    """Share of the units in each bin, SU and MU, with the means here and in the paper above.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    name : str
        ``threshold`` or ``slope``.
    scale : float
        From SI units to those shown.
    edges : array
        Of the bins, in the units shown.
    """
    tallest = 0.0
    for row, quality in enumerate(QUALITIES):
        values = np.clip(scale * _of(data, quality)[f"fitted_{name}"].values, edges[0], edges[-1])
        if f"true_{name}" in data:
            true = scale * data[f"true_{name}"].values[(data.unit_quality == quality).values]
            true = np.clip(true[np.isfinite(true)], edges[0], edges[-1])
            style: dict[str, Any] = {"color": TRUTH, "lw": 2.5, "ls": ("-", ":")[row], "zorder": 0.5}
            _draw_shares(axis, true, edges, label=f"truth, {quality}", **style)
        height = _draw_shares(axis, values, edges, color=COLOURS[quality], label=quality)
        tallest = max(tallest, height)
    for row, quality in enumerate(QUALITIES):
        for source, colour, shift in (("here", COLOURS[quality], 0.0), (SOURCES[0], PAPER, 0.05)):
            mean, error = (scale * data[f"{name}_{x}"].sel(source=source, quality=quality) for x in ("mean", "sem"))
            height_here = tallest * (1.12 + 0.13 * row + shift)
            axis.errorbar(mean, height_here, xerr=error, fmt="os"[row], color=colour, ms=3.5, capsize=2)
    axis.set(ylabel="share of units", ylim=(0, 1.4 * tallest if tallest else 1))


def _draw_shares(axis: Axes, values: Array, edges: Array, **style: Any) -> float:
    """Draw the share of the values in each bin; the height of the tallest."""
    weights = np.full(values.size, 1 / max(values.size, 1))
    return float(np.max(axis.hist(values, edges.tolist(), weights=weights, histtype="step", **style)[0]))


def correlations(axis: Axes, data: xr.Dataset) -> None:
    """Correlations of all units, driven ones filled.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    edges = np.linspace(-0.2, 1, 31).tolist()
    for quality in QUALITIES[::-1]:
        every = data.unit_correlation.values[(data.unit_quality == quality).values]
        driven = _of(data, quality, mask="unit_driven").unit_correlation.values
        axis.hist(every[np.isfinite(every)], edges, histtype="step", color=COLOURS[quality], label=quality)
        axis.hist(driven[np.isfinite(driven)], edges, color=COLOURS[quality], alpha=0.45, label="driven")
    axis.set(xlabel="largest correlation", ylabel="units", title="E  Correlations")
    if not np.isfinite(data.unit_correlation).any():
        axis.text(0.5, 0.5, "not in the table of units", ha="center", transform=axis.transAxes)
    key_above(axis, columns=2)


def shares(axis: Axes, data: xr.Dataset) -> None:
    """Share of driven units, in both readings of the paper and here.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    for row, quality in enumerate(QUALITIES):
        at = np.arange(len(SOURCES)) + 0.16 * (2 * row - 1)
        share, *ends = (100 * data[f"share_driven{end}"].sel(quality=quality) for end in ("", "_low", "_high"))
        look: dict[str, Any] = {"fmt": "os"[row], "color": COLOURS[quality], "capsize": 3, "ms": 5}
        reach = np.maximum(bars(share, *ends), 0)  # of a share of all, the upper end may round to just below it
        axis.errorbar(at, share, reach, label=quality, **look)
    axis.set_xticks(range(len(SOURCES)), ["paper\nRes.", "paper\nMeth.", "here"])
    top = max(75.0, 1.05 * float(np.nanmax(100 * data.share_driven_high)))
    axis.set(ylabel="driven [%]", ylim=(0, top), xlim=(-0.6, 2.6), title="F  Share driven")
    key_above(axis)


def latencies(axis: Axes, data: xr.Dataset) -> None:
    """Latencies; the paper gives none.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    edges = np.linspace(0, 30, 16).tolist()
    for quality in QUALITIES:
        values = 1e3 * _of(data, quality).fitted_latency.values
        axis.hist(values[np.isfinite(values)], edges, histtype="step", color=COLOURS[quality], label=quality)
    axis.set(xlabel="latency [ms]", ylabel="units", title="G  Latencies")
    key_above(axis)
