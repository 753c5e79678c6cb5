"""Spikes of a recording, part of a stimulus and printed maps, which the verbs of spikes share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from vibrissa.cli.shared.output import OutputOptions, show
from vibrissa.cli.shared.progress import progress_bars
from vibrissa.cli.shared.units import Duration, Rate
from vibrissa.errors import ConflictError

if TYPE_CHECKING:
    import xarray as xr


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RecordingOptions:
    """Spikes of a recording, and its trials.

    Attributes
    ----------
    spikes : Path
        CSV with columns unit,trial,spike_time: any name, from 0, seconds from the stimulus' onset. Or an NWB file, a
        Plexon .plx or a NeuroExplorer .nex, a folder of phy or SpikeInterface, or what `scan --simulate-units` and
        `vibrissa sort` wrote.
    trials : int, optional
        Presentations, those without a spike included; must be given with a CSV that does not list these.
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

    def words(self) -> dict[str, Any]:
        """The options as a study file has them."""
        return {name: str(value) if isinstance(value, Path) else value for name, value in vars(self).items()}

    def read(self, window: tuple[float, float]) -> tuple[xr.Dataset, int]:
        """Table of spikes, and the number of trials.

        Parameters
        ----------
        window : (float, float)
            Part of each trial that is kept, about its onset [s].

        Returns
        -------
        spikes, count
            Dataset of spikes in trials, and number of trials.

        Raises
        ------
        InputError
            If neither file nor option has the number of trials.
        """
        from vibrissa.neural.io.recording import recorded_spikes

        with progress_bars() as progress:
            table, known = recorded_spikes(
                self.spikes, window=window, event=self.event, trials=self.trial_table, only=self.only, progress=progress
            )
        if (count := known if self.trials is None else self.trials) is None:
            raise ConflictError("--trials", "must be given with a CSV", remedy="count silent presentations too")
        return table, count


Window = tuple[Duration, Duration]
Band = tuple[Rate, Rate]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PartOptions:
    """Part of a stimulus that is analysed.

    Attributes
    ----------
    skip : float
        Time left out at the start, while units adapt [s].
    window : (float, float), optional
        START STOP of the part of the stimulus that is analysed [s]; spikes outside are left out.
    band : (float, float), optional
        LOW HIGH of the carrier whose envelope is taken [Hz], needed where slower motion runs along with it; all of the
        displacement by default.
    """

    skip: Duration = 1.0
    window: Window | None = None
    band: Band | None = None


WHOLE = PartOptions()


def span(shown: xr.Dataset) -> Window:
    """First and last time of a stimulus [s].

    Parameters
    ----------
    shown : Dataset
        With ``time``.

    Returns
    -------
    tuple of float
        First and last.
    """
    first, last = (float(t) for t in shown.time.values[[0, -1]])
    return first, last


def show_map(data: xr.Dataset, by_both: list[str], by_unit: list[str], output: OutputOptions) -> None:
    """One unit: a line for each whisker (or drive); several: a line for each unit; all variables as JSON.

    Parameters
    ----------
    data : Dataset
        Of all units.
    by_both, by_unit : list of str
        Variables of unit and whisker, and of unit alone.
    output : OutputOptions
        Where they go.
    """
    names = ["unit_name", *by_unit]
    if data.sizes["unit"] > 1 or output.json:
        return output.show(data, columns=names)
    output.save(data)
    if "reason" in data and not str(data.reason.values[0]):  # it is not left out
        names.remove("reason")
    return show(data.isel(unit=0), [*names, *by_both])
