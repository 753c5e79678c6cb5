"""The verb trials-needed: repeats until a unit's threshold, slope and latency are known as well as wanted."""

from __future__ import annotations

from itertools import product
from pathlib import Path

from vibrissa.cli.shared.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.progress import stage
from vibrissa.cli.shared.recorded import WHOLE, PartOptions, StimulusOptions
from vibrissa.cli.shared.refusals import in_options
from vibrissa.cli.shared.units import Duration, Length, Rate, Slope
from vibrissa.errors import ConflictError, MissingError

TABLE = ("threshold", "slope", "baseline", "fano_factor", "spikes_per_trial", "trials_needed", "reason")


def trials_needed(
    *,
    shown: StimulusOptions,
    threshold: list[Length] | None = None,
    slope: list[Slope] | None = None,
    baseline: list[Rate] | None = None,
    fitted_units: Path | None = None,
    latency: Duration = 0.012,
    threshold_within: Length | None = None,
    slope_within: float | None = None,
    latency_within: Duration | None = None,
    gain_sd: float = 0.0,
    fano_factor: float = 1.0,
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
    fitted_units
        Table that `vibrissa neural --out` wrote, in place of the three: its fitted units, each with its own variability
        from trial to trial.
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
    fano_factor
        Variance over mean of the counts of a bin from trial to trial; 1 for Poisson counts.
    bin_width
        Width of the bins of the analysis [s].
    """
    import numpy as np

    from vibrissa.files import load
    from vibrissa.neural.coding.planner import Wanted, expected_of, plan_trials
    from vibrissa.neural.coupling.presentation import Presentation
    from vibrissa.neural.io.tables.stimuli import require_metres
    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit
    from vibrissa.study.neurons.stimuli import read_stimulus
    from vibrissa.study.spec.given import StimulusInput

    wanted = Wanted(threshold=threshold_within, slope=slope_within, latency=latency_within)
    if fitted_units is not None:
        _refuse_both(threshold, slope, baseline)
        expected, gains, fanos = expected_of(load(fitted_units))
    elif threshold and slope and baseline:
        expected = [
            ThresholdLinearUnit(threshold=a, slope=s, baseline=b, latency=latency)
            for a, s, b in product(threshold, slope, baseline)
        ]
        gains, fanos = np.full(len(expected), gain_sd), np.full(len(expected), fano_factor)
    else:
        raise MissingError("units", "must be given by --threshold, --slope and --baseline, or by --fitted-units")
    stimulus, remarks = read_stimulus(StimulusInput(**shown.words()), band=part.band)
    tell(*map(in_options, remarks))
    require_metres(stimulus, "the threshold")
    drive = Presentation.of(stimulus, bin_width=bin_width, **vars(part)).drive()
    with stage("trials of each unit"):
        data = plan_trials(drive, expected, wanted, gain_sd=gains, fano_factor=fanos)
    own = {"gain_sd": float(data.trial_gain_sd[0]), "fano_factor": float(data.fano_factor[0])}
    drawing.draw("spikes.planner", drive, expected[0], wanted, **own)
    output.show(data, columns=TABLE)


def _refuse_both(*given: object) -> None:
    """Refuse units that are described beside a table of them."""
    if any(given):
        raise ConflictError("--fitted-units", "must not be given with --threshold, --slope or --baseline")
