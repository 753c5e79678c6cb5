"""The verb neural: spikes against the envelope of their stimulus."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

TABLE = ("unit_name", "significant", "p_value", "threshold", "threshold_low", "threshold_high", "slope", "latency")


def neural(
    *,
    spikes: Path,
    stimulus: Path,
    whisker: str | None = None,
    trials: int | None = None,
    event: str | None = None,
    trial_table: Path | None = None,
    only: tuple[str, str] | None = None,
    group: list[str] | None = None,
    null: Literal["circular", "paper2014"] = "circular",
    fit: Literal["forward", "paper2014"] = "forward",
    first_segment: Literal["flat-first", "free-first"] = "flat-first",
    level: float = 0.01,
    bin_width: float = 0.01,
    skip: float = 1.0,
    window: tuple[float, float] | None = None,
    band: tuple[float, float] | None = None,
    delay: list[float] | None = None,
    spontaneous: tuple[float, float] | None = None,
    seed: int = 0,
    out: Annotated[Path | None, Parameter(help="Write the results as a dataset (NetCDF).")] = None,
    json: Annotated[bool, Parameter(name="--json", negative="", help="Print one JSON object (SI units).")] = False,
) -> None:
    """Whether the envelope of a stimulus drives each unit: from which threshold, how steeply, how late.

    Parameters
    ----------
    spikes
        CSV with columns unit,trial,spike_time: any name, from 0, seconds from the stimulus' onset. Or an NWB file, a
        Plexon .plx or a NeuroExplorer .nex, a folder of phy or SpikeInterface, or what `vibrissa scan --spikes` and
        `vibrissa sort` wrote.
    stimulus
        CSV with columns time,displacement in seconds and metres: one presentation, as played (filtered). Or, with
        --whisker, the command that `vibrissa replay` wrote; or the dataset of `vibrissa scan --spikes`.
    whisker
        Whisker of that command whose motion is taken: C2, beta, …
    trials
        Presentations, those without a spike included; must be given with a CSV, other files tell.
    event
        Event channel of a .plx or .nex file that marks the onsets of the stimulus.
    trial_table
        Instead, a CSV with columns start,stop [s] and more.
    only
        COLUMN VALUE of the table of trials: the protocol wanted, where several are interleaved.
    group
        Of a folder of sorted units, which are taken: good (the default), mua, unsorted, …; once for each.
    null
        Chance: all circular shifts, adjusted over units, or the paper's 300 shuffles, not adjusted.
    fit
        A hinge seen through the bins, of continuous latency, or the paper's two segments at the best whole shift.
    first_segment
        Of the paper's fit: flat, or with a slope of its own.
    level
        Largest p-value (adjusted, for the circular null) that counts as significant.
    bin_width
        Width of the bins [s].
    skip
        Time left out at the start, while units adapt [s].
    window
        START STOP of the part of the stimulus that is analysed [s]; spikes outside are left out.
    band
        LOW HIGH of the carrier whose envelope is taken [Hz]; all of the displacement by default.
    delay
        Delay at which another whisker had the same stimulus [s]; once for each.
    spontaneous
        START STOP of a window without stimulus [s], for the spontaneous rate.
    seed
        Seed of the resampled trials and shuffles.
    """
    from vibrissa.cli.output import progress_bars, refuse_out, show, tell
    from vibrissa.neural.analysis import EnvelopeAnalysis, analyse_units
    from vibrissa.neural.recording import recorded_spikes

    if first_segment != "flat-first" and fit != "paper2014":
        raise InputError("--first-segment", "must go with --fit paper2014", first_segment)
    how = EnvelopeAnalysis(
        null=null,
        fit=fit,
        first_segment=first_segment,
        level=level,
        bin_width=bin_width,
        skip=skip,
        window=window,
        band=band,
        delays=tuple(delay or ()),
        spontaneous=spontaneous,
        seed=seed,
    )
    refuse_out(out)
    shown = one_stimulus(stimulus, whisker)
    kept = [*(float(t) for t in shown.time.values[[0, -1]]), *(spontaneous or ())]
    with progress_bars() as progress:
        table, told = recorded_spikes(
            spikes,
            window=(min(kept), max(kept)),
            event=event,
            trials=trial_table,
            only=only,
            groups=group or ("good",),
            progress=progress,
        )
    if (count := told if trials is None else trials) is None:
        raise InputError("--trials", "must be given with a CSV", remedy="count silent presentations too")
    data = analyse_units(table, shown, count, how)
    for line in [*_remarks(table, shown, count), *_unheard(table, spontaneous)]:
        tell(line)
    show(data, [] if json else [*TABLE, "identified", "reason"], False, out)
    if json:
        _print_units(data)


def one_stimulus(path: Path, whisker: str | None) -> xr.Dataset:
    """The stimulus of a file: of one presentation, or of one whisker of a stimulator's command."""
    from vibrissa.neural.inputs import read_stimulus

    if whisker is None and (path.suffix.lower() == ".wav" or Path(f"{path}.json").is_file()):  # a command's sidecar
        raise InputError("--whisker", "must be given with a command of vibrissa replay", str(path))
    return read_stimulus(path) if whisker is None else played(path, whisker)


