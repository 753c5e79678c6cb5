"""The verb trials-needed: repeats until a unit's threshold, slope and latency are known as well as wanted."""

from __future__ import annotations

from itertools import product

from vibrissa.cli.shared.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.progress import stage
from vibrissa.cli.shared.recorded import WHOLE, PartOptions, StimulusOptions
from vibrissa.cli.shared.refusals import in_options
from vibrissa.cli.shared.units import Duration, Length, Rate, Slope

TABLE = ("threshold", "slope", "baseline", "spikes_per_trial", "trials_needed", "reason")


def trials_needed(
    *,
    shown: StimulusOptions,
    threshold: list[Length],
    slope: list[Slope],
    baseline: list[Rate],
    latency: Duration = 0.012,
    threshold_within: Length | None = None,
    slope_within: float | None = None,
    latency_within: Duration | None = None,
    gain_sd: float = 0.0,
    bin_width: Duration = 0.01,
    part: PartOptions = WHOLE,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Repeats of a stimulus until threshold, slope and latency of a unit are known as well as wanted.

    With several thresholds, slopes or baselines, every combination is one unit.

    Parameters
    ----------
    threshold
        Envelope above which the unit is expected to fire more [m]; once for each.
    slope
        Rise of the rate above it [1/(s m)]: 0.25 AP/s per µm is 2.5e5; once for each.
    baseline
        Rate below the threshold [Hz]; once for each.
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
    """
    from vibrissa.neural.coding.planner import Wanted, plan_trials
    from vibrissa.neural.coupling.presentation import Presentation
    from vibrissa.neural.io.tables.stimuli import require_metres
    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
    from vibrissa.study.neurons.stimuli import read_stimulus
    from vibrissa.study.spec.given import StimulusInput

    wanted = Wanted(threshold=threshold_within, slope=slope_within, latency=latency_within)
    units = [
        ThresholdLinearUnit(threshold=a, slope=s, baseline=b, latency=latency)
        for a, s, b in product(threshold, slope, baseline)
    ]
    stimulus, remarks = read_stimulus(StimulusInput(**shown.words()), band=part.band)
    tell(*map(in_options, remarks))
    require_metres(stimulus, "the threshold")
    drive = Presentation.of(stimulus, bin_width=bin_width, **vars(part)).drive()
    with stage("trials of each unit"):
        data = plan_trials(drive, units, wanted, gain_sd=gain_sd)
    drawing.draw("others.planner", drive, units[0], wanted, gain_sd=gain_sd)
    output.show(data, columns=TABLE)
