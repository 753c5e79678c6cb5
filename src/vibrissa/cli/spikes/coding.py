"""The verbs of what units code: demodulation, drives, information."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.recorded import (
    ALL_TRIALS,
    WHOLE,
    Band,
    PartOptions,
    RecordingOptions,
    SignalOptions,
    StimulusOptions,
    TrialOptions,
    Window,
    show_map,
)
from vibrissa.cli.shared.words.units import Duration
from vibrissa.errors import RangeError, ShapeError

if TYPE_CHECKING:
    import xarray as xr

MOST_OUTSIDE = 0.5  # share of the spikes outside of the window above which it is said
LATE = 10.0  # times the end of the window beyond which times are likely of another unit or clock
FAR = 100.0  # times its end, from which on they are refused if most are outside


def demodulation(
    *,
    recorded: RecordingOptions,
    shown: StimulusOptions,
    bin_width: Duration = 0.001,
    part: PartOptions = WHOLE,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Test whether each unit follows the envelope of the carrier, or its phase.

    Parameters
    ----------
    bin_width
        Width of the bins [s], a sixth of the carrier's period or less.
    """
    from vibrissa.neural.coding.demodulation import DemodulationAnalysis, demodulation

    how = DemodulationAnalysis(bin_width=bin_width, **vars(part))
    found = recorded.read_with(shown.words(), bin_width, part.band, part.window)
    with stage("units"):
        data = demodulation(found.spikes, found.stimulus, found.n_trials, how)
    tell(*found.remarks)
    drawing.draw("spikes.demodulation", {"demodulation": data})
    ends = [f"demodulation_index{end}" for end in ("", "_low", "_high")]
    more = ["envelope_modulation", "phase_modulation", "vector_strength", "demodulated", "reason", "phase_likeness"]
    output.show(data, columns=["unit_name", *ends, *more])


def drives(
    *,
    spikes: list[Path],
    stimulus: list[Path],
    trials: list[int] | None = None,
    cut: TrialOptions = ALL_TRIALS,
    whisker: str | None = None,
    signal_unit: str | None = None,
    bin_width: Duration = 0.01,
    skip: Duration = 0.5,
    smoothing: Duration = 0.03,
    band: Band | None = None,
    level: float = 0.05,
    latest: Duration = 0.03,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Find which feature of the motion each unit follows, from several stimuli of different carriers.

    Parameters
    ----------
    spikes
        A recording of each stimulus, in any format that `vibrissa neural` reads, with the same units; once for each.
    stimulus
        CSV with columns time,displacement, or what else `vibrissa neural` reads; in the same order.
    trials
        Presentations of each stimulus, in the same order; one number for all. Must be given with a CSV that does not
        list silent ones.
    whisker
        Channel of the stimuli that is taken.
    signal_unit
        Unit of the stimuli where their files state none.
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
    from vibrissa.study.neurons.trial_stimuli import each_trial

    how = DriveAnalysis(bin_width=bin_width, skip=skip, smoothing=smoothing, band=band, level=level, latest=latest)
    counts: list[int | None] = [None] if trials is None else [*trials]
    counts = counts * len(spikes) if len(counts) == 1 else counts
    if not len(spikes) == len(stimulus) == len(counts):
        often = f"{len(spikes)}, {len(stimulus)}, {len(counts)}"
        raise ShapeError("--spikes, --stimulus and --trials", "must be given equally often", often)
    signal = SignalOptions(signal_unit=signal_unit)
    parts: list[tuple[xr.Dataset, xr.Dataset, int]] = []
    remarks: list[str] = []
    for one, shown, count, own in zip(spikes, stimulus, counts, cut.each(len(spikes)), strict=True):
        words = StimulusOptions(stimulus=shown, whisker=whisker, signal=signal).words()
        found = RecordingOptions(spikes=one, trials=count, cut=own).read_with(words, bin_width, band, None, each=True)
        parts += each_trial(found.spikes, found.stimulus, found.n_trials)
        remarks += [f"{one.name}: {line}" for line in found.remarks]
    heard, stimuli, presented = (list(column) for column in zip(*parts, strict=True))
    with stage("units"):
        data = compare_drives(heard, stimuli, presented, how)
    tell(*remarks)
    drawing.draw("spikes.drives", data)
    names = ["drive_gain", "drive_loss", "drive_loss_low", "drive_loss_high"]
    show_map(data, names, ["best_drive", "reason", "carrier_frequency"], output)


def information(
    *,
    recorded: RecordingOptions,
    window: Window,
    bin_width: Duration = 0.01,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Estimate the information of each unit's spikes about the stimulus: of a spike, of a second, of a count.

    Parameters
    ----------
    window
        START STOP of the part of the stimulus that is analysed [s]; leave out the onset, where units adapt.
    bin_width
        Width of the bins [s], which must divide the window.
    """
    from vibrissa.neural.coding.information import unit_information
    from vibrissa.neural.coupling.response import bin_edges

    bin_edges(*window, bin_width)
    table, count, remarks = recorded.read(window, bin_width)
    unlikely = _unlikely(table, window)
    with stage("units"):
        data = unit_information(table, count, window=window, bin_width=bin_width)
    tell(*remarks)
    tell(*unlikely)
    drawing.draw("spikes.information", data)
    ends = [f"spike_information{end}" for end in ("", "_low", "_high", "_plain")]
    names = ["unit_name", "unit_rate", *ends, "information_rate", "count_information", "reason"]
    output.show(data, columns=names)


def _unlikely(spikes: xr.Dataset, window: Window) -> list[str]:
    """Remarks on spikes beyond the window."""
    (start, stop), time, lines = window, spikes.spike_time.values, []
    outside, end = int(((time < start) | (time >= stop)).sum()), stop if stop > 0 else -start
    if outside > MOST_OUTSIDE * time.size:
        far = float(time.max(initial=0.0))
        unit = "look like milliseconds or a session's clock"
        if far > FAR * end and 2 * outside > time.size:
            rule, found = f"must lie within the window, {start:g} to {stop:g} s", f"{outside} of {time.size} outside"
            right = "" if outside == time.size else "; if they are right, leave out those beyond the window"
            raise RangeError("spike_time", rule, found, f"times are in seconds; those up to {far:g} {unit}{right}")
        late = far > LATE * end
        unit = f"; times up to {far:g} {unit}" if late else ""
        lines.append(f"{outside} of {time.size} spikes are outside of the window of {start:g} to {stop:g} s{unit}")
        lines += ["if trials last so long, these times are right: the window alone is analysed"] * late
    return lines
