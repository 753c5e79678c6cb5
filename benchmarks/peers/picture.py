"""Motions of the peers over ours, a panel for each case."""

from __future__ import annotations

import numpy as np
from case import Case

from vibrissa.figures.canvas import house_style, new_figure

MICRONS = 1e6 * Case(base_angle=0.3).whisker.length
SHOWN = (
    "MuJoCo: gap 0.30 mm, 0.3 rad, all; κ₁ on the flat",
    "MuJoCo: ridge, gap 0.30 mm, 0.3 rad",
    "MuJoCo: ridge, gap 0.15 mm, 1.2 rad",
    "MuJoCo: pluck, on an edge, 1.2 rad",
    "MuJoCo: six gaps of 0.30 mm, lands of 0.05 mm, 0.3 rad",
    "MuJoCo: full length, gap 0.60 mm, 0.3 rad, all; κ₁ on the flat",
)
LONGEST = 45e-3  # [s]


@house_style
def draw(trials):
    """Six panels: first mode against time since the jump or the release."""
    figure, axes = new_figure(7.5, 6.5, 3, 2)
    for axis, name in zip(np.ravel(axes), SHOWN, strict=True):
        trial = next(trial for trial in trials if trial.name.startswith(name))
        here = trial.time < LONGEST
        axis.plot(
            1e3 * trial.time[here], MICRONS * trial.theirs[here], color="#D55E00", lw=2.2, label=name.split(":")[0]
        )
        axis.plot(1e3 * trial.time[here], MICRONS * trial.ours[here], "k--", lw=1.0, label="prediction")
        axis.set(title=name.split(": ")[1].split(", all")[0], xlabel="time since the jump [ms]", ylabel="mode 1 [µm]")
        axis.legend(fontsize=7)
        if "pluck" in name:
            axis.set_xlabel("time since the release [ms]")
    return figure
