"""The verb `sort`: from raw traces to units."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import PRINTED, MaybeOut, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import Seed
from vibrissa.cli.shared.words.units import Duration, Length, Rate, Voltage
from vibrissa.errors import ConflictError, MissingError

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.neural.io.formats.traces import RawFormat

TABLE = (
    "unit_name",
    "unit_rate",
    "unit_electrode",
    "snr_mean",
    "refractory_violations",
    "contamination",
    "merged",
    "kept",
)
SCORES = (
    "true_snr",
    "true_spikes",
    "matched_unit",
    "sorting_accuracy",
    "sorting_recall",
    "sorting_precision",
    "units_unmatched",
)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RawOptions:
    """Format of a recording that does not state its own.

    Attributes
    ----------
    sampling_rate : float, optional
        Samples per second of a file of bare samples [Hz].
    channels : int, optional
        Channels of a file of bare samples.
    dtype : {"int16", "int32", "float32", "float64"}
        Kind of the samples.
    gain : float, optional
        Voltage of one step of the samples [V].
    pitch : float, optional
        Distance between neighbouring electrodes [m], the channels in their order along one shank; where the recording
        has no probe of its own.
    stream : str, optional
        Stream of a SpikeGLX or Open Ephys folder.
    """

    sampling_rate: Rate | None = None
    channels: int | None = None
    dtype: Literal["int16", "int32", "float32", "float64"] = "int16"
    gain: Voltage | None = None
    pitch: Length | None = None
    stream: str | None = None

    def format(self) -> RawFormat:
        """The options as the reader takes them."""
        from vibrissa.neural.io.formats.traces import RawFormat

        return RawFormat(**vars(self))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SimulationOptions:
    """The simulated recording, where no other is given.

    Attributes
    ----------
    duration : float
        Length of the simulated recording [s].
    electrodes : int
        Channels of the simulated recording.
    n_units : int
        Units of the simulated recording.
    keep : Path, optional
        Existing folder in which the simulated recording is kept, as recording.dat and truth.csv.
    """

    duration: Duration = 20.0
    electrodes: int = 8
    n_units: int = 6
    keep: Path | None = None

    def generated(self, folder: str | Path, seed: int) -> tuple[Path, RawFormat, xr.Dataset]:
        """The recording, written, and its truth.

        Parameters
        ----------
        folder : path
            Where it is written, if it is not kept.
        seed : int
            Of the recording.

        Returns
        -------
        path, format, truth
            As :func:`vibrissa.neural.sorting.simulated.generate`.
        """
        from vibrissa.neural.sorting.simulated import generate

        where = self.keep or Path(folder)
        return generate(where, seed=seed, duration=self.duration, channels=self.electrodes, units=self.n_units)


def sort(
    recording: Path | None = None,
    *,
    raw: RawOptions = RawOptions(),
    simulation: SimulationOptions = SimulationOptions(),
    sorter: str | None = None,
    truth: Path | None = None,
    seed: Seed = 0,
    workers: int = 1,
    spikes_out: MaybeOut = None,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Sort the spikes of a raw recording into units.

    Without a recording, simulate one and compare the units with its truth.

    Parameters
    ----------
    recording
        A file of bare samples (.raw, .dat, .bin: all channels of a sample, then the next sample), or a folder of
        SpikeGLX, Open Ephys (binary) or SpikeInterface.
    sorter
        A sorter that SpikeInterface has here: spykingcircus2 (the default), simple (the default for one channel),
        tridesclous2, or another that is installed.
    truth
        CSV with columns spike_time,unit of the true spikes, where they are known: accuracy of the units is added.
    seed
        Seed of the sorter, and of the simulated recording.
    workers
        Processes.
    spikes_out
        Write the spikes as CSV with columns spike_time,unit [s], which `vibrissa neural` takes with --trial-table.
    """
    from vibrissa.neural.io.formats.traces import open_traces
    from vibrissa.neural.io.tables.spike_csv import read_spikes, write_csv
    from vibrissa.neural.sorting import sorters as sorting

    _refuse_csv(spikes_out)
    _refuse_useless(recording, raw, simulation, truth)
    how, known = raw.format(), None if truth is None else read_spikes(truth)
    with TemporaryDirectory() as folder:
        if recording is None:
            with stage("simulating a recording"):
                recording, how, known = simulation.generated(folder, seed)
        with stage("sorting" if sorter is None else f"sorting by {sorter}"):
            found = sorting.sort(open_traces(recording, how), sorter, seed=seed, workers=workers)
    if spikes_out is not None:
        write_csv(found, spikes_out)
    tell(*_remarks(found))
    names = list(TABLE)
    if known is not None:
        found = found.merge(sorting.accuracy(found, known), combine_attrs="override")
        names += [name for name in SCORES if name in found]
    drawing.draw("spikes.sorted_units", found)
    output.show(found, names)


def _refuse_useless(recording: Path | None, raw: RawOptions, simulation: SimulationOptions, truth: Path | None) -> None:
    """Refuse options of a recording where one is simulated, and of a simulation where one is given."""
    given, fresh = (raw, RawOptions()) if recording is None else (simulation, SimulationOptions())
    useless = [name for name, value in vars(given).items() if value != vars(fresh)[name]]
    if recording is None and truth is not None:
        useless.append("truth")
    if useless:
        rule = "must go with a recording" if recording is None else "must be left out: the recording is given"
        raise ConflictError(f"--{useless[0].replace('_', '-')}", rule)


def _refuse_csv(path: Path | None) -> None:
    """Refuse, before any work, a name that is not that of a table of spikes."""
    if path is not None and (path.suffix != ".csv" or not path.absolute().parent.is_dir()):
        raise MissingError("--spikes-out", "must end in .csv and lie in an existing folder", str(path))


def _remarks(found: xr.Dataset) -> list[str]:
    """Remarks that a reader needs on the units."""
    attrs: dict[str, Any] = found.attrs
    many = f"{found.sizes['unit']} units, {found.sizes['spike']} spikes in {attrs['duration']:.4g} s"
    lines = [
        f"{many} on {attrs['channels']} channels, by {attrs['sorter']}; which of them are single is for you to judge"
    ]
    broken = [str(name) for name, ok in zip(found.unit_name.values, found.kept.values, strict=True) if not ok]
    merged = [str(name) for name, one in zip(found.unit_name.values, found.merged.values, strict=True) if one]
    if merged:
        lines.append(f"units {', '.join(merged)} are merged clusters: several waveforms, or a contamination over 10 %")
    if broken:
        lines.append(f"units {', '.join(broken)} break the rules for single units (over 1 Hz, no interval below 1 ms)")
    return lines
