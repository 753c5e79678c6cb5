"""Kinematics in time: angle with set point and amplitude, phase, bending and touches of up to four whiskers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.arrays import Array
from vibrissa.figures.canvas import add_caption, house_style, key_above, new_figure
from vibrissa.figures.colours import FITTED, LAND, MEASURED

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 4  # whiskers
BEYOND = 0.5, 99.5  # percentiles of the values, beyond which they may lie outside of the axis
ROOM = 0.15  # of that range, at either end
ANGLE, CYCLE, TOUCH = MEASURED, FITTED, LAND


def compute(kinematics: xr.Dataset) -> xr.Dataset:
    """The whiskers that are shown, with a caption.

    Parameters
    ----------
    kinematics : Dataset
        From :func:`vibrissa.measures.kinematics.kinematics_of`.

    Returns
    -------
    Dataset
        Up to four whiskers, those that touch and then those measured in most frames, in their order; with the
        attributes ``caption`` and ``shown``, which says in the picture how they were chosen, empty where all are shown.
    """
    frames = np.isfinite(kinematics.whisker_angle.values).sum(axis=1)
    touching = kinematics.touching.values == 1 if "touching" in kinematics else np.zeros((len(frames), 1), bool)
    shown = np.sort(np.lexsort((-frames, ~touching.any(axis=1)))[:SHOWN])
    low, high = kinematics.attrs["whisking_band"]
    touches = (
        f"Grey: touches, the whisker within {1e3 * kinematics.attrs['touch_distance']:.2g} mm of the object, or bent."
        if "touching" in kinematics
        else "No touches were sought."
    )
    chosen = f"{shown.size} of {len(frames)} whiskers, first those that touch, then those seen in most frames"
    caption = (
        f"{chosen}. Top: angle at the base to {_line(kinematics.attrs['face_from'])} (0° caudal, 180° rostral; blue), "
        f"set point (orange) and amplitude (band) of whisking. Middle: phase, 0 at the most protracted (band {low:g}–"
        f"{high:g} Hz). Bottom: change Δκ of the curvature at the base against the free whisker. {touches} Gaps: not "
        "seen. The axes of angle and Δκ hold 99 % of the values or more; single frames may lie beyond."
    )
    said = chosen if shown.size < len(frames) else ""
    return kinematics.isel(whisker=shown).assign_attrs(caption=caption, shown=said)


def _line(origin: str) -> str:
    return "the line of the face through two points given" if origin == "two points" else origin


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw a column of three panels for each whisker.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    count = data.sizes["whisker"]
    figure, axes = new_figure(max(8.0, 4.2 * count), 6.6, 3, count, sharex=True, sharey="row")
    for k in range(count):
        one = data.isel(whisker=k)
        _angle(axes[0, k], one)
        axes[1, k].plot(one.time, np.degrees(one.whisking_phase), ".", color=CYCLE, ms=2)
        if not np.isfinite(one.whisking_phase).any():
            axes[1, k].text(0.5, 0.5, "no phase", transform=axes[1, k].transAxes, ha="center", va="center", color="0.4")
        axes[1, k].set(ylim=(-195, 195), yticks=[-180, 0, 180])
        axes[2, k].axhline(0, color="0.8", lw=0.8, zorder=0)
        axes[2, k].plot(one.time, one.curvature_change / 1e3, color=ANGLE, lw=0.8)
        for axis in axes[:, k]:
            _touches(axis, one)
        axes[0, k].set_title(f"whisker {one.whisker.item()}, label {one.whisker_label.item()}")
        axes[2, k].set_xlabel("time [s]")
    for k, values in ((0, np.degrees(data.whisker_angle.values)), (2, data.curvature_change.values / 1e3)):
        _hold_most(axes[k, 0], values)
    key_above(axes[0, 0])
    if data.attrs["shown"]:
        figure.supxlabel(data.attrs["shown"], fontsize="medium")
    for axis, label in zip(axes[:, 0], ("angle [°]", "phase [°]", "Δκ [1/mm]"), strict=True):
        axis.set_ylabel(label)
    return add_caption(figure, data)


def _angle(axis: Axes, one: xr.Dataset) -> None:
    middle, half = np.degrees(one.set_point), np.degrees(one.whisking_amplitude)
    axis.fill_between(one.time, middle - half, middle + half, color=CYCLE, alpha=0.25, lw=0, label="± amplitude")
    axis.plot(one.time, middle, color=CYCLE, lw=1.2, label="set point")
    axis.plot(one.time, np.degrees(one.whisker_angle), color=ANGLE, lw=0.8, label="angle")


def _hold_most(axis: Axes, values: Array) -> None:
    """Choose an axis by nearly all values, so that a few wrong frames do not flatten the others."""
    seen = values[np.isfinite(values)]
    if seen.size:
        low, high = np.percentile(seen, BEYOND)
        room = ROOM * (high - low) or ROOM
        axis.set_ylim(low - room, high + room)


def _touches(axis: Axes, one: xr.Dataset) -> None:
    """Shade the touches of the whisker."""
    if "touch_whisker" not in one:
        return
    mine = one.isel(touch=np.flatnonzero(one.touch_whisker.values == one.whisker_label.item()))
    look: dict[str, Any] = {"color": TOUCH, "alpha": 0.3, "lw": 0, "zorder": 0}
    for onset, length in zip(mine.touch_onset.values, mine.touch_duration.values, strict=True):
        axis.axvspan(onset, onset + length, **look)
