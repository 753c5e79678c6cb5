"""The panels of Figure 9, each on its axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

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
    for quality, mark in zip(QUALITIES, "os", strict=True):
        some = _of(data, quality)
        axis.plot(some.rest_rate, some.below_rate, mark, color=COLOURS[quality], ms=3, label=quality)
    most = float(np.nanmax([data.rest_rate.max(), data.below_rate.max()]))
    axis.plot([0, most], [0, most], color="0.7", lw=0.8, zorder=0)
    axis.set(xlabel="spontaneous rate [Hz]", ylabel="below threshold [Hz]", xlim=(0, None), ylim=(0, None))
    key_above(axis)


def spread(axis: Axes, data: xr.Dataset, name: str, scale: float) -> None:
    """Each unit, joined to its truth, by rising value; above, the means here and in the paper.

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
    """
    labels = []
    for row, (quality, mark) in enumerate(zip(QUALITIES, "os", strict=True)):
        some = _of(data, quality)
        some = some.isel(unit=np.argsort(some[f"fitted_{name}"].values))
        values, place = scale * some[f"fitted_{name}"].values, np.linspace(0.1, 0.6, some.sizes["unit"]) - row
        if f"true_{name}" in data:
            true = scale * some[f"true_{name}"].values
            axis.plot([values, true], [place, place], color=TRUTH, lw=0.8, zorder=0)
            axis.plot(true, place, "|", color=TRUTH, ms=8, mew=2, label="truth" if row == 0 else None)
        axis.plot(values, place, mark, color=COLOURS[quality], ms=3)
        for source, colour, height in (("here", COLOURS[quality], 0.72), (SOURCES[0], PAPER, 0.84)):
            mean, error = (
                scale * float(data[f"{name}_{x}"].sel(source=source, quality=quality)) for x in ("mean", "sem")
            )
            axis.errorbar(mean, height - row, xerr=error, fmt=mark, color=colour, ms=4.5, capsize=2)
        beside: dict[str, Any] = {"textcoords": "offset points", "va": "center", "fontsize": 8}
        axis.annotate("paper", (mean + error, height - row), (5, 0), color=PAPER, **beside)
        labels.append(f"{quality}\nN = {some.sizes['unit']}")
    axis.set_yticks([0.4, -0.6], labels)
    axis.set(ylim=(-1, 1), ylabel="units in order")


def correlations(axis: Axes, data: xr.Dataset) -> None:
    """Correlations of all units; filled, those that pass the test.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`vibrissa.figures.paper.fig9.compute`.
    """
    edges = np.linspace(-0.2, 1, 31).tolist()
    for quality in QUALITIES:
        every = data.unit_correlation.values[(data.unit_quality == quality).values]
        driven = _of(data, quality, mask="unit_driven").unit_correlation.values
        axis.hist(every[np.isfinite(every)], edges, histtype="step", color=COLOURS[quality], label=quality)
        axis.hist(driven[np.isfinite(driven)], edges, color=COLOURS[quality], alpha=0.45, label=f"{quality}, pass")
    axis.set(xlabel="largest correlation", ylabel="units", title="E  Correlations")
    if not np.isfinite(data.unit_correlation).any():
        axis.text(0.5, 0.5, "not in the table of units", ha="center", transform=axis.transAxes)
    key_above(axis, columns=2)


def shares(axis: Axes, data: xr.Dataset) -> None:
    """Share of units that pass the test, in both readings of the paper and here.

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
    axis.set_xticks(range(len(SOURCES)), ["paper,\nResults", "paper,\nMethods", "here"])
    top = max(75.0, 1.05 * float(np.nanmax(100 * data.share_driven_high)))
    axis.set(ylabel="pass the test [%]", ylim=(0, top), xlim=(-0.6, 2.6), title="F  Share that passes")
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
