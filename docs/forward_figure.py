"""From a texture to spikes and back: what drives the units, how one answers, what the analysis finds of them all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import add_caption, house_style, new_figure
from vibrissa.figures.colours import ENVELOPE, FITTED, MEASURED, OF_QUALITY, PREDICTED, TRUTH
from vibrissa.neural.coupling.response import psth
from vibrissa.neural.io.tables.spikes import of_unit
from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
from vibrissa.quantities import dataset, require

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BIN, SHOWN = 0.01, (1.0, 1.6)  # [s] width of the bins, and the stretch that is drawn
HINGE = ("threshold", "slope", "latency", "baseline")


def compute(spikes: xr.Dataset, found: xr.Dataset, *, shown: tuple[float, float] = SHOWN) -> xr.Dataset:
    """One unit over a stretch of the scan, and all units' thresholds and slopes, put in and found.

    Parameters
    ----------
    spikes : Dataset
        From :func:`vibrissa.study.forward.forward.forward`.
    found : Dataset
        From :func:`vibrissa.neural.coupling.analysis.analyse_units`, of the same units in any order.
    shown : (start, stop)
        The stretch [s].

    Returns
    -------
    Dataset
        ``time``, ``point_displacement``, ``point_envelope``; ``spike_time``, ``spike_trial``, ``firing_rate`` and
        ``expected_rate`` (bin) of the unit named in the attribute ``unit``, the steepest of those whose fit is
        identified; truth and fits of all; attribute ``held``: share of the true values within their intervals.
    """
    require(spikes, "point_envelope", "spike_time", "true_threshold")
    require(found, "threshold", "identified")
    listed = found.unit_name.values.tolist()  # a CSV of the spikes gives its units in the order of their names
    found = found.isel(unit=[listed.index(name) for name in spikes.unit_name.values.tolist()])
    sure = found.identified.values & found.significant.values
    k = int(np.argmax(np.where(sure, spikes.true_slope.values, -1)))
    own, (start, stop) = of_unit(spikes, str(spikes.unit_name.values[k])), shown
    seen = (spikes.time.values >= start) & (spikes.time.values < stop)
    fired = (own.spike_time.values >= start) & (own.spike_time.values < stop)
    edges = np.arange(start, stop + BIN / 2, BIN)
    inside = [_inside(spikes, found, name)[sure] for name in HINGE]
    columns: dict[str, Any] = {f"true_{name}": spikes[f"true_{name}"].values for name in HINGE}
    columns |= {f"{name}{end}": found[f"{name}{end}"].values for name in HINGE for end in ("", "_low", "_high")}
    data = dataset(
        {
            "unit": str(spikes.unit_name.values[k]),
            "unit_threshold": float(spikes.true_threshold[k]),
            "n_trials": int(spikes.attrs["n_trials"]),
            "distance": float(spikes.attrs["distance"]),
            "motion_scale": float(spikes.attrs["motion_scale"]),
            "held": float(np.mean(inside)) if sure.any() else np.nan,
        },
        time=spikes.time.values[seen],
        point_displacement=spikes.point_displacement.values[seen],
        point_envelope=spikes.point_envelope.values[seen],
        spike_time=own.spike_time.values[fired],
        spike_trial=own.spike_trial.values[fired],
        bin=edges[:-1],
        firing_rate=psth(own, edges, n_trials=spikes.attrs["n_trials"]).firing_rate.values.squeeze(),
        expected_rate=_expected(spikes, k, edges),
        identified=sure,
        **columns,
    )
    return data.assign_attrs(caption=_caption(data))


def _inside(spikes: xr.Dataset, found: xr.Dataset, name: str) -> np.ndarray:
    true = spikes[f"true_{name}"].values
    return np.asarray((found[f"{name}_low"].values <= true) & (true <= found[f"{name}_high"].values))


def _expected(spikes: xr.Dataset, k: int, edges: np.ndarray) -> np.ndarray:
    """Mean over each bin of the rate the unit was given [Hz]."""
    unit = ThresholdLinearUnit(**{name: float(spikes[f"true_{name}"][k]) for name in HINGE})
    fine = edges[0] + np.arange(20 * (len(edges) - 1)) * BIN / 20 + BIN / 40
    when = spikes.time.values
    rate = np.interp(fine, when, unit.rate(when, spikes.point_envelope.values))
    return np.asarray(rate.reshape(-1, 20).mean(axis=1))


def _caption(data: xr.Dataset) -> str:
    """Caption, with the figure's own numbers."""
    attrs, sure = data.attrs, int(data.identified.sum())
    scaled = f", scaled by {attrs['motion_scale']:.1f}" if attrs["motion_scale"] != 1 else ""
    return (
        f"A texture scanned {attrs['n_trials']} times. A: predicted motion {1e3 * attrs['distance']:g} mm from the base"
        f"{scaled}, its envelope, and the threshold of unit {attrs['unit']}. B, C: its spikes, and its rate in bins of "
        f"{1e3 * BIN:g} ms beside the rate it was given. D, E: thresholds and slopes put in and found, with 95 % "
        f"intervals, of the {sure} of {data.sizes['unit']} units whose fit is identified; over threshold, slope, "
        f"latency and baseline, {100 * attrs['held']:.0f} % of the intervals hold the truth."
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Motion, raster and rate of one unit over time; on the right, what was put in and what was found."""
    figure, axes = new_figure(9.6, 5.8, 3, 2, width_ratios=[2, 1])
    for axis in axes[:, 1]:
        axis.remove()
    motion, raster, rate = axes[:, 0]
    motion.plot(data.time, 1e6 * data.point_displacement, color=PREDICTED, lw=0.6, label="displacement")
    motion.plot(data.time, 1e6 * data.point_envelope, color=ENVELOPE, label="envelope")
    motion.axhline(1e6 * data.attrs["unit_threshold"], color=FITTED, ls="--", label="threshold")
    motion.set(ylabel="[µm]", title="A  Motion near the base")
    motion.margins(y=0.25)
    motion.legend(loc="upper right", ncols=3)
    ink = OF_QUALITY[str(data.attrs["unit"])[:2]]
    raster.plot(data.spike_time, data.spike_trial, "|", color=ink, ms=1.5, mew=0.5)
    raster.set(ylabel="trial", title=f"B  Spikes of unit {data.attrs['unit']}")
    width = float(data.bin[1] - data.bin[0])
    rate.stairs(data.firing_rate, [*data.bin.values, float(data.bin[-1]) + width], color=ink, label="found")
    rate.plot(data.bin + width / 2, data.expected_rate, "o", ms=3, color=TRUTH, label="given", zorder=0)
    highest = 1.3 * float(max(data.firing_rate.max(), data.expected_rate.max()))
    rate.set(xlabel="time [s]", ylabel="rate [Hz]", ylim=(0, highest), title="C  Rate, mean over trials")
    rate.legend(loc="upper right", ncols=2)
    for axis in (raster, rate):
        axis.sharex(motion)
    for axis in (motion, raster):
        axis.tick_params(labelbottom=False)
    motion.set_xlim(float(data.time[0]), float(data.time[-1]))
    right = axes[0, 1].get_gridspec()[:, 1].subgridspec(2, 1)
    _draw_against(figure.add_subplot(right[0]), data, "threshold", 1e6, "D  Threshold [µm]")
    slopes = figure.add_subplot(right[1])
    slopes.set(xscale="log", yscale="log")
    _draw_against(slopes, data, "slope", 1e-6, "E  Slope [AP/s/µm]")
    return add_caption(figure, data)


def _draw_against(axis: Axes, data: xr.Dataset, name: str, scale: float, title: str) -> None:
    """What was found against what was put in, of the units whose fit is identified."""
    sure = data.identified.values
    true, value, low, high = (
        scale * data[one].values[sure] for one in (f"true_{name}", name, f"{name}_low", f"{name}_high")
    )
    ends = np.array([true.min(), true.max()]) if sure.any() else np.array([0.0, 1.0])
    axis.plot(ends, ends, color=TRUTH, lw=3)
    axis.errorbar(true, value, [value - low, high - value], fmt="o", ms=3, lw=0.8, color=MEASURED)
    axis.set(xlabel="put in", ylabel="found", title=title)
