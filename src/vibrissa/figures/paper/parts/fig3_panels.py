"""The panels of Figure 3, each on its axes."""

from __future__ import annotations

import json
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import FOUND, OTHER, TRUTH, round_length

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

PASSED = 0.15  # [s] for which the grating of the sketch has moved
EVERY = 3  # frames from one line to the next in the field of motion
PATHS = 12  # nodes whose paths are drawn
SHOWN_RUNS = 0.15  # [s]
PAPER_MEAN, PAPER_SD = 0.96, 0.05  # correlation of a run with the mean of five, four whiskers
LAND, GAP = "0.35", "0.85"
BESIDE: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "va": "center"}
SOURCES = {"run_correlation": ("all", FOUND), "run_correlation_others": ("others", OTHER),
           "run_correlation_true": ("all, no\nnoise", "0.45")}  # fmt: skip


def without(axis: Axes, title: str, why: str) -> None:
    """Say in an empty panel why it is empty.

    Parameters
    ----------
    axis : Axes
        The panel.
    title : str
        Of the panel.
    why : str
        The reason.
    """
    axis.axis("off")
    axis.set_title(title)
    axis.text(0.5, 0.5, fill(why, 38), ha="center", va="center", color="0.35", transform=axis.transAxes)


def draw_apparatus(axis: Axes, data: xr.Dataset) -> None:
    """Whisker at rest on the grating, seen by the camera along the edges of the grating.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`compute`.
    """
    x, y, facts = 1e3 * data.shaft_x.values, 1e3 * data.shaft_y.values, data.attrs
    axis.fill(1e3 * data.field_x, 1e3 * data.field_y, facecolor="#56B4E9", alpha=0.13, lw=0)
    axis.fill(1e3 * data.field_x, 1e3 * data.field_y, fill=False, edgecolor="#56B4E9", lw=0.8, ls="--")
    axis.plot(x, y, color="k", lw=1.8)
    base = int(np.argmax(y))
    axis.plot(x[base], y[base], "o", color="k", ms=5)
    left, right, height = x.min() - 9, x.max() + 12, facts["base_height"] * 1e3
    axis.fill_between([left, right], -1.6, 0, color=LAND, lw=0)
    start = 1e3 * (data.trough_start.values - facts["speed"] * PASSED)
    inside = (start > left) & (start + 1e3 * data.trough_width.values < right)
    gaps = np.stack([start, 1e3 * data.trough_width.values], axis=1)[inside]
    axis.broken_barh(gaps, (-1.6, 1.6), color=GAP)
    arrow = {"arrowstyle": "<->", "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", (x[base] + 9, 0), (x[base] + 9, height), arrowprops=arrow)
    axis.plot([x[base], x[base] + 10], [y[base], y[base]], color="0.5", lw=0.6, ls=":")
    axis.text(x[base] + 9.6, height / 2, f"H = {height:.1f} mm", rotation=90, va="center")
    axis.annotate("", (left + 1, -3.4), (left + 11, -3.4), arrowprops={"arrowstyle": "->", "lw": 1.2})
    axis.text(left + 12, -3.4, f"$v_{{scan}}$ = {1e3 * facts['speed']:.0f} mm/s", va="center")
    axis.text(x[base], y[base] + 1.2, "skin", ha="right")
    axis.set(xlabel="along the substrate [mm]", ylabel="height [mm]", aspect="equal", xlim=(left, right))
    axis.set(ylim=(-5.5, max(1e3 * data.field_y.values.max(), height) + 1.5))
    axis.set_title(f"A  Set-up, from the camera ({facts['frame_rate']:g} Hz; blue: its field)")


def draw_frame(axis: Axes, data: xr.Dataset) -> None:
    """First frame with the centrelines found in it.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`compute`.
    """
    axis.imshow(data.image, vmin=0, aspect="equal")
    for i, name in enumerate(json.loads(data.attrs["names"])):
        label = name if np.isfinite(data.line_row[i]).any() else f"{name} (not seen in this frame)"
        axis.plot(data.line_column[i], data.line_row[i], ":", color=f"C{(i + 1) % 6}", lw=1.6, label=label)
    axis.set(xlabel="column [pixel]", ylabel="row [pixel]", title="B  First frame and its centrelines")
    axis.legend(loc="upper right", labelcolor="0.1", framealpha=0.7, frameon=True)


