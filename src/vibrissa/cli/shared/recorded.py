"""Spikes of a recording, part of a stimulus and printed maps, which the verbs of spikes share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import OutputOptions, show
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.options import Flag
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Duration, Rate
from vibrissa.errors import ConflictError, ShapeError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.study.neurons.inputs import Recording


T = TypeVar("T")
Window = tuple[Duration, Duration]
Band = tuple[Rate, Rate]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class TrialOptions:
    """Trials and units of a recording, whatever its format.

    Attributes
    ----------
    event : str, optional
        Event channel of a .plx or .nex file that marks the onsets of the stimulus.
    trial_table : list of Path, optional
        Instead, a CSV with columns start,stop [s] and more; of an NWB file also the NAME of a table of intervals in it.
        With several stimuli one for all, or once for each.
    only : list of (str, str), optional
        COLUMN VALUE of the trials to take, where several protocols are interleaved. With several stimuli
        one for all, or once for each.
    period : float, optional
        From one onset of the stimulus to the next [s], of spikes on the session's clock; with --trials.
    first_onset : float
        First onset on the session's clock [s].
    group : list of str, optional
        Kind of sorted units that are taken: good (the default of a folder), mua, unsorted, …, or all; of a file, by the
        quality it states for its units (all by default); once for each.
    unsorted : bool
        Take the unsorted spikes of each channel as a unit; they are left out by default.
    counted_bin : float, optional
        Width of the bins of counts by bin, trial and unit (.npy, .mat) [s].
    kept : Path, optional
        Table that `vibrissa quality --out` wrote: the units that it keeps are taken, and no others.
    """

    event: str | None = None
    trial_table: list[Path] | None = None
    only: list[tuple[str, str]] | None = None
    period: Duration | None = None
    first_onset: Duration = 0.0
    group: list[str] | None = None
    unsorted: Flag = False
    counted_bin: Duration | None = None
    kept: Path | None = None

    def words(self) -> dict[str, Any]:
        """The options as a study file has them."""
        (alone,) = self.each(1)
        own: dict[str, Any] = {"trial_table": str(alone.trial_table[0]) if alone.trial_table else None}
        own["only"] = tuple(word.strip() for word in alone.only[0]) if alone.only else None
        return {**vars(self), **own, "group": tuple(self.group) if self.group else None}

    def each(self, count: int) -> list[TrialOptions]:
        """The options for each of several stimuli.

        Parameters
        ----------
        count : int
            Number of stimuli.

        Returns
        -------
        list of TrialOptions
            Each with one table of trials and one protocol at most.

        Raises
        ------
        InputError
            If a table or a protocol is given several times, but not once for each stimulus.
        """
        tables = _for_each("--trial-table", self.trial_table, count)
        protocols = _for_each("--only", self.only, count)
        return [replace(self, trial_table=a, only=b) for a, b in zip(tables, protocols, strict=True)]

    def read(
        self,
        spikes: Path,
        window: tuple[float, float],
        trials: int | None = None,
        bin_width: float | None = None,
        *,
        needs_count: bool = True,
    ) -> tuple[xr.Dataset, int, list[str]]:
        """Table of spikes, the number of trials, and what a reader should know of them.

        Parameters
        ----------
        spikes : Path
            The recording.
        window : (float, float)
            Part of each trial that is kept, about its onset [s].
        trials : int, optional
            Presentations.
        bin_width : float, optional
            Of the analysis [s].
        needs_count : bool
            Whether the number of trials must be known; else it reaches to the last that has a spike.

        Returns
        -------
        spikes, count, remarks
            Dataset of spikes in trials, number of trials, and remarks in the words of the command line.

        Raises
        ------
        InputError
            If neither file nor option has the number of trials, or trials or counts end before the window.
        """
        from vibrissa.neural.io.tables.inputs import refuse_beyond_recording
        from vibrissa.study.neurons.inputs import read_spikes, silent_end
        from vibrissa.study.neurons.silent_trials import silent_trials
        from vibrissa.study.spec.given import SpikesInput

        given = SpikesInput(spikes=str(spikes), trials=trials, **self.words())
        with progress_bars() as progress:
            asked: dict[str, Any] = {"bin_width": bin_width, "needs_count": needs_count}
            table, count, remarks = read_spikes(given, window, **asked, progress=progress)
        refuse_beyond_recording(table, window)
        remarks += [*silent_trials(table, count), *silent_end(table, *window)]
        return table, count, [in_options(line) for line in remarks]


def _for_each(option: str, given: list[T] | None, count: int) -> list[list[T] | None]:
    """What was given for each stimulus: nothing, one for all, or one for each."""
    if given is None or len(given) == 1:
        return [given] * count
    if len(given) != count:
        rule = "must be given once" if count == 1 else f"must be given once, or once for each of {count} stimuli"
        raise ShapeError(option, rule, f"{len(given)} times")
    return [[one] for one in given]


ALL_TRIALS = TrialOptions()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RecordingOptions:
    """Spikes of a recording, and its trials.

    Attributes
    ----------
    spikes : Path
        CSV with columns unit,trial,spike_time: any name, from 0, seconds from the stimulus' onset. Or an NWB file, a
        Plexon .plx or a NeuroExplorer .nex, counts by bin, trial and unit (.npy, .mat), a folder of phy or
        SpikeInterface, or what `scan --simulate-units` and `vibrissa sort` wrote.
    trials : int, optional
        Presentations, those without a spike included; must be given with a CSV that does not list these.
    cut : TrialOptions
        Its trials and units.
    """

    spikes: Path
    trials: int | None = None
    cut: TrialOptions = ALL_TRIALS

    def words(self) -> dict[str, Any]:
        """The options as a study file has them."""
        return {"spikes": str(self.spikes), "trials": self.trials, **self.cut.words()}

    def read(self, window: tuple[float, float], bin_width: float | None = None) -> tuple[xr.Dataset, int, list[str]]:
        """Table of spikes, the number of trials, and remarks; see :meth:`TrialOptions.read`."""
        return self.cut.read(self.spikes, window, self.trials, bin_width)

    def read_with(
        self,
        shown: dict[str, Any],
        bin_width: float,
        band: tuple[float, float] | None,
        window: tuple[float, float] | None,
        *,
        channels: bool = False,
        each: bool = False,
    ) -> Recording:
        """Spikes and stimulus, and what a reader should know of them.

        Parameters
        ----------
        shown : dict
            Of the stimulus, as a study file has it.
        bin_width, band, window
            Of the analysis [s], [Hz], [s]; without a window, the whole of the stimulus.
        channels : bool
            Whether all channels of the stimulus are wanted; else one.
        each : bool
            Whether each trial may have its own stimulus.

        Returns
        -------
        Recording
            Spikes and stimulus, and remarks in the words of the command line.

        Raises
        ------
        InputError
            If a file is bad, they do not fit together, or each trial has its own stimulus.
        """
        from vibrissa.study.neurons.inputs import read_recording
        from vibrissa.study.neurons.session_stimuli import channels_that_differ
        from vibrissa.study.spec.given import SpikesInput, StimulusInput

        asked: dict[str, Any] = {"bin_width": bin_width, "band": band, "window": window, "channels": channels}
        with progress_bars() as progress:
            found = read_recording(SpikesInput(**self.words()), StimulusInput(**shown), **asked, progress=progress)
        if "trial" in found.stimulus.dims and not each:
            remedy = "neural and drives take one for each trial; or choose trials of one stimulus with --only"
            others = channels_that_differ(found.stimulus)
            each_size = ", ".join(f"{name} ({100 * size:.2g} % of the largest)" for name, size in others.items())
            kind = f"one for each in {each_size}, not in other channels" if others else "one for each"
            remedy = f"leave a channel out that rested; {remedy}" if others else remedy
            raise ConflictError("--stimulus", "must be the same in all trials", kind, remedy)
        return found._replace(remarks=[in_options(line) for line in found.remarks])


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SignalOptions:
    """Unit and kind of a stimulus.

    Attributes
    ----------
    signal_unit : str, optional
        Unit of the stimulus where its file states none: um, deg, dB, a.u.; metres by default.
    envelope : bool
        The stimulus is an envelope already, not the motion.
    """

    signal_unit: str | None = None
    envelope: Flag = False


MOTION = SignalOptions()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class StimulusOptions:
    """The stimulus that was presented.

    Attributes
    ----------
    stimulus : Path
        CSV with columns time,displacement in seconds and metres: one presentation, as played (filtered). Or
        displacement_um, angle_deg, envelope_dB, or a column for each channel (time,contra_um,ipsi_um), with a column
        trial where each trial had its own. Or an NWB file, the command that `vibrissa replay` wrote, or the dataset of
        `scan --simulate-units`.
    whisker : str, optional
        Whisker of a command, column of a table or series of an NWB file that is taken: C2, beta, contra, …
    signal : SignalOptions
        What its numbers are.
    """

    stimulus: Path
    whisker: str | None = None
    signal: SignalOptions = MOTION

    def words(self) -> dict[str, Any]:
        """The options as a study file has them."""
        return {"stimulus": str(self.stimulus), "whisker": self.whisker, **vars(self.signal)}


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PartOptions:
    """Part of a stimulus that is analysed.

    Attributes
    ----------
    skip : float
        Time left out at the start of the stimulus, or of the window, while units adapt [s].
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
