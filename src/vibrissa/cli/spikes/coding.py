"""The verbs of what units code: demodulation, drives, information."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.cli.shared.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.progress import stage
from vibrissa.cli.shared.units import Duration
from vibrissa.cli.spikes.recorded import WHOLE, Band, PartOptions, RecordingOptions, Window, show_map, span

if TYPE_CHECKING:
    import xarray as xr


def demodulation(
    *,
    recorded: RecordingOptions,
    stimulus: Path,
    whisker: str | None = None,
    bin_width: Duration = 0.001,
    part: PartOptions = WHOLE,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Whether each unit follows the envelope of the carrier, or its phase.

    Parameters
    ----------
    stimulus
        CSV with columns time,displacement in seconds and metres: one presentation, as played. Or, with --whisker, the
        command that `vibrissa replay` wrote.
    whisker
        Whisker of that command whose motion is taken.
    bin_width
        Width of the bins [s], a sixth of the carrier's period or less.
    """
    from vibrissa.neural.coding.demodulation import DemodulationAnalysis, demodulation
    from vibrissa.study.neurons.neurons import one_stimulus

    how = DemodulationAnalysis(bin_width=bin_width, **vars(part))
    shown = one_stimulus(stimulus, whisker)
    table, count = recorded.read(span(shown))
    with stage("units"):
        data = demodulation(table, shown, count, how)
    drawing.draw("others.demodulation", {"demodulation": data})
    ends = [f"demodulation_index{end}" for end in ("", "_low", "_high")]
    more = ["envelope_modulation", "phase_modulation", "vector_strength", "demodulated", "reason", "phase_likeness"]
    output.show(data, columns=["unit_name", *ends, *more])


def drives(
    *,
    spikes: list[Path],
    stimulus: list[Path],
    trials: list[int],
    bin_width: Duration = 0.01,
    skip: Duration = 0.5,
    smoothing: Duration = 0.03,
    band: Band | None = None,
    level: float = 0.05,
    latest: Duration = 0.03,
    output: OutputOptions = PRINTED,
) -> None:
    """Drive of each unit: which feature of the motion it follows, from several stimuli of different carriers.

    Parameters
    ----------
    spikes
        CSV with columns unit,trial,spike_time; once for each stimulus, with the same units.
    stimulus
        CSV with columns time,displacement in seconds and metres; in the same order.
    trials
        Presentations of each stimulus, in the same order; one number for all.
    bin_width
        Width of the bins [s].
    skip
        Time left out at the start of every stimulus [s].
    smoothing
        Time constant of the smoothed envelope [s].
    band
        LOW HIGH of the carrier whose envelope is taken [Hz].
    level
        Largest p-value at which a drive is named.
    latest
        Longest latency searched [s], up to 0.03.
    """
    from vibrissa.neural.coding.drive_choice import DriveAnalysis, compare_drives
    from vibrissa.neural.io.tables.inputs import read_stimulus
    from vibrissa.neural.io.tables.spike_csv import read_spikes

    how = DriveAnalysis(bin_width=bin_width, skip=skip, smoothing=smoothing, band=band, level=level, latest=latest)
    counts = trials * len(spikes) if len(trials) == 1 else trials
    heard, shown = [read_spikes(one) for one in spikes], [read_stimulus(one) for one in stimulus]
    with stage("units"):
        data = compare_drives(heard, shown, counts, how)
    names = ["drive_gain", "drive_loss", "drive_loss_low", "drive_loss_high"]
    show_map(data, names, ["best_drive", "reason", "carrier_frequency"], output)


def information(
    *, recorded: RecordingOptions, window: Window, bin_width: Duration = 0.01, output: OutputOptions = PRINTED
) -> None:
    """Information of each unit's spikes about the stimulus, in bits: of a spike, of a second, of the count in a bin.

    Parameters
    ----------
    window
        START STOP of the part of the stimulus that is analysed [s]; leave out the onset, where units adapt.
    bin_width
        Width of the bins [s], which must divide the window.
    """
    from vibrissa.neural.coding.information import unit_information

    table, count = recorded.read(window)
    with stage("units"):
        data = unit_information(table, count, window=window, bin_width=bin_width)
    if line := _silent_end(table, window):
        tell(line)
    ends = [f"spike_information{end}" for end in ("", "_low", "_high", "_plain")]
    names = ["unit_name", "unit_rate", *ends, "information_rate", "count_information", "reason"]
    output.show(data, columns=names)


def _silent_end(spikes: xr.Dataset, window: Window) -> str:
    """Remark on a window whose end is silent: where the recording is shorter, silence counts as information."""
    start, stop = window
    last = float(spikes.spike_time.where(spikes.spike_time < stop).max())
    if stop - last < 0.1 * (stop - start):
        return ""
    return (
        f"no unit fires from {last:.4g} s to the end of the window, {stop:g} s: "
        "if the recording ended there the bits are wrong; end the window with it"
    )