def played(path: Path, whisker: str) -> xr.Dataset:
    """Motion of one whisker of a stimulator's command, as a stimulus."""
    from vibrissa.quantities import dataset
    from vibrissa.stimulus.export import read_command

    command = read_command(path)
    names = command.whisker.values.tolist()
    if whisker not in names:
        raise InputError("--whisker", f"must be one of {', '.join(names)}", repr(whisker))
    motion = command.command.sel(whisker=whisker).values
    return dataset({"source": path.name, "whisker": whisker}, time=command.time.values, point_displacement=motion)


def _remarks(spikes: xr.Dataset, stimulus: xr.Dataset, n_trials: int) -> list[str]:
    """What a reader should know of the input: silent trials, a carrier near half the sampling rate."""
    import numpy as np
    from scipy.signal import periodogram

    told = {
        "spikes_unsorted": "are unsorted (unit 0) and left out",
        "spikes_outside": "lie in no trial and are left out",
    }
    lines = [f"{spikes.attrs[name]} spikes {text}" for name, text in told.items() if spikes.attrs.get(name)]
    lines += filter(None, [spikes.attrs.get("remark")])
    last = int(spikes.spike_trial.values.max())
    if last < n_trials - 1:
        lines.append(f"the last {n_trials - 1 - last} of {n_trials} trials hold no spike of any unit; check --trials")
    if 0 not in spikes.spike_trial.values and n_trials > 1:
        lines.append("trial 0 holds no spike of any unit; trials count from 0")
    time = stimulus.time.values
    rate = (len(time) - 1) / (time[-1] - time[0])
    frequency, power = periodogram(stimulus.point_displacement.values, rate)
    carrier = float(np.sum(frequency * power) / np.sum(power))
    if rate < 6 * carrier:
        lines.append(f"the stimulus, about {carrier:.0f} Hz, is sampled at {rate:.0f} Hz: its envelope may be wrong")
    return lines


def _unheard(spikes: xr.Dataset, spontaneous: tuple[float, float] | None) -> list[str]:
    """Say that a window without any spike of any unit may be one that was not recorded."""
    if spontaneous is None:
        return []
    start, stop = spontaneous
    if ((spikes.spike_time.values >= start) & (spikes.spike_time.values < stop)).any():
        return []
    return [f"no unit fired from {start:g} to {stop:g} s: rates of 0, unless the spikes there are not in the file"]


def _print_units(data: xr.Dataset) -> None:
    """One JSON object with a list of units; NaN becomes null, "not measured"."""
    import json

    def plain(value: Any) -> Any:
        return None if value != value else value

    columns = {str(name).replace("unit_name", "unit"): data[name].values.tolist() for name in data.data_vars}
    rows = zip(*columns.values(), strict=True)
    print(json.dumps({"units": [dict(zip(columns, map(plain, row), strict=True)) for row in rows]}))
