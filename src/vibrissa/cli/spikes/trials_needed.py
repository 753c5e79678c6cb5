"""The verb trials-needed: repeats until a unit's threshold, slope and latency are known as well as wanted."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.recorded import WHOLE, PartOptions, StimulusOptions
from vibrissa.cli.shared.words.levels import LevelOption, RiseOption
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Duration, Rate
from vibrissa.errors import ConflictError, MissingError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit

TABLE = ("threshold", "slope", "baseline", "fano_factor", "spikes_per_trial", "trials_needed", "reason")


def trials_needed(
    *,
    shown: StimulusOptions,
    threshold: list[LevelOption] | None = None,
    slope: list[RiseOption] | None = None,
    baseline: list[Rate] | None = None,
    fitted_units: Path | None = None,
    latency: Duration | None = None,
    threshold_within: LevelOption | None = None,
    slope_within: float | None = None,
    latency_within: Duration | None = None,
    gain_sd: float | None = None,
    fano_factor: float | None = None,
    bin_width: Duration = 0.01,
    part: PartOptions = WHOLE,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Plan the repeats of a stimulus until threshold, slope and latency of a unit are known well enough.

    With several thresholds, slopes or baselines, every combination is one unit.

    Parameters
    ----------
    threshold
        Envelope above which the unit's rate rises, in the unit of the stimulus: 42um, 16dB, 0.1au; once for
        each.
    slope
        Rise of the rate above it, per unit of the stimulus: 0.25/s/um, 25/s/dB; once for each.
    baseline
        Rate below the threshold [Hz]; once for each.
    fitted_units
        Table that `vibrissa neural --out` wrote, in place of the three: its fitted units, each with its own latency and
        variability from trial to trial.
    latency
        Delay from envelope to rate [s]; 12 ms by default.
    threshold_within
        Largest half of the threshold's 95 % interval, in the unit of the stimulus.
    slope_within
        Largest half of the slope's 95 % interval, as a share of the slope.
    latency_within
        Largest half of the latency's 95 % interval [s].
    gain_sd
        Standard deviation of a gain, of mean 1, that multiplies all of a trial's rate; 0 by default.
    fano_factor
        Variance over mean of the counts of a bin from trial to trial; by default 1, as of Poisson counts.
    bin_width
        Width of the bins of the analysis [s].
    """
    import numpy as np

    from vibrissa.netcdf import load
    from vibrissa.neural.coding.planner import Wanted, expected_of, plan_trials
    from vibrissa.neural.coupling.presentation import Presentation
    from vibrissa.neural.io.tables.stimuli import in_unit_of, presented, require_metres
    from vibrissa.study.neurons.stimuli import read_stimulus
    from vibrissa.study.spec.given import StimulusInput

    described = {"--threshold": threshold, "--slope": slope, "--baseline": baseline}
    more = {"--latency": latency, "--gain-sd": gain_sd, "--fano-factor": fano_factor}
    _refuse_units(fitted_units, described, more)
    stimulus, remarks = read_stimulus(StimulusInput(**shown.words()), band=part.band)
    tell(*map(in_options, remarks))
    unit = presented(stimulus).unit
    within = None if threshold_within is None else threshold_within.of(unit, "--threshold-within")
    wanted = Wanted(threshold=within, slope=slope_within, latency=latency_within)
    if fitted_units is not None:
        table = _in_unit(load(fitted_units), unit)
        expected, gains, fanos, names = expected_of(table)
        tell(*_unidentified(table, names))
    else:
        names, expected = [], _combined(threshold or (), slope or (), baseline or (), latency, unit)
        gains = np.full(len(expected), 0.0 if gain_sd is None else gain_sd)
        fanos = np.full(len(expected), 1.0 if fano_factor is None else fano_factor)
    if drawing.picture is not None:
        require_metres(stimulus, "the threshold in the picture")
    drive = Presentation.of(stimulus, bin_width=bin_width, **vars(part)).drive()
    with stage("trials of each unit"):
        data = plan_trials(drive, expected, wanted, gain_sd=gains, fano_factor=fanos, unit=unit)
    own = {"gain_sd": float(data.trial_gain_sd[0]), "fano_factor": float(data.fano_factor[0])}
    drawing.draw("spikes.planner", drive, expected[0], wanted, **own)
    if names:
        data = data.assign(unit_name=("unit", names))
    output.show(in_unit_of(data, stimulus), columns=(*(["unit_name"] if names else []), *TABLE))


def _in_unit(units: xr.Dataset, unit: str) -> xr.Dataset:
    """A table of units without its labels, in the stimulus' unit; one in another unit is refused."""
    if (own := str(units.attrs.get("stimulus_unit", "m"))) != unit:
        raise ConflictError("--fitted-units", f"must have thresholds in {unit}, as the stimulus is", own)
    return units.map(lambda one: one, keep_attrs=False)


def _unidentified(units: xr.Dataset, planned: list[str]) -> list[str]:
    """Remark on units whose fit is taken though the recording does not determine it."""
    if "identified" not in units:
        return []
    names = zip(units.unit_name.values.tolist(), units.identified.values.tolist(), strict=True)
    found = [name for name, identified in names if identified != 1 and name in planned]
    if not found:
        return []
    return [f"{', '.join(found)}: not identified by the recording; its fit, and so the plan, may be far off"]


def _combined(
    threshold: Sequence[LevelOption],
    slope: Sequence[RiseOption],
    baseline: Sequence[float],
    latency: float | None,
    unit: str,
) -> list[ThresholdLinearUnit]:
    """A unit for every combination, in the unit of the stimulus."""
    from vibrissa.neural.simulated.virtual import ThresholdLinearUnit

    of = [one.of(unit, "--threshold") for one in threshold], [one.of(unit, "--slope") for one in slope], baseline
    delay: dict[str, Any] = {} if latency is None else {"latency": latency}
    return [ThresholdLinearUnit(threshold=a, slope=s, baseline=b, **delay) for a, s, b in product(*of)]


def _refuse_units(table: Path | None, described: dict[str, Any], more: dict[str, Any]) -> None:
    """Refuse units that are described beside a table of them, or not described in full."""
    given = [option for option, one in (described | more).items() if one is not None and one != []]
    if table is not None and given:
        remedy = "the table has threshold, slope, baseline, latency and variability of each unit"
        raise ConflictError("--fitted-units", f"must not be given with {', '.join(given)}", remedy=remedy)
    if table is None and not set(described) <= set(given):
        raise MissingError("units", "must be given by --threshold, --slope and --baseline, or by --fitted-units")
