"""The panels of Figure 9, each on its axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, bars

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

QUALITIES = ("SU", "MU")
SOURCES = ("paper, N of Results", "paper, N of Methods", "here")
COLOURS = dict(zip(QUALITIES, (FOUND, OTHER), strict=True))


def _of(data: xr.Dataset, quality: str, *, mask: str = "unit_fitted") -> xr.Dataset:
    return data.isel(unit=np.flatnonzero((data.unit_quality == quality) & data[mask]))


def hinges(axis: Axes, data: xr.Dataset) -> None:
    """Every fitted hinge above its baseline.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    envelope = np.linspace(0, 150e-6, 151)
    for quality in QUALITIES[::-1]:
        units = _of(data, quality)
        above = np.maximum(envelope[:, None] - units.fitted_threshold.values, 0) * units.fitted_slope.values
        axis.plot(1e6 * envelope, above, color=COLOURS[quality], lw=0.5, alpha=0.35)
        axis.plot([], [], color=COLOURS[quality], label=f"{quality}, n = {units.sizes['unit']}")
    axis.set(xlabel="envelope [µm]", ylabel="rate above the baseline [Hz]", ylim=(0, 80), xlim=(0, 150))
    axis.set_title("A  Fitted hinges")
    axis.legend(loc="upper left")


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
        for source, colour, shift in (("here", COLOURS[quality], 0.0), (SOURCES[0], "black", 0.05)):
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
        axis.hist(every[np.isfinite(every)], edges, histtype="step", color=COLOURS[quality], label=f"{quality}, all")
        axis.hist(driven[np.isfinite(driven)], edges, color=COLOURS[quality], alpha=0.45, label=f"{quality}, driven")
    axis.set(xlabel="largest correlation with the envelope", ylabel="units", title="D  Correlations")
    axis.set_ylim(0, 1.35 * axis.get_ylim()[1])  # room for the legend above the bars
    if not np.isfinite(data.unit_correlation).any():
        axis.text(0.5, 0.5, "not in the table of units", ha="center", transform=axis.transAxes)
    axis.legend(loc="upper right", ncols=2)


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
    axis.set_xticks(range(len(SOURCES)), [name.replace(", ", ",\n") for name in SOURCES])
    top = max(75.0, 1.05 * float(np.nanmax(100 * data.share_driven_high)))
    axis.set(ylabel="driven by the envelope [%]", ylim=(0, top), xlim=(-0.6, 2.6), title="E  Share of driven units")
    axis.legend(loc="upper left")


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
    axis.set(xlabel="latency [ms]", ylabel="units", title="F  Latencies (none in the paper)")
    axis.legend(loc="upper right")


def table(axis: Axes, data: xr.Dataset) -> None:
    """The paper's numbers beside those found.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    from matplotlib.transforms import Bbox

    axis.axis("off")
    head = ["", "SU, paper", "SU, here", "MU, paper", "MU, here"]
    look: dict[str, Any] = {"cellLoc": "left", "bbox": Bbox.unit(), "edges": "horizontal"}
    cells, widths = data.table_text.values.tolist(), [0.2, 0.24, 0.16, 0.24, 0.16]
    table = axis.table(cells, colLabels=head, colWidths=widths, **look)
    table.auto_set_font_size(False)
    table.set_fontsize(8)
