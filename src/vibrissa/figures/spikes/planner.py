"""Trials that a unit needs, over its threshold and slope; and how its intervals narrow with the number of trials."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrissa.figures.canvas import add_caption, house_style, key_above, merged, new_figure
from vibrissa.figures.colours import TRUTH
from vibrissa.neural.coding.planner import Wanted, plan_trials
from vibrissa.quantities import dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from vibrissa.neural.coupling.threshold_linear import BinnedDrive
    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit

SLOPES = np.geomspace(0.02e6, 1e6, 21)  # [1/(s m)]
TRIALS = np.unique(np.round(np.geomspace(8, 400, 40)).astype(int))
SHOWN = {"threshold": (1e6, "µm"), "slope": (1e-6, "AP/s/µm"), "latency": (1e3, "ms")}


def compute(
    drive: BinnedDrive, unit: ThresholdLinearUnit, wanted: Wanted, *, gain_sd: float = 0.0, fano_factor: float = 1.0
) -> xr.Dataset:
    """Trials needed by units of other thresholds and slopes, and the intervals of one unit.

    Parameters
    ----------
    drive : BinnedDrive
        The stimulus.
    unit : ThresholdLinearUnit
        The unit whose baseline and latency all have.
    wanted : Wanted
        Half widths of the 95 % intervals.
    gain_sd : float
        Standard deviation of the gain from trial to trial.

    Returns
    -------
    Dataset
        ``trials_map`` (planned_slope, planned_threshold), NaN where no number will do; ``threshold_within``,
        ``slope_within``, ``latency_within`` of the unit.
    """
    least, most = drive.identifiable_range()
    thresholds = np.linspace(0.9 * least, 1.05 * most, 33)
    units = [replace(unit, threshold=float(a), slope=float(s)) for s in SLOPES for a in thresholds]
    plan = plan_trials(drive, units, wanted, gain_sd=gain_sd, fano_factor=fano_factor)
    own = plan_trials(drive, [unit], wanted, gain_sd=gain_sd, fano_factor=fano_factor, at=TRIALS.tolist())
    scales = SHOWN | {"slope": (100, "%")}
    asked = [f"{name} within {scales[name][0] * one:g} {scales[name][1]}" for name, one in vars(wanted).items() if one]
    caption = (
        f"A: trials until the 95 % interval is as narrow as wanted ({', '.join(asked)}), for units of baseline "
        f"{unit.baseline:g} Hz and latency {1e3 * unit.latency:g} ms under this stimulus; white: no number of trials "
        "will do, as the threshold lies where the envelope spends less than 5 % of its time. B to D: half of the "
        "intervals to be expected of the unit at the cross. Counts are assumed to be Poisson"
        f"{f', with a gain that varies by {100 * gain_sd:g} % from trial to trial' if gain_sd else ''}."
    )
    within: dict[str, Any] = {f"{name}_within": own[f"{name}_within"].values for name in SHOWN}
    attrs = {**own.attrs, "caption": caption, "threshold": unit.threshold, "slope": unit.slope}
    return dataset(
        attrs,
        planned_threshold=thresholds,
        planned_slope=SLOPES,
        trials_map=plan.trials_needed.values.reshape(SLOPES.size, -1),
        planned_trials=TRIALS,
        **within,
    )


@house_style
def draw(data: xr.Dataset) -> Figure:
    """Draw the map and the three intervals.

    Parameters
    ----------
    data : Dataset
        From :func:`compute`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    from matplotlib.colors import LogNorm

    figure, axes = new_figure(10.5, 6.2, 3, 2, width_ratios=[1.7, 1])
    left = figure.add_subplot(merged(axes[:, 0]))
    x, y = 1e6 * data.planned_threshold, 1e-6 * data.planned_slope
    look: dict[str, Any] = {"norm": LogNorm(8, 2000), "cmap": "viridis_r", "shading": "nearest", "rasterized": True}
    mesh = left.pcolormesh(x, y, data.trials_map, **look)
    lines = left.contour(x, y, data.trials_map, [20, 50, 100, 200, 500, 1000], colors="k", linewidths=0.6)
    left.clabel(lines, fontsize=7)
    left.plot(1e6 * data.attrs["threshold"], 1e-6 * data.attrs["slope"], "+", color="w", ms=12, mew=2)
    slopes = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0]
    left.set(xlabel="threshold [µm]", ylabel="slope [AP/s/µm]", yscale="log", title="A  Trials needed")
    left.set_yticks(slopes, [f"{one:g}" for one in slopes])
    left.minorticks_off()
    ticks = [10, 20, 50, 100, 200, 500, 1000, 2000]
    figure.colorbar(mesh, ax=left, extend="max", label="trials", ticks=ticks, format="%d")
    for letter, (name, (factor, unit)), axis in zip("BCD", SHOWN.items(), axes[:, 1], strict=True):
        axis.plot(data.planned_trials, factor * data[f"{name}_within"].isel(unit=0))
        if f"{name}_wanted" in data.attrs:
            line = data.attrs[f"{name}_wanted"] * (data.attrs["slope"] if name == "slope" else 1)
            axis.axhline(factor * line, color=TRUTH, label="wanted")
        axis.set(xscale="log", xlabel="trials", ylabel=f"± [{unit}]", ylim=(0, None))
        axis.set_title(f"{letter}  {name.capitalize()}")
        key_above(axis)
        axis.set_xticks([10, 20, 50, 100, 200, 400], ["10", "20", "50", "100", "200", "400"])
        axis.minorticks_off()
    return add_caption(figure, data)
