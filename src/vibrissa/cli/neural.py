"""The verb neural: spikes against the envelope of their stimulus."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    import xarray as xr

TABLE = ("unit_name", "significant", "p_value", "threshold", "threshold_low", "threshold_high", "slope", "latency")


def neural(
    *,
    spikes: Path,
    stimulus: Path,
    whisker: str | None = None,
    trials: int | None = None,
    period: float | None = None,
    first_onset: float = 0.0,
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
    period
        From one onset of the stimulus to the next [s], of spikes on the session's clock; with --trials.
    first_onset
        The first of these onsets [s].
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
    from vibrissa.study.neurons import Neurons, analyse_neurons

    asked = Neurons(
        spikes=str(spikes),
        stimulus=str(stimulus),
        whisker=whisker,
        trials=trials,
        period=period,
        first_onset=first_onset,
        event=event,
        trial_table=None if trial_table is None else str(trial_table),
        only=only,
        group=tuple(group or ("good",)),
        null=null,
        fit=fit,
        first_segment=first_segment,
        level=level,
        bin_width=bin_width,
        skip=skip,
        window=window,
        band=band,
        delay=tuple(delay or ()),
        spontaneous=spontaneous,
        seed=seed,
    )
    refuse_out(out)
    with progress_bars() as progress:
        found = analyse_neurons(asked, progress=progress)
    for line in found.remarks:
        tell(line)
    show(found.units, [] if json else [*TABLE, "identified", "reason"], False, out)
    if json:
        _print_units(found.units)


def one_stimulus(path: Path, whisker: str | None) -> xr.Dataset:
    """The stimulus of a file; see :func:`vibrissa.study.neurons.one_stimulus`."""
    from vibrissa.study.neurons import one_stimulus

    return one_stimulus(path, whisker)


def _print_units(data: xr.Dataset) -> None:
    """One JSON object with a list of units; NaN becomes null, "not measured"."""
    import json

    def plain(value: Any) -> Any:
        return None if value != value else value

    columns = {str(name).replace("unit_name", "unit"): data[name].values.tolist() for name in data.data_vars}
    rows = zip(*columns.values(), strict=True)
    print(json.dumps({"units": [dict(zip(columns, map(plain, row), strict=True)) for row in rows]}))