def draw_field(axis: Axes, data: xr.Dataset) -> None:
    """Mean profile, successive profiles about it, and the paths of some nodes, too large by a factor.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`compute`.
    """
    factor = data.attrs["exaggeration"]
    x, y = (1e3 * (data[f"mean_{a}"] + factor * data[f"motion_{a}"]).transpose("instant", ...).values for a in "xy")
    colours = np.linspace(0.12, 0.88, -(-len(x) // EVERY))
    from matplotlib import colormaps

    for line, colour in zip(range(0, len(x), EVERY), colours, strict=True):
        axis.plot(x[line], y[line], color=colormaps["viridis"](colour), lw=0.9)
    axis.plot(1e3 * data.mean_x, 1e3 * data.mean_y, color="0.6", lw=2.2, zorder=1, label="mean")
    for node in np.linspace(0, x.shape[1] - 1, PATHS).astype(int):
        axis.plot(x[:, node], y[:, node], color="k", lw=0.8)
    axis.plot([], [], color="k", lw=0.8, label="paths of nodes")
    axis.plot([], [], color=colormaps["viridis"](0.5), lw=0.9, label=f"every {EVERY}rd frame of {len(x)}")
    axis.invert_yaxis()
    axis.set(xlabel="x [mm]", ylabel="y, down [mm]", aspect="equal", title=f"C  Motion about the mean, × {factor:g}")
    axis.legend(loc="best")


def draw_shares(axis: Axes, data: xr.Dataset) -> None:
    """Share of the power along the shaft, node by node.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`compute`.
    """
    if "along_share" not in data:
        without(axis, "C  Share across the shaft", "not known: without a skin point no node is fixed to the shaft")
        return
    arc = 1e3 * data.field_arc
    if "along_share_true" in data:
        axis.plot(arc, 100 * data.along_share_true, color=TRUTH, lw=3.5, label="truth")
    axis.plot(arc, 100 * data.along_share, ":", color=OTHER, lw=1.4, label="nodes, with noise")
    axis.plot(arc, 100 * data.along_share_unstretched, color=FOUND, label="from motion across")
    axis.set(xlabel="arc length from the skin [mm]", ylabel="power along the shaft [%]", ylim=(0, 100))
    axis.set_title(f"C  {100 * data.attrs['share_across']:.0f} % of the power is across the shaft")
    axis.legend(loc="upper left")


def draw_traces(axis: Axes, data: xr.Dataset) -> None:
    """Motion of a few nodes, one above the other from the skin (bottom) to the tip (top).

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`compute`.
    """
    motion = 1e6 * data.node_motion.values
    seen = [trace[np.isfinite(trace)] for trace in motion.T]
    level = [np.median(trace) if trace.size else 0.0 for trace in seen]  # an excerpt may lie off the movie's mean
    step = 1.1 * max([1.0, *(np.ptp(trace) for trace in seen if trace.size)])
    for i, arc in enumerate(data.trace_arc.values):
        if "node_motion_true" in data:
            label = "truth" if i == 0 else None
            true = 1e6 * data.node_motion_true[:, i] - level[i]
            axis.plot(data.time, true + i * step, color=TRUTH, lw=2.6, label=label)
        axis.plot(data.time, motion[:, i] - level[i] + i * step, color=f"C{i}", lw=0.9)
        axis.annotate(f"{1e3 * arc:.1f} mm", (1.005, i * step), color=f"C{i}", **BESIDE)
    name = json.loads(data.attrs["names"])[0]
    sense = {"x": "x, to the right", "y": "y, down"}[data.attrs["measured"]]
    bar = round_length(0.6 * step)
    axis.plot([data.time[0]] * 2, [step / 2 - bar / 2, step / 2 + bar / 2], color="k", lw=3, solid_capstyle="butt")
    axis.text(data.time[0], step / 2, f"  {bar:g} µm", va="center")
    axis.set(xlabel="time [s]", ylabel=sense, xlim=(data.time[0], data.time[-1]), yticks=[])
    axis.spines["left"].set_visible(False)
    axis.set_title(f"D  Motion of single nodes of {name}, shifted; at the right their arc length")
    if "node_motion_true" in data:
        axis.legend(loc="upper right")


def draw_runs(axis: Axes, data: xr.Dataset) -> None:
    """The runs of one experiment one upon the other, how each differs from their mean below, and the texture.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`compute`.
    """
    shown = data.run_time.values - data.run_time.values[0] <= SHOWN_RUNS
    time, runs = data.run_time.values[shown], 1e6 * data.run_motion.values[0][:, shown]
    own = runs - runs.mean(axis=0)
    below = runs.min() - 1.15 * max(own.max(), 0.1 * np.ptp(runs))
    for i, (run, rest) in enumerate(zip(runs, own, strict=True)):
        label = f"run {i + 1}, ρ = {float(data.run_correlation[0, i]):.3f}"
        axis.plot(time, run, color=f"C{i % 6}", lw=0.9, label=label)
        axis.plot(time, rest + below, color=f"C{i % 6}", lw=0.7)
    axis.annotate("run − mean", (1.005, below), **BESIDE)
    if "trough_start" in data:
        bottom = below + own.min() - 0.16 * np.ptp(runs)
        start, width = (data[f"trough_{x}"].values / data.attrs["speed"] for x in ("start", "width"))
        inside = start < time[-1]
        axis.broken_barh([(time[0], np.ptp(time))], (bottom, 0.08 * np.ptp(runs)), color=LAND)
        axis.broken_barh(np.stack([start, width], axis=1)[inside], (bottom, 0.08 * np.ptp(runs)), color=GAP)
        axis.annotate("texture", (1.005, bottom + 0.04 * np.ptp(runs)), **BESIDE)
    arc = f", {1e3 * data.attrs['run_arc']:.1f} mm from the skin" if "run_arc" in data.attrs else ""
    axis.set(xlabel="time [s]", ylabel="y, down, about its mean [µm]", xlim=(time[0], time[-1]))
    axis.set_title(f"E  {len(runs)} runs over one texture{arc}")
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def draw_correlations(axis: Axes, data: xr.Dataset) -> None:
    """Correlation of every run of every experiment, with its medians, beside the paper's mean and spread.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From :func:`compute`.
    """
    known = [name for name in SOURCES if name in data]
    for at, name in enumerate(known):
        values = np.sort(data[name].values.ravel())
        aside = np.linspace(-0.3, 0.3, len(values)) if len(values) > 1 else [0.0]
        axis.plot(at + np.asarray(aside), values, ".", color=SOURCES[name][1], ms=3)
        axis.plot(at, np.median(values), "s", color="w", mec="k", ms=6)
    axis.errorbar(len(known), PAPER_MEAN, PAPER_SD, fmt="o", color="k", capsize=3, ms=4)
    axis.axhline(1, color="0.7", lw=0.7, zorder=0)
    axis.set_xticks(range(len(known) + 1), [*(SOURCES[name][0] for name in known), "paper\n(all)"])
    axis.set(ylabel="correlation of a run with the mean of", xlim=(-0.5, len(known) + 0.5))
    axis.set_title("Every run; squares: medians")
