"""The panels of Figure 3, each on its axes."""

from __future__ import annotations

import json
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import key_above, round_length
from vibrissa.figures.colours import GAP, LAND, MEASURED, PAPER, TRUTH
from vibrissa.figures.paper.parts.texture_strip import draw_passing

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

PASSED = 0.15  # [s] for which the grating of the sketch has moved
EVERY = 3  # frames from one line to the next in the field of motion
PATHS = 12  # nodes whose paths are drawn
SHOWN_RUNS = 0.15  # [s]
PAPER_MEAN, PAPER_SD = 0.96, 0.05  # correlation of a run with the mean of five, four whiskers
CLEAR: dict[str, Any] = {"bbox": {"fc": "w", "ec": "none", "alpha": 0.8, "pad": 1}}  # letters on any image
BESIDE: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "va": "center"}
SOURCES = {"run_correlation": ("all", MEASURED, "o"), "run_correlation_others": ("others", MEASURED, "x"),
           "run_correlation_true": ("all, no\nnoise", TRUTH, "o")}  # fmt: skip


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
        From ``compute``.
    """
    x, y, facts = 1e3 * data.shaft_x.values, 1e3 * data.shaft_y.values, data.attrs
    axis.fill(1e3 * data.field_x, 1e3 * data.field_y, facecolor=MEASURED, alpha=0.1, lw=0)
    axis.fill(1e3 * data.field_x, 1e3 * data.field_y, fill=False, edgecolor=MEASURED, lw=0.8, ls="--")
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
    axis.text(left + 12, -3.4, f"$v_{{scan}}$ = {1e3 * facts['speed']:.0f} mm/s", va="center", **CLEAR)
    axis.text(x[base], y[base] + 1.2, "skin", ha="right")
    axis.set(xlabel="along the substrate [mm]", ylabel="height [mm]", aspect="equal", xlim=(left, right))
    axis.set(ylim=(-5.5, max(1e3 * data.field_y.values.max(), height) + 1.5))
    axis.set_title(f"A  Set-up; camera: {facts['frame_rate']:g} frames/s")


def draw_frame(axis: Axes, data: xr.Dataset) -> None:
    """First frame with the centrelines found in it; a square about what C shows.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    """
    axis.imshow(data.image, vmin=0, aspect="equal")
    for i, name in enumerate(json.loads(data.attrs["names"])):
        seen = np.flatnonzero(np.isfinite(data.line_row[i].values))
        if not seen.size:
            axis.text(0.02, 0.94 - 0.1 * i, f"{name}: not in this frame", transform=axis.transAxes, va="top", **CLEAR)
            continue
        axis.plot(data.line_column[i], data.line_row[i], ":", color=MEASURED, lw=1.6)
        end = data.line_column[i].values[seen[-1]], data.line_row[i].values[seen[-1]]
        axis.annotate(name, end, (6, 0), textcoords="offset points", va="center", **CLEAR)
    if "mean_x" in data and "pixel_size" in data.attrs:
        x, y = (data[f"mean_{a}"].values / data.attrs["pixel_size"] for a in "xy")
        corners = [x.min(), x.max(), x.max(), x.min(), x.min()], [y.min(), y.min(), y.max(), y.max(), y.min()]
        axis.plot(*corners, color="w", lw=2.4)
        axis.plot(*corners, color="k", lw=0.8)
    axis.set(xlabel="column [pixel]", ylabel="row [pixel]", title="B  First frame, centrelines dotted")


def draw_field(axis: Axes, data: xr.Dataset) -> None:
    """Mean profile, successive profiles about it, and the paths of some nodes, too large by a factor.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
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
    axis.plot([], [], color=colormaps["viridis"](0.5), lw=0.9, label=f"every {EVERY}rd frame of {len(x)}, dark to pale")
    node = data.attrs["path_node"]
    axis.plot(1e3 * data.mean_x[node], 1e3 * data.mean_y[node], "o", color=MEASURED, ms=4, label="node at the right")
    axis.invert_yaxis()
    axis.set(xlabel="x [mm]", ylabel="y, down [mm]", aspect="equal", title=f"C  Motion about the mean, × {factor:g}")
    key_above(axis, columns=2)


def draw_path(axis: Axes, data: xr.Dataset) -> None:
    """Displacements in x and y of the highlighted node.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    """
    time = 1e3 * (data.path_time - data.path_time[0])
    axis.plot(time, 1e6 * data.path_y, color=MEASURED, label="y, down")
    axis.plot(time, 1e6 * data.path_x, "--", color=MEASURED, lw=0.8, label="x")
    axis.set(xlabel="time [ms]", ylabel="displacement [µm]", xlim=(0, None))
    axis.set_title(f"C  The node {1e3 * data.attrs['path_arc']:.1f} mm from the skin")
    key_above(axis)


