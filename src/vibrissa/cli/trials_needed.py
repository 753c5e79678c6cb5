"""The verb trials-needed: repeats until a unit's threshold, slope and latency are known as well as wanted."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from vibrissa.cli.options import Json, Out
from vibrissa.cli.pictures import Picture, refuse_picture, write_picture
from vibrissa.errors import InputError

Several = Annotated[list[float], Parameter(negative="")]
TABLE = ("threshold", "slope", "baseline", "spikes_per_trial", "trials_needed", "reason")


def trials_needed(
    *,
    stimulus: Path,
    threshold: Several,
    slope: Several,
    baseline: Several,
    latency: float = 0.012,
    threshold_within: float | None = None,
    slope_within: float | None = None,
    latency_within: float | None = None,
    gain_sd: float = 0.0,
    bin_width: float = 0.01,
    skip: float = 1.0,
    window: tuple[float, float] | None = None,
    band: tuple[float, float] | None = None,
    picture: Picture = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Repeats of a stimulus until threshold, slope and latency of a unit are known as well as wanted.

    With several thresholds, slopes or baselines, every combination is one unit.

    Parameters
    ----------
    stimulus
        CSV with columns time,displacement in seconds and metres: one presentation, as played (filtered).
    threshold
        Envelope above which the unit is expected to fire more [m]; once for each.
    slope
        Rise of the rate above it [1/(s m)]: 0.25 AP/s per µm is 2.5e5; once for each.
    baseline
        Rate below it [Hz]; once for each.
    latency
        Delay from envelope to rate [s].
    threshold_within
        Half of the 95 % interval wanted of the threshold [m].
    slope_within
        Half of the 95 % interval wanted of the slope, as a share of the slope.
    latency_within
        Half of the 95 % interval wanted of the latency [s].
    gain_sd
        Standard deviation of a gain, of mean 1, that multiplies all of a trial's rate.
    bin_width
        Width of the bins of the analysis [s].
    skip
        Time left out at the start [s].
    window
        START STOP of the part of the stimulus that is analysed [s].
    band
        LOW HIGH of the carrier whose envelope is taken [Hz].
    """
    from vibrissa.cli.output import refuse_out, show
    from vibrissa.neural.inputs import read_stimulus
    from vibrissa.neural.planner import Wanted, plan_trials
    from vibrissa.neural.presentation import Presentation
    from vibrissa.neural.virtual import HingeUnit

    _refuse_units(threshold, slope)
    wanted = Wanted(threshold=threshold_within, slope=slope_within, latency=latency_within)
    refuse_out(out)
    refuse_picture(picture)
    units = [
        HingeUnit(threshold=a, slope=s, baseline=b, latency=latency) for a, s, b in product(threshold, slope, baseline)
    ]
    shown = Presentation.of(read_stimulus(stimulus), bin_width=bin_width, skip=skip, window=window, band=band)
    data = plan_trials(shown.drive(), units, wanted, gain_sd=gain_sd)
    if picture is not None:
        from vibrissa.figures import planner as figure

        write_picture(figure.draw(figure.compute(shown.drive(), units[0], wanted, gain_sd=gain_sd)), picture)
    show(data, None if json else TABLE, json, out)


def _refuse_units(threshold: list[float], slope: list[float]) -> None:
    """Refuse thresholds that look like micrometres, and slopes that look like those per micrometre."""
    if max(threshold) > 0.01:
        raise InputError("--threshold", "must be at most 0.01 m", max(threshold), "42 µm is 42e-6")
    low = [one for one in slope if 0 < one < 100]
    if low:
        raise InputError("--slope", "must be 0, or at least 100 per s and m", low[0], "0.25 AP/s per µm is 2.5e5")
