"""The verbs of what units code: demodulation, drives, information."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.cli.options import Json, Out
from vibrissa.cli.pictures import Picture, refuse_picture, write_picture
from vibrissa.cli.recorded import Recorded, Window, span, tell, tell_map

if TYPE_CHECKING:
    import xarray as xr


def demodulation(
    *,
    recorded: Recorded,
    stimulus: Path,
    whisker: str | None = None,
    bin_width: float = 0.001,
    skip: float = 1.0,
    window: Window | None = None,
    band: Window | None = None,
    picture: Picture = None,
    out: Out = None,
    json: Json = False,
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
    skip
        Time left out at the start, while units adapt [s].
    window
        START STOP of the part of the stimulus that is analysed [s].
    band
        LOW HIGH of the carrier [Hz]; needed where slower motion runs along with it.
    """
    from vibrissa.cli.neural import one_stimulus
    from vibrissa.cli.output import refuse_out
    from vibrissa.neural.demodulation import DemodulationAnalysis, demodulation

    how = DemodulationAnalysis(bin_width=bin_width, skip=skip, window=window, band=band)
    refuse_out(out)
    refuse_picture(picture)
    shown = one_stimulus(stimulus, whisker)
    table, count = recorded.read(span(shown))
    data = demodulation(table, shown, count, how)
    if picture is not None:
        from vibrissa.figures import demodulation as figure

        write_picture(figure.draw(figure.compute({"demodulation": data})), picture)
    ends = [f"demodulation_index{end}" for end in ("", "_low", "_high")]
    more = ["envelope_modulation", "phase_modulation", "vector_strength", "demodulated", "reason", "phase_likeness"]
    tell(data, ["unit_name", *ends, *more], json, out)


def drives(
    *,
    spikes: list[Path],
    stimulus: list[Path],
    trials: list[int],
    bin_width: float = 0.01,
    skip: float = 0.5,
    smoothing: float = 0.03,
    band: Window | None = None,
    level: float = 0.05,
    latest: float = 0.03,
    out: Out = None,
    json: Json = False,
) -> None:
    """What of the motion each unit follows, told from several stimuli of different carriers.

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
        Chance that a wrong drive is named.
    latest
        Longest latency searched [s], up to 0.03.
    """
    from vibrissa.cli.output import refuse_out
    from vibrissa.neural.drive_choice import DriveAnalysis, compare_drives
    from vibrissa.neural.inputs import read_spikes, read_stimulus

    how = DriveAnalysis(bin_width=bin_width, skip=skip, smoothing=smoothing, band=band, level=level, latest=latest)
    refuse_out(out)
    counts = trials * len(spikes) if len(trials) == 1 else trials
    data = compare_drives([read_spikes(one) for one in spikes], [read_stimulus(one) for one in stimulus], counts, how)
    names = ["drive_gain", "drive_loss", "drive_loss_low", "drive_loss_high"]
    tell_map(data, names, ["best_drive", "reason", "carrier_frequency"], json, out)


def information(
    *, recorded: Recorded, window: Window, bin_width: float = 0.01, out: Out = None, json: Json = False
) -> None:
    """Bits that each unit's spikes tell of the stimulus: of a spike, of a second, of the count in a bin.

    Parameters
    ----------
    window
        START STOP of the part of the stimulus that is analysed [s]; leave out the onset, where units adapt.
    bin_width
        Width of the bins [s], which must divide the window.
    """
    from vibrissa.cli.output import refuse_out
    from vibrissa.cli.output import tell as remark
    from vibrissa.neural.unit_information import unit_information

    refuse_out(out)
    table, count = recorded.read(window)
    data = unit_information(table, count, window=window, bin_width=bin_width)
    if line := _silent_end(table, window):
        remark(line)
    ends = [f"spike_information{end}" for end in ("", "_low", "_high", "_plain")]
    tell(data, ["unit_name", "unit_rate", *ends, "information_rate", "count_information", "reason"], json, out)


def _silent_end(spikes: xr.Dataset, window: Window) -> str:
    """Say that the end of a window is silent: where the recording is shorter, silence counts as information."""
    start, stop = window
    last = float(spikes.spike_time.where(spikes.spike_time < stop).max())
    if stop - last < 0.1 * (stop - start):
        return ""
    return (
        f"no unit fires from {last:.4g} s to the end of the window, {stop:g} s: "
        "if the recording ended there the bits are wrong; end the window with it"
    )
