"""Figure 3: a frame with its tracked centrelines, and the motion of single nodes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.figures.canvas import house_style, new_figure
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SHOWN = 0.5  # [s] of motion
NODES = 5


def compute(study: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """First frame, centrelines in it [pixels], and y of a few nodes about their mean.

    Parameters
    ----------
    study : mapping
        ``still`` and ``profile``.

    Returns
    -------
    Dataset
        ``image`` (row, column); ``line_column``, ``line_row`` (whisker, node) [pixels]; ``node_motion`` (time, trace)
        of the first whisker, about its mean, ``trace_arc`` (trace) [m].
    """
    still, profile = study["still"], study["profile"]
    pixel = profile.attrs["pixel_size"]
    first = profile.isel(whisker=0)
    y = np.where(np.isfinite(first.y_sd.values), first.y.values, np.nan)
    seen = np.flatnonzero(np.isfinite(y).mean(axis=0) > 0.5)
    chosen = seen[np.linspace(0.1 * len(seen), 0.9 * len(seen), NODES).astype(int)] if len(seen) else seen
    shown = slice(0, int(np.searchsorted(profile.time.values - profile.time.values[0], SHOWN)))
    motion = y[:, chosen] - np.nanmean(y[:, chosen], axis=0)
    numbers = [f"whisker {i}" for i in range(profile.sizes["whisker"])]
    return dataset(
        {"names": json.dumps(json.loads(profile.attrs.get("names", "[]")) or numbers)},
        lead=("whisker",),
        whisker=profile.whisker.values,
        row=still.row.values,
        column=still.column.values,
        image=still.image.values,
        line_column=profile.x.values[:, 0] / pixel,
        line_row=profile.y.values[:, 0] / pixel,
        time=profile.time.values[shown],
        node_motion=motion[shown],
        trace_arc=first.arc_length.values[chosen],
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Frame above, node motion below, traces one above the other from the skin (bottom) to the tip (top)."""
    figure, axes = new_figure(7.2, 5.4, 2, 1, height_ratios=[1.1, 1])
    picture, traces = axes[:, 0]
    picture.imshow(data.image, vmin=0, aspect="equal")
    names = json.loads(data.attrs["names"])
    for i, name in enumerate(names):
        label = name if np.isfinite(data.line_row[i]).any() else f"{name} (not seen in this frame)"
        picture.plot(data.line_column[i], data.line_row[i], ":", color=f"C{(i + 1) % 6}", lw=1.6, label=label)
    picture.set(xlabel="column [pixel]", ylabel="row [pixel]", title="First frame and its centrelines")
    picture.legend(loc="upper right", labelcolor="0.1", framealpha=0.7, frameon=True)
    motion = 1e6 * data.node_motion.values
    step = 1.2 * np.nanmax(np.ptp(np.nan_to_num(motion), axis=0), initial=1.0)
    for i, arc in enumerate(data.trace_arc.values):
        traces.plot(data.time, motion[:, i] + i * step, label=f"{1e3 * arc:.1f}")
    traces.set(
        xlabel="time [s]", ylabel="y about its mean, down [µm]", title=f"Motion of single nodes (shifted), {names[0]}"
    )
    traces.legend(title="arc length [mm]", loc="center left", bbox_to_anchor=(1, 0.5), reverse=True)
    return figure
