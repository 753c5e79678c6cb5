"""The verbs of what whiskers do to units: surround and glm."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.recorded import MOTION, WHOLE, PartOptions, RecordingOptions, SignalOptions, show_map
from vibrissa.cli.shared.words.units import Duration
from vibrissa.errors import UnknownError

if TYPE_CHECKING:
    import xarray as xr

Command = Annotated[Path, Parameter(name=("--command", "--stimulus"))]


def surround(
    *,
    recorded: RecordingOptions,
    command: Command,
    signal: SignalOptions = MOTION,
    bin_width: Duration = 0.01,
    part: PartOptions = WHOLE,
    level: float = 0.05,
    unit: str | None = None,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Measure how much each whisker drives each unit, while all replay delayed copies of one texture.

    Parameters
    ----------
    command
        Command of `vibrissa replay`: the motion of all whiskers. Or a CSV with a column for each (time,C1_um,C2_um), or
        an NWB file. `--stimulus` is the same option.
    bin_width
        Width of the bins [s].
    level
        Largest p-value, adjusted over whiskers, at which a whisker drives or suppresses.
    unit
        Print and draw the map of this unit alone.
    """
    from vibrissa.neural.glm.surround import SurroundAnalysis, surround_map

    how = SurroundAnalysis(bin_width=bin_width, level=level, **vars(part))
    presented = {"stimulus": str(command), **vars(signal)}
    found = recorded.read_with(presented, bin_width, part.band, part.window, channels=True)
    with stage("weights of the whiskers"):
        data = surround_map(_alone(found.spikes, unit), found.stimulus, found.n_trials, how)
    tell(*found.remarks)
    drawing.draw("spikes.surround", {"surround": data})
    names = ["surround_weight", "surround_weight_low", "surround_weight_high", "surround_verdict"]
    said = ["driving_whiskers", "suppressing_whiskers"]
    show_map(data, names, [*said, "threshold", "latency", "n_blocks", "reason", "condition_number"], output)


def glm(
    *,
    recorded: RecordingOptions,
    command: Command,
    signal: SignalOptions = MOTION,
    bin_width: Duration = 0.005,
    part: PartOptions = WHOLE,
    reach: Duration = 0.04,
    past: Duration = 0.1,
    penalty: float = 10.0,
    choose_penalty: bool = False,
    level: float = 0.05,
    unit: str | None = None,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Fit a Poisson model to each unit: every whisker at every latency, and the unit's own past.

    Parameters
    ----------
    command
        Command of `vibrissa replay`: the motion of all whiskers. Or a CSV with a column for each (time,C1_um,C2_um), or
        an NWB file. `--stimulus` is the same option.
    bin_width
        Width of the bins [s].
    reach
        Longest latency of a whisker's kernel [s].
    past
        Longest lag of the unit's own past [s]; 0 leaves it out.
    penalty
        Penalty on the squared coefficients of the whiskers.
    choose_penalty
        Choose the penalty that predicts unseen trials best; intervals of strong kernels are then too narrow.
    level
        Largest p-value, adjusted over whiskers, at which a whisker matters.
    unit
        Print and draw this unit alone.
    """
    from vibrissa.neural.glm.kernel_columns import KernelAnalysis
    from vibrissa.neural.glm.poisson_model import whisker_kernels

    how = KernelAnalysis(
        bin_width=bin_width,
        **vars(part),
        reach=reach,
        past=past,
        penalty=None if choose_penalty else penalty,
        level=level,
    )
    presented = {"stimulus": str(command), **vars(signal)}
    found = recorded.read_with(presented, bin_width, part.band, part.window, channels=True)
    with stage("models of the units"):
        data = whisker_kernels(_alone(found.spikes, unit), found.stimulus, found.n_trials, how)
    tell(*found.remarks)
    drawing.draw("spikes.kernels", data)
    names = ["whisker_effect", "whisker_effect_low", "whisker_effect_high", "whisker_p_value", "whisker_matters"]
    show_map(
        data,
        names,
        [
            "whiskers_that_matter",
            "kernel_rate",
            "trial_gain_sd",
            "deviance_explained",
            "kernel_gain",
            "n_blocks",
            "penalty",
            "reason",
            "kernel_condition",
        ],
        output,
    )


def _alone(spikes: xr.Dataset, name: str | None) -> xr.Dataset:
    """Spikes of one unit alone, so that no other is fitted; of all where none is named."""
    from vibrissa.neural.io.tables.spikes import of_units

    if name is None:
        return spikes
    names = [str(one) for one in spikes.unit_name.values]
    if name not in names:
        raise UnknownError("--unit", f"must be one of {', '.join(names)}", repr(name))
    return of_units(spikes, [names.index(name)])