def draw_shares(axis: Axes, data: xr.Dataset) -> None:
    """Share of the power along the shaft, node by node.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    """
    if "along_share" not in data:
        without(axis, "F  Share along the shaft", "not known: without a skin point no node is fixed to the shaft")
        return
    arc = 1e3 * data.field_arc
    if "along_share_true" in data:
        axis.plot(arc, 100 * data.along_share_true, color=TRUTH, lw=3.5, label="truth")
    axis.plot(arc, 100 * data.along_share, ":", color=MEASURED, lw=1.4, label="nodes, with noise")
    axis.plot(arc, 100 * data.along_share_unstretched, color=MEASURED, label="from motion across")
    axis.set(xlabel="arc length from the skin [mm]", ylabel="power along the shaft [%]", ylim=(0, 100))
    axis.set_title("F  Motion along the shaft")
    key_above(axis, columns=2)


def draw_traces(axis: Axes, data: xr.Dataset) -> None:
    """Motion of a few nodes, one above the other from the skin (bottom) to the tip (top).

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
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
        label = "tracked" if i == 0 else None
        axis.plot(data.time, motion[:, i] - level[i] + i * step, color=MEASURED, lw=0.9, label=label)
        axis.annotate(f"{1e3 * arc:.1f} mm", (1.005, i * step), **BESIDE)
    sense = {"x": "x, to the right", "y": "y, down"}[data.attrs["measured"]]
    draw_scale(axis, float(data.time[0] + 0.01 * np.ptp(data.time.values)), step / 2, 0.5 * step)
    axis.set(xlabel="time [s]", ylabel=sense, xlim=(data.time[0], data.time[-1]), yticks=[])
    axis.spines["left"].set_visible(False)
    axis.set_title("G  Nodes, and their distance from the skin")
    key_above(axis)


def draw_scale(axis: Axes, x: float, middle: float, most: float) -> None:
    """Upright scale bar of a round length.

    Parameters
    ----------
    axis : Axes
        In micrometres.
    x, middle : float
        Its place.
    most : float
        Largest length.
    """
    bar = round_length(most)
    axis.plot([x] * 2, [middle - bar / 2, middle + bar / 2], color="k", lw=2, solid_capstyle="butt", clip_on=False)
    beside: dict[str, Any] = {"textcoords": "offset points", "va": "center", "annotation_clip": False}
    axis.annotate(f"{bar:g} µm", (x, middle), (6, 0), **beside, **CLEAR)


def draw_runs(axis: Axes, data: xr.Dataset) -> None:
    """The runs of one experiment one below the other, their mean in black and the texture at the bottom.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    """
    shown = data.run_time.values - data.run_time.values[0] <= SHOWN_RUNS
    time, runs = data.run_time.values[shown], 1e6 * data.run_motion.values[data.attrs["run_shown"]][:, shown]
    step, mean = 0.75 * np.ptp(runs), 1e6 * data.run_mean.values[shown]
    for i, run in enumerate(runs):
        axis.plot(time, run - i * step, color=MEASURED, lw=0.9)
        axis.annotate(
            f"{float(data.run_correlation[data.attrs['run_shown'], i]):.3f}", (-0.01, -i * step), ha="right", **BESIDE
        )
    below = -len(runs) * step
    axis.plot(time, mean + below, color="k", lw=1.1)
    axis.annotate("mean", (-0.01, below), ha="right", **BESIDE)
    if "run_trough_start" in data:
        bottom = below + mean.min() - 0.55 * step
        draw_passing(axis, data, "run_", (time[0], time[-1]), (bottom, 0.2 * step))
        axis.annotate("texture", (-0.01, bottom + 0.1 * step), ha="right", **BESIDE)
    draw_scale(axis, float(time[-1] + 0.01 * np.ptp(time)), 0.0, 0.5 * step)
    axis.set(xlabel="time [s]", xlim=(time[0], time[-1]), yticks=[])
    axis.spines["left"].set_visible(False)
    arc = f", {1e3 * data.attrs['run_arc']:.1f} mm from the skin" if "run_arc" in data.attrs else ""
    axis.set_title(f"D  One node{arc}: y in {len(runs)} runs over one texture")


def draw_correlations(axis: Axes, data: xr.Dataset) -> None:
    """Correlation of every run of every experiment, with its medians, beside the paper's mean and spread.

    Parameters
    ----------
    axis : Axes
        The panel.
    data : Dataset
        From ``compute``.
    """
    known = [name for name in SOURCES if name in data]
    for at, name in enumerate(known):
        experiments = np.sort(data[name].values, axis=1)
        for values, left in zip(experiments, np.linspace(-0.35, 0.35, len(experiments) + 1)[:-1], strict=True):
            place = at + left + np.linspace(0.1, 0.9, len(values)) * 0.7 / len(experiments)
            axis.plot(place.mean(), np.median(values), "s", color="w", mec="k", ms=6)
            axis.plot(place, values, SOURCES[name][2], color=SOURCES[name][1], ms=3)
    axis.errorbar(len(known), PAPER_MEAN, PAPER_SD, fmt="D", color=PAPER, capsize=3, ms=4)
    axis.axhline(1, color="0.7", lw=0.7, zorder=0)
    axis.set_xticks(range(len(known) + 1), [*(SOURCES[name][0] for name in known), "all\n(paper)"])
    axis.set(xlabel="with the mean of … runs", ylabel="correlation of one run", xlim=(-0.5, len(known) + 0.5))
    axis.set_title("E  Every run; squares: medians")
