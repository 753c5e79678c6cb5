"""What the verbs of coding share: the spikes of a recording, and how results are told."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, kw_only=True)
class SpikeOptions:
    """Spikes of a recording, and its trials.

    Attributes
    ----------
    spikes : Path
        CSV with columns unit,trial,spike_time: any name, from 0, seconds from the stimulus' onset. Or an NWB file, a
        Plexon .plx, a NeuroExplorer .nex, a folder of sorted units.
    trials : int, optional
        Presentations, those without a spike included; must be given with a CSV, other files tell.
    event : str, optional
        Event channel of a .plx or .nex file that marks the onsets of the stimulus.
    trial_table : Path, optional
        Instead, a CSV with columns start,stop [s] and more.
    only : (str, str), optional
        COLUMN VALUE of the table of trials: the protocol wanted, where several are interleaved.
    """

    spikes: Path
    trials: int | None = None
    event: str | None = None
    trial_table: Path | None = None
    only: tuple[str, str] | None = None

    def read(self, window: tuple[float, float]) -> tuple[xr.Dataset, int]:
        """Table of spikes, and the number of trials."""
        from vibrissa.cli.output import progress_bars
        from vibrissa.neural.recording import recorded_spikes

        with progress_bars() as progress:
            table, told = recorded_spikes(
                self.spikes, window=window, event=self.event, trials=self.trial_table, only=self.only, progress=progress
            )
        if (count := told if self.trials is None else self.trials) is None:
            raise InputError("--trials", "must be given with a CSV", remedy="count silent presentations too")
        return table, count


Recorded = Annotated[SpikeOptions, Parameter(name="*")]
Window = tuple[float, float]


def span(shown: xr.Dataset) -> Window:
    """First and last time of a stimulus [s]."""
    first, last = (float(t) for t in shown.time.values[[0, -1]])
    return first, last


def tell(data: xr.Dataset, names: list[str], json: bool, out: Path | None) -> None:
    """Print these variables, or all of them as JSON."""
    from vibrissa.cli.output import show

    show(data, None if json else names, json, out)


def tell_map(data: xr.Dataset, by_both: list[str], by_unit: list[str], json: bool, out: Path | None) -> None:
    """One unit: a line for each whisker (or drive); several: a line for each unit."""
    names = ["unit_name", *by_unit]
    if data.sizes["unit"] > 1 or json:
        return tell(data, names, json, out)
    from vibrissa.cli.output import show

    show(data, [], False, out)
    if "reason" in data and not str(data.reason.values[0]):  # it is not left out
        names.remove("reason")
    show(data.isel(unit=0), [*names, *by_both], False, None)
    return None
